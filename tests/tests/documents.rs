//! The documents hang together: the book has every page, links lead somewhere, and words of the glossary are those of the code.

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

use crate::repository::{files, names, read, root};

/// Where the links of a page lead, without those to the web and within the page.
fn links(page: &str) -> Vec<&str> {
    let outside_code = page
        .split("```")
        .step_by(2)
        .flat_map(|text| text.split("](").skip(1));
    outside_code
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target)
        .filter(|target| !target.contains("://") && !target.starts_with('#'))
        .collect()
}

/// The part of an address that a heading is found by.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let letters = kept
        .chars()
        .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    letters.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn every_link_leads_to_something() {
    let pages = files("md");
    assert!(pages.len() > 25, "{pages:?}");
    let mut broken = Vec::new();
    for page in &pages {
        let text = read(page);
        for link in links(&text) {
            let (path, part) = link.split_once('#').unwrap_or((link, ""));
            let target = page.parent().expect("a folder").join(path);
            let there = target.exists()
                && (part.is_empty()
                    || read(&target)
                        .lines()
                        .any(|line| line.starts_with('#') && anchor(line) == part));
            if !there {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// Packages by name: where they are, and their manifest.
fn packages() -> HashMap<String, (PathBuf, String)> {
    let manifests = files("toml").into_iter();
    let manifests = manifests.filter(|path| path.ends_with("Cargo.toml"));
    let named = manifests.filter_map(|path| {
        let text = read(&path);
        let name = text.split("[package]\nname = \"").nth(1)?;
        let name = name.split('"').next()?.to_owned();
        Some((name, (path.parent()?.to_owned(), text)))
    });
    named.collect()
}

/// Whether a command of cargo names a package and targets that there are.
fn is_there(command: &str, packages: &HashMap<String, (PathBuf, String)>) -> bool {
    let words: Vec<&str> = command.split_whitespace().collect();
    let after = |option| words.windows(2).find(|pair| pair[0] == option);
    let Some([_, package]) = after("-p") else {
        return true;
    };
    let Some((folder, manifest)) = packages.get(*package) else {
        return false;
    };
    [
        ("--test", "tests"),
        ("--example", "examples"),
        ("--bench", "benches"),
    ]
    .into_iter()
    .filter_map(|(option, place)| Some((place, after(option)?[1])))
    .all(|(place, name)| {
        let alone = place == "tests" && manifest.contains("autotests = false");
        let declared = manifest.contains(&format!("name = \"{name}\""));
        let main = folder.join(place).join(name);
        declared || !alone && (main.with_extension("rs").exists() || main.join("main.rs").exists())
    })
}

#[test]
fn every_command_of_cargo_names_what_there_is() {
    let packages = packages();
    assert!(packages.len() > 25, "{:?}", packages.keys());
    assert!(!is_there(
        "cargo test -p taut-bridge --test haply",
        &packages
    ));
    let (mut found, mut broken) = (0, Vec::new());
    for path in ["md", "rs", "toml", "h"].into_iter().flat_map(files) {
        let text = read(&path);
        for kind in ["cargo test ", "cargo run ", "cargo bench "] {
            for rest in text.split(kind).skip(1) {
                let end = rest.find(['`', '\n', '"', ')']).unwrap_or(rest.len());
                found += 1;
                if !is_there(&rest[..end], &packages) && !path.ends_with("documents.rs") {
                    broken.push(format!("{}: {kind}{}", path.display(), &rest[..end]));
                }
            }
        }
    }
    assert!(found > 40, "{found}");
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_book_has_every_page_once() {
    let docs = root().join("docs");
    let summary = read(docs.join("SUMMARY.md"));
    let mut named = links(&summary);
    named.sort_unstable();
    let mut there: Vec<String> = fs::read_dir(&docs)
        .expect("the documents")
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| name.ends_with(".md") && name != "SUMMARY.md")
        .collect();
    there.sort_unstable();
    assert_eq!(named, there);
}

#[test]
fn every_picture_is_shown_or_made_for_one_that_is() {
    let pages = files("md");
    let all: String = pages.iter().map(read).collect();
    let pictures = fs::read_dir(root().join("docs/pictures")).expect("pictures");
    for name in pictures.flatten().map(|entry| entry.file_name()) {
        let name = name.to_string_lossy();
        let is_picture = name.ends_with(".png") || name.ends_with(".svg");
        assert!(!is_picture || all.contains(&*name), "nobody shows {name}");
    }
}

#[test]
fn words_of_the_glossary_are_those_of_the_code() {
    let page = read(root().join("docs/glossary.md"));
    let sources = files("rs").into_iter();
    let others = sources.filter(|path| !path.ends_with("documents.rs"));
    let code: String = others.map(read).collect();
    let mut words = 0;
    for row in page.lines().filter(|line| line.starts_with("| ")) {
        let cell = row.split('|').nth(2).unwrap_or_default();
        for name in names(cell) {
            words += 1;
            assert!(code.contains(name), "{name} is not in the code: {row}");
        }
    }
    assert!(words > 30, "{words}");
}

#[test]
fn the_papers_sections_lead_to_files() {
    let page = read(root().join("server/method/REFERENCES.md"));
    let (_, section) = page
        .split_once("## The paper's sections and our files")
        .expect("the heading");
    let section = section.split("\n## ").next().unwrap_or(section);
    let mut paths = 0;
    for row in section.lines().filter(|line| line.contains("`src/")) {
        let cell = row.split('|').nth(2).unwrap_or_default();
        for path in names(cell) {
            paths += 1;
            let file = root().join("server/method").join(path);
            assert!(file.exists(), "{path} is not there: {row}");
        }
    }
    assert!(paths > 10, "{paths}");
}
