//! Priorities, cores and rates of the loops.

use super::parts::{MAX_RATE, MIN_UPDATES};
use super::spec::{RealTime, RealTimeMode};
use crate::document::{Range, Section};

pub(super) fn realtime(section: Option<Section<'_>>) -> Option<RealTime> {
    let mut realtime = RealTime {
        mode: RealTimeMode::Waive,
        haptics_priority: 80,
        coupling_priority: 70,
        god_object_priority: None,
        haptics_core: None,
        coupling_core: None,
        god_object_core: None,
        god_object_rate: None,
    };
    let Some(section) = section else {
        return Some(realtime);
    };
    let priority = |key| {
        section
            .integer(key, 1, 99)
            .and_then(|n| u8::try_from(n).ok())
    };
    let core = |key| {
        section
            .integer(key, 0, 1023)
            .and_then(|n| usize::try_from(n).ok())
    };
    realtime.mode = section
        .choice(
            "mode",
            &[
                ("enforce", RealTimeMode::Enforce),
                ("waive", RealTimeMode::Waive),
            ],
        )
        .unwrap_or_default();
    realtime.haptics_priority = priority("haptics_priority").unwrap_or(realtime.haptics_priority);
    realtime.coupling_priority =
        priority("coupling_priority").unwrap_or(realtime.coupling_priority);
    realtime.god_object_priority = priority("god_object_priority");
    realtime.haptics_core = core("haptics_core");
    realtime.coupling_core = core("coupling_core");
    realtime.god_object_core = core("god_object_core");
    realtime.god_object_rate =
        section.number("god_object_rate", Range::Between(MIN_UPDATES, MAX_RATE));
    section.finish();
    Some(realtime)
}
