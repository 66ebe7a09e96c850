//! `taut-lab oracle [RECIPE...]`: makes the tables of right answers anew, with their errors, and says how far the method's finer run is
//! from them. `taut-lab oracle --clearance UM --step UM [RECIPE...]` writes nothing: it says how far a run with these is from the tables.

use std::error::Error;
use std::fs;
use std::process::ExitCode;

use super::error::{VARIANTS, apart, errors, variant};
use super::table::{Table, path};
use super::{Fineness, Followed, follow};
use crate::cpu_time::quantile;
use crate::crew;
use crate::provenance;
use crate::recipe::{Ideal, Recipe};
use crate::recipes::{Extent, all};
use crate::reference;

const HEAD: &str = "recipe, compared with, force p50, p95, max (N), torque p50, p95, max (N m)";

/// Makes the tables of the named recipes, or of all; or tries another fineness on them.
pub fn run(arguments: &[String]) -> Result<ExitCode, Box<dyn Error>> {
    let mut tried = None;
    let mut names = Vec::new();
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut micrometres = || -> Result<f64, Box<dyn Error>> {
            let number = rest.next().ok_or(format!("{argument} needs micrometres"))?;
            Ok(1e-6 * number.parse::<f64>()?)
        };
        match argument.as_str() {
            "--clearance" => tried.get_or_insert_with(Fineness::default).clearance = micrometres()?,
            "--step" => tried.get_or_insert_with(Fineness::default).step = micrometres()?,
            option if option.starts_with('-') => {
                return Err(format!("there is no option `{option}`").into());
            }
            name => names.push(name),
        }
    }
    let recipes = wanted(&names);
    if recipes.is_empty() {
        return Err("no recipe of these has an answer of the oracle".into());
    }
    match tried {
        Some(fineness) => attempt(&recipes, fineness),
        None => make(&recipes)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// Those with an answer of the oracle, in both extents; of two with the same answer one.
fn wanted(names: &[&str]) -> Vec<Recipe> {
    let mut recipes: Vec<Recipe> = Vec::new();
    for recipe in all(Extent::Full).into_iter().chain(all(Extent::Quick)) {
        let wanted = names.is_empty() || names.contains(&recipe.name);
        let known = recipes.iter().any(|other| path(other) == path(&recipe));
        if matches!(recipe.ideal, Ideal::Oracle) && wanted && !known {
            recipes.push(recipe);
        }
    }
    recipes
}

/// Runs with another fineness, against the tables.
fn attempt(recipes: &[Recipe], fineness: Fineness) {
    let runs = crew::map(crew::cores(), recipes, |recipe| follow(recipe, fineness));
    println!("{HEAD}");
    for (recipe, run) in recipes.iter().zip(runs) {
        eprintln!("{recipe:?}: {:?}", run.account);
        let difference = apart(&recipe.answer().wrenches, &run.wrenches);
        println!("{}", line(recipe, "its table", &difference));
    }
}

fn make(recipes: &[Recipe]) -> Result<(), Box<dyn Error>> {
    let commit = provenance::commit();
    let tasks: Vec<(usize, usize)> = (0..recipes.len())
        .flat_map(|recipe| (0..VARIANTS.len()).map(move |index| (recipe, index)))
        .collect();
    let runs = crew::map(crew::cores(), &tasks, |(recipe, index)| {
        let run = follow(&recipes[*recipe], variant(*index));
        eprintln!(
            "{:?}, {}: {:?}",
            recipes[*recipe], VARIANTS[*index], run.account
        );
        run
    });
    println!("{HEAD}");
    for (recipe, runs) in recipes.iter().zip(runs.chunks(VARIANTS.len())) {
        write(recipe, &runs[0], errors(runs), &commit)?;
        for (name, run) in VARIANTS.iter().zip(runs).skip(1) {
            println!(
                "{}",
                line(recipe, name, &apart(&runs[0].wrenches, &run.wrenches))
            );
        }
        let finer = reference::of(recipe);
        let difference = apart(&runs[0].wrenches, &finer.wrenches);
        println!("{}", line(recipe, "the method's finer run", &difference));
    }
    Ok(())
}

fn write(
    recipe: &Recipe,
    run: &Followed,
    errors: [f64; 2],
    commit: &str,
) -> Result<(), Box<dyn Error>> {
    let path = path(recipe);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let table = Table::new(run, variant(0), errors);
    fs::write(&path, table.text(recipe, commit))?;
    eprintln!("{}", path.display());
    Ok(())
}

fn line(recipe: &Recipe, name: &str, difference: &[Vec<f64>; 2]) -> String {
    let shares = |values: &Vec<f64>| {
        [0.5, 0.95, 1.0]
            .map(|share| format!("{:.2e}", quantile(values, share)))
            .join(", ")
    };
    format!(
        "{recipe:?}, {name}, {}, {}",
        shares(&difference[0]),
        shares(&difference[1])
    )
}
