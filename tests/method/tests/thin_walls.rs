//! Thin plates, fast bodies and the wrong side of a wall: where methods pop through.

use std::f64::consts::PI;
use std::sync::Arc;

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::spatial::six;
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Point3, Vector3};
use taut_method_tests::checker::PenetrationChecker;
use taut_method_tests::motion::Led;
use taut_method_tests::solids::{body, cells, mesh, obstacle, world};
use taut_scene::shapes::{Axis, cuboid, cylinder};

/// K_t of 1 kg and the default gains, N/m.
const STIFFNESS: f64 = 1000.0;

/// A cube of this half side, and a plate whose upper face is z = 0.
fn cube_over_plate(half: f64, thickness: f64, side: f64) -> Arc<World> {
    let plate = mesh(cuboid([side, side, 0.5 * thickness]));
    let below = Pose::translation(0.0, 0.0, -0.5 * thickness);
    let plate = obstacle("plate", plate, below);
    world(body(mesh(cuboid([half; 3]))), [plate])
}

/// Across the plate alone, and there what the depth asks for, to the limit; lengths of a metre are `scale` metres.
fn assert_force(wrench: &Vector6, depth: f64, settings: &Settings, scale: f64, time: f64) {
    assert!(wrench.fixed_rows::<2>(0).norm() <= 1e-6 * scale, "{wrench}");
    let (force, expected) = (wrench[2], STIFFNESS * depth);
    if expected > settings.force_limit {
        assert!(
            (force - settings.force_limit).abs() <= 1e-9 * settings.force_limit,
            "{force} N at {time} s"
        );
    } else if expected < -STIFFNESS * 2.0 * settings.rest_distance {
        assert_eq!(force, 0.0, "a force in the air at {time} s");
    } else {
        let slack = STIFFNESS * (2.0 * settings.rest_distance + 1e-9 * scale);
        assert!((force - expected).abs() <= slack, "{force}, not {expected}");
    }
}

/// A cube is pushed through a plate, stays below it, slides there and comes back. Lengths of a metre are `scale` metres.
fn pushed_through(thickness: f64, scale: f64) {
    let half = 0.005 * scale;
    let lowest = -half;
    let world = cube_over_plate(half, thickness * scale, 0.1 * scale);
    let checker = PenetrationChecker::new(&world);
    let mut settings = Settings::for_size(2.0 * half);
    settings.force_limit = 20.0 * scale;
    settings.torque_limit *= scale * scale;
    let (speed, period) = (0.1 * scale, 0.01);
    let at = |x: f64, z: f64| Pose::translation(x, 0.0, z);
    let depth = 0.05 * scale;
    let mut led = Led::in_world(world, &settings, at(0.0, depth));
    let (mut time, mut last_force) = (0.0, 0.0_f64);
    let mut device = Vector3::new(0.0, 0.0, depth);
    let corners = [
        Vector3::new(0.0, 0.0, -depth),
        Vector3::new(0.0, 0.0, -depth - 1e-9 * scale),
        Vector3::new(depth, 0.0, -depth),
        Vector3::new(-depth, 0.0, -depth),
        Vector3::new(-depth, 0.0, depth),
    ];
    for corner in corners {
        loop {
            let way = corner - device;
            let step = way.norm().min(speed * period);
            if step == 0.0 {
                break;
            }
            device += way * (step / way.norm());
            time += period;
            let sample = led.step(time, &at(device.x, device.z));
            assert!(
                sample.god_object.translation.z + lowest >= settings.minimum_gap,
                "through the plate at {time} s: {}",
                sample.god_object
            );
            assert!(checker.penetrated(&sample.god_object).is_none());
            assert_force(&sample.wrench, -(device.z + lowest), &settings, scale, time);
            let force = sample.wrench[2];
            assert!(
                (force - last_force).abs() <= 1.5 * STIFFNESS * speed * period,
                "{last_force} to {force} N at {time} s"
            );
            last_force = force;
        }
        // It stays for a while.
        for _ in 0..20 {
            time += period;
            let sample = led.step(time, &at(device.x, device.z));
            assert!((sample.wrench[2] - last_force).abs() <= 1e-6 * settings.force_limit);
        }
    }
    assert_eq!(last_force, 0.0);
}

#[test]
fn a_plate_of_a_millimetre_holds_whatever_is_pushed_at_it() {
    pushed_through(1e-3, 1.0);
}

#[test]
fn a_plate_of_a_tenth_of_a_millimetre_holds_whatever_is_pushed_at_it() {
    pushed_through(1e-4, 1.0);
}

#[test]
fn a_plate_holds_when_everything_is_a_thousand_times_smaller_or_larger() {
    pushed_through(1e-3, 1e-3);
    pushed_through(1e-3, 1e3);
}

#[test]
fn a_fast_cube_stops_at_a_thin_plate() {
    let plate = mesh(cuboid([0.1, 0.1, 0.05e-3]));
    let plate = obstacle("plate", plate, Pose::identity());
    let world = world(body(mesh(cuboid([0.5e-3; 3]))), [plate]);
    let settings = Settings {
        k_s: 1.0,
        ..Settings::for_size(1e-3)
    };
    let top = 0.05e-3 + 0.5e-3;
    for speed in [0.5, 2.0, 5.0] {
        // At 70 updates a second a step is up to 71 mm.
        let step = speed / 70.0;
        let mut led = Led::in_world(
            world.clone(),
            &settings,
            Pose::translation(0.001, 0.002, top + 2.3 * step),
        );
        for k in 1..8 {
            let z = top + (2.3 - f64::from(k)) * step;
            let sample = led.step(f64::from(k) / 70.0, &Pose::translation(0.001, 0.002, z));
            let above = sample.god_object.translation.z - top;
            assert!(above >= settings.minimum_gap, "{speed} m/s: {above}");
            if z < top {
                assert!(above <= 1e-5, "{speed} m/s: stops {above} m above");
            }
        }
    }
}

#[test]
fn a_spinning_bar_stops_at_a_pin() {
    let (pin_radius, pin_at, half_width) = (1e-3, 0.09, 1e-3);
    let bar = mesh(cuboid([0.1, half_width, half_width]));
    let facets = 256;
    let pin = mesh(cylinder(pin_radius, 0.01, facets, Axis::Z));
    // 25 rad/s at 70 Hz: 20 degrees a step. The pin stands 15 degrees away.
    let away = 15.0_f64.to_radians();
    let motion = Motion {
        start: Pose::identity(),
        displacement: six(&Vector3::zeros(), &(Vector3::z() * 20.0_f64.to_radians())),
        reference_point: Point3::origin(),
    };
    let settings = AdvancementSettings::default();
    let found = time_of_impact(
        &bar,
        &motion,
        &pin,
        &Pose::translation(pin_at * away.cos(), pin_at * away.sin(), 0.0),
        &settings,
        &mut CollisionWorkspace::new(),
        &mut Work::default(),
    );
    let TimeOfImpact::Impact { time } = found else {
        panic!("{found:?}")
    };
    // The bar's side comes to the pin where the pin's axis is both half widths from the bar's.
    let exact = (away - ((pin_radius + half_width) / pin_at).asin()) / 20.0_f64.to_radians();
    let sagitta = pin_radius * (1.0 - (PI / facets as f64).cos());
    let path = pin_at * 20.0_f64.to_radians();
    let early = (exact - time) * path;
    assert!(
        (-sagitta..=1e-5).contains(&early),
        "{early} m early, {sagitta} m of sagitta"
    );
}

/// A wall of a millimetre, 0.1 m deep, open at its upper end: the walls of a U.
#[test]
fn a_body_inside_a_u_stays_inside_until_the_hand_has_walked_round_its_end() {
    let planes_x = [-0.021, -0.020, 0.020, 0.021];
    let u_shape = cells(
        [&planes_x, &[-0.05, 0.05], &[-0.001, 0.0, 0.1]],
        |[i, _, k]| k == 0 || i != 1,
    );
    let half = 0.004;
    let u_shape = obstacle("u", mesh(u_shape), Pose::identity());
    let world = world(body(mesh(cuboid([half; 3]))), [u_shape]);
    let checker = PenetrationChecker::new(&world);
    let settings = Settings::for_size(2.0 * half);
    let mut led = Led::in_world(world, &settings, Pose::translation(0.0, 0.0, 0.03));
    let corners = [
        (0.045, 0.03),
        (0.045, 0.0301),
        (0.045, 0.115),
        (0.045, 0.13),
    ];
    let (mut x, mut z, mut time) = (0.0_f64, 0.03_f64, 0.0);
    for (to_x, to_z) in corners {
        let steps = ((to_x - x).hypot(to_z - z) / 1e-3).ceil().max(40.0);
        let (dx, dz) = ((to_x - x) / steps, (to_z - z) / steps);
        for _ in 0..steps as usize {
            (x, z, time) = (x + dx, z + dz, time + 0.01);
            let sample = led.step(time, &Pose::translation(x, 0.0, z));
            assert!(checker.penetrated(&sample.god_object).is_none());
            let place = sample.god_object.translation;
            // The hand is behind the wall: the body is not, and the force points back.
            if x > 0.02 && place.z + half < 0.0999 {
                assert!(
                    place.x <= 0.02 - half,
                    "left the U at {time} s: {}",
                    sample.god_object
                );
                assert!(sample.wrench[0] < 0.0, "{} at {time} s", sample.wrench);
                assert!(
                    sample.wrench[2].abs() <= 1e-6,
                    "{} at {time} s",
                    sample.wrench
                );
            }
        }
    }
    let end = led.pose().translation;
    assert!(
        (end.x - 0.045).abs() < 1e-3 && (end.z - 0.13).abs() < 1e-3,
        "{end}"
    );
}
