//! The board's side: a line for each line, with an arm in a simulated hand.

use std::time::Duration;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use taut_plant::{Hand, MinJerkPath, Plant, Tremor, ViaPoint};

use super::frame::{Frame, LINE, read_force};
use crate::device::Pose;
use crate::pseudo_terminal::FarEnd;

/// Silence after which the motors are off: the older board's 0.5 s, assumed of this one.
const MOTORS_OFF: Duration = Duration::from_millis(500);
/// Most that is simulated in one call.
const LONGEST_SILENCE: Duration = Duration::from_secs(1);

/// An arm on its board.
pub struct SimulatedPolhem {
    plant: Plant,
    line: Vec<u8>,
    epoch: Option<Duration>,
    elapsed: Duration,
    commanded: Duration,
    lines: u64,
    largest_force: f64,
}

impl SimulatedPolhem {
    /// At rest where the hand's path begins; without a path 60 mm down and up again, for ever.
    #[must_use]
    pub fn new(hand: Hand, path: Option<MinJerkPath>, tremor: Option<Tremor>) -> Self {
        let at = |time_s, down: f64| ViaPoint {
            time_s,
            pose: Pose::translation(0.01, 0.02, 0.03 - down),
        };
        let points = vec![
            at(0.0, 0.0),
            at(2.0, 0.06),
            at(4.0, 0.06),
            at(6.0, 0.0),
            at(8.0, 0.0),
        ];
        let path = path.or_else(|| MinJerkPath::new(points, true).ok());
        let path = path.unwrap_or_else(|| MinJerkPath::hold(Pose::identity())); // growing times: never
        let mut plant = Plant::new(crate::devices::polhem_grip(), hand, path);
        if let Some(tremor) = tremor {
            plant = plant.with_tremor(tremor);
        }
        Self {
            plant,
            line: Vec::with_capacity(LINE),
            epoch: None,
            elapsed: Duration::ZERO,
            commanded: Duration::ZERO,
            lines: 0,
            largest_force: 0.0,
        }
    }

    /// What the motors render, N.
    #[must_use]
    pub fn rendered(&self) -> Vector3<f64> {
        self.plant.rendered_wrench().fixed_rows::<3>(0).into()
    }

    /// Largest norm of a rendered force so far, N.
    #[must_use]
    pub fn largest_force(&self) -> f64 {
        self.largest_force
    }

    /// Lines taken so far.
    #[must_use]
    pub fn lines(&self) -> u64 {
        self.lines
    }

    fn advance(&mut self, now: Duration) {
        let epoch = *self.epoch.get_or_insert(now);
        let passed = now.saturating_sub(epoch);
        let due = passed.saturating_sub(self.elapsed);
        self.elapsed = self.elapsed.max(passed);
        if now.saturating_sub(self.commanded) > MOTORS_OFF {
            self.plant.command(&Vector6::zeros());
        }
        self.plant
            .advance(self.plant.time() + due.min(LONGEST_SILENCE));
    }

    fn obey(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.advance(now);
        self.lines += 1;
        if let Some([x, y, z]) = read_force(&self.line) {
            self.commanded = now;
            self.plant.command(&Vector6::new(x, y, z, 0.0, 0.0, 0.0));
            self.largest_force = self.largest_force.max(self.rendered().norm());
        }
        let pose = self.plant.measured_pose();
        let frame = Frame {
            position: pose.translation.vector.into(),
            angles: angles(&pose.rotation),
            info: 1,
        };
        out.extend(frame.line().into_iter().flatten());
    }
}

/// tA, lambda, tD, tE of a rotation, with tE zero: Rz(tA) Ry(-lambda) Rx(tD).
fn angles(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    let (roll, pitch, yaw) = rotation.euler_angles();
    [yaw, -pitch, roll, 0.0]
}

impl FarEnd for SimulatedPolhem {
    fn take(&mut self, now: Duration, bytes: &[u8], out: &mut Vec<u8>) {
        for byte in bytes {
            self.line.push(*byte);
            if *byte == b'\n' {
                self.obey(now, out);
                self.line.clear();
            } else if self.line.len() >= LINE {
                self.line.clear(); // no line is so long
            }
        }
    }
}
