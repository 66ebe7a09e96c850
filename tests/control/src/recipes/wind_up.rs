//! R21: a bar in a slot while the device turns about; then the bar is lifted out of the slot.
//!
//! Short of a whole turn the bar returns the way that the device went, although the other way is shorter: by the branch nearest to
//! the last one. It must not spin through: a bar that is pulled by the longer rotation vector tips over about whichever axis the slot
//! leaves free. A whole turn is none, and two are none.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use god_object::spatial::rotation_vector;
use god_object::{Coupling, GodObject, Pose, Settings, World};
use nalgebra::Vector3;
use taut_method_tests::solids::{self, body, mesh, obstacle};
use taut_scene::shapes::cuboid;

use crate::closed_loop::PERIOD;
use crate::row::{Row, Rows};

/// Half extents of the bar, m.
const BAR: [f64; 3] = [0.05, 0.005, 0.005];
/// From the bar to either wall of the slot, m.
const CLEARANCE: f64 = 0.5e-3;
/// Half extents of a wall, m.
const WALL: [f64; 3] = [0.1, 0.01, 0.01];
/// Turns of the device, rad: short of a whole one, and two.
const TURNS: [f64; 2] = [5.0 / 3.0 * PI, 2.0 * TAU];
/// How fast it turns, rad/s.
const SPEED: f64 = PI;
/// How far the device lifts the bar, m, and the time that it takes, s.
const LIFT: (f64, f64) = (0.04, 0.4);
/// Time for which the device then waits, s.
const WAIT: f64 = 2.0;
/// Part of the wait at the end in which nothing may move any more, s.
const STILL: f64 = 1.0;
/// What counts as the same orientation, rad.
const SAME: f64 = 1e-5;
/// Angle at which the torque saturates, rad.
const SATURATION: f64 = 1.0;

/// What the run has seen.
#[derive(Debug, Default)]
struct Seen {
    /// Most that the bar turned in the slot, rad.
    in_slot: f64,
    /// Largest torque with the wind-up, N m: 0 where the torque keeps its sign.
    wrong_torque: f64,
    /// Largest change of torque per tick in the slot, N m.
    torque_step: f64,
    /// Sum of all turns about z, rad, and of all turns without sign.
    turned: f64,
    way: f64,
    /// Largest turn of one update, rad.
    largest_turn: f64,
    /// Turns in the last part, rad.
    at_end: f64,
    /// Most sub-steps of an update in the last part: 1 finds nothing to do. A whole turn per update would look like rest.
    busy: u32,
    /// From the device's orientation at the end, rad.
    left: f64,
    /// Smallest gap less the least allowed, m.
    gap: f64,
}

fn world() -> Arc<World> {
    let y = BAR[1] + CLEARANCE + WALL[1];
    let wall = |name: &str, side: f64| {
        let place = Pose::translation(0.0, side * y, 0.0);
        obstacle(name, mesh(cuboid(WALL)), place)
    };
    let walls = [wall("left", 1.0), wall("right", -1.0)];
    solids::world(body(mesh(cuboid(BAR))), walls)
}

fn lead(whole_turn: f64) -> (Seen, f64) {
    let world = world();
    let settings = Settings::for_size(2.0 * BAR[0]);
    let rotational = settings.stiffness(1.0) * world.body.inertia[(2, 2)];
    let settings = Settings {
        torque_limit: rotational * SATURATION,
        ..settings
    };
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object =
        GodObject::new(world, settings, Pose::identity()).unwrap_or_else(|error| panic!("{error}"));
    let period = PERIOD.as_secs_f64();
    let wound = whole_turn / SPEED;
    let lifted = wound + LIFT.1;
    let ticks = ((lifted + WAIT) / period) as u32;
    let mut seen = Seen {
        gap: f64::INFINITY,
        ..Seen::default()
    };
    let (mut last, mut last_torque) = (Pose::identity(), 0.0);
    let mut device = Pose::identity();
    for tick in 0..=ticks {
        let time = f64::from(tick) * period;
        let angle = whole_turn * (time / wound).min(1.0);
        let height = LIFT.0 * ((time - wound) / LIFT.1).clamp(0.0, 1.0);
        device = Pose::new(Vector3::z() * height, Vector3::zeros())
            * Pose::rotation(Vector3::z() * angle);
        let report = god_object.step(&device, None);
        let set = god_object.constraint_set();
        let torque = coupling.step(time, &device, set).wrench[5];
        seen.gap = seen.gap.min(set.gap_min - settings.minimum_gap);

        let pose = set.god_object_pose;
        let turn = rotation_vector(&(pose.rotation * last.rotation.inverse()));
        last = pose;
        seen.turned += turn.z;
        seen.way += turn.norm();
        seen.largest_turn = seen.largest_turn.max(turn.norm());
        if time < wound {
            seen.in_slot = seen.in_slot.max(rotation_vector(&pose.rotation).norm());
            seen.wrong_torque = seen.wrong_torque.max(torque);
            seen.torque_step = seen.torque_step.max(f64::abs(torque - last_torque));
        }
        last_torque = torque;
        if time > lifted + WAIT - STILL {
            seen.at_end += turn.norm();
            seen.busy = seen.busy.max(report.substeps);
        }
    }
    seen.left = rotation_vector(&(device.rotation * last.rotation.inverse())).norm();
    (seen, rotational)
}

/// Wound up, let go, at rest.
pub(crate) fn run() -> Vec<Row> {
    let play = 2.0 * CLEARANCE / BAR[0];
    let mut all = Vec::new();
    for turn in TURNS {
        let (seen, rotational) = lead(turn);
        // The bound of the conventions, 1.5 K v T, for the turn; at a whole turn the bar changes stops, across its play, and may do so in one update.
        let crossed = if turn < TAU { 0.0 } else { play };
        let allowed = rotational * 1.5 * (SPEED * PERIOD.as_secs_f64() + crossed);
        let mut rows = Rows::of(format!("{} deg", turn.to_degrees().round()));
        rows.at_most("turn of the bar in the slot", seen.in_slot, play, "rad");
        // Where less than 0.1 rad is left to a whole turn, the shorter arc pulls.
        let least = if turn < TAU { 0.0 } else { 0.1 * rotational };
        rows.at_most("torque with the wind-up", seen.wrong_torque, least, "N m");
        let step = seen.torque_step;
        rows.at_most("change of torque per ms, wound", step, allowed, "N m");
        let largest = seen.largest_turn;
        rows.at_most("largest turn in one update", largest, FRAC_PI_2, "rad");
        rows.at_most("from the device at the end", seen.left, SAME, "rad");
        rows.at_most("turns in the last second", seen.at_end, SAME, "rad");
        let busy = f64::from(seen.busy);
        rows.at_most("sub-steps of an update in the last second", busy, 1.0, "");
        // Within the slot's play at each half turn, and from there the way that the device went beyond whole ones.
        let returned = turn % TAU;
        let most = returned + 8.0 * play;
        rows.at_most("turns in all, about any axis", seen.way, most, "rad");
        rows.holds(
            "turn of the bar about z",
            format!("{:.5} rad", seen.turned),
            format!("{returned:.5} rad"),
            (seen.turned - returned).abs() <= SAME,
        );
        let gap = format!("{:.2e} m above the least", seen.gap);
        rows.holds("gap", gap, ">= 0", seen.gap >= 0.0);
        all.extend(rows.all);
    }
    all
}
