//! Gears and threads: many contacts that lie on each other, with the answers of their own geometry.

use std::f64::consts::TAU;

use god_object::spatial::angular;
use god_object::{Pose, Settings};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use taut_method_tests::checker::PenetrationChecker;
use taut_method_tests::machined::{Thread, gears};
use taut_method_tests::motion::Led;
use taut_method_tests::solids::{body, mesh, obstacle, world};

fn turned(angle: f64, z: f64) -> Pose {
    Pose::from_parts(
        Translation3::new(0.0, 0.0, z),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle),
    )
}

#[test]
fn a_gear_turns_freely_through_its_backlash_and_then_is_stiff() {
    let (turning, standing, place) = gears(24);
    let held = body(mesh(turning.mesh()));
    let (inertia, base) = (held.inertia[(2, 2)], turning.base_radius());
    let world = world(held, [obstacle("gear", mesh(standing.mesh()), place)]);
    let checker = PenetrationChecker::new(&world);
    let settings = Settings::for_size(0.044);
    let gain = settings.k_h * settings.k_s;
    let play = turning.set_back / turning.pitch_radius() - settings.rest_distance / base;
    let mut led = Led::in_world(world, &settings, Pose::identity());
    let mut time = 0.0;
    for side in [1.0, -1.0] {
        let mut stiff = 0;
        for k in 0..=75 {
            // Up to 0.015 rad, there in 75 ms; each angle held until the body has come to rest.
            let angle = side * 2e-4 * f64::from(k);
            let device = turned(angle, 0.0);
            let mut sample = led.step(time, &device);
            for _ in 0..25 {
                time += 1e-3;
                sample = led.step(time, &device);
            }
            assert!(
                checker.penetrated(&sample.god_object).is_none(),
                "{angle} rad"
            );
            let torque = angular(&sample.wrench).z;
            let beyond = angle.abs() - play;
            let expected =
                -side * gain * base * base * beyond.max(0.0) / (1.0 + base * base / inertia);
            // Facets of the flanks, and the rest distance at the second pair of teeth.
            let slack = 0.02 * expected.abs() + gain * base * 3.0 * settings.rest_distance;
            assert!(
                (torque - expected).abs() <= slack,
                "at {angle} rad: {torque} N m, not {expected}"
            );
            stiff += i32::from(beyond > 2e-3);
        }
        assert!(stiff > 30);
        for k in (0..75).rev() {
            time += 1e-3;
            led.step(time, &turned(side * 2e-4 * f64::from(k), 0.0));
        }
    }
}

/// M10 x 1.5, 64 facets a turn, 0.2 mm of radial clearance, without friction.
struct NutOnBolt {
    thread: Thread,
    led: Led,
    checker: PenetrationChecker,
    settings: Settings,
    inertia: f64,
    start: f64,
    time: f64,
}

impl NutOnBolt {
    const CLEARANCE: f64 = 0.2e-3;
    const MASS: f64 = 1.0;

    fn new() -> Self {
        let thread = Thread {
            major_radius: 5e-3,
            pitch: 1.5e-3,
            facets: 64,
        };
        let nut = body(mesh(thread.nut(2, Self::CLEARANCE, 8e-3)));
        let inertia = nut.inertia[(2, 2)];
        let bolt = obstacle("bolt", mesh(thread.bolt(7)), Pose::identity());
        let world = world(nut, [bolt]);
        let settings = Settings::for_size(0.016);
        let start = thread.pitch;
        Self {
            checker: PenetrationChecker::new(&world),
            led: Led::in_world(world, &settings, turned(0.0, start)),
            thread,
            settings,
            inertia,
            start,
            time: 0.0,
        }
    }

    /// How far the nut goes along the bolt before the flanks touch, m.
    fn axial_play(&self) -> f64 {
        Self::CLEARANCE / Thread::SLOPE
    }

    fn angle(&self) -> f64 {
        self.led.pose().rotation.scaled_axis().z
    }
}

#[test]
fn a_nut_advances_by_its_pitch_while_it_is_turned_and_pulled_back() {
    let mut scene = NutOnBolt::new();
    let pitch = scene.thread.pitch;
    // Half a turn a second, three turns; the hand stays half a millimetre behind.
    let (period, behind, turns) = (5e-3, 0.5e-3, 3.0);
    let steps = (turns / 0.5 / period) as u32;
    let mut compared = 0;
    for step in 0..=steps {
        let turned_by = 0.5 * period * f64::from(step);
        scene.time += period;
        let device = turned(TAU * turned_by, scene.start + pitch * turned_by - behind);
        let sample = scene.led.step(scene.time, &device);
        if step % 20 == 0 {
            assert!(
                scene.checker.penetrated(&sample.god_object).is_none(),
                "after {turned_by} turns"
            );
        }
        // The body trails the hand by an update or two when the flanks first meet.
        if step < 20 {
            continue;
        }
        let advance = sample.god_object.translation.z - scene.start - pitch * turned_by;
        assert!(
            advance.abs() <= 1.1 * scene.axial_play(),
            "{advance} m off after {turned_by} turns"
        );
        let force = sample.wrench[2];
        let expected = -scene.settings.k_h * scene.settings.k_s * (-behind - advance);
        assert!(
            (force - expected).abs() <= 0.05,
            "{force} N, not {expected}"
        );
        // An inclined plane without friction: 0.1 mN m of 0.4 N, and no more.
        let torque = angular(&sample.wrench).z;
        assert!(torque.abs() <= 1e-3, "{torque} N m after {turned_by} turns");
        compared += 1;
    }
    assert!(compared > 1000);
    let turned_by = scene.led.pose().translation.z - scene.start;
    assert!((turned_by - turns * pitch).abs() <= 1.1 * scene.axial_play());
}

#[test]
fn a_nut_that_is_pulled_does_not_jump_a_ridge() {
    let mut scene = NutOnBolt::new();
    let lead = scene.thread.pitch / TAU;
    for side in [1.0, -1.0] {
        let pull = 3e-3;
        for k in 0..=300 {
            scene.time += 1e-3;
            let way = pull * (f64::from(k) / 200.0).min(1.0);
            let sample = scene
                .led
                .step(scene.time, &turned(0.0, scene.start + side * way));
            if k % 20 == 0 {
                assert!(scene.checker.penetrated(&sample.god_object).is_none());
            }
        }
        for _ in 0..200 {
            scene.time += 1e-3;
            scene
                .led
                .step(scene.time, &turned(0.0, scene.start + side * pull));
        }
        // Without friction it turns a little: z - h phi = c at the least kinetic distance to the hand.
        let share = NutOnBolt::MASS * lead * lead / (scene.inertia + NutOnBolt::MASS * lead * lead);
        let play = scene.axial_play();
        let expected = play + share * (pull - play);
        let advance = side * (scene.led.pose().translation.z - scene.start);
        assert!(
            (advance - expected).abs() <= 0.1 * play,
            "{advance} m, not {expected}"
        );
        let slack = 0.1 * play / lead;
        let turn = side * scene.angle();
        let expected_turn = (expected - play) / lead;
        assert!(
            (turn - expected_turn).abs() <= slack,
            "{turn} rad, not {expected_turn}"
        );
    }
}
