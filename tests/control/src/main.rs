//! Prints the table of the control recipes: `cargo run --release -p taut-control-tests [NAME...]`. Exit code 1 where one fails.

use std::process::ExitCode;

use taut_control_tests::RECIPES;

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted
        .iter()
        .find(|name| RECIPES.iter().all(|recipe| recipe.name != name.as_str()))
    {
        let known: Vec<_> = RECIPES.iter().map(|recipe| recipe.name).collect();
        eprintln!(
            "there is no recipe `{unknown}`; there are {}",
            known.join(", ")
        );
        return ExitCode::from(2);
    }
    let chosen = RECIPES
        .iter()
        .filter(|recipe| wanted.is_empty() || wanted.iter().any(|name| name == recipe.name));
    let (mut rows, mut failed) = (0, 0);
    println!("| recipe | case | measured | expected | pass |");
    println!("|--------|------|----------|----------|------|");
    for recipe in chosen {
        for row in (recipe.run)() {
            rows += 1;
            failed += usize::from(!row.pass);
            let verdict = if row.pass { "yes" } else { "NO" };
            println!(
                "| {} | {} | {} | {} | {verdict} |",
                recipe.name, row.case, row.measured, row.expected
            );
        }
    }
    println!("\n{rows} rows, {failed} failed");
    ExitCode::from(u8::from(failed > 0))
}
