//! Runs the recipes for every method and rate: `cargo run --release -p taut-lab -- [--quick] [--out DIRECTORY] [--method NAME]... [RECIPE...]`.
//!
//! Prints the table and writes it, the CSV files and the chart. Exit code 1 where this project's own method fails at 1 kHz, or a study or
//! a reference answer does.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use taut_lab::method::Method;
use taut_lab::outcome::run_recipe;
use taut_lab::recipes::{Extent, STUDIES, all};
use taut_lab::row::{Row, Verdict};
use taut_lab::{chart, report};

/// Where files go unless told otherwise.
const DIRECTORY: &str = "target/lab";
/// The rate at which this project's method must pass every recipe, Hz.
const OWN_RATE: u32 = 1000;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let (mut extent, mut directory, mut wanted) =
        (Extent::Full, PathBuf::from(DIRECTORY), Vec::new());
    if std::env::args().nth(1).as_deref() == Some("fidelity") {
        return taut_lab::fidelity::command::run(std::env::args().skip(2));
    }
    let mut methods = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => extent = Extent::Quick,
            "--out" => directory = arguments.next().ok_or("--out needs a directory")?.into(),
            "--method" => {
                let name = arguments.next().ok_or("--method needs a name")?;
                let known = Method::ALL.iter().find(|method| method.name() == name);
                methods.push(*known.ok_or_else(|| {
                    let all = Method::ALL.map(Method::name).join(", ");
                    format!("there is no method `{name}`; there are {all}")
                })?);
            }
            option if option.starts_with('-') => {
                return Err(format!("there is no option `{option}`").into());
            }
            name => wanted.push(name.to_owned()),
        }
    }
    if methods.is_empty() {
        methods.extend(Method::ALL);
    }
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let recipes = all(extent);
    let known = |name: &str| {
        recipes.iter().any(|recipe| recipe.name == name)
            || STUDIES.iter().any(|study| study.name == name)
    };
    if let Some(unknown) = wanted.iter().find(|name| !known(name.as_str())) {
        return Err(format!("there is no recipe `{unknown}`").into());
    }
    let mut rows: Vec<Row> = Vec::new();
    for study in STUDIES.iter().filter(|study| is_wanted(study.name)) {
        eprintln!("{}: {}", study.name, study.about);
        rows.extend((study.run)(extent));
    }
    let mut outcomes = Vec::new();
    for recipe in recipes.iter().filter(|recipe| is_wanted(recipe.name)) {
        eprint!("{recipe:?}: {} ", recipe.about);
        let (of_recipe, its_rows) = run_recipe(recipe, &methods, |_| eprint!("."));
        eprintln!();
        outcomes.extend(of_recipe);
        rows.extend(its_rows);
    }
    rows.sort_by(|a, b| a.recipe.cmp(b.recipe)); // stable: cases stay in their order
    print!("{}", report::table(&rows));
    report::write(&rows, &outcomes, &directory)?;
    chart::write(&rows, &outcomes, &directory)?;
    println!("\nfiles in {}", directory.display());
    let failed = rows.iter().any(own_failure);
    Ok(ExitCode::from(u8::from(failed)))
}

/// Whether a row is a failure of this project's own: of its method at the rate that counts, or of something that has no rate.
fn own_failure(row: &Row) -> bool {
    let own =
        row.rate.is_none() || (row.method == Method::Ours.name() && row.rate == Some(OWN_RATE));
    own && row.verdict == Verdict::Fail
}
