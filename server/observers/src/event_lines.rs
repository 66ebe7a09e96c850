//! One line for each discrete event.

use serde::Serialize;
use taut_proto::state::{EventRecord, event_code};

use crate::feed::Fresh;
use crate::lines::{Naming, missed_line, written};

/// Makes lines of events, and says where some are missing.
#[derive(Clone, Debug)]
pub struct EventLines {
    naming: Naming,
    /// Number of the newest event; `None` before the first.
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

    /// Lines of the events in `fresh`, oldest first, without their ends.
    pub fn take(&mut self, fresh: Fresh<'_>) -> Vec<String> {
        let mut lines = Vec::with_capacity(fresh.events.len());
        for event in fresh.events {
            let before = self.newest.replace(event.id);
            let gap = before.map_or(0, |before| event.id.wrapping_sub(before).wrapping_sub(1));
            if gap > 0 {
                lines.push(missed_line(u64::from(gap)));
            }
            lines.push(written(&self.line(event, fresh.state.tick)));
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
    use taut_proto::HotState;

    fn lines(trail: &mut EventLines, ids: std::ops::Range<u32>, code: u32) -> Vec<Value> {
        let mut state = HotState::empty();
        state.tick = (7 << 32) + 100;
        let event = |id| EventRecord { id, tick: 90, code };
        let events: Vec<_> = ids.map(event).collect();
        let lines = trail.take(Fresh {
            state: &state,
            events: &events,
        });
        lines
            .iter()
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect()
    }

    #[test]
    fn each_event_is_a_line_and_a_gap_is_said() {
        let mut trail = EventLines::new(|_| None);
        let shown = lines(&mut trail, 4..6, 1);
        let ids: Vec<_> = shown.iter().map(|line| line["id"].clone()).collect();
        assert_eq!(ids, [json!(4), json!(5)]);
        assert_eq!(shown[0]["kind"], json!("contact-on"));
        assert_eq!(shown[0]["tick"], json!((7_u64 << 32) + 90));
        assert!(lines(&mut trail, 0..0, 1).is_empty());
        let shown = lines(&mut trail, 8..10, 1);
        assert_eq!(shown[0], json!({"type": "missed", "events": 2}));
        assert_eq!(shown.len(), 3);
    }

    #[test]
    fn buttons_and_the_device_port_say_what_of() {
        let mut trail = EventLines::new(|kind| (kind == 10).then_some("the force was limited"));
        let button = event_code::BUTTON_DOWN | 2 << event_code::VALUE_SHIFT;
        let shown = lines(&mut trail, 2..3, button);
        assert_eq!(
            (&shown[0]["kind"], &shown[0]["button"]),
            (&json!("button-down"), &json!(2))
        );
        let shown = lines(&mut trail, 3..4, event_code::safety(10, 23.5));
        assert_eq!(shown[0]["kind"], json!("device-port"));
        assert_eq!(
            (&shown[0]["text"], &shown[0]["value"]),
            (&json!("the force was limited"), &json!(23.5))
        );
        let shown = lines(&mut trail, 4..5, 0x77);
        assert_eq!(
            (&shown[0]["kind"], &shown[0]["code"]),
            (&json!("unknown"), &json!(0x77))
        );
    }
}
