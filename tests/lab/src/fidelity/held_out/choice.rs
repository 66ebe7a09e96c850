//! What the held-out scenes choose and foretell, and whether it held.

use std::fmt::Write as _;
use std::path::Path;

use taut_scene::SceneError;

use super::super::scenes::FidelityScene;
use super::super::sweep::{Swept, choice};
use super::super::tables::markdown;

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
    let kept = swept.iter().filter(|s| s.is_kept()).count();
    (markdown("scene", swept, Swept::ratio), kept)
}
