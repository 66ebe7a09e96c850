//! docs/scene-file.md has every key that the parser knows, and no other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use taut_scene::Scene;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/scene-file.md");
/// No key is near to it, so the complaint about it lists all that are known.
const UNKNOWN: &str = "qqqqqq";
/// Deeper tables than any: shape, surface, texture, height map.
const MAX_DEPTH: usize = 6;

type Tables = BTreeMap<String, BTreeSet<String>>;

/// `shape` and `pose` are the same in the god-object as in an obstacle and in scenery, and what is drawn is a shape.
fn table_name(name: &str) -> String {
    for owner in ["[god_object] ", "[[obstacle]] ", "[[scenery]] "] {
        if let Some(inner) = name.strip_prefix(owner)
            && ["shape", "pose"].contains(&inner.split(' ').next().unwrap_or_default())
        {
            return inner.to_owned();
        } else if let Some(inner) = name
            .strip_prefix(owner)
            .and_then(|n| n.strip_prefix("visual"))
        {
            return format!("shape{inner}");
        }
    }
    name.to_owned()
}

/// The tables that complain of an unknown key when `assignment` puts one there, with the keys that they know.
fn complaints(scene: &Scene, assignment: &str) -> Vec<(String, BTreeSet<String>)> {
    let Err(error) = scene.with_override(assignment) else {
        return Vec::new();
    };
    let start = format!("unknown key `{UNKNOWN}` in ");
    let complaint = |text: &str| {
        let (name, keys) = text.strip_prefix(&start)?.split_once("; known keys: ")?;
        let keys = keys.split(", ").map(str::to_owned).collect();
        Some((name.to_owned(), keys))
    };
    let texts = error.problems().iter().map(|p| p.text.as_str());
    texts.filter_map(complaint).collect()
}

/// Every table that the parser reads, found by asking: whatever key it knows may be a table.
fn known() -> Tables {
    let text = "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { mesh = \"a.ply\" }\nvisual = { mesh = \"a.ply\" }\n\
                [[obstacle]]\nname = \"o\"\nshape = { mesh = \"a.ply\" }\nvisual = { mesh = \"a.ply\" }\n\
                [[scenery]]\nname = \"s\"\nshape = { mesh = \"a.ply\" }\n";
    let scene = Scene::parse("s.toml", text, Path::new("")).unwrap();
    let mut tables = Tables::new();
    let mut pending = vec![(String::new(), 0)];
    while let Some((path, depth)) = pending.pop() {
        let assignment = match path.as_str() {
            "" => format!("{UNKNOWN}=1"),
            // What is there already keeps its keys: some are known only beside others.
            "god_object" | "god_object.shape" | "obstacle.0" | "obstacle.0.shape" | "scenery.0"
            | "scenery.0.shape" | "god_object.visual" | "obstacle.0.visual" => {
                format!("{path}.{UNKNOWN}=1")
            }
            _ => format!("{path}={{{UNKNOWN}=1}}"),
        };
        for (name, keys) in complaints(&scene, &assignment) {
            for key in keys.iter().filter(|_| depth < MAX_DEPTH) {
                let child = match (path.as_str(), key.as_str()) {
                    ("", list @ ("obstacle" | "scenery")) => format!("{list}.0"),
                    ("", key) => key.to_owned(),
                    (path, key) => format!("{path}.{key}"),
                };
                pending.push((child, depth + 1));
            }
            tables.entry(table_name(&name)).or_default().extend(keys);
        }
    }
    tables
}

/// The tables of the page: a heading with the table's name, and a row for each key.
fn documented(page: &str) -> Tables {
    let mut tables = Tables::new();
    let mut name = None;
    for line in page.lines() {
        if let Some(heading) = line.strip_prefix("## ") {
            let quoted = heading.strip_prefix('`').and_then(|h| h.strip_suffix('`'));
            name = quoted.map(str::to_owned);
        } else if let (Some(name), Some(row)) = (&name, line.strip_prefix("| `")) {
            let key = row.split('`').next().unwrap_or_default().to_owned();
            let added = tables.entry(name.clone()).or_default().insert(key);
            assert!(added, "twice in {name}: {line}");
        }
    }
    tables
}

#[test]
fn the_page_has_every_key_and_no_other() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (known, documented) = (known(), documented(&page));
    // The search has gone down to the deepest table there is.
    assert!(
        known.contains_key("[[obstacle]] surface texture height_map"),
        "{known:?}"
    );
    for (table, keys) in &known {
        assert_eq!(documented.get(table), Some(keys), "table {table}");
    }
    for table in documented.keys() {
        assert!(known.contains_key(table), "the parser has no table {table}");
    }
}

#[test]
fn the_pages_example_is_a_scene() {
    let page = std::fs::read_to_string(PAGE).unwrap();
    let blocks: Vec<&str> = page
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .collect();
    assert!(!blocks.is_empty());
    for block in blocks {
        Scene::parse("scene-file.md", block, Path::new("")).unwrap();
    }
}

#[test]
fn an_adaptation_that_says_one_number_has_the_other_of_the_page() {
    let adaptation = |coupling: &str| {
        let text = format!(
            "name = \"x\"\n[god_object]\nmass = 1.0\nshape = {{ sphere = {{ radius = 0.01 }} }}\n\
             pose = {{ position = [0.0, 0.0, 0.1] }}\n\
             [[obstacle]]\nname = \"o\"\nshape = {{ plane = {{}} }}\n[coupling]\n{coupling}\n"
        );
        let scene = Scene::parse("s.toml", &text, Path::new("")).unwrap();
        let settings = scene.build().unwrap().settings;
        let adaptation = settings.adaptation.unwrap();
        (adaptation.duration, adaptation.threshold)
    };
    assert_eq!(adaptation(""), (0.02, -2e-3));
    let longer = adaptation("adaptation = { duration = 0.05 }");
    assert_eq!(longer, (0.05, -2e-3));
    let finer = adaptation("adaptation = { threshold = -1e-4 }");
    assert_eq!(finer, (0.02, -1e-4));
}
