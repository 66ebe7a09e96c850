//! What an operator's wish comes to: read, checked, and put together as the next session, on a thread of its own.

use std::path::Path;
use std::sync::Arc;

use taut_scene::{EditedKey, FinishedFile, Scene};

use super::load::{Loader, Next};
use crate::session::Session;
use crate::session::operator::SceneWish;
use crate::shared::failure::Failure;

/// Most changes that are named as not kept.
const MAX_NOT_KEPT: usize = 100;

/// A wish, and what it is made of.
pub(super) struct Wanted {
    pub(super) loader: Loader,
    /// The scene that runs.
    pub(super) scene: Scene,
    pub(super) from: String,
    pub(super) in_file: Arc<str>,
    pub(super) not_kept: Vec<String>,
    /// What can be chosen.
    pub(super) scenes: Vec<String>,
    pub(super) wish: SceneWish,
}

/// What is to take the place of the scene that runs.
pub(super) struct Change {
    pub(super) next: Next,
    /// For people.
    pub(super) what: String,
    /// The file is to have it.
    pub(super) keep: bool,
}

impl Wanted {
    /// Everything that can be wrong is found here; nothing is opened and nothing written.
    pub(super) fn make(self) -> Result<Change, Failure> {
        let keep = self.wish.keep;
        let (mut next, what) = match &self.wish.scene {
            Some(named) => self.another(named)?,
            None => self.same()?,
        };
        if keep {
            next.not_kept.clear();
        }
        Session::begin(&next.setup)?;
        Ok(Change { next, what, keep })
    }

    /// The scene that runs, with some keys set.
    fn same(&self) -> Result<(Next, String), Failure> {
        let (edited, keys) = self.scene.edited(&self.wish.edits)?;
        if edited.text() == self.scene.text() {
            return Err(Failure::bad_input("the scene has all of that already"));
        }
        let mut next = self.loader.change(&self.from, edited)?;
        next.in_file = self.in_file.clone();
        next.not_kept = self.not_kept.clone();
        let named = tell(&keys, &mut next.not_kept);
        Ok((next, named))
    }

    /// Another scene, or this one as its file is, with some keys set.
    fn another(&self, named: &str) -> Result<(Next, String), Failure> {
        let is_it = |scene: &&String| {
            let file = Path::new(scene).file_name();
            scene.as_str() == named || file.is_some_and(|file| file == named)
        };
        let Some(name) = self.scenes.iter().find(is_it) else {
            return Err(Failure::BadInput(format!(
                "the scene \"{named}\" is none of those that may be chosen ({}); name it in [operator] scenes of the workbench file",
                self.scenes.join(", ")
            )));
        };
        let read = Scene::named_or_file(name)?;
        let (edited, keys) = read.edited(&self.wish.edits)?;
        let mut next = self.loader.choose(name, Some(edited))?;
        next.in_file = read.text().clone();
        let mut what = format!("scene {name}");
        if !keys.is_empty() {
            what = format!("{what}, {}", tell(&keys, &mut next.not_kept));
        }
        Ok((next, what))
    }
}

/// What was set, for people; it is added to what is not kept.
fn tell(keys: &[EditedKey], not_kept: &mut Vec<String>) -> String {
    let named: Vec<String> = keys.iter().map(ToString::to_string).collect();
    not_kept.extend(named.iter().cloned());
    let more = not_kept.len().saturating_sub(MAX_NOT_KEPT);
    not_kept.drain(..more);
    named.join(", ")
}

/// Puts the text of a scene into its file, unless the file is another than the one that was read.
pub(super) fn write_scene(file: &str, text: &str, read: &str) -> Result<(), String> {
    let path = Path::new(file);
    let there = std::fs::read(path).map_err(|error| format!("{file} cannot be read ({error})"))?;
    if there != read.as_bytes() {
        return Err(format!(
            "{file} was changed since it was read; take that first (choose the scene anew, or serve with --follow-scene)"
        ));
    }
    FinishedFile::replace(path, text).map_err(|error| {
        format!(
            "{file} cannot be written ({error}); it is as it was; check its folder's permissions"
        )
    })
}
