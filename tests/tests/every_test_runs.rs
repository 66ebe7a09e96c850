//! A package's tests are one binary, `tests/all.rs`: a file that it does not name would never run, and nobody would see it.

use std::fs;
use std::path::{Path, PathBuf};

/// Folders named `tests` that hold an `all.rs`.
fn suites(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of the repository") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().and_then(|name| name.to_str());
        if !path.is_dir() || name.is_none_or(|name| name.starts_with('.') || name == "target") {
            continue;
        }
        if path.join("all.rs").is_file() {
            found.push(path.clone());
        }
        suites(&path, found);
    }
}

#[test]
fn every_test_file_is_named_in_its_suite() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    suites(&root, &mut found);
    assert!(found.len() >= 15, "suites: {found:?}");
    for suite in found {
        let all = fs::read_to_string(suite.join("all.rs")).expect("all.rs");
        for entry in fs::read_dir(&suite).expect("a folder of tests") {
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
