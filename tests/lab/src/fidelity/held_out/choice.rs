//! What the held-out scenes choose and foretell, and whether it held.

use std::fmt::Write as _;
use std::path::Path;

use taut_scene::SceneError;

use super::super::scenes::FidelityScene;
use super::super::sweep::{Swept, choice};

/// The predictions, as they were committed.
pub const PREDICTIONS: &str = include_str!("../../../data/held-out.csv");
/// First line of the predictions.
const COLUMNS: &str = "scene,rate_hz,gap_tolerance_m,rounds,mesh_error_m,predicted_j\n";

/// What the scenes choose and foretell, from their files alone: the CSV that is committed before anything is
/// run.
pub fn predictions(scenes: &[FidelityScene], directory: &Path) -> Result<String, SceneError> {
    let mut csv = COLUMNS.to_owned();
    for scene in scenes {
        let (setting, predicted) = choice(scene, directory)?;
        let _ = writeln!(
            csv,
            "{},{},{:e},{},{:.6},{predicted:.6}",
            scene.name, setting.rate, setting.gap_tolerance, setting.rounds, setting.mesh_error
        );
    }
    Ok(csv)
}

/// The verdict on what was chosen: a table of Markdown, and how many choices are within the budget or have no
/// setting that is.
pub fn verdict(swept: &[Swept]) -> (String, usize) {
    let mut text = "| scene | rate, Hz | rounds | J predicted | J measured | cost over the least within the budget | verdict |\n| --- | --- | --- | --- | --- | --- | --- |\n".to_owned();
    let mut kept = 0;
    for s in swept {
        let verdict = match (s.is_within(), s.cheapest()) {
            (true, _) => "within",
            (false, Some(_)) => "**over, though some setting is within**",
            (false, None) => "over, as every setting is",
        };
        kept += usize::from(s.is_within() || s.cheapest().is_none());
        let ratio = s.ratio().map_or("–".to_owned(), |r| format!("{r:.2}"));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.3} | {:.3} | {ratio} | {verdict} |",
            s.name, s.auto.setting.rate, s.auto.setting.rounds, s.plan.predicted_j, s.auto.j
        );
    }
    (text, kept)
}
