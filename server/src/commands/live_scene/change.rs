//! What an operator's wish comes to: read, checked, and put together as the next session, on a thread of its own.

use std::path::Path;
use std::sync::Arc;

use taut_scene::{EditedKey, FinishedFile, Scene};

use super::load::{Loader, Next};
use super::recordings;
use super::running::Running;
use crate::commands::recording_size;
use crate::session::Session;
use crate::session::operator::SceneWish;
use crate::shared::failure::Failure;

/// Most changes that are named as not kept.
const MAX_NOT_KEPT: usize = 100;

/// A wish, and what it is made of.
pub(super) struct Wanted {
    pub(super) loader: Loader,
    pub(super) running: Arc<Running>,
    pub(super) wish: SceneWish,
}

/// What is to take the place of the scene that runs, and what it comes to, for people.
pub(super) type Change = (Next, String);

impl Wanted {
    /// Everything that can be wrong is found here; nothing is opened and nothing written. `None`: it runs so already, and the file is to have it.
    pub(super) fn make(self) -> Result<Option<Change>, Failure> {
        let made = match (self.wish.recording, &self.wish.scene) {
            (Some(on), _) => return self.recorded(on).map(Some),
            (None, Some(named)) => Some(self.another(named)?),
            (None, None) => self.same()?,
        };
        let Some((mut next, what)) = made else {
            return Ok(None);
        };
        if self.wish.keep {
            next.not_kept.clear();
        }
        Session::begin(&mut next.setup)?;
        Ok(Some((next, what)))
    }

    /// The scene that runs, recorded or not.
    fn recorded(&self, on: bool) -> Result<Change, Failure> {
        let running = &*self.running;
        if self.wish.scene.is_some() || !self.wish.edits.is_empty() || self.wish.keep {
            return Err(Failure::bad_input(
                "a recording is of the scene as it runs; change that first, or afterwards",
            ));
        }
        let (directory, what) = match (&running.recording, on, &running.recordings) {
            (Some(recording), true, _) => {
                return Err(Failure::BadInput(format!(
                    "the session is recorded to {} already",
                    recording.display()
                )));
            }
            (None, false, _) => return Err(Failure::bad_input("the session is not recorded")),
            (Some(recording), false, _) => (
                None,
                format!("the recording to {} ends", recording.display()),
            ),
            (None, true, None) => {
                return Err(Failure::bad_input("there is no folder for recordings"));
            }
            (None, true, Some(recordings)) => {
                let directory = recordings::place(recordings);
                (Some(directory), String::new())
            }
        };
        let loader = self.loader.recorded_to(directory.clone());
        let mut next = loader.change(running, running.scene.clone())?;
        next.goes_on = !on; // a recording begins at the scene's start
        Session::begin(&mut next.setup)?;
        let what = match directory {
            Some(directory) => {
                recordings::make(&directory)?; // last: what is refused leaves nothing behind
                recording_size::sentence(&directory)
            }
            None => what,
        };
        Ok((next, what))
    }

    /// The scene that runs, with some keys set; `None` as for [`Wanted::make`].
    fn same(&self) -> Result<Option<Change>, Failure> {
        let running = &*self.running;
        let (edited, keys) = running.scene.edited(&self.wish.edits)?;
        if edited.text() == running.scene.text() {
            if self.wish.keep && !running.not_kept.is_empty() {
                return Ok(None);
            }
            return Err(Failure::bad_input("the scene has all of that already"));
        }
        let mut next = self.loader.change(running, edited)?;
        next.goes_on = true;
        let named = tell(&keys, &mut next.not_kept);
        Ok(Some((next, named)))
    }

    /// Another scene, or this one as its file is, with some keys set.
    fn another(&self, named: &str) -> Result<Change, Failure> {
        let name = chosen(&self.running.scenes, named)?;
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

/// Which of the scenes that may be chosen is named: by its whole name, or by that of its file where one alone has it.
fn chosen<'s>(scenes: &'s [String], named: &str) -> Result<&'s str, Failure> {
    let all = scenes.iter().map(String::as_str);
    if let Some(scene) = all.clone().find(|scene| *scene == named) {
        return Ok(scene);
    }
    let is_it = |scene: &&str| Path::new(scene).file_name().is_some_and(|f| f == named);
    let found: Vec<&str> = all.filter(is_it).collect();
    match found[..] {
        [only] => Ok(only),
        [] => Err(Failure::BadInput(format!(
            "the scene \"{named}\" is none of those that may be chosen ({}); name it in [operator] scenes of the workbench file",
            scenes.join(", ")
        ))),
        _ => Err(Failure::BadInput(format!(
            "the scene \"{named}\" is the file's name of several that may be chosen; write one of {}",
            found.join(", ")
        ))),
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
            "{file} was changed since it was read; take that first: choose the scene anew, or wait where the server follows it (--follow-scene). What is not kept goes with that"
        ));
    }
    FinishedFile::replace(path, text).map_err(|error| {
        format!(
            "{file} cannot be written ({error}); it is as it was; check its folder's permissions"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_chosen_by_its_whole_name_before_a_name_of_a_file() {
        let names = [
            "lab/other.toml",
            "other.toml",
            "a/plate.toml",
            "b/plate.toml",
            "c/hole.toml",
        ];
        let scenes = names.map(str::to_owned);
        let asked = |named: &str| chosen(&scenes, named).map_err(|why| why.to_string());
        for name in names {
            assert_eq!(asked(name), Ok(name));
        }
        assert_eq!(asked("hole.toml"), Ok("c/hole.toml"));
        let several = asked("plate.toml").expect_err("two have it");
        assert!(several.contains("write one of a/plate.toml, b/plate.toml"));
        let none = asked("c").expect_err("a folder");
        assert!(none.contains("none of those"));
    }
}
