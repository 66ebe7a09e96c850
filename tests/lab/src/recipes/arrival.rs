//! R14: a wall that is first seen when the device is behind it: sets made by hand, so that it is late by just so much.
//!
//! The device rests on a floor, 5 mm deep, and d behind a wall that arrives. Adaptation lets the wall's row rise over a time; without it the
//! force steps by K d. Energy is not given out, since the device rests.

use god_object::spatial::linear;
use god_object::{Adaptation, Coupling, Pose, Settings};
use nalgebra::{Point3, Vector3};
use taut_control_tests::walls;

use super::Extent;
use crate::clock::TICK;
use crate::method::Method;
use crate::row::Row;

/// N/m.
const STIFFNESS: f64 = 1000.0;
const FLOOR: f64 = 5e-3;
/// How far behind the wall the device is, m.
const BEHIND: [f64; 3] = [1e-3, 5e-3, 10e-3];
/// Times of adaptation, s, and violations that enter at once, m.
const RAMPS: [f64; 4] = [0.0, 0.02, 0.05, 0.1];
const THRESHOLDS: [f64; 2] = [0.0, -2e-3];
/// The wall arrives at this tick; the force is looked at until this one.
const ARRIVES: u32 = 50;
const TICKS: u32 = 250;
/// Of a share: rounding, and a tick more or less.
const SLACK: f64 = 1e-6;

pub(super) fn run(_extent: Extent) -> Vec<Row> {
    let mut rows = Vec::new();
    for behind in BEHIND {
        for ramp in RAMPS {
            for threshold in THRESHOLDS {
                rows.extend(arrive(behind, ramp, threshold));
            }
        }
    }
    for method in Method::ALL {
        let reason = match method {
            Method::Ours => continue,
            Method::OursByDefault | Method::PaperAdapted => "it adapts as ours does",
            Method::Penalty | Method::StaticCoupling | Method::LinearisedPenalty => {
                "its contacts are springs: nothing is let in"
            }
            _ => "it lets every constraint in at once: the ramp of 0 s",
        };
        rows.push(Row::new("R14", "late wall", method.name()).out_of_scope(reason));
    }
    rows
}

fn arrive(behind: f64, ramp: f64, threshold: f64) -> Vec<Row> {
    let settings = Settings {
        adaptation: Some(Adaptation {
            duration: ramp,
            threshold,
        }),
        ..walls::linear(STIFFNESS)
    };
    let world = walls::cube();
    let mut coupling = Coupling::new(&world, &settings);
    let floor = (Point3::origin(), Vector3::z());
    let wall = (Point3::origin(), Vector3::x());
    let before = walls::contacts(&settings, &[floor]);
    let mut after = walls::contacts(&settings, &[floor, wall]);
    after.sequence = 1;
    let device = Pose::translation(-behind, 0.0, -FLOOR);
    let forces: Vec<Vector3<f64>> = (0..TICKS)
        .map(|tick| {
            let set = if tick < ARRIVES { &before } else { &after };
            let time = f64::from(tick) * TICK;
            linear(&coupling.step(time, &device, set).wrench)
        })
        .collect();
    let step = forces[1..]
        .iter()
        .zip(&forces)
        .map(|(b, a)| (b - a).norm())
        .fold(0.0, f64::max);
    let last = forces[forces.len() - 1];
    let right = Vector3::new(STIFFNESS * behind, 0.0, STIFFNESS * FLOOR);
    let floor_off = forces.iter().map(|f| (f.z - right.z).abs());
    // What is at most the threshold enters at once; the rest rises over the ramp.
    let at_once = ramp == 0.0 || behind <= -threshold;
    let limit = if at_once {
        STIFFNESS * behind
    } else {
        STIFFNESS * behind * TICK / ramp
    };
    let row = Row {
        settings: format!("ramp {} ms; threshold {} mm", ramp * 1e3, threshold * 1e3),
        ..Row::new(
            "R14",
            format!("wall {} mm late", behind * 1e3),
            Method::Ours.name(),
        )
    };
    vec![
        row.clone()
            .at_most("step", step, "N/ms", limit * (1.0 + SLACK)),
        row.clone()
            .at_most("error_at_the_end", (last - right).norm(), "N", SLACK),
        row.at_most("floor_disturbed", floor_off.fold(0.0, f64::max), "N", SLACK),
    ]
}
