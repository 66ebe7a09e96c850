//! Implicit constraints against closed forms: the force when the hand has turned far from a body that is held.
//!
//! The reference is the pose at which the body would come to rest, `min |x_h - x|_M^2` over poses that touch, found by one-
//! or three-dimensional search on the true geometry; its force is `k_h k_s M (x - x_h)`.

use crate::geometry_shapes;
use crate::shape_support::Form;

use std::sync::Arc;

use crate::support::{box_body, box_mesh, box_obstacle, box_on_table, penetrates};
use god_object::nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use god_object::spatial::{angular, linear, six};
use god_object::{Coupling, GodObject, Obstacle, Pose, RotationMetric, Settings, Vector6, World};

const HALF: Vector3<f64> = Vector3::new(0.02, 0.02, 0.01);
/// Radius of gyration where a test asks for the same inertia about every axis, m.
const GYRATION: f64 = 0.02;
/// How deep the device is below the height at which the body touches, m.
const DEPTH: f64 = 3e-3;

fn settings(rounds: u32) -> Settings {
    Settings {
        implicit_rounds: rounds,
        force_limit: 1e6,
        torque_limit: 1e6,
        ..Settings::for_size(0.04)
    }
}

/// The wrench of one coupling step on the set collected at `start`.
fn felt(world: &Arc<World>, settings: Settings, start: &Pose, device: &Pose) -> Vector6 {
    let god_object = GodObject::new(world.clone(), settings, *start).expect("a free start");
    let felt = Coupling::new(world, &settings).step(0.0, device, god_object.constraint_set());
    assert!(felt.kkt < 1e-9, "{}", felt.kkt);
    felt.wrench
}

/// Height of the box's middle over its lowest corner.
fn height(rotation: &Rotation3<f64>) -> f64 {
    let low = rotation.matrix().row(2).map(f64::abs);
    low.transpose().dot(&HALF)
}

/// `f` at its minimum over [low, high], where it has one; golden section.
fn minimum(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..90 {
        let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
        if f(a) < f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}

/// Relative errors of the wrench for 0 to 3 rounds, torque made a force by the body's half side.
fn errors(
    world: &Arc<World>,
    change: impl Fn(&mut Settings),
    start: &Pose,
    device: &Pose,
    reference: &Vector6,
) -> [f64; 4] {
    let size = |w: &Vector6| linear(w).norm() + angular(w).norm() / HALF.x;
    [0, 1, 2, 3].map(|rounds| {
        let mut settings = settings(rounds);
        change(&mut settings);
        size(&(felt(world, settings, start, device) - reference)) / size(reference)
    })
}

#[test]
fn box_pivoting_on_an_edge_converges_to_the_closed_form() {
    let world = box_on_table();
    let settings = settings(0);
    let inertia = world.body.inertia[(1, 1)];
    let about = |angle: f64| Rotation3::from_scaled_axis(Vector3::y() * angle);
    for (tilt, turn) in [
        (20.0, 10.0),
        (20.0, 30.0),
        (20.0, 60.0),
        (70.0, -30.0),
        (70.0, -60.0),
    ] {
        let (tilt, turn) = (f64::to_radians(tilt), f64::to_radians(turn));
        let touching = |angle: f64| height(&about(angle)) + settings.rest_distance;
        let pose = |angle: f64, z: f64| {
            Pose::from_parts(Vector3::new(0.0, 0.0, z).into(), about(angle).into())
        };
        let start = pose(tilt, touching(tilt));
        let goal = tilt + turn;
        let device_z = touching(goal) - DEPTH;
        let cost =
            |angle: f64| (touching(angle) - device_z).powi(2) + inertia * (angle - goal).powi(2);
        let rest = minimum(goal - 0.5, goal + 0.5, cost);
        let stiffness = settings.k_h * settings.k_s;
        let reference = six(
            &(Vector3::z() * (touching(rest) - device_z) * stiffness),
            &(Vector3::y() * inertia * (rest - goal) * stiffness),
        );
        let errors = errors(&world, |_| (), &start, &pose(goal, device_z), &reference);
        println!("edge from {tilt:.2} by {turn:.2} rad: {errors:.5?}");
        assert!(errors[1] < 0.65 * errors[0], "{errors:?}");
        assert!(errors[2] < 0.35 * errors[1], "{errors:?}");
        assert!(errors[3] < 0.03 * errors[0], "{errors:?}");
    }
}

#[test]
fn box_pivoting_on_a_corner_converges_to_the_true_minimum() {
    let world = box_on_table();
    let isotropic = |settings: &mut Settings| {
        settings.rotation_metric = RotationMetric::RadiusOfGyration(GYRATION);
    };
    let settings = settings(0);
    let start_rotation = Rotation3::from_euler_angles(0.5, 0.6, 0.2);
    let at = |rotation: &Rotation3<f64>, z: f64| {
        Pose::from_parts(
            Vector3::new(0.0, 0.0, z).into(),
            UnitQuaternion::from_rotation_matrix(rotation),
        )
    };
    for turn in [10.0, 20.0, 40.0, 60.0_f64] {
        for axis in [
            Vector3::new(0.3, 0.2, 1.0),
            Vector3::new(0.6, -0.3, 1.0),
            Vector3::new(-0.4, 0.5, 0.8),
        ] {
            let touching = |r: &Rotation3<f64>| height(r) + settings.rest_distance;
            let goal =
                Rotation3::from_scaled_axis(axis.normalize() * turn.to_radians()) * start_rotation;
            let start = at(&start_rotation, touching(&start_rotation));
            let device_z = touching(&goal) - DEPTH;
            // Newton by finite differences from the device's rotation: v turns it back.
            let cost = |v: &Vector3<f64>| {
                let z = touching(&(Rotation3::from_scaled_axis(*v) * goal));
                (z - device_z).powi(2) + GYRATION.powi(2) * v.norm_squared()
            };
            let rest = descend(cost);
            let rest_rotation = Rotation3::from_scaled_axis(rest) * goal;
            let stiffness = settings.k_h * settings.k_s;
            let reference = six(
                &(Vector3::z() * (touching(&rest_rotation) - device_z) * stiffness),
                &(rest * GYRATION.powi(2) * stiffness),
            );
            let errors = errors(&world, isotropic, &start, &at(&goal, device_z), &reference);
            println!("corner by {turn:.2} degrees: {errors:.5?}");
            assert!(errors[1] < 0.15 * errors[0], "{errors:?}");
            assert!(errors[2] < 0.25 * errors[1], "{errors:?}");
            assert!(errors[3] < 5e-3, "{errors:?}");
        }
    }
}

/// The minimum of a smooth function of three unknowns near zero: Newton with central differences.
fn descend(f: impl Fn(&Vector3<f64>) -> f64) -> Vector3<f64> {
    let step = 1e-4;
    let mut x = Vector3::zeros();
    for _ in 0..30 {
        let at = |i: usize, a: f64, j: usize, b: f64| {
            let mut y = x;
            y[i] += a;
            y[j] += b;
            f(&y)
        };
        let gradient =
            Vector3::from_fn(|i, _| (at(i, step, i, 0.0) - at(i, -step, i, 0.0)) / (2.0 * step));
        let hessian = Matrix3::from_fn(|i, j| {
            (at(i, step, j, step) - at(i, step, j, -step) - at(i, -step, j, step)
                + at(i, -step, j, -step))
                / (4.0 * step * step)
        });
        x -= hessian.try_inverse().expect("curved") * gradient;
    }
    x
}

/// The force where the god-object has come to rest under `device`: the method's own answer, without any rotation left to linearise.
fn at_rest(world: &Arc<World>, start: &Pose, device: &Pose) -> Vector6 {
    let settings = settings(0);
    let mut god_object = GodObject::new(world.clone(), settings, *start).expect("a free start");
    for _ in 0..3000 {
        god_object.step(device, None);
    }
    assert!(!penetrates(world, god_object.pose()));
    Coupling::new(world, &settings)
        .step(0.0, device, god_object.constraint_set())
        .wrench
}

#[test]
fn box_on_a_cylinder_and_box_in_a_groove_come_nearer_to_the_force_at_rest() {
    // A box on a prism with 32 sides, and in a groove of two slabs.
    let cylinder = Obstacle {
        mesh: prism(0.03, 0.1, 32),
        ..box_obstacle("cylinder", HALF, Vector3::zeros())
    };
    let on_cylinder = Arc::new(World {
        body: box_body(HALF),
        obstacles: vec![cylinder],
    });
    let slab = |side: f64| Obstacle {
        mesh: box_mesh(Vector3::new(0.1, 0.1, 0.01)),
        pose: Pose::from_parts(
            (Rotation3::from_axis_angle(&Vector3::y_axis(), side * 0.6)
                * Vector3::new(side * -0.09, 0.0, -0.01)
                + Vector3::new(side * -0.001, 0.0, 0.0))
            .into(),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), side * 0.6),
        ),
        ..box_obstacle("slab", HALF, Vector3::zeros())
    };
    let in_groove = Arc::new(World {
        body: box_body(HALF),
        obstacles: vec![slab(1.0), slab(-1.0)],
    });
    let size = |w: &Vector6| linear(w).norm() + angular(w).norm() / HALF.x;
    for (name, world, z) in [
        ("cylinder", on_cylinder, 0.0405),
        ("groove", in_groove, 0.03),
    ] {
        let mut start = Pose::translation(0.0, 0.0, z);
        let above = Pose::translation(0.0, 0.0, z - 0.012);
        let mut settle = GodObject::new(world.clone(), settings(0), start).expect("free");
        for _ in 0..500 {
            settle.step(&above, None);
        }
        start = *settle.pose();
        for turn in [5.0, 10.0, 20.0_f64] {
            let device = Pose::from_parts(
                (start.translation.vector - Vector3::z() * DEPTH).into(),
                UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn.to_radians()),
            );
            let reference = at_rest(&world, &start, &device);
            let errors = [0, 1, 2, 3].map(|rounds| {
                size(&(felt(&world, settings(rounds), &start, &device) - reference))
                    / size(&reference)
            });
            println!("{name} by {turn} degrees: {errors:.5?}");
            // On the cylinder the facet that the box rolls to is not in the set: no round can know it.
            assert!(errors[1] < 0.7 * errors[0], "{errors:?}");
            assert!(errors[3] < 0.75 * errors[0], "{errors:?}");
        }
    }
}

/// A prism about the y axis.
fn prism(radius: f64, half_length: f64, sides: u32) -> god_object::Mesh {
    let (vertices, triangles) = geometry_shapes::peg(radius, half_length, sides);
    let about_y = vertices.iter().map(|v| v.coords.yzx().into()).collect();
    geometry_shapes::mesh((about_y, triangles))
}

#[test]
fn without_rotation_the_rounds_change_no_bit() {
    let world = box_on_table();
    let start = Pose::translation(0.0, 0.0, 0.0101);
    let device = Pose::translation(0.003, -0.002, 0.004);
    let linear = felt(&world, settings(0), &start, &device);
    assert!(linear[2] > 1.0);
    for rounds in 1..=3 {
        assert_eq!(felt(&world, settings(rounds), &start, &device), linear);
    }
}

/// Sub-steps in which the box follows a device that turns it about its lower edge by 0.9 rad at once, for 0 to 2 rounds.
fn substeps_of_a_pivot(k_s: f64) -> [u32; 3] {
    let world = box_on_table();
    let turned = |angle: f64, z: f64| Pose::new(Vector3::new(0.0, 0.0, z), Vector3::y() * angle);
    [0, 1, 2].map(|rounds| {
        let settings = Settings {
            k_s,
            ..settings(rounds)
        };
        let start = turned(
            0.3,
            height(&Rotation3::from_scaled_axis(Vector3::y() * 0.3)) + 2e-5,
        );
        let mut god_object = GodObject::new(world.clone(), settings, start).expect("a free start");
        let mut substeps = 0;
        for _ in 0..40 {
            let report = god_object.step(&turned(1.2, 0.015), None);
            assert!(report.gap_min >= settings.minimum_gap);
            assert!(!penetrates(&world, god_object.pose()));
            substeps += report.substeps;
            if god_object.pose().rotation.angle() > 1.3 {
                return substeps;
            }
        }
        panic!("the body does not follow");
    })
}

/// With rounds one update gets much farther before it must look again.
#[test]
fn a_body_that_pivots_needs_fewer_sub_steps() {
    let substeps = substeps_of_a_pivot(0.5);
    println!("sub-steps for 0 to 2 rounds: {substeps:?}");
    assert!(substeps[1] * 6 < substeps[0] * 5, "{substeps:?}");
    assert!(substeps[2] * 4 < substeps[0] * 3, "{substeps:?}");
}

/// Over the whole of so long a way the rounds do not come to rest, over half of it they do.
#[test]
fn a_way_too_long_for_rounds_is_made_in_halves() {
    let substeps = substeps_of_a_pivot(1.0);
    println!("sub-steps for 0 to 2 rounds: {substeps:?}");
    assert!(substeps[1] < 2 * substeps[0], "{substeps:?}");
    assert!(substeps[2] < 2 * substeps[0], "{substeps:?}");
}

/// Far round, each round of the three is longer than the one before: they end anywhere, and the force must then not be theirs.
#[test]
fn on_a_long_bar_that_is_swept_far_rounds_that_do_not_converge_give_way_to_the_linear_rows() {
    let gyration = 0.05;
    let half = Vector3::new(0.1, 0.005, 0.005);
    let world = Arc::new(World {
        body: box_body(half),
        ..World::clone(&box_on_table())
    });
    let settings = |rounds: u32| Settings {
        rotation_metric: RotationMetric::RadiusOfGyration(gyration),
        ..settings(rounds)
    };
    let tilt = UnitQuaternion::from_scaled_axis(Vector3::y() * 0.3);
    let low = tilt.to_rotation_matrix().matrix().row(2).map(f64::abs);
    let up = low.transpose().dot(&half) + settings(0).rest_distance;
    let start = Pose::from_parts(Vector3::new(0.0, 0.0, up).into(), tilt);
    let size = |w: &Vector6| linear(w).norm() + angular(w).norm() / gyration;
    let mut last: Option<Vector6> = None;
    for k in 0..=500 {
        let turn = 0.005 * f64::from(k);
        let device = Pose::from_parts(
            Vector3::new(0.0, 0.0, up - DEPTH).into(),
            UnitQuaternion::from_scaled_axis(Vector3::y() * turn) * tilt,
        );
        let [linear, rounds] = [0, 3].map(|rounds| felt(&world, settings(rounds), &start, &device));
        if let Some(last) = last {
            let step = size(&(rounds - last)) / size(&linear);
            assert!(step < 0.1, "a step of {step} at {turn} rad");
        }
        last = Some(rounds).filter(|_| turn > 0.2);
        if turn > 2.3 {
            let apart = size(&(rounds - linear)) / size(&linear);
            assert!(apart < 1e-12, "{apart} from the linear rows at {turn} rad");
        }
    }
}

/// A bar between pins with a little play, and a hand that winds it up: sets that were made before the bar came to the pins have rounds, those of the
/// bar at rest have none, and both pull the same way.
#[test]
fn a_hand_that_winds_up_a_held_bar_feels_no_jump_where_rounds_set_in() {
    let half = Vector3::new(0.05, 0.005, 0.005);
    let (radius, arm, play) = (0.004, 0.04, 1e-4);
    let up = half.z + radius + play;
    let pins = [(arm, up), (arm, -up), (-arm, up), (-arm, -up)];
    let pin = |(x, z): (f64, f64)| {
        Form::Cylinder(radius, 0.02).obstacle("pin", Pose::translation(x, 0.0, z))
    };
    let world = Arc::new(World {
        body: box_body(half),
        obstacles: pins.map(pin).into(),
    });
    let loops = |rounds: u32| Settings {
        adaptation: None,
        rotation_metric: RotationMetric::RadiusOfGyration(GYRATION),
        ..settings(rounds)
    };
    let god_object =
        || GodObject::new(world.clone(), loops(2), Pose::identity()).expect("a free start");
    let (in_the_middle, mut at_the_pins) = (god_object(), god_object());
    let mut couplings = [0, 2].map(|rounds| Coupling::new(&world, &loops(rounds)));
    let stiffness = loops(2).stiffness(1.0) * GYRATION * GYRATION;
    let (step, off) = (1_f64.to_radians(), play / arm);
    let mut last = [Vector3::zeros(); 2];
    for degrees in 0..=345 {
        let turn = f64::from(degrees).to_radians();
        let device = Pose::rotation(Vector3::y() * turn);
        at_the_pins.step(&device, None);
        let set = if degrees / 10 % 2 == 0 {
            at_the_pins.constraint_set()
        } else {
            in_the_middle.constraint_set()
        };
        let torques = couplings
            .each_mut()
            .map(|coupling| angular(&coupling.step(turn, &device, set).wrench));
        let [linear, rounds] = torques;
        assert!(
            (linear - rounds).norm() <= 0.1 * stiffness * off,
            "{rounds} N m instead of {linear} N m at {degrees} degrees"
        );
        for (torque, last) in torques.iter().zip(&mut last) {
            // The pull's slope is below 1.5, and from the middle the bar has the way to the pins before it.
            let jump = (torque - std::mem::replace(last, *torque)).norm();
            assert!(
                jump <= stiffness * (1.5 * (step + off) + off),
                "a step of {jump} N m at {degrees} degrees"
            );
        }
    }
}
