//! Names of ROS 2.

/// Whether `text` is a part of a name: letters, digits and `_`, no digit first.
pub(super) fn is_word(text: &str) -> bool {
    let is_first = |c: char| c.is_ascii_alphabetic() || c == '_';
    text.starts_with(is_first) && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Whether `text` is an absolute name of a topic.
pub(super) fn is_topic(text: &str) -> bool {
    text.len() <= 200
        && text
            .strip_prefix('/')
            .is_some_and(|rest| rest.split('/').all(is_word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_topics_are_those_of_ros() {
        for good in ["/a", "/a_1/_b", "/ft_sensor/wrench"] {
            assert!(is_topic(good), "{good}");
        }
        for bad in [
            "", "/", "a", "/1a", "/a/", "//a", "/a-b", "/a/*", "/a/**", "/a$", "/ä",
        ] {
            assert!(!is_topic(bad), "{bad}");
        }
        assert!(!is_topic(&format!("/{}", "a".repeat(200))));
    }
}
