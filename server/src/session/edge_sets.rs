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
use god_object::nalgebra::{Point3, Vector3};
use taut_bridge::edge::write_set;
use taut_link::Broadcaster;
use taut_proto::constraints::SET_PAUSED;
use taut_proto::wrench::WRENCH_AT_EDGE;
use taut_proto::{ArrayVec, ConstraintPart, ConstraintSet, Division, WrenchCommand};

use crate::shared::clock::nanoseconds;
use crate::shared::contact_snapshot::{ContactSnapshot, MAX_MOVING, MovingObstacle};

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
    ways: Ways,
}

/// What moving obstacles did from the set before to the one that is sent: not every update's set is.
#[derive(Debug, Default)]
struct Ways {
    /// Of the set that is sent.
    sequence: Option<u64>,
    now: Places,
    before: Places,
}

type Places = ArrayVec<MovingObstacle, MAX_MOVING>;

impl Ways {
    /// Takes the set that is sent now, or again.
    fn follow(&mut self, newest: &ContactSnapshot) {
        let sequence = newest.set.sequence;
        if self.sequence.replace(sequence) != Some(sequence) {
            self.before.clone_from(&self.now);
        }
        self.now.clone_from(&newest.moving);
    }

    /// How far the point of `obstacle` that is at `point` has come, m; `None` where it is not known to move.
    fn of(&self, obstacle: u16, point: &Point3<f64>) -> Option<Vector3<f64>> {
        let place = |places: &Places| places.iter().find(|p| p.obstacle == obstacle).copied();
        let (before, now) = (place(&self.before)?.pose, place(&self.now)?.pose);
        if now == before {
            return Some(Vector3::zeros()); // exactly
        }
        Some(point - before * now.inverse_transform_point(point))
    }
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
            ways: Ways::default(),
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
            self.ways = Ways::default();
            return false;
        }
        let silence = now.saturating_sub(Duration::from_nanos(command.time_ns));
        if silence > HAPTICS_SILENCE {
            self.ways = Ways::default();
            return true;
        }
        if self.sent >= self.due {
            if now.saturating_sub(newest.published) <= OLDEST {
                self.begin(newest, armed);
            } else {
                self.ways = Ways::default();
            }
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
        self.ways.follow(newest);
        for (row, contact) in self.set.rows.iter_mut().zip(&newest.set.constraints) {
            if let Some(way) = self.ways.of(row.obstacle, &contact.point) {
                row.obstacle_displacement = way.map(|x| x as f32).into();
            }
        }
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

#[cfg(test)]
mod tests {
    use god_object::NonPenetrationConstraint;
    use god_object::constraint::{Feature, FeaturePair};
    use god_object::spatial::Pose;
    use taut_proto::{Assembler, PartTaken};

    use super::*;
    use crate::shared::contact_snapshot::constraint;

    /// What is known after the update at `ms`: a plate comes up by 0.1 mm in each.
    fn plate(ms: u64, rows: u32) -> ContactSnapshot {
        let mut snapshot = ContactSnapshot::at_start(&Pose::identity(), 256);
        let pose = Pose::translation(0.0, 0.0, 1e-4 * ms as f64);
        snapshot.moving.push(MovingObstacle { obstacle: 3, pose });
        snapshot.published = Duration::from_millis(ms);
        snapshot.set.sequence = ms;
        let row = |vertex| NonPenetrationConstraint {
            features: FeaturePair {
                obstacle: 3,
                on_body: Feature::Vertex(vertex),
                on_obstacle: Feature::Face(0),
            },
            point: Point3::new(0.01, 0.0, 1e-4 * ms as f64),
            obstacle_displacement: Vector3::z() * 1e-4,
            ..constraint(3, 1e-3)
        };
        snapshot.set.constraints.extend((0..rows).map(row));
        snapshot
    }

    #[test]
    fn rows_say_what_an_obstacle_did_since_the_set_before_that_was_sent() {
        for rows in [1, 200] {
            let mut sets = EdgeSets::new(&Settings::for_size(0.04));
            let mut assembler = Assembler::new();
            let (mut sequences, mut way) = (Vec::new(), 0.0);
            for ms in 1..=300 {
                let now = Duration::from_millis(ms);
                let command = WrenchCommand {
                    time_ns: nanoseconds(now),
                    origin_ns: 0,
                    wrench: [0.0; 6],
                    obstacle_work: 0.0,
                    flags: WRENCH_AT_EDGE,
                };
                let mut whole = false;
                let _ = sets.tick(now, &command, true, &plate(ms, rows), |part| {
                    whole |= assembler.take(&part) == PartTaken::Whole;
                });
                if whole && let Some(set) = assembler.newest() {
                    sequences.push(set.head.sequence);
                    way += f64::from(set.rows[0].obstacle_displacement[2]);
                }
            }
            // The first says what its own update did.
            let (first, last) = (sequences[0], sequences[sequences.len() - 1]);
            let came = 1e-4 * (last - first + 1) as f64;
            assert!(
                last > 290 && (way - came).abs() < 1e-7,
                "{way} m of {came} m by {} sets of {rows} rows",
                sequences.len()
            );
        }
    }
}
