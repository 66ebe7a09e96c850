//! `taut import`: parts into a folder with meshes, a scene and its picture. The work is `taut_scene::import`.

use taut_scene::{ImportReport, ImportRequest};

use super::preview;
use crate::cli::ImportArgs;
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;

/// Imports, or says every fault of every part.
pub(super) fn run(args: &ImportArgs) -> Result<ImportReport, Failure> {
    let request = ImportRequest {
        parts: args.parts.clone(),
        folder: args.out.clone(),
        unit: args.unit,
        up: args.up,
        simplify: args.simplify,
        close_holes: args.close_holes,
        thicken: args.thicken,
        name: args.name.clone(),
        obstacles_only: args.obstacle,
        only: args.only.clone(),
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
