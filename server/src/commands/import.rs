//! `taut import`: parts into a folder with meshes, a scene and its picture. The work is `taut_scene::import`.

use taut_scene::{ImportPart, ImportReport, ImportRequest, Problem, give_to_parts};

use super::preview;
use crate::cli::ImportArgs;
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;

/// Imports, or says every fault of every part.
pub(super) fn run(args: &ImportArgs) -> Result<ImportReport, Failure> {
    let mut parts: Vec<ImportPart> = args.parts.iter().map(|w| ImportPart::named(w)).collect();
    let bad = |problem: Problem| Failure::BadInput(problem.to_string());
    let unit = give_to_parts("--unit", &args.unit, &mut parts, |part| &mut part.unit);
    let up = give_to_parts("--up", &args.up, &mut parts, |part| &mut part.up);
    let request = ImportRequest {
        parts,
        folder: args.out.clone(),
        unit: unit.map_err(bad)?,
        up: up.map_err(bad)?,
        simplify: args.simplify,
        close_holes: args.close_holes,
        thicken: args.thicken,
        name: args.name.clone(),
        obstacles_only: args.obstacle,
        only: args.only.clone(),
        split: args.split,
    };
    // Until there is something to remove, a signal ends the process as ever.
    let mut signals = None;
    let mut is_interrupted = || {
        let listening = signals.get_or_insert_with(Shutdown::by_signals);
        listening.as_ref().is_ok_and(Shutdown::is_asked)
    };
    let imported = taut_scene::import_unless(&request, &mut is_interrupted);
    let mut report = imported.map_err(|error| {
        let all: Vec<String> = error.problems().iter().map(ToString::to_string).collect();
        let all = all.join("\n");
        if is_interrupted() {
            Failure::Failed(all)
        } else {
            Failure::BadInput(all)
        }
    })?;
    // A picture is a help, not part of the scene.
    match preview::beside(&report.scene) {
        Ok(picture) => report.picture = Some(picture),
        Err(reason) => report.notes.push(format!("no picture was drawn: {reason}")),
    }
    Ok(report)
}
