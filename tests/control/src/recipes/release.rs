//! R17: a peg in its hole, pressed sideways; then the hand lets go.
//!
//! | symbol | name in code | unit | meaning                                                    |
//! |--------|--------------|------|------------------------------------------------------------|
//! | c      | `CLEARANCE`  | m    | apothem of the hole less radius of the peg's vertices       |
//! | d      |              | m    | how far the device is beyond the clearance                  |
//! | K      |              | N/m  | rendered: `k_h k_s m`                                       |
//!
//! The coupling as published is a spring, and 2 N s/m of the device alone would let 0.2 kg swing 4 mm past the hole: the scene asks
//! for contact damping. All three loops: plant at 1 kHz with the force one tick late, god-object and coupling on each sample. The hole runs along y;
//! the hand presses along x.

use std::sync::Arc;
use std::time::Duration;

use god_object::{Coupling, GodObject, Pose, Settings, World};
use taut_method_tests::solids::{self, body, mesh, obstacle};
use taut_plant::{Grip, Hand, MinJerkPath, Motors, Plant, ViaPoint};
use taut_scene::shapes::{Axis, box_with_hole, cylinder};

use crate::Row;
use crate::closed_loop::PERIOD;

/// Radius of the peg's vertices, half its length and half the box's side, m.
const PEG: (f64, f64) = (0.010, 0.030);
/// Facets of peg and hole.
const FACETS: usize = 72;
/// See the head.
const CLEARANCE: f64 = 0.5e-3;
/// Contact damping over stiffness, s: 20 N s/m with 1000 N/m.
const DAMPING_TIME: f64 = 0.02;
/// How far the peg is in the hole, m.
const INSERTED: f64 = 0.050;
/// How far the device is held to the side, m.
const SIDEWAYS: f64 = 5e-3;
/// When the hand lets go, s.
const RELEASE: f64 = 1.0;
/// Within which time the device must have settled, s.
const SETTLING: f64 = 0.5;
/// How long the run goes on, s.
const END: f64 = 2.5;
/// Speed below which the device stands, m/s.
const STANDING: f64 = 1e-3;
/// How far beyond the contact a device at rest may stand, m: a force of 0.1 N.
const AT_CONTACT: f64 = 1e-4;
/// Largest overshoot beyond the hole, m.
const OVERSHOOT: f64 = 1e-3;
/// Share of the energy at the release by which it may seem to grow from one tick to the next: the difference between the
/// facets of the hole and the circle that is reckoned with.
const ENERGY_TOLERANCE: f64 = 1e-3;
/// Part of the end in which the god-object may not move, s, and what counts as no motion, m.
const STILL: (f64, f64) = (0.5, 1e-7);

/// What the run has seen after the release.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// How far the device was aside when it was let go, m.
    held_at: f64,
    /// Time after which the device stays at the contact or in the clearance, slow, s.
    settled: f64,
    /// Farthest beyond the other side of the hole, m.
    overshoot: f64,
    /// Energy of device and coupling at the release, J.
    energy: f64,
    /// Largest growth of that energy above its least so far, J.
    gained: f64,
    /// Way of the god-object in the last part, m.
    moved: f64,
}

fn world() -> Arc<World> {
    let peg = cylinder(PEG.0, PEG.1, FACETS, Axis::Y);
    let hole = box_with_hole([PEG.1; 3], PEG.0 + CLEARANCE, FACETS, Axis::Y);
    let hole = obstacle("box", mesh(hole), Pose::identity());
    solids::world(body(mesh(peg)), [hole])
}

/// A firm hand that presses the device, in equilibrium, `SIDEWAYS` to the side.
fn pressing(stiffness: f64, start: Pose) -> MinJerkPath {
    let hand = Hand::FIRM;
    let intended = SIDEWAYS + stiffness * (SIDEWAYS - CLEARANCE) / hand.stiffness;
    let via = |time_s: f64, aside: f64| ViaPoint {
        time_s,
        pose: Pose::translation(aside, 0.0, 0.0) * start,
    };
    MinJerkPath::new(vec![via(0.0, 0.0), via(0.5, intended)], false)
        .unwrap_or_else(|error| panic!("{error}"))
}

fn let_go(settings: &Settings) -> Seen {
    let world = world();
    let stiffness = settings.stiffness(world.body.mass);
    let start = Pose::translation(0.0, 2.0 * PEG.1 - INSERTED, 0.0);
    let mut coupling = Coupling::new(&world, settings);
    let mut god_object =
        GodObject::new(world, *settings, start).unwrap_or_else(|error| panic!("{error}"));
    let mut plant = Plant::new(Grip::workbench(), Hand::FIRM, pressing(stiffness, start))
        .with_motors(Motors {
            delay: PERIOD,
            lag: Duration::ZERO,
        });
    let ticks = |time: f64| (time / PERIOD.as_secs_f64()) as u32;
    let mut seen = Seen::default();
    let mut least = f64::INFINITY;
    let mut last = start;
    for tick in 0..ticks(END) {
        let now = PERIOD * tick;
        plant.advance(now);
        if tick == ticks(RELEASE) {
            plant.set_hand(Hand::RELEASED);
            seen.held_at = plant.pose().translation.x;
        }
        let device = plant.measured_pose();
        god_object.step(&device, None);
        let set = god_object.constraint_set();
        let answer = coupling.step(now.as_secs_f64(), &device, set);
        plant.command(&answer.wrench);
        if tick < ticks(RELEASE) {
            continue;
        }

        let since = f64::from(tick - ticks(RELEASE)) * PERIOD.as_secs_f64();
        let aside = device.translation.vector;
        let beyond = (aside.x.hypot(aside.z) - CLEARANCE).max(0.0);
        let standing = plant.velocity().fixed_rows::<3>(0).norm() <= STANDING;
        if !(standing && beyond <= AT_CONTACT) {
            seen.settled = since;
        }
        seen.overshoot = seen.overshoot.max(-aside.x - CLEARANCE);
        let energy = plant.kinetic_energy() + 0.5 * stiffness * beyond * beyond;
        if seen.energy == 0.0 {
            seen.energy = energy;
        }
        least = least.min(energy);
        seen.gained = seen.gained.max(energy - least);
        let pose = set.god_object_pose;
        if tick >= ticks(END - STILL.0) {
            seen.moved += (pose.translation.vector - last.translation.vector).norm();
        }
        last = pose;
    }
    seen
}

/// One release.
pub(crate) fn run() -> Vec<Row> {
    let settings = Settings {
        damping_time: DAMPING_TIME,
        ..Settings::for_size(2.0 * PEG.1)
    };
    let seen = let_go(&settings);
    vec![
        Row::within("held aside", seen.held_at, SIDEWAYS, 0.02, "m"),
        Row::at_most("time to settle", seen.settled, SETTLING, "s"),
        Row::at_most("overshoot beyond the hole", seen.overshoot, OVERSHOOT, "m"),
        Row::at_most(
            "growth of the energy after the release",
            seen.gained / seen.energy,
            ENERGY_TOLERANCE,
            "of it",
        ),
        Row::at_most(
            "way of the god-object in the last 0.5 s",
            seen.moved,
            STILL.1,
            "m",
        ),
    ]
}
