//! R20: a body between stops while the device turns past a half turn and back.
//!
//! A rotation vector of the shorter arc flips its sign at pi, and the torque would jump by 2 pi K_r. It must keep its sign, grow
//! to the saturation and stay there.

use std::f64::consts::PI;

use god_object::{Coupling, Pose, Settings};
use nalgebra::Vector3;

use crate::closed_loop::PERIOD;
use crate::row::{Row, Rows};
use crate::walls::{contacts, cube, linear, stops_about_z};

/// How far the device turns, rad.
const TURN: f64 = 200.0 / 180.0 * PI;
/// How fast, rad/s.
const SPEED: f64 = PI / 3.0;
/// Angle at which the torque saturates, rad.
const SATURATION: f64 = 1.0;
/// What counts as the same torque, relative to the saturated one: rounding.
const SAME: f64 = 1e-9;

/// Torque against the turn: `(angle, torque about z)` at each tick, and what else there was of force and torque; and K_r, N m/rad.
fn torques(axis_turn: f64) -> (Vec<(f64, f64)>, f64, f64) {
    let world = cube();
    let settings = linear(1000.0);
    let rotational = settings.stiffness(1.0) * world.body.inertia[(2, 2)];
    let settings = Settings {
        torque_limit: rotational * SATURATION,
        ..settings
    };
    let set = contacts(&settings, &stops_about_z());
    let mut coupling = Coupling::new(&world, &settings);
    let period = PERIOD.as_secs_f64();
    let there = (TURN / SPEED / period) as u32;
    let mut torques = Vec::new();
    let mut beside = 0.0_f64;
    for tick in 0..=2 * there {
        let up = if tick <= there {
            tick
        } else {
            2 * there - tick
        };
        let angle = f64::from(up) * period * SPEED * axis_turn;
        let device = Pose::rotation(Vector3::z() * angle);
        let mut wrench = coupling
            .step(f64::from(tick) * period, &device, &set)
            .wrench;
        torques.push((angle, wrench[5]));
        wrench[5] = 0.0;
        beside = beside.max(wrench.norm());
    }
    (torques, rotational, beside)
}

/// Both ways round.
pub(crate) fn run() -> Vec<Row> {
    let mut all = Vec::new();
    for (name, sense) in [("200 deg and back", 1.0), ("-200 deg and back", -1.0)] {
        let mut rows = Rows::of(name);
        let (torques, rotational, beside) = torques(sense);
        let limit = rotational * SATURATION;
        // Against the turn: never with it.
        let wrong = torques
            .iter()
            .map(|(_, torque)| torque * sense)
            .fold(f64::NEG_INFINITY, f64::max);
        rows.at_most("torque with the turn", wrong.max(0.0), 0.0, "N m");
        // K_r times the angle, up to the saturation: monotone, then constant.
        let error = torques
            .iter()
            .map(|(angle, torque)| {
                let ideal = -sense * (rotational * angle.abs()).min(limit);
                (torque - ideal).abs() / limit
            })
            .fold(0.0, f64::max);
        rows.at_most("error of K_r angle, saturated at 1 rad", error, SAME, "");
        let jump = torques
            .windows(2)
            .map(|pair| (pair[1].1 - pair[0].1).abs())
            .fold(0.0, f64::max);
        let allowed = 1.5 * rotational * SPEED * PERIOD.as_secs_f64();
        rows.at_most("largest change of torque per ms", jump, allowed, "N m");
        rows.at_most("force and other torque", beside / limit, SAME, "");
        all.extend(rows.all);
    }
    all
}
