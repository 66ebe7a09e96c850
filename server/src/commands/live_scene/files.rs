//! The files of a scene that is served (`taut serve --follow-scene`): edited, they begin another session.

use std::path::{Path, PathBuf};

use taut_scene::{NeededFile, Workbench};

use super::load::Next;
use crate::session::file_watch::FileWatch;
use crate::shared::failure::Failure;

/// Watches the workbench file and the files of its scene.
pub(super) struct SceneWatch {
    files: FileWatch,
    /// Text that says what the scene is made of, as far as it is in one: its own, and that of what it names; and what is shown beside it.
    contents: Vec<Vec<u8>>,
    paths: Vec<PathBuf>,
}

impl SceneWatch {
    /// Watches what was read just now.
    pub(super) fn new(config: &Path, workbench: &Workbench) -> Result<Self, Failure> {
        let mut paths = Vec::new();
        let mut of_meshes = Vec::new();
        for file in workbench.needed_files()? {
            match file {
                NeededFile::OfScene {
                    scene,
                    found,
                    by_mesh,
                    ..
                } if scene == workbench.scene => {
                    of_meshes.extend(by_mesh.then(|| found.clone()));
                    paths.push(found);
                }
                NeededFile::Named(path) if path == Path::new(&workbench.scene) => paths.push(path),
                NeededFile::OfScene { .. } | NeededFile::Named(_) | NeededFile::Secret(_) => {}
            }
        }
        let mut watched = vec![config.to_path_buf()];
        let named = paths.iter().filter(|path| !of_meshes.contains(path));
        watched.extend(named.cloned());
        Ok(Self {
            files: FileWatch::new(watched).and_while_there(of_meshes),
            contents: contents(workbench, &paths),
            paths,
        })
    }

    /// A file that is watched was written here: what it holds now is no change.
    pub(super) fn wrote(&mut self, file: &str) {
        let place = self.paths.iter().position(|path| path == Path::new(file));
        // The name of the scene is the first of the contents.
        if let Some(known) = place.and_then(|place| self.contents.get_mut(place + 1)) {
            *known = std::fs::read(file).unwrap_or_default();
        }
    }

    /// Whether it is time for a look, and the look shows other files than those that were read.
    pub(super) fn is_due(&mut self) -> bool {
        self.files.is_due()
    }

    /// The session that is to take the place of this one, if what was read is another scene and can be served; says what became of a change.
    pub(super) fn take(&self, read: Result<Next, Failure>) -> Option<Next> {
        match read {
            // The workbench file may have changed in what is followed without a new session, or needs a restart. What was read counts: what was written
            // since then is due by itself.
            Ok(next)
                if next.files.as_ref().map(|files| &files.contents) == Some(&self.contents) =>
            {
                None
            }
            Ok(next) => {
                taut_log::say(&format!(
                    "the scene {} is taken: the force fades, and another session begins",
                    next.workbench.scene
                ));
                Some(next)
            }
            Err(error) => {
                taut_log::say(&format!(
                    "the changed scene is not taken, and the one before goes on: {error}"
                ));
                None
            }
        }
    }
}

/// Name of the scene, the bytes of its files, and what is shown beside it.
fn contents(workbench: &Workbench, paths: &[PathBuf]) -> Vec<Vec<u8>> {
    let files = paths
        .iter()
        .map(|path| std::fs::read(path).unwrap_or_default());
    let shown = format!("{:?}", workbench.show).into_bytes();
    std::iter::once(workbench.scene.as_bytes().to_vec())
        .chain(files)
        .chain([shown])
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;
    use std::time::Duration;

    use clap::Parser;
    use taut_scene::{SHIPPED_WORKBENCH, Scene};
    use taut_test_kit::BALL_ON_FLOOR;

    use super::super::LiveScene;
    use super::super::load::Loader;
    use super::*;
    use crate::cli::ServeArgs;
    use crate::session::setup::workbench::Overrides;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: ServeArgs,
    }

    /// Asks until the files are read, `then` does what it does, and the answer is there.
    fn followed(watch: &mut SceneWatch, loader: &Loader, then: impl Fn()) -> Option<Next> {
        while !watch.is_due() {
            thread::sleep(Duration::from_millis(10));
        }
        let next = loader.load();
        then();
        watch.take(next)
    }

    /// `taut serve --follow-scene` of a workbench file in `place`, and of this scene there.
    fn followed_scene(place: &Path, text: &str) -> (ServeArgs, PathBuf) {
        let [config, key, scene] =
            ["workbench.toml", "key", "scene.toml"].map(|name| place.join(name));
        let scene_name = scene.to_str().expect("a plain path");
        let workbench = SHIPPED_WORKBENCH.replace(
            "scene = \"peg-in-a-hole\"",
            &format!("scene = \"{scene_name}\""),
        );
        std::fs::write(&config, workbench).expect("written");
        std::fs::write(&scene, text).expect("written");
        taut_link::create_key_file(&key).expect("a key");
        let words = ["serve".as_ref(), "--config".as_ref(), config.as_os_str()];
        let more = ["--key".as_ref(), key.as_os_str(), "--follow-scene".as_ref()];
        let args = Cli::try_parse_from([words, more].concat())
            .expect("valid")
            .args;
        (args, scene)
    }

    fn following(args: ServeArgs) -> (Loader, SceneWatch) {
        let loader = Loader::new(args, Overrides::default());
        let mut first = loader.load().unwrap_or_else(|error| panic!("{error}"));
        let watch = first.files.take().expect("it follows");
        (loader, watch)
    }

    #[test]
    fn a_scene_that_is_written_while_it_is_read_makes_one_session_and_that_of_the_new_text() {
        let place = tempfile::tempdir().expect("a directory");
        let (args, scene) = followed_scene(place.path(), BALL_ON_FLOOR);
        let write = |k_h: &str| {
            let text = BALL_ON_FLOOR.replace("2000.0", k_h);
            std::fs::write(&scene, text).expect("written");
        };
        let (loader, mut watch) = following(args);

        write("2000.0"); // the same text, at a later time
        let none = followed(&mut watch, &loader, || write("1500.0"));
        assert!(none.is_none(), "a session of the old text");
        let next = followed(&mut watch, &loader, || ()).expect("the new one");
        assert!(next.in_file.contains("1500.0"), "{}", next.in_file);
    }

    #[test]
    fn what_is_shown_beside_the_scene_is_followed_as_the_scene_is() {
        let place = tempfile::tempdir().expect("a directory");
        let (args, _) = followed_scene(place.path(), BALL_ON_FLOOR);
        let config = args.config.clone();
        let (loader, mut watch) = following(args);
        let text = std::fs::read_to_string(&config).expect("a file");
        let shown = text.replacen("contacts = false", "contacts = true", 1);
        assert_ne!(shown, text);
        std::fs::write(&config, shown).expect("written");
        let next = followed(&mut watch, &loader, || ()).expect("another look");
        assert!(next.setup.content.description.show.contacts);
    }

    #[test]
    fn files_are_read_beside_the_session_and_not_by_who_looks_after_it() {
        let place = tempfile::tempdir().expect("a directory");
        let (args, scene) = followed_scene(place.path(), BALL_ON_FLOOR);
        let mut live = LiveScene::new(&args, Overrides::default(), Arc::default());
        let mut first = live.first().unwrap_or_else(|error| panic!("{error}"));
        live.begin(&mut first);
        let edited = BALL_ON_FLOOR.replace("2000.0", "1500.00");
        std::fs::write(&scene, edited).expect("written");
        let next = loop {
            let is_read_already = live.pending.is_some();
            let next = live.follow(Duration::ZERO);
            if let Some(next) = next {
                assert!(is_read_already, "it was read while the session waited");
                break next;
            }
            thread::sleep(Duration::from_millis(10));
        };
        assert!(next.in_file.contains("1500.0"), "{}", next.in_file);
    }

    #[test]
    fn what_is_kept_of_a_chosen_scene_is_no_change_of_its_file() {
        let place = tempfile::tempdir().expect("a directory");
        let (args, _) = followed_scene(place.path(), BALL_ON_FLOOR);
        let other = place.path().join("other.toml");
        std::fs::write(&other, BALL_ON_FLOOR).expect("written");
        let name = other.to_str().expect("a plain path");
        let read = Scene::named_or_file(name).expect("a scene");
        let (edited, _) = read
            .edited(&["coupling.k_h=1500.0"])
            .expect("it can be set");

        let mut live = LiveScene::new(&args, Overrides::default(), Arc::default());
        let chosen = live.loader.choose(name, Some(edited));
        let mut next = chosen.unwrap_or_else(|error| panic!("{error}"));
        next.in_file = read.text().clone();
        let written = live.write(&mut next);
        written.unwrap_or_else(|error| panic!("{error}"));
        let kept = std::fs::read_to_string(&other).expect("a file");
        assert!(kept.contains("1500.0"), "{kept}");

        live.loader.keep(next.chosen.take(), &next.setup);
        let again = live.loader.load();
        let again = again.unwrap_or_else(|error| panic!("{error}"));
        let [known, found] = [next.files, again.files].map(|files| files.expect("it follows"));
        assert!(
            known.contents == found.contents,
            "a session of its own writing"
        );
    }

    #[test]
    fn a_library_of_materials_that_goes_or_comes_is_a_change_as_any() {
        let place = tempfile::tempdir().expect("a directory");
        let write = |name: &str, text: &str| {
            std::fs::write(place.path().join(name), text).expect("written");
        };
        let seen = "[[scenery]]\nname = \"seen\"\nshape = { mesh = \"a.obj\" }\n";
        write(
            "a.obj",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 0.03 0 0\nv 0 0.03 0\nv 0 0 0.03\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
        );
        write("a.mtl", "newmtl m\nKd 1 0 0\n");
        let (args, _) = followed_scene(place.path(), &format!("{BALL_ON_FLOOR}{seen}"));
        let (loader, mut watch) = following(args);
        let library = place.path().join("a.mtl");
        std::fs::remove_file(&library).expect("removed");
        let without = followed(&mut watch, &loader, || ()).expect("another look");
        let watch = without.files.expect("it follows");
        assert!(watch.paths.contains(&library), "it may come back");
    }
}
