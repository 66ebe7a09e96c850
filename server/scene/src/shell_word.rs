//! Words of commands that a person copies.

/// Text as one word of a shell command, in quotes where it needs them.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_shell_would_split_or_change_is_quoted() {
        assert_eq!(shell_word("a-b/scene.toml"), "a-b/scene.toml");
        assert_eq!(shell_word("my parts/a.toml"), "'my parts/a.toml'");
        assert_eq!(shell_word("it's"), "'it'\\''s'");
        assert_eq!(shell_word(""), "''");
    }
}
