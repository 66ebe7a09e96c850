//! R16: a device with little damping pressed on a wall by a constant force, its position counted by an encoder.
//!
//! What the encoder rounds away is energy that the wall gives back: a released device cycles for ever although the linear loop is
//! stable, unless Coulomb friction takes it up. No cycle below `min(2 b / T, 2 f_c / Delta)`.
//!
//! The expected forces from peak to peak are those 2 s after the device is let go 2.2 mm above the wall. They are not yet those of the
//! steady cycle: at 1900 N/m the linear loop takes 8 s to fall to a third, and what is left for ever is a few counts of the encoder.
//! Both are measured; the steady one against what a count is.

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
/// Where the device is let go, m above the wall.
const DROP: f64 = 2.2e-3;
/// How near the size of a cycle must be to what is expected.
const TOLERANCE: f64 = 0.1;
/// From when and for how many ticks the force is watched: while the drop dies away, and when it has.
const DYING: [u32; 2] = [2_000, 1_000];
const STEADY: [u32; 2] = [40_000, 2_000];
/// A count of force, told from the difference of two forces.
const ROUNDING: f64 = 1e-9;

/// Stiffness, N/m; force from peak to peak 2 s after the drop without friction and with it, N.
const EXPECTED: [(f64, f64, f64); 4] = [
    (500.0, 0.13, 0.0),
    (1000.0, 0.53, 0.0),
    (1600.0, 2.5, 0.0),
    (1900.0, 4.2, 1.2),
];

/// Force from peak to peak, N, over the ticks that are watched, one pair after the other.
fn peak_to_peak<const N: usize>(stiffness: f64, coulomb: f64, watched: [[u32; 2]; N]) -> [f64; N] {
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
    run.plant
        .place(Pose::translation(DROP, 0.0, 0.0), Vector6::zeros());
    run.push = Vector6::x() * -PUSH;
    let mut tick = 0;
    watched.map(|[from, ticks]| {
        while tick < from {
            run.tick();
            tick += 1;
        }
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for _ in 0..ticks {
            let force = run.tick().wrench[0];
            tick += 1;
            low = low.min(force);
            high = high.max(force);
        }
        high - low
    })
}

/// The expected cycles, and none below the limit of passivity.
pub(crate) fn run() -> Vec<Row> {
    let mut rows = Vec::new();
    for (stiffness, without, with) in EXPECTED {
        let count = stiffness * RESOLUTION;
        for (coulomb, expected) in [(0.0, without), (COULOMB, with)] {
            let [dying, steady] = peak_to_peak(stiffness, coulomb, [DYING, STEADY]);
            let name = format!("K {stiffness} N/m, f_c {coulomb} N");
            let after = format!("{name}, 2 s after the drop");
            rows.push(if expected > 0.0 {
                Row::within(after, dying, expected, TOLERANCE, "N")
            } else {
                Row::at_most(after, dying, 0.0, "N")
            });
            rows.push(if coulomb == 0.0 {
                Row::holds(
                    format!("{name}, steady"),
                    format!("{steady:.3} N"),
                    format!("{count:.3} N, a count, to {PUSH} N"),
                    steady >= count * (1.0 - ROUNDING) && steady < PUSH,
                )
            } else {
                Row::at_most(format!("{name}, steady"), steady, 0.0, "N")
            });
        }
    }
    let period = PERIOD.as_secs_f64();
    let mut largest = 0.0_f64;
    for coulomb in [0.005, 0.01, 0.02, 0.05] {
        let limit = passive_limit_quantised(DAMPING, coulomb, period, RESOLUTION);
        let [steady] = peak_to_peak(0.98 * limit, coulomb, [STEADY]);
        largest = largest.max(steady);
    }
    let name = "2 % below min(2b/T, 2f_c/Delta), f_c 0.005 to 0.05 N";
    rows.push(Row::at_most(name, largest, 0.0, "N"));
    rows
}
