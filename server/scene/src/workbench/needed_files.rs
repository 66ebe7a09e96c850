//! The files that a server reads beside its workbench file: what must be copied with it.

use std::path::{Path, PathBuf};

use super::load::Workbench;
use super::spec::Device;
use crate::mesh_file::files_beside;
use crate::problem::FileError;
use crate::scene::{Scene, shipped_scene_text};

/// A file that a workbench names, itself or by its scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NeededFile {
    /// Where the workbench file says.
    Named(PathBuf),
    /// The same, and what is in it is a secret.
    Secret(PathBuf),
    /// Of a scene: its name as the scene has it, and where it was found.
    OfScene {
        /// The scene, as [`Workbench::scene`].
        scene: String,
        /// Relative to the scene file, else to a data directory.
        name: String,
        /// The file.
        found: PathBuf,
        /// A mesh of the scene names it, and not the scene: a buffer, or a library of materials, which may be missing: the mesh is read all the same.
        by_mesh: bool,
    },
}

impl Workbench {
    /// The scene, and those that may be chosen from the operator's page; each once.
    pub fn scenes(&self) -> Vec<&str> {
        let mut scenes = vec![self.scene.as_str()];
        for scene in self
            .operator
            .scenes
            .iter()
            .filter(|_| self.operator.enabled)
        {
            if !scenes.contains(&scene.as_str()) {
                scenes.push(scene);
            }
        }
        scenes
    }

    /// Every file that `taut serve` reads beside the workbench file and the cluster key, and what its nodes read of screens.
    pub fn needed_files(&self) -> Result<Vec<NeededFile>, FileError> {
        let mut files = Vec::new();
        self.load_scene()?;
        for scene in self.scenes() {
            if shipped_scene_text(scene).is_none() {
                files.push(NeededFile::Named(PathBuf::from(scene)));
            }
            let read = Scene::named_or_file(scene)?;
            let by_scene = read.file_names();
            for (name, found) in read.files_or_missing()? {
                files.push(NeededFile::OfScene {
                    by_mesh: by_scene.iter().all(|(named, _)| *named != name),
                    scene: scene.to_owned(),
                    name,
                    found,
                });
            }
        }
        match &self.device {
            Device::Simulated { path, strings, .. } => {
                files.extend(path.clone().map(NeededFile::Named));
                // A shipped geometry has a name; a file has an ending or a folder.
                let geometry = strings
                    .as_deref()
                    .filter(|named| named.contains(['.', '/', '\\']));
                files.extend(geometry.map(|named| NeededFile::Named(named.into())));
            }
            Device::Trace { path, .. } => files.push(NeededFile::Named(path.clone())),
            Device::Driver(chosen) => {
                files.extend(chosen.files().map(NeededFile::Named));
            }
            Device::Remote => {}
        }
        // The nodes read them; here `taut check` does.
        for name in self.screens.iter().flat_map(|screen| screen.output.files()) {
            files.push(NeededFile::Named(self.screen_file(name)));
        }
        if self.zenoh.enabled {
            files.extend(self.zenoh.config.clone().map(NeededFile::Named));
        }
        if self.observers.enabled {
            files.extend(self.observers.token_file.clone().map(NeededFile::Secret));
        }
        if self.operator.enabled {
            files.extend(self.operator.token_file.clone().map(NeededFile::Secret));
        }
        let also = self.network.also_key.as_ref();
        files.extend(also.map(|key| NeededFile::Secret(key.file.clone())));
        Ok(files)
    }
}

impl Scene {
    /// The files that the scene names and that are not part of the program, and those that its meshes are read with: each name once, and where it is.
    pub fn files(&self) -> Result<Vec<(String, PathBuf)>, FileError> {
        let mut files = self.files_or_missing()?;
        files.retain(|(_, found)| found.is_file());
        Ok(files)
    }

    /// The same with what a mesh names and is not there, where it would be.
    fn files_or_missing(&self) -> Result<Vec<(String, PathBuf)>, FileError> {
        let mut files: Vec<(String, PathBuf)> = Vec::new();
        for (name, at) in self.file_names() {
            if self.is_in_program(name) || files.iter().any(|(known, _)| known == name) {
                continue;
            }
            let found = self.locate(name, at)?;
            files.push((name.to_owned(), found.clone()));
            for beside in files_beside(&found) {
                let name = Path::new(name).with_file_name(&beside);
                let name = name.to_string_lossy().into_owned();
                if files.iter().all(|(known, _)| *known != name) {
                    files.push((name, found.with_file_name(&beside)));
                }
            }
        }
        Ok(files)
    }
}
