//! The paper's scenes under a virtual clock, without a process: what the god-object does and what the hand feels.
//!
//! Poses are checked for penetration by code that shares nothing with the method. Source: Ortega et al. 2007, Figures 10 to 12.

use nalgebra::Vector3;
use taut_bridge::{MinJerkPath, ViaPoint};
use taut_method_tests::checker::PenetrationChecker;
use taut_method_tests::motion::{Sample, lead, shipped};
use taut_scene::{BuiltScene, data_file};

/// Stiffness that the hand feels in the shipped scenes, N/m.
const STIFFNESS: f64 = 1000.0;
/// The same for a peg that is in its hole, N: nothing but the lower side of the hole, which it is parallel to, touches it.
const NO_AXIAL_FORCE: f64 = 1e-9;
/// How deep the shipped hands press into what they slide on, m.
const DEPTH: f64 = 0.006;
/// Force that counts as none, N: of forces of several newtons, what rounding leaves.
const NO_FORCE: f64 = 1e-6;
/// Half the length of the shipped peg, and of the box with the hole, m.
const HALF_LENGTH: f64 = 0.030;

/// The scene's hand goes where it intends to, `rate_hz` times a second, for `duration`, s.
fn led(scene: &BuiltScene, rate_hz: f64, duration: f64) -> Vec<Sample> {
    let hand = scene.hand.as_ref().expect("the scene has a hand");
    let points = hand.path.samples().iter().map(|s| ViaPoint {
        time_s: s.time,
        pose: s.pose,
    });
    let path = MinJerkPath::new(points.collect(), hand.repeat);
    let path = path.unwrap_or_else(|error| panic!("{error}"));
    let steps = (duration * rate_hz).round() as u64;
    let intended = (0..=steps).map(|step| {
        let time = step as f64 / rate_hz;
        (time, path.at(time).0)
    });
    lead(scene, intended).collect()
}

/// No sample's pose penetrates, and no gap is below the least one.
fn assert_apart(scene: &BuiltScene, samples: &[Sample], every: usize) {
    let checker = PenetrationChecker::new(&scene.world);
    for sample in samples {
        assert!(
            sample.gap_min >= scene.settings.minimum_gap,
            "a gap of {:e} m at {} s",
            sample.gap_min,
            sample.time
        );
    }
    for sample in samples.iter().step_by(every) {
        assert_eq!(
            checker.penetrated(&sample.god_object),
            None,
            "at {} s: {}",
            sample.time,
            sample.god_object
        );
    }
}

fn force(sample: &Sample) -> Vector3<f64> {
    sample.wrench.fixed_rows::<3>(0).into()
}

fn torque(sample: &Sample) -> Vector3<f64> {
    sample.wrench.fixed_rows::<3>(3).into()
}

/// The force of a stiff surface `depth` away from where the body stands, which is `rest_distance` before it.
fn assert_force(what: &str, sample: &Sample, value: f64, depth: f64, rest_distance: f64) {
    let (least, most) = (
        STIFFNESS * (depth - rest_distance),
        STIFFNESS * (depth + 2.0 * rest_distance),
    );
    assert!(
        (least..=most).contains(&value),
        "{what} {value} N at {} s, not {least} to {most}",
        sample.time
    );
}

/// Nothing but rounding is felt of a force, N, or a torque, N m.
fn assert_none(what: &str, sample: &Sample, value: f64) {
    assert!(
        value.abs() <= NO_FORCE,
        "{what} {value} at {} s",
        sample.time
    );
}

fn between(samples: &[Sample], from: f64, to: f64) -> impl Iterator<Item = &Sample> {
    samples
        .iter()
        .filter(move |sample| (from..to).contains(&sample.time))
}

/// (a), (b): the tip, then the side, slides on the top. Nothing along the hole; the full force across, also where the peg goes
/// from one triangle to the next.
fn assert_slides_on_the_top(samples: &[Sample], rest: f64) {
    for sample in between(samples, 0.0, 11.8) {
        assert_none("F_y", sample, force(sample).y);
    }
    // From 1 s to 4.5 s, and from 7.4 s to 11 s, the hand is 6 mm deep. A peg that rolls onto a side between two facets stands
    // lower by its sagitta, 10 mm (1 - cos 2.5 degrees) = 9.5 um.
    for sample in between(samples, 1.0, 4.5).chain(between(samples, 7.4, 11.0)) {
        assert_force("F_z", sample, force(sample).z, DEPTH, rest + 9.6e-6);
    }
}

/// (c), (d): each face pushes back and never pulls, the left one in full while the hand is 6 mm deep, the right one until the hole is felt.
fn assert_faces_push_back(samples: &[Sample], rest: f64) {
    for sample in between(samples, 12.8, 17.3) {
        let along = force(sample).y;
        assert!(along <= NO_FORCE, "F_y {along} at {} s", sample.time);
    }
    for sample in between(samples, 14.3, 16.7) {
        assert_force("-F_y", sample, -force(sample).y, DEPTH, rest);
    }
    assert!(between(samples, 19.6, 22.0).all(|sample| force(sample).y >= -NO_FORCE));
    assert!(between(samples, 20.9, 21.5).all(|sample| force(sample).y > 0.99 * STIFFNESS * DEPTH));
}

/// (e): 50 mm in and out again, all on the axis of the hole but for a while at depth. The peg touches nothing or the lower
/// side, which pushes straight up: nothing along the hole, and nothing that twists the round peg, from the mouth on.
fn assert_goes_in_and_out(samples: &[Sample], rest: f64) {
    let depths = samples.iter().map(insertion);
    let deepest = depths.fold(f64::NEG_INFINITY, f64::max);
    assert!(
        (0.050 - rest..0.0501).contains(&deepest),
        "the peg went {deepest} m in"
    );
    assert!(
        insertion(&samples[samples.len() - 1]) < 0.0,
        "the peg did not come out"
    );
    let inserted = |sample: &&Sample| insertion(sample) > 0.0;
    assert!(
        between(samples, 22.4, 28.4).filter(inserted).count() > 5000,
        "the peg was hardly inserted"
    );
    for sample in between(samples, 22.4, 28.4).filter(inserted) {
        let force = force(sample);
        assert!(
            force.y.abs() <= NO_AXIAL_FORCE && force.x.abs() <= NO_AXIAL_FORCE,
            "inserted: {force} at {} s",
            sample.time
        );
        assert_none("inserted: the round peg's torque", sample, torque(sample).y);
    }
    // Pressed 2 mm down: the clearance is 0.5 mm, and facets add up to 22 um to that.
    for sample in between(samples, 25.3, 26.6) {
        let force = force(sample);
        assert!(
            insertion(sample) >= 0.040 && (1.478..=1.515).contains(&force.z),
            "pressed at depth: F_z {} at {} s",
            force.z,
            sample.time
        );
    }
}

/// How far the tip is in the hole, m, measured from the right face.
fn insertion(sample: &Sample) -> f64 {
    let at = &sample.god_object.translation;
    let (tip, beside_the_axis) = (at.y - HALF_LENGTH, at.x.hypot(at.z));
    if beside_the_axis < 0.002 {
        HALF_LENGTH - tip
    } else {
        f64::NEG_INFINITY
    }
}

#[test]
fn the_peg_goes_in_and_out_and_its_axial_force_is_that_of_figure_11() {
    let scene = shipped("peg-in-a-hole");
    assert_eq!(
        (
            scene.world.body.mesh.triangles().len(),
            scene.world.obstacles[0].mesh.triangles().len()
        ),
        (288, 280)
    );
    assert!((scene.stiffness() - STIFFNESS).abs() < 1e-9);
    let samples = led(&scene, 1000.0, 30.0);
    assert_apart(&scene, &samples, 5);
    let rest = scene.settings.rest_distance;
    assert_slides_on_the_top(&samples, rest);
    assert_faces_push_back(&samples, rest);
    assert_goes_in_and_out(&samples, rest);
}

#[test]
fn two_bunnies_slide_for_ten_seconds_and_no_pair_of_triangles_ever_intersects() {
    if data_file("bunny_27k.ply").is_none() {
        taut_test_kit::left_out(
            "two bunnies, because bunny_27k.ply is not there; scripts/get-bunny fetches it",
        );
        return;
    }
    // A slower clock than the workbench's, so that the test is short: longer steps are harder for the collision detection.
    const RATE_HZ: f64 = 125.0;
    let scene = shipped("two-bunnies");
    let samples = led(&scene, RATE_HZ, 16.0);
    let touching = samples.iter().filter(|sample| sample.active > 0).count() as f64 / RATE_HZ;
    assert!(
        touching >= 10.0,
        "the bunnies touched for {touching} s only"
    );
    let way: f64 = samples
        .windows(2)
        .map(|two| {
            (two[1].god_object.translation.vector - two[0].god_object.translation.vector).norm()
        })
        .sum();
    assert!(way > 0.3, "the bunny slid for {way} m only");
    assert!(
        samples
            .iter()
            .all(|sample| force(sample).norm() <= scene.settings.force_limit + NO_FORCE)
    );
    assert_apart(&scene, &samples, 1);
}

#[test]
fn a_sphere_on_a_plane_feels_the_closed_form_force_and_never_loses_it() {
    let scene = shipped("sphere-on-plane");
    let samples = led(&scene, 1000.0, 11.4);
    assert_apart(&scene, &samples, 5);
    let rest = scene.settings.rest_distance;
    for sample in &samples {
        let depth = 0.020 - sample.device.translation.z;
        let force = force(sample);
        assert_none("friction", sample, force.x);
        assert_none("friction", sample, force.y);
        assert_none("a torque on the sphere of", sample, torque(sample).norm());
        if depth > 2.0 * rest {
            assert_force("F_z", sample, force.z, depth, rest);
        } else if depth < -2.0 * rest {
            assert_eq!(force.z, 0.0, "a force in the air at {} s", sample.time);
        }
    }
}
