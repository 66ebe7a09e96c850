//! A scene that is edited while it is served (`taut serve --follow-scene`).
//!
//! A change begins another session: the force is led down, the loops are built anew, and nodes, bridge and observers join again as after a restart of the
//! server. So nothing jumps, and whoever has to arm after a restart has to arm. A scene that cannot be served changes nothing.

use std::path::{Path, PathBuf};

use taut_scene::{NeededFile, Workbench};

use crate::report::terminal::Terminal;
use crate::session::Session;
use crate::session::file_watch::FileWatch;
use crate::session::setup::SessionSetup;
use crate::shared::failure::Failure;

/// Watches the workbench file and the files of its scene.
pub(super) struct SceneWatch {
    files: FileWatch,
    /// Text that says what the scene is made of, as far as it is in one: its own, and that of what it names.
    contents: Vec<Vec<u8>>,
    paths: Vec<PathBuf>,
}

impl SceneWatch {
    /// Watches what was read just now.
    pub(super) fn new(config: &Path, workbench: &Workbench) -> Result<Self, Failure> {
        let mut paths = Vec::new();
        for file in workbench.needed_files()? {
            match file {
                NeededFile::OfScene { found, .. } => paths.push(found),
                NeededFile::Named(path) if path == Path::new(&workbench.scene) => paths.push(path),
                NeededFile::Named(_) | NeededFile::Secret(_) => {}
            }
        }
        let mut watched = vec![config.to_path_buf()];
        watched.extend(paths.iter().cloned());
        Ok(Self {
            files: FileWatch::new(watched),
            contents: contents(&workbench.scene, &paths),
            paths,
        })
    }

    /// The session that is to take the place of this one, if the scene is another and can be served; says what became of a change.
    pub(super) fn follow(
        &mut self,
        terminal: &Terminal,
        load: impl FnOnce() -> Result<(Workbench, SessionSetup), Failure>,
    ) -> Option<(Workbench, SessionSetup)> {
        if !self.files.is_due() {
            return None;
        }
        let loaded = load().and_then(|(workbench, setup)| {
            Session::begin(&setup)?;
            Ok((workbench, setup))
        });
        match loaded {
            // The workbench file may have changed in what is followed without a new session, or needs a restart.
            Ok((workbench, _)) if contents(&workbench.scene, &self.paths) == self.contents => None,
            Ok(next) => {
                terminal.say(&format!(
                    "the scene {} is taken: the force fades, and another session begins",
                    next.0.scene
                ));
                Some(next)
            }
            Err(error) => {
                terminal.say(&format!(
                    "the changed scene is not taken, and the one before goes on: {error}"
                ));
                None
            }
        }
    }
}

/// Name of the scene, and the bytes of its files.
fn contents(scene: &str, paths: &[PathBuf]) -> Vec<Vec<u8>> {
    let files = paths
        .iter()
        .map(|path| std::fs::read(path).unwrap_or_default());
    std::iter::once(scene.as_bytes().to_vec())
        .chain(files)
        .collect()
}
