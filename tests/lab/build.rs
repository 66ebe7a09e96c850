//! Hashes the sources of the method: reference answers that an older method gave are made again.

use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    let sources = Path::new("../../server/method/src");
    println!("cargo::rerun-if-changed={}", sources.display());
    let mut files = Vec::new();
    list(sources, &mut files);
    files.sort();
    // FNV-1a, 64 bits: a cache's key, nothing to be safe from.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for file in files {
        for byte in fs::read(&file).expect("a source file can be read") {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    println!("cargo::rustc-env=TAUT_METHOD_SOURCES={hash:016x}");
}

fn list(directory: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("the method's sources are beside the laboratory") {
        let path = entry.expect("a directory can be listed").path();
        if path.is_dir() {
            list(&path, files);
        } else {
            files.push(path);
        }
    }
}
