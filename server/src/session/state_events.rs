//! The events that states carry: contacts, buttons, faults, and what the port tells.

use taut_proto::ArrayVec;
use taut_proto::state::{EventRecord, MAX_EVENTS, event_code};

use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::device_state::{DeviceState, RECENT_EVENTS};

/// Buttons of a device, one bit each.
const BUTTONS: u32 = u16::BITS;
/// The number of a button in an event's code.
pub(super) const BUTTON_SHIFT: u32 = 16;
/// Events that may wait for their state.
const MAX_WAITING: usize = 64;
/// Most events that one sample brings: contact, fault, every button, everything that the port keeps.
const MAX_AT_ONCE: usize = 2 + BUTTONS as usize + RECENT_EVENTS;

/// Discrete events out of what changed; each goes into one state, and the link sees to it that no client misses it.
#[derive(Debug, Default)]
pub(super) struct EventSource {
    /// Oldest first.
    waiting: ArrayVec<EventRecord, MAX_WAITING>,
    count: u32,
    touching: bool,
    buttons: u16,
    faulty: bool,
    /// Number of the newest event of the port that was taken.
    safety: u64,
}

impl EventSource {
    pub(super) fn follow(&mut self, device: &DeviceState, contacts: &ContactSnapshot) {
        // What changed is compared with what was told: without room it is found with a later sample.
        if self.waiting.remaining_capacity() < MAX_AT_ONCE {
            return;
        }
        let tick = device.sequence as u32;
        let touching = contacts.report.active > 0;
        if touching != self.touching {
            let code = if touching {
                event_code::CONTACT_ON
            } else {
                event_code::CONTACT_OFF
            };
            self.push(tick, code);
        }
        let changed = device.buttons ^ self.buttons;
        for button in (0..BUTTONS).filter(|button| changed >> button & 1 == 1) {
            let down = device.buttons >> button & 1 == 1;
            let code = if down {
                event_code::BUTTON_DOWN
            } else {
                event_code::BUTTON_UP
            };
            self.push(tick, code | button << BUTTON_SHIFT);
        }
        if device.faulty != self.faulty {
            let code = if device.faulty {
                event_code::FAULT
            } else {
                event_code::RESUMED
            };
            self.push(tick, code);
        }
        for event in device.safety.after(self.safety) {
            self.push(tick, event_code::safety(event.kind as u8, event.value));
            self.safety = event.number;
        }
        (self.touching, self.buttons, self.faulty) = (touching, device.buttons, device.faulty);
    }

    fn push(&mut self, tick: u32, code: u32) {
        self.count = self.count.wrapping_add(1);
        self.waiting.push(EventRecord {
            id: self.count,
            tick,
            code,
        });
    }

    /// Moves the oldest that wait into a state, as many as it holds.
    pub(super) fn take(&mut self, into: &mut ArrayVec<EventRecord, MAX_EVENTS>) {
        into.clear();
        let count = self.waiting.len().min(MAX_EVENTS);
        into.extend(self.waiting.drain(..count));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::spatial::Pose;

    #[test]
    fn more_events_than_a_state_holds_go_into_the_next_ones() {
        let start = Pose::translation(0.0, 0.0, 0.1);
        let contacts = ContactSnapshot::at_start(&start, 32);
        let mut device = DeviceState::at_start(&start);
        let mut source = EventSource::default();
        let mut state = ArrayVec::new();
        let mut events = Vec::new();
        let mut send = |source: &mut EventSource| {
            source.take(&mut state);
            events.extend(state.iter().map(|event| (event.id, event.code)));
        };

        // All buttons at once, then a storm of them that is more than the states can carry.
        for press in 0..100 {
            device.buttons = if press % 2 == 0 { u16::MAX } else { 0 };
            source.follow(&device, &contacts);
            send(&mut source);
        }
        for _ in 0..2 * MAX_WAITING {
            source.follow(&device, &contacts);
            send(&mut source);
        }
        let ids: Vec<u32> = events.iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, (1..=events.len() as u32).collect::<Vec<_>>());
        for button in 0..BUTTONS {
            let of_button: Vec<u32> = events
                .iter()
                .filter(|(_, code)| code >> BUTTON_SHIFT == button)
                .map(|(_, code)| code & 0xffff)
                .collect();
            assert_eq!(of_button.last(), Some(&event_code::BUTTON_UP), "{button}");
            let kinds = [event_code::BUTTON_DOWN, event_code::BUTTON_UP];
            let down_and_up = of_button.iter().zip(kinds.iter().cycle());
            assert!(down_and_up.clone().all(|(kind, expected)| kind == expected));
        }
    }
}
