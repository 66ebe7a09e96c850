//! What can go wrong on a render node.

use std::path::PathBuf;

use taut_link::LinkError;
use thiserror::Error;

use crate::view::ScreenError;

/// Why a render node ended other than by being told to.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// No adapter: the caller may go on without drawing.
    #[error(
        "no graphics adapter was found on this machine; install the packages mesa-vulkan-drivers and libvulkan1 to draw in software"
    )]
    NoGpu,
    /// There is an adapter, and it does not work.
    #[error(
        "the graphics adapter {adapter} cannot be used: {reason}; update its driver, or take another with --gpu"
    )]
    Gpu {
        /// Name of the adapter.
        adapter: String,
        /// What it said.
        reason: String,
    },
    /// No adapter is the one asked for.
    #[error(
        "there is no graphics adapter \"{wanted}\"; this machine has {known}: give a number or a part of a name with --gpu"
    )]
    UnknownGpu {
        /// What was asked for.
        wanted: String,
        /// What there is.
        known: String,
    },
    /// No monitor is the one asked for.
    #[error(
        "there is no monitor \"{wanted}\"; this machine has {known}: correct `monitor` in the workbench file or --monitor"
    )]
    UnknownMonitor {
        /// What was asked for.
        wanted: String,
        /// What there is.
        known: String,
    },
    /// Windows were asked for where there is no display.
    #[error(
        "no display can be opened ({reason}); set DISPLAY or WAYLAND_DISPLAY, or draw off-screen with --headless"
    )]
    NoDisplay {
        /// What the window system said.
        reason: String,
    },
    /// A picture could not be written.
    #[error("cannot write the picture {}: {reason}; name a folder that can be written with --out", path.display())]
    Picture {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        reason: String,
    },
    /// The folder for meshes cannot be used.
    #[error("meshes cannot be kept in {}: {reason}; name a folder that can be written with --mesh-cache, or use --no-mesh-cache", path.display())]
    MeshCache {
        /// The folder.
        path: PathBuf,
        /// What the operating system said.
        reason: String,
    },
    /// The server cannot be reached, or refuses this node.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The server was there and is not any more, for longer than the node was to wait.
    #[error(
        "the server {server} was lost: {reason}; see whether it still runs, then start this node again (or let it wait longer: --give-up)"
    )]
    ServerLost {
        /// Its address.
        server: String,
        /// What the link said.
        reason: String,
    },
    /// The workbench file has no such node.
    #[error(
        "the workbench has no render node named \"{node}\"; it has {known}: give one of them with --node"
    )]
    UnknownNode {
        /// The name given.
        node: String,
        /// The names there are.
        known: String,
    },
    /// A node names a screen that the workbench has not.
    #[error(
        "render node {node} is to draw the screen \"{screen}\", which the workbench has not; correct the workbench file on the server"
    )]
    UnknownScreen {
        /// The node.
        node: String,
        /// The screen's name.
        screen: String,
    },
    /// A screen cannot be drawn on.
    #[error(
        "the screen \"{screen}\" cannot be drawn on: {source}; correct the workbench file on the server"
    )]
    BadScreen {
        /// Its name.
        screen: String,
        /// Why not.
        source: ScreenError,
    },
    /// A file that corrects the picture of a screen cannot be used.
    #[error(
        "{what} (files of screens are read on the node that draws them, in the folder of --screens)"
    )]
    ScreenFile {
        /// What is wrong, with the file's name and what to do.
        what: String,
    },
    /// The graphics adapter does not hold it.
    #[error(
        "{what} has {width}x{height} pixels, but the graphics adapter holds {most} each way at most; {remedy}"
    )]
    TooLarge {
        /// What it is, with its name.
        what: String,
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// Longest side that the adapter holds, pixels.
        most: u32,
        /// What to do.
        remedy: &'static str,
    },
    /// The scene's description has a value that cannot be drawn.
    #[error(
        "the server's scene cannot be drawn: {what}; correct the scene or workbench file on the server"
    )]
    BadScene {
        /// What is wrong.
        what: String,
    },
    /// A film cannot be made of its pictures.
    #[error("the film cannot be written: {0}; ask for fewer or smaller pictures")]
    Film(#[from] png::EncodingError),
    /// The operating system refuses a thread, a runtime or a signal handler.
    #[error("the operating system gave no {what}: {reason}; close other programs and try again")]
    System {
        /// What was asked for.
        what: &'static str,
        /// What it said.
        reason: String,
    },
    /// An option has a value that makes no sense.
    #[error("{option} must be {rule}, not {value}")]
    Option {
        /// The option's name.
        option: &'static str,
        /// What it must be.
        rule: String,
        /// What it was.
        value: String,
    },
}

impl RenderError {
    /// The exit code of a program that ends with this error: 2 for bad input, 1 for the rest.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Option { .. } | Self::UnknownNode { .. } | Self::UnknownScreen { .. } => 2,
            Self::BadScreen { .. } | Self::BadScene { .. } | Self::MeshCache { .. } => 2,
            Self::ScreenFile { .. } | Self::TooLarge { .. } => 2,
            Self::UnknownGpu { .. } | Self::UnknownMonitor { .. } => 2,
            // A wrong key, a name that does not resolve, a server that does not answer.
            Self::Link(error) => match error {
                LinkError::Closed { .. } | LinkError::System { .. } => 1,
                _ => 2,
            },
            Self::NoGpu | Self::Gpu { .. } | Self::NoDisplay { .. } => 1,
            Self::Film(_)
            | Self::Picture { .. }
            | Self::ServerLost { .. }
            | Self::System { .. } => 1,
        }
    }
}
