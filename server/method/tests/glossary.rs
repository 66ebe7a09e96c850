//! The glossary names what is there.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a test reads the sources; the method reads nothing"
)]

use std::path::Path;

fn sources(folder: &Path, all: &mut String) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, all);
        } else {
            all.push_str(&std::fs::read_to_string(&path).expect("a source"));
        }
    }
}

#[test]
fn every_name_of_the_glossary_is_in_the_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let references = std::fs::read_to_string(root.join("REFERENCES.md")).expect("REFERENCES.md");
    let (_, glossary) = references.split_once("## Glossary").expect("a glossary");
    let mut all = String::new();
    sources(&root.join("src"), &mut all);
    let words: std::collections::HashSet<&str> = all
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    let rows = glossary
        .lines()
        .filter(|line| line.starts_with("| "))
        .skip(2);
    let mut names = 0;
    for row in rows {
        let of_code = row.split('|').nth(2).expect("three columns");
        for name in of_code.split('`').skip(1).step_by(2) {
            names += 1;
            assert!(
                words.contains(name),
                "the glossary has `{name}`, the code has not"
            );
        }
    }
    assert!(names > 20);
}
