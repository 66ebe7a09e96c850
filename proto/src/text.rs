//! Text from outside, which may hold anything; and bytes as hexadecimal digits, for key files and fingerprints.
//!
//! Every text that comes over the wire is an [`Untrusted`]: `String` has no decoder. What a peer wrote cannot get into a line for
//! people as it is, because formatting it escapes it: terminal control sequences, line ends, and characters that turn the
//! direction of writing or cannot be seen. Other texts from outside (the reason of a closed connection, what a library says of a
//! peer) go through [`Printable`], which does the same.

use std::fmt;

/// Most characters of a text from outside that are shown, unless the format asks for fewer (`{:.40}`).
pub const MAX_SHOWN_CHARS: usize = 500;

/// Text from outside. Formatted, it is escaped and cut; [`Untrusted::raw`] is for comparing and computing.
#[derive(Clone, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Untrusted(String);

impl Untrusted {
    /// As it came: not for people.
    #[must_use]
    pub fn raw(&self) -> &str {
        &self.0
    }

    /// As it came: not for people.
    #[must_use]
    pub fn into_raw(self) -> String {
        self.0
    }

    /// Whether it is shown as it came.
    #[must_use]
    pub fn is_printable(&self) -> bool {
        Printable(&self.0).to_string() == self.0
    }
}

impl fmt::Display for Untrusted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Printable(&self.0).fmt(f)
    }
}

impl fmt::Debug for Untrusted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "\"{}\"", Printable(&self.0))
    }
}

impl From<&str> for Untrusted {
    fn from(text: &str) -> Self {
        Self(text.to_owned())
    }
}

impl From<String> for Untrusted {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl PartialEq<str> for Untrusted {
    fn eq(&self, other: &str) -> bool {
        self.0 == other
    }
}

impl PartialEq<&str> for Untrusted {
    fn eq(&self, other: &&str) -> bool {
        self.0 == *other
    }
}

impl PartialEq<String> for Untrusted {
    fn eq(&self, other: &String) -> bool {
        self.0 == *other
    }
}

/// Shows a text from outside so that a terminal, a log and a reader take it for what it is: one line, at most
/// [`MAX_SHOWN_CHARS`] characters, everything that does not print escaped as Rust does (`\u{1b}`, `\n`). Shown again, it stays.
#[derive(Clone, Copy, Debug)]
pub struct Printable<'t>(pub &'t str);

impl fmt::Display for Printable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let most = f.precision().unwrap_or(MAX_SHOWN_CHARS);
        let (shown, rest) = match self.0.char_indices().nth(most) {
            Some((end, _)) => self.0.split_at(end),
            None => (self.0, ""),
        };
        // Quotes and backslashes harm nobody: what is quoted in a sentence stays readable.
        for piece in shown.split_inclusive(HARMLESS) {
            let text = piece.strip_suffix(HARMLESS).unwrap_or(piece);
            write!(f, "{}{}", text.escape_debug(), &piece[text.len()..])?;
        }
        if rest.is_empty() {
            Ok(())
        } else {
            write!(f, "... ({} bytes more)", rest.len())
        }
    }
}

/// What Rust would escape although it prints.
const HARMLESS: [char; 3] = ['"', '\'', '\\'];

/// Two digits per byte.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// 64 digits and nothing else; the error is how many digits come before the first other character.
pub(crate) fn parse_hex(text: &str) -> Result<[u8; 32], usize> {
    let found = text.chars().take_while(char::is_ascii_hexdigit).count();
    if found != 64 || text.len() != 64 {
        return Err(found);
    }
    let (pairs, _) = text.as_bytes().as_chunks::<2>();
    let mut bytes = [0; 32];
    for (byte, [high, low]) in bytes.iter_mut().zip(pairs) {
        *byte = digit(*high) << 4 | digit(*low);
    }
    Ok(bytes)
}

/// Value of a digit that is known to be hexadecimal.
fn digit(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        _ => (digit.to_ascii_lowercase().wrapping_sub(b'a') + 10) & 0x0f,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_a_terminal_obeys_is_spelled_out() {
        for (raw, shown) in [
            ("front", "front"),
            ("Bühne \"links\" C:\\x", "Bühne \"links\" C:\\x"),
            (
                "\u{1b}[2J\u{1b}]0;owned\u{7}",
                "\\u{1b}[2J\\u{1b}]0;owned\\u{7}",
            ),
            ("\u{9b}31m", "\\u{9b}31m"),
            ("a\r\nERROR b", "a\\r\\nERROR b"),
            (
                "user\u{202e}gnp.exe\u{2066}",
                "user\\u{202e}gnp.exe\\u{2066}",
            ),
            (
                "a\u{2028}b\u{200b}c\u{feff}",
                "a\\u{2028}b\\u{200b}c\\u{feff}",
            ),
            ("\u{301}on nothing", "\\u{301}on nothing"),
        ] {
            let text = Untrusted::from(raw);
            assert_eq!(text.to_string(), shown);
            assert_eq!(format!("{text:?}"), format!("\"{shown}\""));
            assert_eq!(text.is_printable(), raw == shown, "{shown}");
        }
    }

    #[test]
    fn what_is_long_is_cut_and_says_so() {
        let text = Untrusted::from("ä".repeat(10_000));
        let shown = text.to_string();
        assert!(shown.starts_with(&"ä".repeat(MAX_SHOWN_CHARS)));
        assert!(shown.ends_with("... (19000 bytes more)"), "{shown}");
        assert_eq!(
            format!("{:.2}", Untrusted::from("abc")),
            "ab... (1 bytes more)"
        );
        assert!(!text.is_printable());
    }

    proptest! {
        #[test]
        fn whatever_comes_is_one_short_line_without_controls(raw in any::<String>()) {
            let shown = Untrusted::from(raw.as_str()).to_string();
            prop_assert!(!shown.chars().any(char::is_control));
            prop_assert!(shown.chars().count() <= 10 * MAX_SHOWN_CHARS + 40);
            if raw.chars().count() <= 50 {
                prop_assert_eq!(Printable(&shown).to_string(), shown.as_str());
            }
        }
    }
}
