//! The monitor: samples of the shared data to rerun, 50 times a second, on a thread of its own.
//!
//! The one place that knows whether this build has a monitor (feature `monitor`).

#[cfg(not(feature = "monitor"))]
mod absent;
// Needs nothing of the monitor, so its tests run in every build.
#[cfg(any(test, feature = "monitor"))]
mod events;
#[cfg(feature = "monitor")]
mod streaming;

#[cfg(not(feature = "monitor"))]
pub(crate) use absent::MonitorFeed;
#[cfg(feature = "monitor")]
pub(crate) use streaming::MonitorFeed;

use std::fs;
use std::io::ErrorKind;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use god_object::World;
use god_object::spatial::Pose;
use taut_proto::scene::ScreenDescription;
use taut_recording::{Recorder, Taps};

use crate::loops::statistics::Statistics;
use crate::loops::wiring::SharedView;
use crate::session::head::Head;
use crate::session::setup::RecordingSettings;
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;
use crate::shared::felt_ticks::FeltReader;

/// Where the monitor is served and recorded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MonitorSettings {
    /// Address to listen on.
    pub bind: IpAddr,
    /// TCP port of the stream; 0 takes a free one.
    pub grpc_port: u16,
    /// TCP port of the web page; 0 takes a free one.
    pub web_port: u16,
    /// Also write everything to this new `.rrd` file.
    pub record: Option<PathBuf>,
    /// Most bytes of history kept for late observers.
    pub memory_limit_bytes: u64,
    /// Serve the stream and the page; otherwise it is only recorded.
    pub serve: bool,
}

/// The recordings of a session that has not begun: dropped as such, they are removed, and the next start finds their names free.
#[derive(Debug, Default)]
pub(crate) struct FreshRecording(Vec<PathBuf>);

impl FreshRecording {
    /// The file was made just now. What is none, such as a pipe, is left alone.
    pub(crate) fn made(&mut self, path: Option<&Path>) {
        let file = path.filter(|path| path.is_file());
        self.0.extend(file.map(Path::to_path_buf));
    }

    /// Begins a recording that can be computed again. One that cannot be begun may have left files as well, as on a full disk; a directory that had
    /// something in it, or that could not be looked into, is left alone.
    pub(crate) fn begin(
        &mut self,
        wanted: &RecordingSettings,
    ) -> Result<(Taps, Recorder), Failure> {
        let directory = &wanted.directory;
        let is_new = matches!(fs::symlink_metadata(directory), Err(error) if error.kind() == ErrorKind::NotFound);
        let was_empty = fs::read_dir(directory).is_ok_and(|mut files| files.next().is_none());
        let begun = Recorder::start(directory, wanted.manifest.clone(), &wanted.scene);
        if is_new || was_empty {
            let files = fs::read_dir(directory).into_iter().flatten().flatten();
            self.0.extend(files.map(|file| file.path()));
            self.0.extend(is_new.then(|| directory.clone()));
        }
        begun.map_err(Failure::bad_input)
    }

    /// The session has begun: what it records stays.
    pub(crate) fn keep(&mut self) {
        self.0.clear();
    }
}

impl Drop for FreshRecording {
    fn drop(&mut self) {
        for path in &self.0 {
            // Nobody is left to be told. A directory goes only when it is empty.
            let _ = fs::remove_file(path).or_else(|_| fs::remove_dir(path));
        }
    }
}

/// What the monitor draws once.
#[derive(Clone, Debug)]
pub struct MonitorPicture {
    /// The scene's name.
    pub name: String,
    /// Bodies and their meshes.
    pub world: Arc<World>,
    /// Indices of the obstacles that move.
    pub moving: Vec<usize>,
    /// Where the god-object starts.
    pub start: Pose,
    /// The screens, workbench frame.
    pub screens: Vec<ScreenDescription>,
    /// Workbench from scene, without the magnification.
    pub workbench_from_scene: Pose,
    /// Size of the scene on the workbench over its size in the simulation.
    pub display_scale: f64,
    /// The viewer's head at rest, workbench frame.
    pub head: Pose,
    /// Gap at which bodies touch, m.
    pub rest_distance: f64,
    /// Own colours of the god-object, then of the obstacles, sRGB; `None`: the role's.
    pub colours: Vec<Option<[u8; 3]>>,
}

/// The shared data that the monitor reads.
#[derive(Debug)]
pub struct MonitorSources {
    /// Where the viewer's head is.
    pub head: Head,
    /// What the loops publish.
    pub shared: SharedView,
    /// What the hand feels, tick by tick.
    pub felt: FeltReader,
    /// All counters.
    pub statistics: Statistics,
    /// Session time.
    pub clock: SessionClock,
}

/// The network's counts, which the main thread tells the monitor.
#[derive(Debug, Default)]
pub struct NetworkCounts {
    /// Datagrams sent.
    pub packets_sent: std::sync::atomic::AtomicU64,
    /// Datagrams received and accepted.
    pub packets_received: std::sync::atomic::AtomicU64,
    /// Connected clients.
    pub clients: std::sync::atomic::AtomicU32,
}

/// How serious a line for the log is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// Something happened.
    Info,
    /// Something that should not happen often.
    Warning,
    /// Something is broken.
    Error,
}
