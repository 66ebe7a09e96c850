//! Loading a workbench file.

use std::path::{Path, PathBuf};

use god_object::Pose;

use super::dynamics::DeviceDynamics;
use super::frames::Frames;
use super::log::Log;
use super::looking_on::{ObserverStream, Vrpn, Zenoh};
use super::operator::Operator;
use super::parse::parse;
use super::spec::{
    Device, Machine, Monitoring, Network, Node, RealTime, Safety, Screen, Show, Viewer,
};
use super::wrench_in::WrenchIn;
use crate::document::{At, Document};
use crate::files::{MAX_TOML_BYTES, read_text};
use crate::problem::FileError;
use crate::scene::{Scene, shipped_scene_text};

/// The example that is part of the program: the L-shaped workbench, every key with its unit.
pub const SHIPPED_WORKBENCH: &str = include_str!("../../../workbench.toml");

/// A workbench that was read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Workbench {
    /// Its name.
    pub name: String,
    /// The scene: a shipped one's name, or a path.
    pub scene: String,
    /// Workbench from scene, unless the scene's `[view]` says otherwise.
    pub scene_origin: Pose,
    /// At least one.
    pub screens: Vec<Screen>,
    /// At least one.
    pub nodes: Vec<Node>,
    /// The machines; none where the file does not say.
    pub machines: Vec<Machine>,
    /// The viewer.
    pub viewer: Viewer,
    /// The device.
    pub device: Device,
    /// What a real device is, where it is declared.
    pub dynamics: Option<DeviceDynamics>,
    /// The network.
    pub network: Network,
    /// Frames of the render nodes.
    pub frames: Frames,
    /// The rerun stream.
    pub monitoring: Monitoring,
    /// Scheduling.
    pub realtime: RealTime,
    /// What no force may pass.
    pub safety: Safety,
    /// What is logged.
    pub log: Log,
    /// What is drawn beside the bodies.
    pub show: Show,
    /// The VRPN server.
    pub vrpn: Vrpn,
    /// JSON lines for browsers and scripts.
    pub observers: ObserverStream,
    /// The operator's page.
    pub operator: Operator,
    /// Publication through Zenoh routers.
    pub zenoh: Zenoh,
    /// A force from outside.
    pub wrench_in: WrenchIn,
    pub(super) scene_at: At,
    /// Of the file: what it names is relative to it.
    pub(super) directory: PathBuf,
}

impl Workbench {
    /// Reads a file. Paths in it are relative to it.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Self::parse(
            &path.display().to_string(),
            &read_text(path, MAX_TOML_BYTES)?,
            &directory,
        )
    }

    /// Reads text; `file` is its name in messages, paths are relative to `directory`.
    pub fn parse(file: &str, text: &str, directory: &Path) -> Result<Self, FileError> {
        parse(&Document::parse(file, text)?, directory)
    }

    /// The shipped L-shaped workbench.
    pub fn shipped() -> Result<Self, FileError> {
        Self::parse("workbench.toml", SHIPPED_WORKBENCH, &PathBuf::new())
    }

    /// The same with some values changed, as by `--set network.quic_port=0`; for [`Workbench::load`]'s file or text.
    pub fn parse_with_overrides<S: AsRef<str>>(
        file: &str,
        text: &str,
        directory: &Path,
        assignments: &[S],
    ) -> Result<Self, FileError> {
        let mut document = Document::parse(file, text)?;
        for assignment in assignments {
            document = document.with_override(assignment.as_ref())?;
        }
        parse(&document, directory)
    }

    /// Reads the scene that the workbench names.
    pub fn load_scene(&self) -> Result<Scene, FileError> {
        if shipped_scene_text(&self.scene).is_none() && !Path::new(&self.scene).is_file() {
            let text = format!(
                "the scene \"{}\" is neither shipped nor a file; write a shipped name or a path",
                self.scene
            );
            return Err(self.scene_at.problem(text).into());
        }
        Scene::named_or_file(&self.scene)
    }

    /// Where the scene stands, workbench from scene: this file's `scene_origin`, as far as the scene's own `[view]` does
    /// not say otherwise. Positions of the scene are multiplied by `display_scale` first.
    pub fn workbench_from_scene(&self, scene: &Scene) -> Pose {
        let (view, mut pose) = (scene.view(), self.scene_origin);
        if let Some(origin) = view.origin {
            pose.translation.vector = origin.coords;
        }
        if let Some(rotation) = view.rotation {
            pose.rotation = rotation;
        }
        pose
    }
}
