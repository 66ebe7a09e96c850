//! `taut export`: a recorded session as an MCAP file. The work is `taut_recording::export_mcap`; what it needs of the scene is found here.

use std::path::{Path, PathBuf};

use taut_recording::{
    ExportReport, MovingObstacle, Recording, RecordingError, SceneFrames, export_mcap,
};
use taut_scene::{BuiltScene, FinishedFile};

use crate::cli::ExportArgs;
use crate::commands::replay::recorded::{files_of, scene_of};
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;

/// Exports what is whole. Nothing is left of an export that does not end.
pub(super) fn run(args: &ExportArgs) -> Result<ExportReport, Failure> {
    let interrupted = Shutdown::by_signals()?;
    let recording = Recording::open(&args.recording).map_err(Failure::bad_input)?;
    let frames = scene_of(&recording).map(frames_of);
    let scene = frames.as_ref().map_err(ToString::to_string);
    let cannot_write = |error: std::io::Error| {
        Failure::BadInput(format!(
            "{}: the export cannot be written ({error}); check the path, its permissions and the free space",
            args.out.display()
        ))
    };
    let files = files_of(&recording);
    let of_scene = files.iter().map(PathBuf::as_path);
    let inputs: Vec<&Path> = [args.recording.as_path()]
        .into_iter()
        .chain(of_scene)
        .collect();
    let mut file = FinishedFile::create(&args.out, &inputs).map_err(cannot_write)?;
    let report =
        export_mcap(&recording, scene, &mut file, || interrupted.is_asked()).map_err(|error| {
            match error {
                RecordingError::Interrupted => Failure::failed(error),
                error => Failure::BadInput(format!("{}: {error}", args.out.display())),
            }
        })?;
    file.finish().map_err(cannot_write)?;
    Ok(report)
}

/// What moves, and where wrenches act.
fn frames_of(built: BuiltScene) -> SceneFrames {
    let obstacles = &built.world.obstacles;
    SceneFrames {
        reference_point: built.world.body.reference_point,
        obstacles: built
            .motions
            .into_iter()
            .map(|motion| MovingObstacle {
                index: motion.obstacle,
                name: obstacles
                    .get(motion.obstacle)
                    .map_or_else(String::new, |obstacle| obstacle.name.clone()),
                pose_at: Box::new(move |elapsed| motion.pose_at(elapsed)),
            })
            .collect(),
    }
}
