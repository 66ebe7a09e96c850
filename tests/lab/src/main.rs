//! The command of the laboratory: `cargo run --release -p taut-lab -- --help` says what it runs and writes.
//!
//! Results that are finished are kept in `done` beside the files, and not run again unless `--fresh` says so.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use taut_lab::crew;
use taut_lab::method::Method;
use taut_lab::papers;
use taut_lab::recipes::Extent;
use taut_lab::replay;
use taut_lab::report;
use taut_lab::run::{Plan, own_failure};
use taut_lab::store::Store;
use taut_lab::sweeps::SWEEPS;

/// Where files go unless told otherwise.
const DIRECTORY: &str = "target/lab";

/// What the command line says.
struct Arguments {
    plan: Plan,
    directory: PathBuf,
    page: bool,
    fresh: bool,
}

fn main() -> ExitCode {
    run().unwrap_or_else(|error| {
        eprintln!("taut-lab: {error}");
        ExitCode::from(2)
    })
}

fn run() -> Result<ExitCode, Box<dyn Error>> {
    let all: Vec<String> = std::env::args().skip(1).collect();
    if all.iter().any(|argument| argument == "--help") {
        print!("{}", help());
        return Ok(ExitCode::SUCCESS);
    }
    let mut given = all.iter().skip(1).cloned();
    match all.first().map(String::as_str) {
        Some("fidelity") => taut_lab::fidelity::command::run(given),
        Some("--measure") => measure(given),
        Some("papers") => {
            print!("{}", papers::table(&papers::figures()));
            Ok(ExitCode::SUCCESS)
        }
        Some("league") => {
            let directory = given.next().unwrap_or(DIRECTORY.to_owned());
            taut_lab::page::league::write(Path::new(&directory))?;
            Ok(ExitCode::SUCCESS)
        }
        Some("oracle") => taut_lab::oracle::command(&all[1..]),
        Some("measured") => measured(given.next()),
        _ => laboratory(arguments(all.into_iter())?),
    }
}

/// Runs a plan, and writes and prints what came of it.
fn laboratory(given: Arguments) -> Result<ExitCode, Box<dyn Error>> {
    let Arguments {
        plan,
        directory,
        page,
        fresh,
    } = given;
    plan.validate()?;
    let store = store(fresh, &directory);
    let results = plan.run(&store);
    results.write(&directory, page)?;
    print!("{}", report::headlines(&results.scores));
    print!("{}", report::table(&results.rows));
    println!("\nfiles in {}", directory.display());
    if store.read() > 0 {
        println!("{} results were kept from before", store.read());
    }
    let failed = results.rows.iter().any(own_failure);
    Ok(ExitCode::from(u8::from(failed)))
}

/// Finished results beside the files; none where everything is to run again.
fn store(fresh: bool, directory: &Path) -> Store {
    if fresh {
        Store::none()
    } else {
        Store::in_directory(&directory.join("done"))
    }
}

/// Replays every measured trial through every method that turns its body, and writes the figures.
fn measured(path: Option<String>) -> Result<ExitCode, Box<dyn Error>> {
    let path = path.map_or_else(
        || Path::new(DIRECTORY).join("measured-forces.csv"),
        PathBuf::from,
    );
    let mut all = Vec::new();
    for &method in Method::SIX_DEGREES {
        let choice = replay::choose(method)?;
        for trial in replay::TRIALS {
            all.push(replay::replay(trial, method, choice)?);
            eprintln!("{trial}, {}", method.name());
        }
    }
    let table = replay::csv(&all);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&path, &table)?;
    print!("{table}");
    Ok(ExitCode::SUCCESS)
}

/// Makes the table of costs anew, at the path that is given or where it is committed; rows of methods that are not asked for stay.
fn measure(mut given: impl Iterator<Item = String>) -> Result<ExitCode, Box<dyn Error>> {
    let mut path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/data/costs.csv"));
    let (mut methods, mut fresh) = (Vec::new(), false);
    while let Some(argument) = given.next() {
        match argument.as_str() {
            "--method" => methods.push(method_named(given.next())?),
            "--fresh" => fresh = true,
            option if option.starts_with('-') => return Err(no_option(option).into()),
            _ => path = argument.into(),
        }
    }
    if methods.is_empty() {
        methods.extend(Method::ALL);
    }
    let store = store(fresh, Path::new(DIRECTORY));
    let old = std::fs::read_to_string(&path).unwrap_or_default();
    let table = taut_lab::costs::measure(&methods, &old, &store, |done, total| {
        eprintln!("{done} of {total} recipes");
    })?;
    std::fs::write(&path, table)?;
    println!("{}", path.display());
    if store.read() > 0 {
        println!(
            "{} rows were kept from before; --fresh measures them again",
            store.read()
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn method_named(name: Option<String>) -> Result<Method, String> {
    let name = name.ok_or("--method needs a name")?;
    let known = Method::ALL.iter().find(|method| method.name() == name);
    known.copied().ok_or_else(|| {
        let all = Method::ALL.map(Method::name).join(", ");
        format!("there is no method `{name}`; there are {all}")
    })
}

fn no_option(option: &str) -> String {
    format!("there is no option `{option}`; --help lists them")
}

fn help() -> String {
    format!(
        "\
Runs the recipes for every method and rate; prints the table, and writes it with CSV files and charts.

taut-lab [report] [OPTION...] [RECIPE...]
taut-lab fidelity [--quick] [--seen | --held-out | --predict | --front | --every [CASE...]] [--out DIRECTORY]
taut-lab --measure [--method NAME]... [--fresh] [FILE]
taut-lab measured [FILE]
taut-lab papers
taut-lab league [DIRECTORY]
taut-lab oracle [RECIPE...]

  report           adds all sweeps and maps, and writes report.html, a page of everything
  fidelity         what the choice of a scene's settings costs, beside every setting
  measured         replays measured contact forces through every method (tests/data/measured)
  papers           each opponent on a scene of its own paper, beside what is published
  league           picture and table of taut beside other engines, from the committed rows of scripts/league
  oracle           makes the tables of right answers anew (tests/lab/data/oracle), of some recipes or of all
  --measure        makes the table of costs anew (tests/lab/data/costs.csv): on a quiet machine; of --method NAME alone where that is given
  --quick          a part of the cases
  --held-out       of fidelity: the twelve scenes whose predictions were written down before they were run; --predict prints these, --front
                   runs the methods in them, and --seen the twelve scenes that were held out before
  --every          of fidelity: the choice in every recipe with a right answer and every shipped scene
  --out DIRECTORY  where files go (default: {DIRECTORY})
  --threads N      how many at once (default: one for each core)
  --method NAME    this method only; may be repeated: {}
  --sweep NAME     this sweep; may be repeated: {}
  --maps           the stability maps
  --fresh          runs what is finished, too

Recipes are named as in the table (R01, R09, ...); all of them run unless some recipes, sweeps or the maps are named.
Exit code 1: this project's own method fails at 1 kHz, or a study or a reference answer does. 2: the arguments are wrong, or a file cannot be written.
Example: taut-lab report --quick R01 R09
",
        Method::ALL.map(Method::name).join(", "),
        SWEEPS.map(|sweep| sweep.name).join(", ")
    )
}

fn arguments(mut given: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let (mut extent, mut directory) = (Extent::Full, PathBuf::from(DIRECTORY));
    let (mut methods, mut sweeps, mut names) = (Vec::new(), Vec::new(), Vec::new());
    let (mut page, mut fresh, mut maps, mut threads) = (false, false, false, crew::cores());
    while let Some(argument) = given.next() {
        match argument.as_str() {
            "report" | "--report" => page = true,
            "--quick" => extent = Extent::Quick,
            "--fresh" => fresh = true,
            "--maps" => maps = true,
            "--out" => directory = given.next().ok_or("--out needs a directory")?.into(),
            "--threads" => {
                let number = given.next().and_then(|number| number.parse().ok());
                threads = number
                    .filter(|threads| *threads > 0)
                    .ok_or("--threads needs a number above 0")?;
            }
            "--method" => methods.push(method_named(given.next())?),
            "--sweep" => {
                let name = given.next().ok_or("--sweep needs a name")?;
                let known = SWEEPS.iter().find(|sweep| sweep.name == name);
                sweeps.push(*known.ok_or_else(|| {
                    let all = SWEEPS.map(|sweep| sweep.name).join(", ");
                    format!("there is no sweep `{name}`; there are {all}")
                })?);
            }
            option if option.starts_with('-') => return Err(no_option(option)),
            _ => names.push(argument),
        }
    }
    if methods.is_empty() {
        methods.extend(Method::ALL);
    }
    // A sweep alone runs no recipes, recipes alone no sweeps, and a report of everything all of both.
    let everything = names.is_empty() && sweeps.is_empty() && !maps;
    if everything && page {
        sweeps.extend(SWEEPS);
        maps = true;
    }
    Ok(Arguments {
        plan: Plan {
            extent,
            recipes: (!everything).then_some(names),
            methods,
            sweeps,
            maps,
            threads,
        },
        directory,
        page,
        fresh,
    })
}
