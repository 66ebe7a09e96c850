//! What happened last, for the operator's page: the device port's events by kind, and what was said of the network.

use std::collections::VecDeque;
use std::time::Duration;

use serde::Serialize;
use taut_bridge::{EventKind, SafetyEvent};

use crate::session::monitor::Severity;

/// Lines about the network that are kept.
const MAX_LINES: usize = 24;

/// One of the things that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Entry {
    /// Session time, s.
    t: f64,
    /// `info`, `warning` or `error`.
    level: &'static str,
    text: String,
    /// How often, since the start.
    times: u64,
}

/// The newest of everything. Bounded: each kind of the port's events is there once.
#[derive(Debug, Default)]
pub(super) struct Recent {
    events: [Option<Entry>; EventKind::ALL.len()],
    lines: VecDeque<Entry>,
}

impl Recent {
    /// Takes an event of the port that happened `times` times since the last of its kind was taken.
    pub(super) fn event(&mut self, event: &SafetyEvent, times: u64) {
        let kind = event.kind;
        let level = match () {
            () if kind.is_fault() => Severity::Error,
            () if kind.is_warning() => Severity::Warning,
            () => Severity::Info,
        };
        let place = &mut self.events[kind as usize];
        let before = place.as_ref().map_or(0, |entry| entry.times);
        *place = Some(Entry {
            t: event.time.as_secs_f64(),
            level: name(level),
            text: event.to_string(),
            times: before + times,
        });
    }

    /// Takes a line about the network.
    pub(super) fn line(&mut self, now: Duration, severity: Severity, text: &str) {
        if self.lines.len() == MAX_LINES {
            self.lines.pop_front();
        }
        self.lines.push_back(Entry {
            t: now.as_secs_f64(),
            level: name(severity),
            text: text.to_owned(),
            times: 1,
        });
    }

    pub(super) fn newest_first(&self) -> Vec<&Entry> {
        let mut all: Vec<&Entry> = self.events.iter().flatten().chain(&self.lines).collect();
        all.sort_by(|a, b| b.t.total_cmp(&a.t));
        all
    }
}

fn name(severity: Severity) -> &'static str {
    match severity {
        Severity::Info => "info",
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_event_is_there_once_and_lines_are_bounded_newest_first() {
        let mut recent = Recent::default();
        for number in 1..=1000 {
            let at = Duration::from_millis(number);
            recent.event(
                &SafetyEvent {
                    number,
                    time: at,
                    kind: EventKind::ForceLimited,
                    value: 20.0,
                },
                2,
            );
            recent.line(at, Severity::Warning, &format!("line {number}"));
        }
        let lost = SafetyEvent {
            number: 1001,
            time: Duration::from_secs(2),
            kind: EventKind::DeviceLost,
            value: 0.02,
        };
        recent.event(&lost, 1);
        let all = recent.newest_first();
        assert_eq!(all.len(), MAX_LINES + 2);
        assert_eq!((all[0].level, all[0].times), ("error", 1));
        let limited = all.iter().find(|entry| entry.times > 1);
        assert_eq!(
            limited.map(|entry| (entry.times, entry.level)),
            Some((2000, "warning"))
        );
        assert!(all.windows(2).all(|pair| pair[0].t >= pair[1].t));
    }
}
