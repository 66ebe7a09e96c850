//! The board's side: a line for each line, with an arm in a simulated hand.

use std::time::Duration;

use nalgebra::{UnitQuaternion, Vector3};
use taut_plant::{Hand, MinJerkPath, Tremor};

use super::frame::{Frame, LINE, read_force};
use crate::devices::held_arm::{HeldArm, down_and_up};
use crate::pseudo_terminal::FarEnd;

/// Silence after which the motors are off: the older board's 0.5 s, assumed of this one.
const MOTORS_OFF: Duration = Duration::from_millis(500);

/// An arm on its board.
pub struct SimulatedPolhem {
    arm: HeldArm,
    line: Vec<u8>,
    lines: u64,
}

impl SimulatedPolhem {
    /// At rest where the hand's path begins; without a path 60 mm down and up again, for ever.
    #[must_use]
    pub fn new(hand: Hand, path: Option<MinJerkPath>, tremor: Option<Tremor>) -> Self {
        let path = path.unwrap_or_else(|| down_and_up(Vector3::new(0.01, 0.02, 0.03)));
        Self {
            arm: HeldArm::new(crate::devices::polhem_grip(), hand, path, tremor),
            line: Vec::with_capacity(LINE),
            lines: 0,
        }
    }

    /// The arm in the hand.
    #[must_use]
    pub fn held(&self) -> &HeldArm {
        &self.arm
    }

    /// Lines taken so far.
    #[must_use]
    pub fn lines(&self) -> u64 {
        self.lines
    }

    fn obey(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.arm.advance(now, MOTORS_OFF);
        self.lines += 1;
        if let Some(force) = read_force(&self.line) {
            self.arm.push(now, &force.into());
        }
        let pose = self.arm.plant.measured_pose();
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
