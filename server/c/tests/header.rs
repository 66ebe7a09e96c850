//! The header is what cbindgen makes of the sources, and stays small.

use std::path::Path;

fn made() -> String {
    let crate_directory = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(crate_directory.join("cbindgen.toml")).unwrap();
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["errors", "types", "scene", "files"] {
        builder = builder.with_src(crate_directory.join(format!("src/{file}.rs")));
    }
    let mut header = Vec::new();
    builder.generate().unwrap().write(&mut header);
    String::from_utf8(header).unwrap()
}

#[test]
fn the_header_is_that_of_the_sources() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/taut.h");
    let made = made();
    if std::env::var_os("TAUT_WRITE_HEADER").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let header = std::fs::read_to_string(&path).unwrap();
    assert!(
        header == made,
        "include/taut.h is out of date: TAUT_WRITE_HEADER=1 cargo test -p taut-c --test all header::"
    );
}

#[test]
fn there_are_at_most_twenty_functions() {
    let names: std::collections::BTreeSet<String> = made()
        .split("taut_")
        .skip(1)
        .filter_map(|rest| Some(rest.split_once('(')?.0.to_owned()))
        .filter(|name| name.chars().all(|c| c.is_ascii_lowercase() || c == '_'))
        .collect();
    assert!((10..=20).contains(&names.len()), "{names:?}");
}
