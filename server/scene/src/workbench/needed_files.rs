//! The files that a server reads beside its workbench file: what must be copied with it.

use std::path::PathBuf;

use super::load::Workbench;
use super::spec::Device;
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
        /// Relative to the scene file, else to a data directory.
        name: String,
        /// The file.
        found: PathBuf,
    },
}

impl Workbench {
    /// Every file that `taut serve` reads beside the workbench file and the cluster key.
    pub fn needed_files(&self) -> Result<Vec<NeededFile>, FileError> {
        let mut files = Vec::new();
        if shipped_scene_text(&self.scene).is_none() {
            files.push(NeededFile::Named(PathBuf::from(&self.scene)));
        }
        for (name, found) in self.load_scene()?.files()? {
            files.push(NeededFile::OfScene { name, found });
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
    /// The files that the scene names and that are not part of the program: each name once, and where it is.
    pub fn files(&self) -> Result<Vec<(String, PathBuf)>, FileError> {
        let mut files: Vec<(String, PathBuf)> = Vec::new();
        for (name, at) in self.file_names() {
            if self.is_in_program(name) || files.iter().any(|(known, _)| known == name) {
                continue;
            }
            files.push((name.to_owned(), self.locate(name, at)?));
        }
        Ok(files)
    }
}
