//! The table in docs/importing.md is what the cases say.

use std::fmt::Write as _;
use std::path::PathBuf;

use super::awkward::run;
use super::cases::{Expected, cases};

const BEGIN: &str = "<!-- the table is written by: cargo test -p taut-scene --test all write_the_table -- --ignored -->\n";
const END: &str = "<!-- end of the table -->\n";

fn page() -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../docs/importing.md"
    ))
}

/// Times and folders are none of it: the same on every machine.
fn table() -> String {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from(
        "\n| file | what is awkward | options | `taut import` |\n| --- | --- | --- | --- |\n",
    );
    for case in cases() {
        let (_, outcome) = run(&case, folder.path());
        let said = match (&case.expected, outcome) {
            (Expected::Imported { .. }, Ok(report)) => {
                let findings: Vec<String> = report.parts[0]
                    .all_findings()
                    .map(|f| f.text.clone())
                    .collect();
                if findings.is_empty() {
                    "nothing to mend".to_owned()
                } else {
                    findings.join("; ")
                }
            }
            (_, Err(error)) => format!("**refused**: {}", error.problems()[0].text),
            (_, Ok(_)) => "was imported".to_owned(),
        };
        let options = if case.options.is_empty() {
            String::new()
        } else {
            format!("`{}`", case.options)
        };
        writeln!(
            text,
            "| {} | {} | {options} | {said} |",
            case.file, case.what
        )
        .unwrap();
    }
    text + "\n"
}

fn split() -> (String, String, String) {
    let text = std::fs::read_to_string(page()).unwrap();
    let (before, rest) = text.split_once(BEGIN).expect("the table begins");
    let (table, after) = rest.split_once(END).expect("the table ends");
    (before.to_owned(), table.to_owned(), after.to_owned())
}

#[test]
fn the_page_has_the_table() {
    const WRITE: &str =
        "write it again: cargo test -p taut-scene --test all write_the_table -- --ignored";
    let ((_, written, _), table) = (split(), table());
    for (there, wanted) in written.lines().zip(table.lines()) {
        assert_eq!(there, wanted, "{WRITE}");
    }
    assert_eq!(written.lines().count(), table.lines().count(), "{WRITE}");
}

#[test]
#[ignore = "writes docs/importing.md"]
fn write_the_table() {
    let (before, _, after) = split();
    std::fs::write(page(), format!("{before}{BEGIN}{}{END}{after}", table())).unwrap();
}
