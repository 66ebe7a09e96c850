//! From the trail of recent events that every state repeats to one line for each event.

use serde::Serialize;
use taut_proto::HotState;
use taut_proto::state::{EventRecord, event_code};

use crate::lines::{Naming, missed_line, written};

/// Takes each event once.
#[derive(Clone, Debug)]
pub struct EventLines {
    naming: Naming,
    /// Number of the newest event that was taken; `None` before the first state.
    newest: Option<u32>,
}

#[derive(Serialize)]
struct EventLine {
    r#type: &'static str,
    id: u32,
    tick: u64,
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    button: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    value: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    text: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    code: Option<u32>,
}

impl EventLines {
    /// Of a session whose device port's events have these names.
    #[must_use]
    pub fn new(naming: Naming) -> Self {
        Self {
            naming,
            newest: None,
        }
    }

    /// Lines of the events that are new in this state, oldest first, without their ends. What happened before the first state
    /// is past and not told.
    pub fn take(&mut self, state: &HotState) -> Vec<String> {
        let newest = state.events.iter().map(|event| event.id).max();
        let Some(taken) = self.newest else {
            self.newest = Some(newest.unwrap_or(0));
            return Vec::new();
        };
        // Numbers go round after 2^32 events: later is what is less than half a round ahead.
        let is_later = |event: &&EventRecord| (event.id.wrapping_sub(taken) as i32) > 0;
        let new = state.events.iter().filter(is_later);
        let mut lines = Vec::new();
        // The trail is short: more events at once than it holds, and the oldest are gone.
        let gap = new
            .clone()
            .next()
            .map_or(0, |first| first.id.wrapping_sub(taken) - 1);
        if gap > 0 {
            lines.push(missed_line(u64::from(gap)));
        }
        lines.extend(
            new.clone()
                .map(|event| written(&self.line(event, state.tick))),
        );
        if let Some(last) = new.last() {
            self.newest = Some(last.id);
        }
        lines
    }

    fn line(&self, event: &EventRecord, now: u64) -> EventLine {
        let argument = event.code >> event_code::VALUE_SHIFT;
        let mut line = EventLine {
            r#type: "event",
            id: event.id,
            tick: whole_tick(event.tick, now),
            kind: "unknown",
            button: None,
            value: None,
            text: None,
            code: None,
        };
        line.kind = match event.code & 0xffff {
            event_code::CONTACT_ON => "contact-on",
            event_code::CONTACT_OFF => "contact-off",
            event_code::FAULT => "fault",
            event_code::RESUMED => "resumed",
            code @ (event_code::BUTTON_DOWN | event_code::BUTTON_UP) => {
                line.button = Some(argument);
                if code == event_code::BUTTON_DOWN {
                    "button-down"
                } else {
                    "button-up"
                }
            }
            _ => match event_code::safety_of(event.code) {
                Some((kind, value)) => {
                    line.value = Some(value);
                    line.text = (self.naming)(kind);
                    line.code = Some(u32::from(kind));
                    "device-port"
                }
                None => {
                    line.code = Some(event.code);
                    "unknown"
                }
            },
        };
        line
    }
}

/// The tick whose low half is `low`, at or before `now`.
fn whole_tick(low: u32, now: u64) -> u64 {
    now.saturating_sub(u64::from((now as u32).wrapping_sub(low)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    fn state(ids: std::ops::Range<u32>, code: u32) -> HotState {
        let mut state = HotState::empty();
        state.tick = (7 << 32) + 100;
        state
            .events
            .extend(ids.map(|id| EventRecord { id, tick: 90, code }));
        state
    }

    fn lines(trail: &mut EventLines, state: &HotState) -> Vec<Value> {
        let lines = trail.take(state);
        lines
            .iter()
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect()
    }

    #[test]
    fn each_event_is_told_once_in_order_and_the_past_is_not() {
        let mut trail = EventLines::new(|_| None);
        assert!(lines(&mut trail, &state(1..4, 1)).is_empty());
        let told = lines(&mut trail, &state(2..6, 1));
        let ids: Vec<_> = told.iter().map(|line| line["id"].clone()).collect();
        assert_eq!(ids, [json!(4), json!(5)]);
        assert_eq!(told[0]["kind"], json!("contact-on"));
        assert_eq!(told[0]["tick"], json!((7_u64 << 32) + 90));
        assert!(lines(&mut trail, &state(2..6, 1)).is_empty());
        // 6 and 7 are gone from the trail: that is said.
        let told = lines(&mut trail, &state(8..10, 1));
        assert_eq!(told[0], json!({"type": "missed", "events": 2}));
        assert_eq!(told.len(), 3);
    }

    #[test]
    fn numbers_that_go_round_are_still_later() {
        let mut trail = EventLines::new(|_| None);
        lines(&mut trail, &state(u32::MAX - 1..u32::MAX, 1));
        let mut next = state(u32::MAX - 1..u32::MAX, 2);
        next.events.push(EventRecord {
            id: 3,
            tick: 95,
            code: 2,
        });
        let told = lines(&mut trail, &next);
        assert_eq!(told.last().map(|line| &line["id"]), Some(&json!(3)));
    }

    #[test]
    fn buttons_and_the_device_port_say_what_of() {
        let mut trail = EventLines::new(|kind| (kind == 10).then_some("the force was limited"));
        lines(&mut trail, &state(1..2, 1));
        let button = event_code::BUTTON_DOWN | 2 << event_code::VALUE_SHIFT;
        let told = lines(&mut trail, &state(2..3, button));
        assert_eq!(
            (&told[0]["kind"], &told[0]["button"]),
            (&json!("button-down"), &json!(2))
        );
        let told = lines(&mut trail, &state(3..4, event_code::safety(10, 23.5)));
        assert_eq!(told[0]["kind"], json!("device-port"));
        assert_eq!(
            (&told[0]["text"], &told[0]["value"]),
            (&json!("the force was limited"), &json!(23.5))
        );
        let told = lines(&mut trail, &state(4..5, 0x77));
        assert_eq!(
            (&told[0]["kind"], &told[0]["code"]),
            (&json!("unknown"), &json!(0x77))
        );
    }
}
