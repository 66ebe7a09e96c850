//! A package's tests are one binary, `tests/all.rs`: a file that it does not name would never run, and nobody would see it.

use std::fs;

use crate::repository::{files, read};

#[test]
fn every_test_file_is_named_in_its_suite() {
    let mut suites = files("rs");
    suites.retain(|path| path.ends_with("all.rs"));
    assert!(suites.len() >= 15, "suites: {suites:?}");
    for suite in suites {
        let all = read(&suite);
        for entry in fs::read_dir(suite.parent().expect("a folder")).expect("a folder of tests") {
            let path = entry.expect("an entry").path();
            let is_module =
                path.extension().is_some_and(|end| end == "rs") || path.join("mod.rs").is_file();
            let name = path
                .file_stem()
                .and_then(|name| name.to_str())
                .unwrap_or("");
            assert!(
                !is_module
                    || name == "all"
                    || all.lines().any(|line| line == format!("mod {name};")),
                "{}: write `mod {name};` in all.rs beside it",
                path.display()
            );
        }
    }
}
