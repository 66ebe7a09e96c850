//! Hashes sources: reference answers that an older method gave are made again, and so are results of an older laboratory. Names the compiler.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What an answer of the method depends on.
const METHOD: [&str; 1] = ["../../server/method/src"];
/// What else a result of a recipe depends on: recipes and methods, the independent check, shapes, versions of crates.
const LABORATORY: [&str; 6] = [
    "src",
    "data/costs.csv",
    "data/oracle",
    "../method/src",
    "../../server/scene/src",
    "../../Cargo.lock",
];
/// What only shows results: a page that looks better makes nothing be run again.
const SHOWS: [&str; 11] = [
    "src/page.rs",
    "src/page",
    "src/plot.rs",
    "src/chart.rs",
    "src/overview.rs",
    "src/maps",
    "src/report.rs",
    "src/run.rs",
    "src/score.rs",
    "src/main.rs",
    "src/sweeps",
];

fn main() {
    for (name, sources) in [
        ("TAUT_METHOD_SOURCES", &METHOD[..]),
        ("TAUT_LAB_SOURCES", &LABORATORY[..]),
    ] {
        println!("cargo::rustc-env={name}={:016x}", hash(sources));
    }
    let compiler = std::env::var_os("RUSTC").expect("cargo names the compiler");
    let version = Command::new(compiler).arg("--version").output();
    let version = version.expect("the compiler that builds this can be asked");
    let version = String::from_utf8_lossy(&version.stdout);
    println!("cargo::rustc-env=TAUT_COMPILER={}", version.trim());
}

/// FNV-1a, 64 bits: a cache's key, nothing to be safe from.
fn hash(sources: &[&str]) -> u64 {
    let mut files = Vec::new();
    for source in sources {
        println!("cargo::rerun-if-changed={source}");
        list(Path::new(source), &mut files);
    }
    files.sort();
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for file in files {
        for byte in fs::read(&file).expect("a source file can be read") {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    hash
}

fn list(path: &Path, files: &mut Vec<PathBuf>) {
    if SHOWS.iter().any(|shows| path == Path::new(shows)) {
        return;
    }
    if !path.is_dir() {
        files.push(path.to_owned());
        return;
    }
    for entry in fs::read_dir(path).expect("the sources are beside the laboratory") {
        list(&entry.expect("a directory can be listed").path(), files);
    }
}
