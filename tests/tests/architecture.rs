//! The tables of ARCHITECTURE.md say where things are: what they name is there.

use std::path::PathBuf;

use crate::repository::{names, read, root};

const FOLDERS: [&str; 3] = ["", "server/src", "server/method/src"];
const MOST_STATIONS: usize = 12;

/// The rows of the table under a heading, as cells.
fn rows(page: &str, heading: &str) -> Vec<Vec<String>> {
    let (_, after) = page.split_once(heading).expect("the heading");
    let section = after.split("\n## ").next().unwrap_or(after);
    let rows = section.lines().filter(|line| line.starts_with("| "));
    rows.skip(2)
        .map(|line| line.split('|').map(|cell| cell.trim().to_owned()).collect())
        .collect()
}

fn find(path: &str) -> Option<PathBuf> {
    let places = FOLDERS.map(|folder| root().join(folder).join(path));
    places.into_iter().find(|place| place.exists())
}

#[test]
fn every_station_of_the_walks_is_a_function_of_its_file() {
    let page = read(root().join("ARCHITECTURE.md"));
    for heading in [
        "## From a device sample to the force",
        "## From a god-object pose to a lit pixel",
    ] {
        let rows = rows(&page, heading);
        assert_eq!(rows.len(), MOST_STATIONS, "{heading}");
        for row in rows {
            let [file, functions @ ..] = &names(&row[2]).collect::<Vec<_>>()[..] else {
                panic!("{row:?} names no file");
            };
            let place = find(file).unwrap_or_else(|| panic!("{file} is not there"));
            let text = read(place);
            assert!(!functions.is_empty(), "{row:?} names no function");
            for function in functions {
                let name = function.rsplit("::").next().unwrap_or(function);
                assert!(
                    text.contains(&format!("fn {name}(")) || text.contains(&format!("fn {name}<")),
                    "{file} has no function {name}"
                );
            }
        }
    }
}

#[test]
fn whoever_wants_to_change_something_is_sent_to_a_place_that_is_there() {
    let page = read(root().join("ARCHITECTURE.md"));
    let rows = rows(&page, "## To change something, go there");
    assert!(rows.len() > 8);
    for row in rows {
        let named: Vec<&str> = names(&row[2]).collect();
        let folder = named.first().and_then(|first| find(first));
        let folder = folder.unwrap_or_else(|| panic!("{row:?}: the first place is not there"));
        for place in &named[1..] {
            // The others may be given beside the first.
            let beside = folder.parent().map(|parent| parent.join(place));
            let below = folder.join(place);
            let there =
                find(place).is_some() || below.exists() || beside.is_some_and(|p| p.exists());
            assert!(there, "{row:?}: {place} is not there");
        }
    }
}
