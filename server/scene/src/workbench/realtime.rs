//! Priorities, cores and rates of the loops.

use super::parts::{MAX_RATE, MIN_UPDATES};
use super::spec::{RealTime, RealTimeMode};
use crate::document::{Range, Section};

pub(super) fn realtime(section: &Section<'_>) -> RealTime {
    let default = RealTime::default();
    let priority = |key| section.integer(key, 1, 99);
    let core = |key| section.integer(key, 0, 1023);
    let modes = [
        ("enforce", RealTimeMode::Enforce),
        ("waive", RealTimeMode::Waive),
    ];
    RealTime {
        mode: section.choice("mode", &modes).unwrap_or_default(),
        haptics_priority: priority("haptics_priority").unwrap_or(default.haptics_priority),
        coupling_priority: priority("coupling_priority").unwrap_or(default.coupling_priority),
        god_object_priority: priority("god_object_priority"),
        haptics_core: core("haptics_core"),
        coupling_core: core("coupling_core"),
        god_object_core: core("god_object_core"),
        god_object_rate: section.number("god_object_rate", Range::Between(MIN_UPDATES, MAX_RATE)),
    }
}
