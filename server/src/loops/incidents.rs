//! The events of the device port, by kind: counted in the haptics loop without waiting, logged elsewhere.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use taut_bridge::{EventKind, SafetyEvent};

use crate::shared::atomic_f64::AtomicF64;

/// How often each kind of event happened, and the newest of each. One writer; any thread may read.
#[derive(Debug, Default)]
pub struct IncidentCounts([Incident; EventKind::ALL.len()]);

#[derive(Debug, Default)]
struct Incident {
    count: AtomicU64,
    /// Number of the newest event among all of the port.
    number: AtomicU64,
    time_ns: AtomicU64,
    value: AtomicF64,
}

impl IncidentCounts {
    /// Counts one. Wait-free.
    pub fn count(&self, event: &SafetyEvent) {
        let incident = &self.0[event.kind as usize];
        let time_ns = u64::try_from(event.time.as_nanos()).unwrap_or(u64::MAX);
        incident.number.store(event.number, Ordering::Relaxed);
        incident.time_ns.store(time_ns, Ordering::Relaxed);
        incident.value.store(event.value);
        // Last: who sees the count grow sees the newest event too, or a newer one.
        incident.count.fetch_add(1, Ordering::Release);
    }

    /// How often this kind happened.
    pub fn of(&self, kind: EventKind) -> u64 {
        self.0[kind as usize].count.load(Ordering::Acquire)
    }

    /// The newest event of this kind, if there was one. Parts of two events may mix if one happens meanwhile: for people to read.
    pub fn newest(&self, kind: EventKind) -> Option<SafetyEvent> {
        let incident = &self.0[kind as usize];
        (self.of(kind) > 0).then(|| SafetyEvent {
            number: incident.number.load(Ordering::Relaxed),
            time: Duration::from_nanos(incident.time_ns.load(Ordering::Relaxed)),
            kind,
            value: incident.value.load(),
        })
    }
}

/// What one listener has heard of the counts.
#[derive(Debug)]
pub(crate) struct IncidentCursor([u64; EventKind::ALL.len()]);

impl Default for IncidentCursor {
    fn default() -> Self {
        Self([0; EventKind::ALL.len()])
    }
}

impl IncidentCursor {
    /// The newest event of each kind that happened since the last call, with how often it did, in the order of their numbers.
    pub(crate) fn since_last(&mut self, counts: &IncidentCounts) -> Vec<(SafetyEvent, u64)> {
        let mut fresh = Vec::new();
        for (kind, last) in EventKind::ALL.into_iter().zip(&mut self.0) {
            let count = counts.of(kind);
            let grown = count - *last;
            *last = count;
            if grown > 0 {
                fresh.extend(counts.newest(kind).map(|event| (event, grown)));
            }
        }
        fresh.sort_by_key(|(event, _)| event.number);
        fresh
    }
}

/// The line that tells of an event that happened `times` times.
pub(crate) fn line(event: &SafetyEvent, times: u64) -> String {
    let time_s = event.time.as_secs_f64();
    let line = format!("{event} at {time_s:.3} s, no. {}", event.number);
    if times > 1 {
        line + &format!(" ({times} times)")
    } else {
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_has_a_count_of_its_own_and_its_newest_event() {
        let counts = IncidentCounts::default();
        let mut number = 0;
        for (place, kind) in EventKind::ALL.into_iter().enumerate() {
            assert_eq!(counts.newest(kind), None);
            for _ in 0..=place {
                number += 1;
                counts.count(&SafetyEvent {
                    number,
                    time: Duration::from_millis(number),
                    kind,
                    value: number as f64,
                });
            }
            let newest = counts.newest(kind).map(|event| (event.number, event.value));
            assert_eq!(newest, Some((number, number as f64)));
        }
        for (place, kind) in EventKind::ALL.into_iter().enumerate() {
            assert_eq!(counts.of(kind), place as u64 + 1, "{kind:?}");
        }
    }

    #[test]
    fn a_listener_hears_of_each_kind_once_and_how_often() {
        let (counts, mut cursor) = (IncidentCounts::default(), IncidentCursor::default());
        let event = |number, kind| SafetyEvent {
            number,
            time: Duration::from_millis(1500),
            kind,
            value: 0.021,
        };
        counts.count(&event(1, EventKind::DeviceLost));
        counts.count(&event(2, EventKind::Arming));
        counts.count(&event(3, EventKind::DeviceLost));
        let heard = cursor.since_last(&counts);
        let lines: Vec<_> = heard
            .iter()
            .map(|(event, times)| line(event, *times))
            .collect();
        assert_eq!(
            lines,
            [
                "safety: the force ramps in at 1.500 s, no. 2",
                "device: lost, the force fades (0.021 s) at 1.500 s, no. 3 (2 times)"
            ]
        );
        assert!(cursor.since_last(&counts).is_empty());
    }
}
