//! A build without the monitor: it says so when it is asked for one.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

use super::{MonitorPicture, MonitorSettings, MonitorSources, NetworkCounts, Severity};
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;

/// There is never one.
#[derive(Debug)]
pub struct MonitorFeed(Infallible);

impl MonitorFeed {
    /// Whether this build has a monitor.
    pub const BUILT_IN: bool = false;

    /// Always refused.
    pub fn start(
        _settings: &MonitorSettings,
        _picture: &MonitorPicture,
        _sources: MonitorSources,
        _network: Arc<NetworkCounts>,
        _shutdown: &Shutdown,
    ) -> Result<Self, Failure> {
        Err(Failure::BadInput(
            "this program was built without the monitor: give --no-monitor, or build it with `--features monitor`".into(),
        ))
    }

    /// The web page that opens the stream.
    pub fn address(&self) -> Option<&str> {
        match self.0 {}
    }

    /// The stream's own address.
    pub fn stream_address(&self) -> Option<&str> {
        match self.0 {}
    }

    /// The file to which it is written.
    pub fn recording(&self) -> Option<&Path> {
        match self.0 {}
    }

    /// Shows a line.
    pub fn log(&self, _severity: Severity, _line: &str) {
        match self.0 {}
    }

    /// Ends it; how many samples were dropped.
    pub fn stop(self) -> Result<u64, Failure> {
        match self.0 {}
    }
}
