//! The tables of promises in the documents: what a row says keeps a promise is there, and so is the test that it names.

use std::collections::BTreeSet;

use taut_network_tests::hostile::attacks;

use crate::repository::{everything, names, read, root};

const PAGES: [&str; 4] = [
    "docs/safety.md",
    "docs/security.md",
    "docs/frames.md",
    "docs/pose-stream.md",
];
/// Fewest rows of all tables: a table that is not found has none.
const FEWEST_ROWS: usize = 80;

/// What the repository has: paths from its root, and the names of its tests.
struct Repository {
    paths: BTreeSet<String>,
    tests: BTreeSet<String>,
}

impl Repository {
    fn read() -> Repository {
        let (mut paths, mut tests) = (BTreeSet::new(), BTreeSet::new());
        for path in everything() {
            if path.is_file() && path.extension().is_some_and(|of| of == "rs") {
                tests.extend(tests_of(&read(&path)));
            }
            let place = path.strip_prefix(root()).expect("it is in it");
            paths.insert(format!("/{}", place.display()));
        }
        Repository { paths, tests }
    }

    /// Whether there is this file or folder; its beginning may be left out.
    fn has(&self, path: &str) -> bool {
        let end = format!("/{}", path.trim_end_matches('/'));
        self.paths.iter().any(|known| known.ends_with(&end))
    }

    /// A test of this name, or the only sense of one that `...` shortens; an attack; a file with tests; a script.
    fn has_test(&self, name: &str) -> bool {
        let shortened = match (name.strip_prefix("..."), name.strip_suffix("...")) {
            (Some(end), _) => self.tests.iter().any(|test| test.ends_with(end)),
            (_, Some(begin)) => self.tests.iter().any(|test| test.starts_with(begin)),
            _ => false,
        };
        shortened
            || self.tests.contains(name)
            || attacks().any(|attack| attack.name == name)
            || taut_tests_in(name, self)
    }
}

/// Whether `name` is a file of the repository that tests something: a script, or a source file with tests.
fn taut_tests_in(name: &str, repository: &Repository) -> bool {
    let is_source = name.ends_with(".rs");
    repository.has(name)
        && (!is_source
            || repository
                .paths
                .iter()
                .filter(|path| path.ends_with(&format!("/{name}")))
                .any(|path| !tests_of(&read(root().join(&path[1..]))).is_empty()))
}

/// Names of the functions that have an attribute of a test, or are within `proptest!`.
fn tests_of(source: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut is_test = false;
    for line in source.lines().map(str::trim) {
        if line.starts_with("#[test]") || line.starts_with("#[tokio::test") {
            is_test = true;
        } else if let Some(rest) = line
            .strip_prefix("async fn ")
            .or_else(|| line.strip_prefix("fn "))
            && is_test
        {
            let end = rest.find('(').unwrap_or(rest.len());
            names.push(rest[..end].to_owned());
            is_test = false;
        }
    }
    names
}

/// Rows of the table of promises: promise, where it is kept, test.
fn rows(page: &str) -> Vec<[String; 3]> {
    let (_, table) = page.split_once("## Promises\n").expect("a table");
    let rows = table.lines().filter(|line| line.starts_with("| "));
    rows.skip(1) // the head
        .filter(|line| !line.starts_with("| ---") && !line.starts_with("|---"))
        .map(|line| {
            let cells: Vec<String> = line
                .trim_matches('|')
                .split(" | ")
                .map(|cell| cell.trim().to_owned())
                .collect();
            cells
                .try_into()
                .unwrap_or_else(|cells| panic!("three cells: {cells:?}"))
        })
        .collect()
}

/// What stands between backquotes, with several each for its own.
fn words(cell: &str) -> Vec<String> {
    names(cell).flat_map(several).collect()
}

/// `a/{b,c}.rs` is two files.
fn several(word: &str) -> Vec<String> {
    match word.split_once('{').zip(word.split_once('}')) {
        Some(((begin, rest), (_, end))) => {
            let inner = rest.split('}').next().unwrap_or_default();
            let one = |middle: &str| format!("{begin}{middle}{end}");
            inner.split(',').map(one).collect()
        }
        None => vec![word.to_owned()],
    }
}

#[test]
fn every_promise_names_a_place_and_a_test_that_are_there() {
    let repository = Repository::read();
    let (mut count, mut missing) = (0, Vec::new());
    for page in PAGES {
        let text = read(root().join(page));
        for [promise, kept, test] in rows(&text) {
            count += 1;
            let mut tests = words(&test);
            // "its unit tests": those of the files that keep it.
            if test.contains("unit tests") {
                let kept = words(&kept).into_iter();
                let tested: Vec<_> = kept
                    .filter(|word| word.ends_with(".rs") && repository.has_test(word))
                    .collect();
                if tested.is_empty() {
                    missing.push(format!("{page}: no unit tests ({promise})"));
                }
                tests.extend(tested);
            }
            let lost = tests.iter().filter(|name| !repository.has_test(name));
            missing.extend(lost.map(|name| format!("{page}: no test `{name}` ({promise})")));
            if tests.is_empty() {
                missing.push(format!("{page}: no test is named ({promise})"));
            }
            let paths = words(&kept);
            let lost = paths
                .iter()
                .filter(|word| word.contains('/') || word.ends_with(".rs"))
                .filter(|word| !repository.has(word));
            missing.extend(lost.map(|name| format!("{page}: no `{name}` ({promise})")));
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
    assert!(count >= FEWEST_ROWS, "{count} promises");
}

#[test]
fn every_attack_stands_beside_a_promise() {
    let tables = PAGES.map(|page| read(root().join(page))).concat();
    for attack in attacks() {
        let named = format!("`{}`", attack.name);
        assert!(
            tables.contains(&named),
            "no promise names the attack {named}"
        );
    }
}
