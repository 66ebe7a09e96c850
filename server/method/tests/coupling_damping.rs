//! Contact damping: along the contacts that hold the body, and nowhere else.

use crate::support;

use god_object::nalgebra::Vector3;
use god_object::{Coupling, Pose, Settings};

const TICK: f64 = 1e-3;
const DAMPING_TIME: f64 = 0.01;

fn settings(damping_time: f64) -> Settings {
    Settings {
        damping_time,
        adaptation: None,
        ..Settings::for_size(0.1)
    }
}

/// Force after the device has gone from `from` for ten ticks with `velocity`.
fn force(damping_time: f64, from: Vector3<f64>, velocity: Vector3<f64>) -> (Vector3<f64>, f64) {
    let settings = settings(damping_time);
    let world = support::box_on_table();
    let set = support::floor(&settings);
    let mut coupling = Coupling::new(&world, &settings);
    let mut force = Vector3::zeros();
    for tick in 0..10 {
        let time = f64::from(tick) * TICK;
        let device = Pose::from_parts((from + velocity * time).into(), Default::default());
        let wrench = coupling.step(time, &device, &set).wrench;
        force = Vector3::from(wrench.fixed_rows::<3>(0));
    }
    (force, settings.stiffness(world.body.mass))
}

#[test]
fn a_wall_damps_as_its_stiffness_times_the_damping_time() {
    let (from, velocity) = (Vector3::z() * -2e-3, Vector3::z() * -0.05);
    let (damped, stiffness) = force(DAMPING_TIME, from, velocity);
    let (spring, _) = force(0.0, from, velocity);
    let added = damped - spring;
    let expected = Vector3::z() * (stiffness * DAMPING_TIME * 0.05);
    assert!((added - expected).norm() < 1e-9, "{added}");
}

#[test]
fn a_motion_along_a_surface_is_not_braked() {
    let velocity = Vector3::new(0.2, -0.1, 0.0);
    let (damped, _) = force(DAMPING_TIME, Vector3::z() * -2e-3, velocity);
    let (spring, _) = force(0.0, Vector3::z() * -2e-3, velocity);
    assert!((damped - spring).norm() < 1e-12 && damped.z > 1.0);
}

#[test]
fn what_leaves_is_not_pulled_back_and_what_touches_nothing_feels_nothing() {
    let leaving = force(DAMPING_TIME, Vector3::z() * -3e-3, Vector3::z() * 0.3).0;
    assert_eq!(leaving, Vector3::zeros());
    let coming = force(DAMPING_TIME, Vector3::z() * 3e-3, Vector3::z() * -0.3).0;
    assert_eq!(coming, Vector3::zeros());
}

#[test]
fn a_device_that_stands_feels_the_spring_alone() {
    let settings = settings(DAMPING_TIME);
    let world = support::box_on_table();
    let set = support::floor(&settings);
    let mut coupling = Coupling::new(&world, &settings);
    let at = |z: f64| Pose::translation(0.0, 0.0, z);
    coupling.step(0.0, &at(0.0), &set);
    let moving = coupling.step(TICK, &at(-2e-3), &set).wrench[2];
    // The same sample again, as when a new set arrives: the velocity is still known.
    let again = coupling.step(1.2 * TICK, &at(-2e-3), &set).wrench[2];
    let standing = coupling.step(3.0 * TICK, &at(-2e-3), &set).wrench[2];
    let spring = settings.stiffness(world.body.mass) * 2e-3;
    assert!((standing - spring).abs() < 1e-9, "{standing} {spring}");
    assert!(moving > spring + 1.0 && (again - moving).abs() < 1e-12);
    // A stall tells no velocity.
    let late = coupling.step(0.1, &at(-3e-3), &set).wrench[2];
    assert!((late - 1.5 * spring).abs() < 1e-9);
}
