//! `taut-lab fidelity`: what is run, and where its files go.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::held_out::{choice, front, scenes as held_out};
use super::scenes::FidelityScene;
use super::sweep::{Swept, sweep};
use super::tables::{choices, every_setting, table, within_times};
use super::{every, picture, scenes, seen};
use crate::crew;

/// What is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// The scenes of different need.
    Scenes,
    /// Those that were held out once.
    Seen,
    /// Those that are held out: what is foretold of them.
    Predict,
    /// The same, run.
    HeldOut,
    /// The methods in them.
    Front,
    /// All recipes and shipped scenes.
    Every,
}

/// Exit code 1 where a choice is over the budget although some setting is within it.
pub fn run(arguments: impl Iterator<Item = String>) -> Result<ExitCode, Box<dyn Error>> {
    let (mut quick, mut directory) = (false, PathBuf::from("target/lab"));
    let mut what = What::Scenes;
    let mut names = Vec::new();
    let mut arguments = arguments;
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => quick = true,
            "--seen" => what = What::Seen,
            "--held-out" => what = What::HeldOut,
            "--predict" => what = What::Predict,
            "--front" => what = What::Front,
            "--every" => what = What::Every,
            "--out" => directory = arguments.next().ok_or("--out needs a directory")?.into(),
            option if option.starts_with('-') => {
                return Err(format!("fidelity has no option `{option}`").into());
            }
            _ => names.push(argument),
        }
    }
    let files = directory.join("fidelity");
    fs::create_dir_all(&files)?;
    match what {
        What::Scenes => run_scenes(scenes::all(&files)?, (&files, &directory), quick),
        What::Seen => {
            let swept = swept(&seen::all(&files)?, &files, quick)?;
            let (table, kept) = choice::verdict(&swept);
            Ok(told(&table, kept, swept.len()))
        }
        What::Predict => {
            print!("{}", choice::predictions(&held_out::all(&files)?, &files)?);
            Ok(ExitCode::SUCCESS)
        }
        What::HeldOut => run_held_out(&files, &directory, quick),
        What::Front => {
            let found = front::run(&held_out::all(&files)?, &files)?;
            fs::write(
                directory.join("held-out-methods-found.csv"),
                front::csv(&found),
            )?;
            let (table, [right, of, fronts, of_fronts]) = front::verdict(&found);
            print!("{table}");
            println!("{right} of {of} foretold right; the cheapest in {fronts} of {of_fronts}");
            Ok(ExitCode::SUCCESS)
        }
        What::Every => {
            let judged = every::run(&names)?;
            fs::write(directory.join("fidelity_every.csv"), every::csv(&judged))?;
            print!("{}", every::table(&judged));
            let kept = judged.iter().filter(|judged| judged.is_kept()).count();
            Ok(ExitCode::from(u8::from(kept < judged.len())))
        }
    }
}

fn swept(
    scenes: &[FidelityScene],
    files: &Path,
    quick: bool,
) -> Result<Vec<Swept>, taut_scene::SceneError> {
    let swept = crew::map(crew::cores(), scenes, |scene| {
        let swept = sweep(scene, files, quick);
        eprintln!("{}", scene.name);
        swept
    });
    swept.into_iter().collect()
}

fn run_scenes(
    scenes: Vec<FidelityScene>,
    (files, directory): (&Path, &Path),
    quick: bool,
) -> Result<ExitCode, Box<dyn Error>> {
    let swept = swept(&scenes, files, quick)?;
    fs::write(directory.join("fidelity.csv"), every_setting(&swept))?;
    fs::write(directory.join("fidelity_choice.csv"), choices(&swept))?;
    fs::write(directory.join("fidelity_time.csv"), within_times(&swept))?;
    fs::write(directory.join("fidelity.svg"), picture::svg(&swept)?)?;
    print!("{}", table(&swept));
    println!("files in {}", directory.display());
    let kept = swept.iter().all(Swept::is_kept);
    Ok(ExitCode::from(u8::from(!kept)))
}

/// Against what was committed.
fn run_held_out(files: &Path, directory: &Path, quick: bool) -> Result<ExitCode, Box<dyn Error>> {
    let scenes = held_out::all(files)?;
    if choice::predictions(&scenes, files)? != choice::PREDICTIONS {
        return Err("the choices are not those of tests/lab/data/held-out.csv any more: what was held out has been seen, so hold out other scenes".into());
    }
    let swept = swept(&scenes, files, quick)?;
    fs::write(directory.join("held-out-found.csv"), choices(&swept))?;
    let (table, kept) = choice::verdict(&swept);
    Ok(told(&table, kept, swept.len()))
}

fn told(table: &str, kept: usize, of: usize) -> ExitCode {
    print!("{table}");
    println!("{kept} of {of} kept");
    ExitCode::from(u8::from(kept < of))
}
