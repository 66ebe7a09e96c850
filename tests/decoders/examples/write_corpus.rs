//! Writes the samples of every decoder as the beginning of its corpus: `cargo run -p taut-decoders --example write_corpus -- DIRECTORY`.
//!
//! A directory per decoder; prints the decoders' names, one per line.

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use taut_decoders::DECODERS;

fn main() -> Result<(), Box<dyn Error>> {
    let root: PathBuf = std::env::args().nth(1).ok_or("name a directory")?.into();
    for decoder in DECODERS {
        let directory = root.join(decoder.name);
        fs::create_dir_all(&directory)?;
        for (number, seed) in (decoder.seeds)().iter().enumerate() {
            fs::write(directory.join(format!("sample-{number}")), seed)?;
        }
        println!("{}", decoder.name);
    }
    Ok(())
}
