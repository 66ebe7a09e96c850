//! R16: a device with little damping pressed on a wall by a constant force, its position counted by an encoder.
//!
//! What the encoder rounds away is energy that the wall gives back: a released device cycles for ever although the linear loop is
//! stable, unless Coulomb friction takes it up. No cycle below `min(2 b / T, 2 f_c / Delta)`.

use god_object::{Pose, Vector6};
use nalgebra::Vector3;
use taut_plant::stability::passive_limit_quantised;
use taut_plant::{Encoder, Grip, Hand, MinJerkPath, Plant};

use crate::Row;
use crate::closed_loop::{ClosedLoop, PERIOD, grip};
use crate::walls::{above_x, contacts, cube, linear};

/// One count of the encoder, m.
const RESOLUTION: f64 = 29.24e-6;
/// What presses the device on the wall, N.
const PUSH: f64 = 2.0;
/// Damping of the device, N s/m.
const DAMPING: f64 = 1.0;
/// Coulomb friction where there is some, N.
const COULOMB: f64 = 0.02;
/// How near the size of a cycle must be to what is expected.
const TOLERANCE: f64 = 0.1;
/// Ticks until the start has died away, and ticks over which the force is watched.
const TICKS: [u32; 2] = [20_000, 5_000];

/// Stiffness, N/m; force from peak to peak without friction and with it, N.
const EXPECTED: [(f64, f64, f64); 4] = [
    (500.0, 0.13, 0.0),
    (1000.0, 0.53, 0.0),
    (1600.0, 2.5, 0.0),
    (1900.0, 4.2, 1.2),
];

/// Force from peak to peak, N, after the start has died away.
#[must_use]
pub fn peak_to_peak(stiffness: f64, coulomb: f64) -> f64 {
    let settings = linear(stiffness);
    let set = contacts(&settings, &above_x());
    let device = Grip {
        coulomb_force: Vector3::repeat(coulomb),
        ..grip(DAMPING)
    };
    let plant = Plant::new(device, Hand::RELEASED, MinJerkPath::hold(Pose::identity()))
        .with_encoder(Encoder {
            length: RESOLUTION,
            angle: 0.0,
        });
    let mut run = ClosedLoop::new(&cube(), &settings, set, plant);
    run.push = Vector6::x() * -PUSH;
    let [start, watched] = TICKS;
    for _ in 0..start {
        run.tick();
    }
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for _ in 0..watched {
        let force = run.tick().wrench[0];
        low = low.min(force);
        high = high.max(force);
    }
    high - low
}

/// The expected cycles, and none below the limit of passivity.
#[must_use]
pub fn run() -> Vec<Row> {
    let mut rows = Vec::new();
    for (stiffness, without, with) in EXPECTED {
        for (coulomb, expected) in [(0.0, without), (COULOMB, with)] {
            let measured = peak_to_peak(stiffness, coulomb);
            let name = format!("K {stiffness} N/m, f_c {coulomb} N");
            rows.push(if expected > 0.0 {
                Row::within(name, measured, expected, TOLERANCE, "N")
            } else {
                Row::at_most(name, measured, 0.0, "N")
            });
        }
    }
    let period = PERIOD.as_secs_f64();
    let mut largest = 0.0_f64;
    for coulomb in [0.005, 0.01, 0.02, 0.05] {
        let limit = passive_limit_quantised(DAMPING, coulomb, period, RESOLUTION);
        largest = largest.max(peak_to_peak(0.98 * limit, coulomb));
    }
    let name = "2 % below min(2b/T, 2f_c/Delta), f_c 0.005 to 0.05 N";
    rows.push(Row::at_most(name, largest, 0.0, "N"));
    rows
}
