//! Loading a scene by file or by name.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use god_object::{
    HeightMap, HeightMapTexture, Mesh, Texture, TextureCoordinates, UvHeightMapTexture,
};
use taut_proto::Panorama;

use super::built::GOD_OBJECT_NAME;
use super::parse::{SceneSpec, parse};
use super::settings_tables::{CouplingSpec, LimitSpec, MethodSpec};
use super::shipped::{SHIPPED_SCENES, shipped_file, shipped_scene_text};
use super::spec::{
    BodySpec, HandPathSpec, HeightMapMapping, HeightMapSpec, ObstacleSpec, ScenerySpec, Shape, View,
};
use crate::document::{At, Document};
use crate::environment_file::read_environment;
use crate::files::{MAX_TOML_BYTES, data_dirs, read_text};
use crate::height_map_file::read_height_map;
use crate::mesh_file::{FileLook, RawMesh, read_part, read_texture_coordinates};
use crate::problem::{FileError, Problem};
use crate::trace::{DeviceTrace, looping_fault_of};

/// Where a scene's own files are looked for first.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Origin {
    /// Beside this file.
    Directory(PathBuf),
    /// Among the files that are shipped in the program.
    Shipped,
}

/// What a scene was read from: enough to read it again.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneSource {
    /// The text of the file.
    pub text: Arc<str>,
    /// Where its own files are; `None` for a scene that is shipped in the program.
    pub directory: Option<PathBuf>,
    /// What was set beside the text, in order.
    pub overrides: Vec<String>,
}

/// A scene that was read and checked; its meshes are not loaded yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    document: Document,
    origin: Origin,
    text: Arc<str>,
    overrides: Vec<String>,
    pub(super) spec: SceneSpec,
}

impl Scene {
    /// Reads a scene file.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        let text = read_text(path, MAX_TOML_BYTES)?;
        let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Self::parse(&path.display().to_string(), &text, &directory)
    }

    /// The bodies that are touched and have their form from mesh files: name, form, and where the scene says so.
    pub(crate) fn bodies_from_files(&self) -> impl Iterator<Item = (&str, &Shape, &At)> {
        let held = &self.spec.god_object;
        let obstacles = self.spec.obstacles.iter();
        std::iter::once((GOD_OBJECT_NAME, &held.shape, &held.shape_at))
            .chain(obstacles.map(|o| (o.name.as_str(), &o.shape, &o.shape_at)))
            .filter(|(_, shape, _)| shape.file().is_some())
    }

    /// One of [`SHIPPED_SCENES`] by its name, or else the file of this path.
    pub fn named_or_file(name_or_path: &str) -> Result<Self, FileError> {
        if let Some(text) = shipped_scene_text(name_or_path) {
            return Self::from_text(&format!("{name_or_path}.toml"), text, Origin::Shipped);
        }
        let path = Path::new(name_or_path);
        if !path.exists() && path.extension().is_none() {
            let names: Vec<&str> = SHIPPED_SCENES.iter().map(|scene| scene.name).collect();
            let text = format!(
                "is neither a file nor a shipped scene; write a path or one of {}",
                names.join(", ")
            );
            return Err(Problem::of_file(name_or_path, text).into());
        }
        Self::load(path)
    }

    /// Reads a scene from text; `file` is its name in messages, files are looked for in `directory`.
    pub fn parse(file: &str, text: &str, directory: &Path) -> Result<Self, FileError> {
        Self::from_text(file, text, Origin::Directory(directory.to_path_buf()))
    }

    /// Reads a scene again; `file` is its name in messages.
    pub fn from_source(file: &str, source: &SceneSource) -> Result<Self, FileError> {
        let origin = source
            .directory
            .clone()
            .map_or(Origin::Shipped, Origin::Directory);
        Self::from_text(file, &source.text, origin)?.with_overrides(&source.overrides)
    }

    fn from_text(file: &str, text: &str, origin: Origin) -> Result<Self, FileError> {
        let document = Document::parse(file, text)?;
        let spec = parse(&document)?;
        Ok(Self {
            document,
            origin,
            text: text.into(),
            overrides: Vec::new(),
            spec,
        })
    }

    /// What it was read from.
    pub fn source(&self) -> SceneSource {
        SceneSource {
            text: self.text.clone(),
            directory: match &self.origin {
                Origin::Directory(directory) => Some(directory.clone()),
                Origin::Shipped => None,
            },
            overrides: self.overrides.clone(),
        }
    }

    /// The same scene with one value changed, as by `--set coupling.k_s=1.0`. Lists are counted from 0:
    /// `obstacle.0.name="box"`.
    pub fn with_override(&self, assignment: &str) -> Result<Self, FileError> {
        self.with_overrides(&[assignment])
    }

    /// [`Scene::with_override`] for each, in order, checked once at the end: overrides that only fit together are fine.
    pub fn with_overrides<S: AsRef<str>>(&self, assignments: &[S]) -> Result<Self, FileError> {
        let mut document = self.document.clone();
        for assignment in assignments {
            document = document.with_override(assignment.as_ref())?;
        }
        let spec = parse(&document)?;
        let mut overrides = self.overrides.clone();
        overrides.extend(assignments.iter().map(|text| text.as_ref().to_owned()));
        Ok(Self {
            document,
            spec,
            overrides,
            origin: self.origin.clone(),
            text: self.text.clone(),
        })
    }

    /// The same scene with another text, under the same name and with the same overrides.
    pub(super) fn with_text(&self, text: &str) -> Result<Self, FileError> {
        let file = &self.document.root.at.file;
        Self::from_text(file, text, self.origin.clone())?.with_overrides(&self.overrides)
    }

    /// Its text as it stands now.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }

    /// The scene's name.
    pub fn name(&self) -> &str {
        &self.spec.name
    }

    /// The body in the user's hand.
    pub fn god_object(&self) -> &BodySpec {
        &self.spec.god_object
    }

    /// Everything else.
    pub fn obstacles(&self) -> &[ObstacleSpec] {
        &self.spec.obstacles
    }

    /// What is seen and never touched.
    pub fn scenery(&self) -> &[ScenerySpec] {
        &self.spec.scenery
    }

    /// `[coupling]`.
    pub fn coupling(&self) -> &CouplingSpec {
        &self.spec.coupling
    }

    /// `[limits]`.
    pub fn limits(&self) -> &LimitSpec {
        &self.spec.limits
    }

    /// `[method]`.
    pub fn method(&self) -> &MethodSpec {
        &self.spec.method
    }

    /// `[hand]`.
    pub fn hand(&self) -> Option<&HandPathSpec> {
        self.spec.hand.as_ref()
    }

    /// `[view]`.
    pub fn view(&self) -> View {
        self.spec.view
    }

    pub(super) fn document_start(&self) -> &At {
        &self.document.root.at
    }

    /// The via points of the hand, if the scene has any.
    pub fn hand_path(&self) -> Result<Option<DeviceTrace>, FileError> {
        let Some(hand) = &self.spec.hand else {
            return Ok(None);
        };
        self.trace(&hand.path, &hand.at).map(Some)
    }

    /// Why the simulated hand cannot follow its path; `None` where it can, or where the path cannot be read.
    pub fn hand_fault(&self) -> Option<Problem> {
        let hand = self.spec.hand.as_ref().filter(|hand| hand.repeat)?;
        let (file, text) = self.trace_text(&hand.path, &hand.at).ok()?;
        looping_fault_of(&file, &text)
    }

    /// The trace of this name, as written in the scene.
    pub(super) fn trace(&self, name: &str, at: &At) -> Result<DeviceTrace, FileError> {
        let (file, text) = self.trace_text(name, at)?;
        DeviceTrace::parse(&file, &text)
    }

    /// Name in messages and text of a trace.
    fn trace_text(&self, name: &str, at: &At) -> Result<(String, Cow<'static, str>), Problem> {
        if let (Origin::Shipped, Some(text)) = (&self.origin, shipped_file(name)) {
            return Ok((name.to_owned(), text.into()));
        }
        let path = self.locate(name, at)?;
        let text = read_text(&path, taut_recording::MAX_TRACE_BYTES)?;
        Ok((path.display().to_string(), text.into()))
    }

    /// The mesh file of this name, or some pieces of it, as written in the scene, and how it says that its body looks.
    pub(super) fn mesh_file(
        &self,
        name: &str,
        only: &[String],
        at: &At,
    ) -> Result<(RawMesh, FileLook), FileError> {
        let part = read_part(&self.locate(name, at)?, only)?;
        match only.iter().find(|piece| !part.pieces.has(piece)) {
            Some(piece) => Err(unusable(at, name, part.pieces.no_such(piece)).into()),
            None => Ok((part.mesh, part.look)),
        }
    }

    /// The picture of a height map.
    pub(super) fn height_map_file(&self, spec: &HeightMapSpec) -> Result<HeightMap, Problem> {
        read_height_map(&self.locate(&spec.path, &spec.at)?)
    }

    /// The texture of a height map, its picture read and laid on this shape with this mesh.
    pub(super) fn height_map(
        &self,
        spec: &HeightMapSpec,
        shape: &Shape,
        mesh: &Mesh,
    ) -> Result<Texture, FileError> {
        let map = Arc::new(self.height_map_file(spec)?);
        let amplitude = spec.amplitude;
        let tile = match spec.mapping {
            HeightMapMapping::Triplanar { tile } => tile,
            HeightMapMapping::Uv => {
                return Ok(Texture::UvHeightMap(UvHeightMapTexture {
                    map,
                    coordinates: Arc::new(self.texture_coordinates(spec, shape, mesh)?),
                    amplitude,
                }));
            }
        };
        Ok(Texture::HeightMap(HeightMapTexture {
            map,
            tile,
            amplitude,
        }))
    }

    /// Of the mesh file that the shape names.
    fn texture_coordinates(
        &self,
        spec: &HeightMapSpec,
        shape: &Shape,
        mesh: &Mesh,
    ) -> Result<TextureCoordinates, FileError> {
        let whole = match shape {
            Shape::Mesh {
                path,
                simplify: None,
                only,
                ..
            } if only.is_empty() => Some(path),
            _ => None,
        };
        let Some(path) = whole else {
            let text = "mapping = \"uv\" needs the texture coordinates of a mesh file, as it is; name one without `simplify` and `only`, or use mapping = \"triplanar\"";
            return Err(spec.at.problem(text).into());
        };
        let coordinates = read_texture_coordinates(&self.locate(path, &spec.at)?)?;
        TextureCoordinates::new(mesh, &coordinates).map_err(|error| {
            let text = format!("the mesh \"{path}\" has no use for its texture coordinates: {error}; export it again");
            spec.at.problem(text).into()
        })
    }

    pub(crate) fn locate(&self, name: &str, at: &At) -> Result<PathBuf, Problem> {
        self.origin.locate(name, at)
    }

    /// Whether a file that the scene names is part of the program.
    pub(crate) fn is_in_program(&self, name: &str) -> bool {
        self.origin == Origin::Shipped && shipped_file(name).is_some()
    }

    /// The light around the scene, if it names any.
    pub(super) fn environment(&self) -> Result<Option<Panorama>, Problem> {
        let Some(spec) = &self.spec.environment else {
            return Ok(None);
        };
        read_environment(&self.locate(&spec.path, &spec.at)?).map(Some)
    }

    /// Meshes, height maps, traces and light, as written and where; some may be named twice.
    pub(crate) fn file_names(&self) -> Vec<(&str, &At)> {
        let held = &self.spec.god_object;
        let mut names: Vec<(&str, &At)> = Vec::new();
        names.extend(held.shape.file().map(|name| (name, &held.shape_at)));
        let obstacles = self.spec.obstacles.iter().map(|o| &o.visual);
        let visuals = std::iter::once(&held.visual).chain(obstacles).flatten();
        names.extend(visuals.filter_map(|seen| Some((seen.shape.file()?, &seen.at))));
        for obstacle in &self.spec.obstacles {
            let (map, motion) = (&obstacle.height_map, &obstacle.motion);
            names.extend(obstacle.shape.file().map(|name| (name, &obstacle.shape_at)));
            names.extend(map.as_ref().map(|map| (map.path.as_str(), &map.at)));
            names.extend(
                motion
                    .as_ref()
                    .map(|motion| (motion.trace.as_str(), &motion.at)),
            );
        }
        for seen in &self.spec.scenery {
            names.extend(seen.shape.file().map(|name| (name, &seen.shape_at)));
        }
        let light = self.spec.environment.as_ref();
        names.extend(light.map(|light| (light.path.as_str(), &light.at)));
        names.extend(
            self.spec
                .hand
                .as_ref()
                .map(|hand| (hand.path.as_str(), &hand.at)),
        );
        names
    }
}

/// A complaint about a mesh that a scene names.
pub(crate) fn unusable(at: &At, mesh: &str, why: impl std::fmt::Display) -> Problem {
    at.problem(format!("the mesh \"{mesh}\" cannot be used: {why}"))
}

impl Origin {
    /// Beside the scene, else in a data directory.
    pub(super) fn locate(&self, name: &str, at: &At) -> Result<PathBuf, Problem> {
        let mut places = Vec::new();
        if let Self::Directory(directory) = self {
            places.push(directory.join(name));
        }
        places.extend(
            data_dirs()
                .into_iter()
                .map(|directory| directory.join(name)),
        );
        if let Some(found) = places.iter().find(|place| place.is_file()) {
            return Ok(found.clone());
        }
        let looked: Vec<String> = places
            .iter()
            .map(|place| place.display().to_string())
            .collect();
        let looked = if looked.is_empty() {
            "there is no data directory".into()
        } else {
            format!("looked for {}", looked.join(" and "))
        };
        let help = if name.starts_with("bunny") {
            "run scripts/get-bunny, or name the directory that holds it in TAUT_DATA"
        } else {
            "check the path, or name the directory that holds it in TAUT_DATA"
        };
        Err(at.problem(format!(
            "the file \"{name}\" does not exist ({looked}); {help}"
        )))
    }
}
