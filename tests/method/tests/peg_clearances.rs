//! A round peg in its hole at three clearances, two tessellations and any orientation in the world.
//!
//! | symbol | name in code | unit | meaning                                                  |
//! |--------|--------------|------|----------------------------------------------------------|
//! | c      | `clearance`  | m    | apothem of the hole less radius of the peg's vertices    |
//! | d      | [`OFFSET`]   | m    | how far the hand presses the inserted peg to the side    |
//! | s      | `sagitta`    | m    | how much nearer to the axis the peg's flats are than its vertices |
//!
//! The hole runs along y of its own frame; forces are compared there.

use std::f64::consts::PI;
use std::sync::Arc;

use god_object::{Pose, Settings, World};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use taut_method_tests::checker::PenetrationChecker;
use taut_method_tests::hand::{HandError, Random};
use taut_method_tests::motion::{Led, Sample};
use taut_method_tests::solids::{self, body, mesh, obstacle};
use taut_scene::shapes::{Axis, box_with_hole, cylinder};

const CLEARANCES: [f64; 3] = [0.5e-3, 0.1e-3, 0.05e-3];
const FACETS: [usize; 2] = [72, 144];
const ORIENTATIONS: u64 = 4;
/// Every so many of them with the finer tessellation, too.
const FINE_EVERY: usize = 4;
const PEG_RADIUS: f64 = 0.010;
/// Half the length of the peg and of the box, m.
const HALF_LENGTH: f64 = 0.030;
/// How far the hand presses to the side, m.
const OFFSET: f64 = 2e-3;
/// K_t of 1 kg and the default gains, N/m.
const STIFFNESS: f64 = 1000.0;
/// Time between updates, s.
const PERIOD: f64 = 0.012;
/// What counts as no force or torque beside a force of newtons, relative to it (a torque: times a metre).
const NONE: f64 = 1e-6;

fn world(clearance: f64, facets: usize, world_from_hole: Pose) -> Arc<World> {
    let peg = cylinder(PEG_RADIUS, HALF_LENGTH, facets, Axis::Y);
    let hole = box_with_hole([HALF_LENGTH; 3], PEG_RADIUS + clearance, facets, Axis::Y);
    let hole = obstacle("box", mesh(hole), world_from_hole);
    solids::world(body(mesh(peg)), [hole])
}

/// What one run leaves, in the hole's frame.
struct Inserted {
    /// Force and torque on the hand that presses to the side without tilt.
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// How far the tip is in the hole, m.
    depth: f64,
}

/// Goes 50 mm in: to the mouth, then in with the error of a hand; then, back on the axis, presses along z.
fn insert(clearance: f64, facets: usize, seed: u64) -> Inserted {
    let mut random = Random(seed);
    let world_from_hole = Pose::from_parts(
        Translation3::from(random.direction() * random.unit()),
        random.rotation(),
    );
    let world = world(clearance, facets, world_from_hole);
    let checker = PenetrationChecker::new(&world);
    let settings = Settings::for_size(2.0 * HALF_LENGTH);
    let start = 2.0 * HALF_LENGTH + 0.005;
    let in_hole = |y: f64| world_from_hole * Pose::translation(0.0, y, 0.0);
    let mut led = Led::in_world(world.clone(), &settings, in_hole(start));
    let hand = HandError::of_a_hand(seed);
    let steady = hand.without_tremor();
    let hole_from_world = world_from_hole.inverse();
    let mut time = 0.0;
    let mut step = |led: &mut Led, device: Pose, check: bool| -> Sample {
        time += PERIOD;
        let sample = led.step(time, &device);
        assert!(
            sample.gap_min >= settings.minimum_gap,
            "{clearance} {facets} {seed}: gap {:e}",
            sample.gap_min
        );
        assert!(!check || checker.penetrated(&sample.god_object).is_none());
        sample
    };

    // To the mouth on the axis, to 10 mm in; then with the hand's error to 50 mm.
    for k in 0..5 {
        let y = start - 0.015 * f64::from(k + 1) / 5.0;
        step(&mut led, in_hole(y), k % 5 == 0);
    }
    for k in 0..20 {
        let y = start - 0.015 - 0.04 * f64::from(k + 1) / 20.0;
        let device = hand.at(PERIOD * f64::from(k), &in_hole(y), 1.0);
        step(&mut led, device, k % 5 == 0);
    }
    // The hand corrects itself, then presses to the side.
    let pressed = world_from_hole * Pose::translation(0.0, start - 0.055, OFFSET);
    for k in 0..8 {
        let constant = 1.0 - f64::from(k) / 8.0;
        step(
            &mut led,
            steady.at(0.0, &in_hole(start - 0.055), constant),
            k % 5 == 0,
        );
    }
    let mut last = step(&mut led, pressed, true);
    for _ in 0..20 {
        last = step(&mut led, pressed, false);
    }
    assert!(checker.penetrated(&last.god_object).is_none());
    let turned: UnitQuaternion<f64> = hole_from_world.rotation;
    Inserted {
        force: turned * Vector3::from(last.wrench.fixed_rows::<3>(0)),
        torque: turned * Vector3::from(last.wrench.fixed_rows::<3>(3)),
        depth: 2.0 * HALF_LENGTH - (hole_from_world * last.god_object).translation.y,
    }
}

/// Every orientation and both tessellations at one clearance.
fn every_orientation(clearance: f64) {
    let rest = Settings::for_size(2.0 * HALF_LENGTH).rest_distance;
    for (facets, every) in FACETS.into_iter().zip([1, FINE_EVERY]) {
        let sagitta = PEG_RADIUS * (1.0 - (PI / facets as f64).cos());
        for seed in (1..=ORIENTATIONS).step_by(every) {
            let Inserted {
                force,
                torque,
                depth,
            } = insert(clearance, facets, seed);
            let case = format!("c {clearance}, {facets} facets, orientation {seed}");
            assert!((depth - 0.050).abs() < 1e-6, "{case}: {depth} m in");
            let size = force.norm();
            assert!(
                force.y.abs() <= NONE * size,
                "{case}: {force} along the hole"
            );
            assert!(
                torque.y.abs() <= NONE * size,
                "{case}: {torque} about the hole, {force}"
            );
            // From where the surface stands, a rest distance before itself; a peg that rolls stands lower by its sagitta.
            let [least, most] =
                [-sagitta, 2.0 * rest].map(|more| STIFFNESS * (OFFSET - clearance + more));
            assert!(
                (least..=most).contains(&-force.z),
                "{case}: {force}, not {least} to {most}"
            );
            assert!(
                force.x.abs() <= size * (PI / facets as f64).sin(),
                "{case}: {force} is turned by more than half a facet"
            );
        }
    }
}

#[test]
fn half_a_millimetre_is_a_clearance_in_every_orientation() {
    every_orientation(CLEARANCES[0]);
}

#[test]
fn a_tenth_of_a_millimetre_is_a_clearance_in_every_orientation() {
    every_orientation(CLEARANCES[1]);
}

#[test]
fn fifty_micrometres_are_a_clearance_in_every_orientation() {
    every_orientation(CLEARANCES[2]);
}

/// A hand tilts the inserted peg further than the hole lets it, and pulls: without friction it comes out.
#[test]
fn a_peg_that_is_tilted_against_both_rims_does_not_jam() {
    let clearance = 0.1e-3;
    let world = world(clearance, 72, Pose::identity());
    let checker = PenetrationChecker::new(&world);
    let settings = Settings::for_size(2.0 * HALF_LENGTH);
    // 20 mm in, where two points touch at a tilt of 2 c / 20 mm = 10 mrad; the hand tilts by 20 mrad.
    let inserted = 2.0 * HALF_LENGTH - 0.020;
    let device = |y: f64| Pose::new(Vector3::new(0.0, y, 0.0), Vector3::x() * 0.02);
    let mut led = Led::in_world(world, &settings, Pose::translation(0.0, inserted, 0.0));
    for k in 0..30 {
        led.step(PERIOD * f64::from(k), &device(inserted));
    }
    let pull = 1e-3;
    for k in 0..28 {
        let y = inserted + pull * f64::from(k + 1);
        let sample = led.step(PERIOD * f64::from(30 + k), &device(y));
        assert!(checker.penetrated(&sample.god_object).is_none());
        let behind = y - sample.god_object.translation.y;
        // Half of the way left is covered in an update: a body in the air is one pull behind. The hole gives
        // the tilt back, over some updates, as the peg comes out, which moves it along the hole by its length times the tilt squared.
        assert!(
            behind <= 2.0 * pull,
            "{behind} m behind at {y}: {}",
            sample.wrench
        );
    }
    let out = led.step(1.0, &device(inserted + 0.040));
    assert!(out.god_object.translation.y > 2.0 * HALF_LENGTH);
}
