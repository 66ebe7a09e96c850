//! What runs, and of that what the page shows.

use std::path::PathBuf;
use std::sync::Arc;

use taut_scene::{Scene, Workbench, shipped_scene_text};

use super::load::Next;
use super::recordings;
use crate::session::operator::{SceneDesk, Standing, objects_of};
use crate::session::setup::SessionSetup;

/// Why a shipped scene is not kept.
pub(super) const NO_FILE: &str =
    "the scene is part of the program and has no file; serve a scene file of your own";

/// The scene that runs.
#[derive(Clone)]
pub(super) struct Running {
    pub(super) scene: Scene,
    /// A shipped scene's name, or its file.
    pub(super) from: String,
    /// Text of the file, as it was when it was read or written last.
    pub(super) in_file: Arc<str>,
    /// What was changed since.
    pub(super) not_kept: Vec<String>,
    /// What can be chosen.
    pub(super) scenes: Vec<String>,
    why_closed: Option<&'static str>,
    /// Where recordings go that are begun from the page.
    pub(super) recordings: Option<PathBuf>,
    /// Where it is recorded.
    pub(super) recording: Option<PathBuf>,
    why_not_recorded: Option<&'static str>,
    /// What can be changed, a JSON object.
    objects: String,
}

impl Running {
    /// A session of this begins; `from_start`: the command line has every session recorded.
    pub(super) fn of(next: &Next, from_start: bool) -> Self {
        let Next {
            workbench, setup, ..
        } = next;
        let mut scenes: Vec<String> = (workbench.scenes().into_iter().map(str::to_owned)).collect();
        // The scene that the workbench names stays one of them while another is chosen.
        let named = next.chosen.as_ref().map(|chosen| &chosen.instead_of);
        scenes.extend(named.filter(|named| !scenes.contains(named)).cloned());
        Self {
            scene: setup.scene.clone(),
            from: workbench.scene.clone(),
            in_file: next.in_file.clone(),
            not_kept: next.not_kept.clone(),
            scenes,
            why_closed: why_closed(workbench, setup, from_start),
            recordings: workbench.operator.recordings.clone(),
            recording: setup.recording.as_ref().map(|r| r.directory.clone()),
            why_not_recorded: recordings::why_not(workbench, setup, from_start),
            objects: objects_of(setup),
        }
    }

    /// Shows it at the page, as this revision.
    pub(super) fn show(&self, desk: &SceneDesk, revision: u64) {
        let recording = self.recording.as_ref().map(|at| at.display().to_string());
        let standing = Standing {
            revision,
            name: self.scene.name(),
            from: &self.from,
            scenes: &self.scenes,
            not_kept: &self.not_kept,
            why_closed: self.why_closed,
            why_not_kept: self.why_not_kept(),
            recording: recording.as_deref(),
            why_not_recorded: self.why_not_recorded,
        };
        desk.show(&standing, &self.objects);
    }

    /// Why the file cannot take it.
    pub(super) fn why_not_kept(&self) -> Option<&'static str> {
        let is_shipped = shipped_scene_text(&self.from).is_some();
        is_shipped.then_some(NO_FILE)
    }
}

/// Why nobody changes the scene of this session.
fn why_closed(
    workbench: &Workbench,
    setup: &SessionSetup,
    from_start: bool,
) -> Option<&'static str> {
    let monitor = setup.monitor.as_ref();
    if setup.recording.is_some() && !from_start {
        return Some(
            "the session is recorded, and a recording is of one scene; end the recording first",
        );
    }
    if setup.recording.is_some() || monitor.is_some_and(|m| m.record.is_some()) {
        return Some("the session is recorded, and a recording is of one scene; serve without");
    }
    recordings::is_opened_once(workbench).then_some(recordings::OPENED_ONCE)
}
