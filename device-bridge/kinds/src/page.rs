//! The table of keys in `docs/devices.md`.

use std::fmt::Write as _;
use std::path::Path;

use crate::key::{Key, Takes};
use crate::kind::Kind;
use crate::kinds::KINDS;

/// The table, as the document has it.
fn keys_page() -> String {
    let mut page = "| kind | key | value | meaning |\n| --- | --- | --- | --- |\n".to_owned();
    for kind in &KINDS {
        let mut name = format!("`{}`", kind.name);
        if kind.every_key().next().is_none() {
            // Writing to a string does not fail.
            let _ = writeln!(page, "| {name} | – | | {} |", kind.what);
        }
        for key in kind.every_key() {
            let name = std::mem::take(&mut name);
            let _ = writeln!(
                page,
                "| {name} | {} | {} | {} |",
                written(kind, key),
                value(&key.takes),
                key.what
            );
        }
    }
    page
}

/// The key, and where it may stand.
fn written(kind: &Kind, key: &Key) -> String {
    let mark = match () {
        () if kind.place == Some(*key) => " (after the name)",
        () if key.in_file_only => " (file only)",
        () => "",
    };
    format!("`{}`{mark}", key.name)
}

fn value(takes: &Takes) -> String {
    match takes {
        Takes::Number(low, high) => format!("{low} to {high}"),
        Takes::Whole(low, i64::MAX) => format!("whole, from {low}"),
        Takes::Whole(low, high) => format!("whole, {low} to {high}"),
        Takes::OneOf(words) => format!("`{}`", words.join("`, `")),
        Takes::YesOrNo => "`yes`, `no`; in a file `true`, `false`".to_owned(),
        Takes::Axes => "such as `x -z y`".to_owned(),
        Takes::RightHandedAxes => "right-handed, such as `x -z y`".to_owned(),
        Takes::Text(_) => "text".to_owned(),
        Takes::NameOrFile(_) => "name or file".to_owned(),
        Takes::File => "path".to_owned(),
        Takes::Service => "`HOST:PORT`".to_owned(),
        Takes::Tracker => "`TRACKER@HOST:PORT`".to_owned(),
        Takes::Pose => "`{ position, rotation }`".to_owned(),
    }
}

/// A kind that is added without a word on what it was tried with, or on how a reader reports a real one, is caught here.
#[test]
fn the_document_says_of_every_kind_what_it_was_tried_with() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/devices.md");
    let document = std::fs::read_to_string(path).expect("the document");
    let (_, rest) = document.split_once("## What there is").expect("a heading");
    let (there, rest) = rest.split_once("\n## ").expect("the next heading");
    assert!(rest.contains("## How to tell us of a real device\n"));
    for kind in &KINDS {
        let name = kind.name;
        let chosen = [
            format!("`{name}`"),
            format!("`{name}:"),
            format!("`{name}="),
            format!("kind = \"{name}\""),
        ];
        let row = there
            .lines()
            .filter(|line| line.starts_with('|'))
            .find(|line| {
                let by = line.split('|').nth(2).unwrap_or("");
                chosen.iter().any(|text| by.contains(text))
            });
        let row = row.unwrap_or_else(|| panic!("no row for {name}"));
        let tried = row.split('|').nth(5).unwrap_or("").trim();
        assert!(tried.len() > 4, "tried with what? {row}");
    }
}

/// `TAUT_WRITE_DOCUMENTS=1` writes the table instead of comparing it.
#[test]
fn the_document_has_every_key() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/devices.md");
    let document = std::fs::read_to_string(&path).expect("the document");
    let (before, rest) = document.split_once("| kind | key |").expect("the table");
    let end = rest.find("\n\n").map_or(rest.len(), |end| end + 1);
    let wanted = keys_page();
    if std::env::var_os("TAUT_WRITE_DOCUMENTS").is_some() {
        let text = format!("{before}{wanted}{}", &rest[end..]);
        std::fs::write(&path, text).expect("written");
        return;
    }
    let found = format!("| kind | key |{}", &rest[..end]);
    assert!(
        found == wanted,
        "docs/devices.md has another table of keys; run: TAUT_WRITE_DOCUMENTS=1 cargo test -p taut-kinds"
    );
}
