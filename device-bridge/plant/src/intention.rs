//! What a hand intends, and how long it takes to change its mind.

use std::time::Duration;

use nalgebra::Vector6;

use crate::min_jerk::MinJerkPath;
use crate::spatial::Pose;

/// From an event to the first change of what the hand intends: the middle of 150-200 ms, which is an assumption.
pub const REACTION_TIME: Duration = Duration::from_millis(175);

/// The path that a hand follows, and the one that it has decided on.
#[derive(Clone, Debug)]
pub(crate) struct Intention {
    path: MinJerkPath,
    /// Time at which `path` begins, s.
    begins: f64,
    /// Decided on, and when it begins, s. Swapped in and not dropped, so that a loop frees no memory.
    next: Option<f64>,
    decided: MinJerkPath,
}

impl Intention {
    pub(crate) fn new(path: MinJerkPath) -> Self {
        Self {
            decided: path.clone(),
            path,
            begins: 0.0,
            next: None,
        }
    }

    /// Decides at `time` (s) on `path`, whose time 0 is a reaction time later.
    pub(crate) fn decide(&mut self, time: f64, path: MinJerkPath) {
        self.decided = path;
        self.next = Some(time + REACTION_TIME.as_secs_f64());
    }

    /// Intended pose and velocity at `time` (s), which never runs back.
    pub(crate) fn at(&mut self, time: f64) -> (Pose, Vector6<f64>) {
        if let Some(begins) = self.next.filter(|begins| *begins <= time) {
            std::mem::swap(&mut self.path, &mut self.decided);
            self.begins = begins;
            self.next = None;
        }
        self.path.at(time - self.begins)
    }
}
