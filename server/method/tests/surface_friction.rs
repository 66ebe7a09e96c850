//! Coulomb friction: closed forms on a box, stick without creep, round cones, and no energy out of closed paths.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use crate::support::{box_body, box_obstacle, box_on_table};
use god_object::nalgebra::{UnitQuaternion, Vector3};
use god_object::spatial::{angular, linear};
use god_object::{
    Coupling, CouplingOutput, ForceShading, GodObject, Pose, Settings, Vector6, World,
};
use proptest::prelude::*;

const HALF: f64 = 0.02;
const HALF_HEIGHT: f64 = 0.01;
const STIFFNESS: f64 = 1000.0;
/// tan 20 degrees.
const FRICTION: f64 = 0.363_970_234_266_202_4;

/// Both loops on one world.
struct Loops {
    god_object: GodObject,
    coupling: Coupling,
    time: f64,
}

impl Loops {
    fn new(world: Arc<World>, start: Pose) -> Self {
        let settings = Settings::for_size(2.0 * HALF);
        Self {
            coupling: Coupling::new(&world, &settings),
            god_object: GodObject::new(world, settings, start).expect("a free start"),
            time: 0.0,
        }
    }

    fn update(&mut self, device: &Pose) {
        let report = self.god_object.step(device, None);
        assert!(!report.rejected);
    }

    fn feel(&mut self, device: &Pose) -> CouplingOutput {
        self.time += 1e-3;
        self.coupling
            .step(self.time, device, self.god_object.constraint_set())
    }

    fn both(&mut self, device: &Pose) -> CouplingOutput {
        self.update(device);
        self.feel(device)
    }

    /// Presses to `depth` where the body is, at the place that `device` gives.
    fn settle(&mut self, device: &Pose, steps: usize) -> CouplingOutput {
        for _ in 0..steps {
            self.both(device);
        }
        self.both(device)
    }
}

fn rough_table(friction: f64) -> Arc<World> {
    let mut world = World::clone(&box_on_table());
    world.obstacles[0].surface.friction = friction;
    Arc::new(world)
}

fn on_table() -> Loops {
    Loops::new(rough_table(FRICTION), at(0.0, 0.0, HALF_HEIGHT + 1e-4))
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_parts(Vector3::new(x, y, z).into(), UnitQuaternion::identity())
}

/// Down to 5 mm deep in small steps, straight.
fn press(loops: &mut Loops, depth: f64) {
    for i in 1..=50 {
        loops.both(&at(0.0, 0.0, HALF_HEIGHT - depth * f64::from(i) / 50.0));
    }
    for _ in 0..30 {
        loops.both(&at(0.0, 0.0, HALF_HEIGHT - depth));
    }
}

#[test]
fn a_block_pulled_sideways_sticks_and_then_slides_at_mu_times_the_load() {
    let mut loops = on_table();
    let depth = 5e-3;
    press(&mut loops, depth);
    let rest = *loops.god_object.pose();
    let load = loops.feel(&at(0.0, 0.0, HALF_HEIGHT - depth)).wrench[2];
    assert!((load - STIFFNESS * depth).abs() < 0.02, "{load}");
    for i in 1..=80 {
        let x = 5e-5 * f64::from(i);
        let felt = loops.settle(&at(x, 0.0, HALF_HEIGHT - depth), 60).wrench;
        let expected = (STIFFNESS * x).min(FRICTION * felt[2]);
        assert!(
            (felt[0] + expected).abs() < 2e-4 * load,
            "{x} m: {} N, not {expected} N",
            -felt[0]
        );
        assert!((felt[2] - load).abs() < 1e-6 * load, "{felt}");
        assert!(felt[1].abs() < 1e-6 * load, "{felt}");
        if STIFFNESS * x < 0.99 * FRICTION * load {
            assert_eq!(*loops.god_object.pose(), rest, "creeps while it sticks");
        }
    }
    assert!(loops.god_object.pose().translation.x > 1e-3);
}

#[test]
fn a_body_that_sticks_does_not_creep() {
    let mut loops = on_table();
    press(&mut loops, 5e-3);
    // 95 % of what the cone holds, in a direction of no symmetry, for three seconds.
    let pull = 0.95 * FRICTION * 5e-3;
    let device = at(pull * 0.6, pull * 0.8, HALF_HEIGHT - 5e-3);
    let first = loops.settle(&device, 100).wrench;
    let rest = *loops.god_object.pose();
    for _ in 0..3000 {
        let felt = loops.both(&device).wrench;
        // 1000 N/m: 1e-9 N in three seconds is 1e-12 m.
        assert!((felt - first).norm() < 1e-9, "{}", felt - first);
    }
    assert_eq!(*loops.god_object.pose(), rest);
    assert!((linear(&first).xy().norm() - STIFFNESS * pull).abs() < 1e-3);
}

#[test]
fn no_direction_is_preferred() {
    let depth = 5e-3;
    for i in 0..36 {
        let angle = TAU * f64::from(i) / 36.0;
        let mut loops = on_table();
        press(&mut loops, depth);
        let far = Vector3::new(angle.cos(), angle.sin(), 0.0) * 6e-3;
        let felt = loops
            .settle(&at(far.x, far.y, HALF_HEIGHT - depth), 100)
            .wrench;
        let (tangential, load) = (linear(&felt).xy().norm(), felt[2]);
        assert!(
            (tangential / (FRICTION * load) - 1.0).abs() < 1e-3,
            "{i}: {tangential} N of {load} N"
        );
        let against = -(felt[0] * far.x + felt[1] * far.y) / (tangential * far.norm());
        assert!(against > 1.0 - 1e-5, "{i}: {against}");
    }
}

#[test]
fn on_an_incline_the_body_sticks_below_the_angle_of_friction_and_slides_above() {
    for (degrees, sticks) in [
        (5.0, true),
        (15.0, true),
        (19.5, true),
        (20.5, false),
        (30.0, false),
    ] {
        let tilt: f64 = f64::to_radians(degrees);
        let turned = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        let mut slope = box_obstacle("slope", Vector3::new(0.5, 0.5, 0.05), Vector3::zeros());
        slope.pose = Pose::from_parts((turned * Vector3::new(0.0, 0.0, -0.05)).into(), turned);
        slope.surface.friction = FRICTION;
        let world = Arc::new(World {
            body: box_body(Vector3::new(HALF, HALF, HALF_HEIGHT)),
            obstacles: vec![slope],
        });
        let rest_distance = Settings::for_size(2.0 * HALF).rest_distance;
        let up = turned * Vector3::z() * (HALF_HEIGHT + rest_distance);
        let start = Pose::from_parts(up.into(), turned);
        let mut loops = Loops::new(world, start);
        // The hand pulls like a weight of 4 N: straight down by the same length, wherever the body is.
        let weight = |pose: &Pose| {
            let mut device = *pose;
            device.translation.z -= 4e-3;
            device
        };
        let device = weight(&start);
        loops.settle(&device, 50);
        let rest = *loops.god_object.pose();
        for _ in 0..1000 {
            let device = weight(loops.god_object.pose());
            loops.both(&device);
        }
        let moved = (loops.god_object.pose().translation.vector - rest.translation.vector).norm();
        if sticks {
            assert_eq!(moved, 0.0, "creeps at {degrees} degrees");
        } else {
            assert!(moved > 0.01, "{moved} m at {degrees} degrees");
        }
    }
}

#[test]
fn a_patch_resists_turning_by_mu_times_load_times_radius() {
    let mut loops = on_table();
    let depth = 5e-3;
    press(&mut loops, depth);
    let radius = HALF * 2f64.sqrt();
    let inertia = 8.0 * HALF * HALF / 12.0;
    let stiffness = STIFFNESS * inertia;
    let load = STIFFNESS * depth;
    let limit = FRICTION * load * radius;
    for share in [0.3, 0.9, 1.5, 3.0] {
        let angle = share * limit / stiffness;
        let device = Pose::from_parts(
            Vector3::new(0.0, 0.0, HALF_HEIGHT - depth).into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
        );
        let felt = loops.settle(&device, 100).wrench;
        let expected = limit * f64::min(share, 1.0);
        assert!(
            (angular(&felt).z + expected).abs() < 5e-3 * limit,
            "{share}: {} N m, not {expected}",
            -angular(&felt).z
        );
        assert!(linear(&felt).xy().norm() < 1e-3 * load, "{felt}");
    }
}

#[test]
fn on_turning_back_the_force_lets_go_at_once() {
    // The hand runs 20 mm at 0.2 m/s with updates at 70 Hz and turns: friction must not pull on from behind.
    let mut loops = on_table();
    let depth = 5e-3;
    press(&mut loops, depth);
    let (mut turned_by, mut last) = (None, 0.0);
    for i in 0..200 {
        let t = f64::from(i) * 1e-3;
        let x = if t < 0.1 { 0.2 * t } else { 0.2 * (0.2 - t) };
        let device = at(x, 0.0, HALF_HEIGHT - depth);
        if i % 14 == 0 {
            loops.update(&device);
        }
        let felt = loops.feel(&device).wrench;
        if t > 0.05 && t < 0.1 {
            assert!((felt[0] + FRICTION * felt[2]).abs() < 1e-3, "{t}: {felt}");
        }
        if t > 0.1 && felt[0] > 0.0 && turned_by.is_none() {
            turned_by = Some(0.02 - x);
        }
        // The spring is stretched by mu N / K: no jump anywhere but K v T.
        if i > 5 {
            assert!((felt[0] - last).abs() < 0.21, "{t}: {last} to {}", felt[0]);
        }
        last = felt[0];
    }
    let stretch = FRICTION * depth;
    let turned_by = turned_by.expect("the force turns");
    assert!(turned_by < 1.2 * stretch, "{turned_by} m");
}

#[test]
fn obstacles_without_friction_give_the_same_bits_beside_rough_ones() {
    let mut rough = World::clone(&box_on_table());
    rough.obstacles.push(box_obstacle(
        "rough",
        Vector3::new(0.1, 0.1, 0.1),
        Vector3::new(3.0, 0.0, 0.0),
    ));
    // A shaded obstacle: in both worlds every pair that faces becomes a row, friction or not.
    rough.obstacles[1].surface.shading = Some(ForceShading { crease_angle: 0.5 });
    let smooth = rough.clone();
    rough.obstacles[1].surface.friction = 0.7;
    let start = at(0.0, 0.0, HALF_HEIGHT + 1e-4);
    let mut a = Loops::new(Arc::new(rough), start);
    let mut b = Loops::new(Arc::new(smooth), start);
    for i in 0..400 {
        let t = f64::from(i) * 1e-3;
        let device = Pose::new(
            Vector3::new(0.05 * (9.0 * t).sin(), 0.03 * t, 0.006 * (20.0 * t).cos()),
            Vector3::new(t, 0.3 * t, -t),
        );
        assert_eq!(a.both(&device), b.both(&device));
        assert_eq!(a.god_object.pose(), b.god_object.pose());
    }
}

/// A closed path: rest above the table, down, harmonics sideways and in turning, up again.
fn closed_path(amplitudes: &[f64; 12], share: f64) -> Pose {
    let ramp = (FRAC_PI_2 * (share * 10.0).min((1.0 - share) * 10.0).clamp(0.0, 1.0)).sin();
    let wave = |k: usize| {
        amplitudes[2 * k] * (TAU * share).sin() + amplitudes[2 * k + 1] * (2.0 * TAU * share).sin()
    };
    Pose::new(
        Vector3::new(
            6e-3 * wave(0),
            6e-3 * wave(1),
            HALF_HEIGHT + 1e-3 - 4e-3 * ramp * (1.0 + 0.5 * wave(2)),
        ),
        Vector3::new(0.08 * wave(3), 0.08 * wave(4), 0.3 * wave(5)),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn friction_never_gives_energy_on_a_closed_path(
        amplitudes in prop::array::uniform12(-1.0f64..1.0),
        friction in 0.05f64..1.2,
        period in 1usize..5,
    ) {
        let mut loops = Loops::new(rough_table(friction), at(0.0, 0.0, HALF_HEIGHT + 1.1e-3));
        let steps = 3000;
        let (mut given, mut exchanged) = (0.0, 0.0);
        let mut last: Option<(Pose, Vector6)> = None;
        for i in 0..=steps {
            let device = closed_path(&amplitudes, i as f64 / f64::from(steps));
            if i % period as i32 == 0 {
                loops.update(&device);
            }
            let felt = loops.feel(&device);
            prop_assert!(!felt.saturated);
            if let Some((pose, wrench)) = last {
                let moved = god_object::spatial::pose_difference(&device, &pose, &Vector3::zeros());
                // Trapezoids: the work of a force that is sampled finely enough, not of a held one.
                let work = 0.5 * (felt.wrench + wrench).dot(&moved);
                given += work;
                exchanged += work.abs();
            }
            last = Some((device, felt.wrench));
        }
        prop_assert!(given <= 1e-3 * exchanged, "{given} J of {exchanged} J");
    }
}
