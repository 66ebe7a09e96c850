//! Runs the recipes for every method and rate: `cargo run --release -p taut-lab -- [--quick] [--out DIRECTORY] [RECIPE...]`.
//!
//! Prints the table and writes it, the CSV files and the chart. Exit code 1 where this project's own method fails at 1 kHz.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use taut_lab::clock::RATES;
use taut_lab::method::Method;
use taut_lab::outcome::Outcome;
use taut_lab::recipes::{Extent, all};
use taut_lab::{chart, report};

/// Where files go unless told otherwise.
const DIRECTORY: &str = "target/lab";
/// The rate at which this project's method must pass every recipe, Hz.
const OWN_RATE: u32 = 1000;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let (mut extent, mut directory, mut wanted) =
        (Extent::Full, PathBuf::from(DIRECTORY), Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => extent = Extent::Quick,
            "--out" => directory = arguments.next().ok_or("--out needs a directory")?.into(),
            name => wanted.push(name.to_owned()),
        }
    }
    let mut recipes = all(extent);
    if let Some(unknown) = wanted
        .iter()
        .find(|name| recipes.iter().all(|recipe| recipe.name != name.as_str()))
    {
        return Err(format!("there is no recipe `{unknown}`").into());
    }
    recipes.retain(|recipe| wanted.is_empty() || wanted.iter().any(|name| name == recipe.name));
    let mut outcomes = Vec::new();
    for recipe in &recipes {
        for method in Method::ALL {
            for rate in RATES {
                outcomes.push(Outcome::of(recipe, method, rate));
            }
        }
        eprintln!("{recipe:?}: {}", recipe.about);
    }
    print!("{}", report::table(&outcomes));
    report::write(&outcomes, &directory)?;
    chart::write(&outcomes, &directory)?;
    println!("\nfiles in {}", directory.display());
    let own_fails = outcomes
        .iter()
        .any(|o| o.method == Method::Ours && o.rate == OWN_RATE && !o.passes());
    Ok(ExitCode::from(u8::from(own_fails)))
}
