//! Constraint sets to a bridge that couples by itself: the newest one at a fixed rate, so that what is lost costs one period.
//!
//! On the broadcaster's thread. A set of up to some twenty rows is one datagram, the fullest 94; at most `DATAGRAMS_PER_TICK` leave in one
//! tick, so that a large set takes several and the next one is then the newest. A set of many datagrams would seldom arrive whole
//! on a network that loses one in twenty: from `REPEATED_FROM` on, all are sent twice, in turn.
//!
//! **None is sent** when the god-object loop has not renewed it for `OLDEST`, or when the hand was not heard for 120 ms: then the bridge
//! hears nothing and lets its force fade, as it does when the network breaks.

use std::time::Duration;

use god_object::Settings;
use taut_bridge::edge::write_set;
use taut_link::Broadcaster;
use taut_proto::constraints::SET_PAUSED;
use taut_proto::wrench::WRENCH_AT_EDGE;
use taut_proto::{ConstraintPart, ConstraintSet, Division, WrenchCommand};

use crate::shared::clock::nanoseconds;
use crate::shared::contact_snapshot::ContactSnapshot;

/// Most datagrams in one tick of the broadcaster: 9 MB/s at 1 kHz.
const DATAGRAMS_PER_TICK: usize = 8;
/// Sets of this many datagrams are sent twice.
const REPEATED_FROM: usize = 4;
/// Age of a set from which on it is not sent any more: the bridge, which counts from the device sample that a set answers, would not render in full what
/// rests on it.
const OLDEST: Duration = Duration::from_millis(80);
/// Silence of the haptics loop from which on no set is sent.
const HAPTICS_SILENCE: Duration = Duration::from_millis(20);

/// The set that is being sent. No allocation after `new`.
#[derive(Debug)]
pub struct EdgeSets {
    separations: bool,
    set: ConstraintSet,
    division: Division,
    /// Datagrams sent of it, and how many it takes.
    sent: usize,
    due: usize,
}

impl EdgeSets {
    /// For a session with these settings.
    pub fn new(settings: &Settings) -> Self {
        Self {
            separations: settings.implicit_rounds > 0,
            set: ConstraintSet::new(),
            division: Division::default(),
            sent: 0,
            due: 0,
        }
    }

    /// Gives `send` what is due at `now`, if the bridge that `command` answers couples by itself and is heard; whether it does.
    ///
    /// `armed`: the haptics loop's port gives force; if not, the bridge's fades.
    pub fn tick(
        &mut self,
        now: Duration,
        command: &WrenchCommand,
        armed: bool,
        newest: &ContactSnapshot,
        mut send: impl FnMut(ConstraintPart),
    ) -> bool {
        if command.flags & WRENCH_AT_EDGE == 0 {
            self.due = 0;
            return false;
        }
        let silence = now.saturating_sub(Duration::from_nanos(command.time_ns));
        if silence > HAPTICS_SILENCE {
            return true;
        }
        if self.sent >= self.due && now.saturating_sub(newest.published) <= OLDEST {
            self.begin(newest, armed);
        }
        let end = self.due.min(self.sent + DATAGRAMS_PER_TICK);
        for datagram in self.sent..end {
            let part = datagram % self.division.parts();
            send(self.division.part(&self.set, part));
        }
        self.sent = end;
        true
    }

    /// Tells the bridge that no force is to be given, if it has a set: it comes again, with that word.
    pub fn pause(&mut self, broadcaster: &mut Broadcaster) {
        if self.due == 0 {
            return;
        }
        self.set.head.flags |= SET_PAUSED;
        for part in 0..self.division.parts() {
            broadcaster.send_constraints(self.division.part(&self.set, part));
        }
    }

    fn begin(&mut self, newest: &ContactSnapshot, armed: bool) {
        write_set(&newest.set, self.separations, &mut self.set);
        if !armed {
            self.set.head.flags |= SET_PAUSED;
        }
        self.set.head.made_ns = nanoseconds(newest.published);
        self.set.head.device_ns = nanoseconds(newest.device_time);
        self.division = Division::of(&self.set);
        let parts = self.division.parts();
        self.due = if parts >= REPEATED_FROM {
            2 * parts
        } else {
            parts
        };
        self.sent = 0;
    }
}
