//! Names of bodies and their files.

use std::collections::{HashMap, HashSet};

/// Longest name of a body made of its file's, bytes: with a number and an ending it is a name of a file everywhere.
const MAX_NAME_BYTES: usize = 128;

/// Names that are taken, as systems that know no capitals see them.
#[derive(Debug)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// Of names that were taken already: the number to try next.
    next: HashMap<String, u32>,
}

impl Names {
    /// No body has one of these.
    pub(super) fn without(reserved: &[&str]) -> Self {
        Self {
            taken: reserved.iter().map(|name| name.to_lowercase()).collect(),
            next: HashMap::new(),
        }
    }

    /// A name for the body and its file, from what the user or a file calls it: unique, of letters and digits of any language, `_` and `-`.
    pub(super) fn name(&mut self, called: &str) -> String {
        let plain = plain(called);
        let mut name = plain.clone();
        while !self.taken.insert(name.to_lowercase()) {
            let number = self.next.entry(plain.to_lowercase()).or_insert(2);
            name = format!("{plain}-{number}");
            *number += 1;
        }
        name
    }
}

/// Letters and digits of any language, `_`, and `-` for all else.
fn plain(called: &str) -> String {
    let mut plain = String::new();
    for c in called.chars() {
        // Accents that some systems write behind their letter.
        let is_mark = ('\u{300}'..='\u{36f}').contains(&c);
        let kept = if c.is_alphanumeric() || c == '_' || is_mark {
            c
        } else {
            '-'
        };
        if plain.len() + kept.len_utf8() > MAX_NAME_BYTES {
            break;
        }
        if kept != '-' || !plain.ends_with('-') {
            plain.push(kept);
        }
    }
    match plain.trim_matches('-') {
        "" => "part".to_owned(),
        name => name.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_keep_the_letters_of_every_language() {
        let mut names = Names::without(&[]);
        for (called, name) in [
            (
                "B\u{fc}chse Gr\u{f6}\u{df}e 2",
                "B\u{fc}chse-Gr\u{f6}\u{df}e-2",
            ),
            (
                "b\u{dc}CHSE gr\u{f6}\u{df}e 2",
                "b\u{dc}CHSE-gr\u{f6}\u{df}e-2-2",
            ),
            ("Bu\u{308}chse", "Bu\u{308}chse"),
            ("\u{90e8}\u{54c1} (1)", "\u{90e8}\u{54c1}-1"),
            ("a=b\"c", "a-b-c"),
            ("??", "part"),
        ] {
            assert_eq!(names.name(called), name);
        }
        let long = names.name(&"\u{90e8}".repeat(300));
        assert!(long.len() <= MAX_NAME_BYTES && !long.is_empty());
    }
}
