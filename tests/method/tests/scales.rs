//! The same scene a thousand times smaller or larger, or a kilometre away, feels the same.

use god_object::{Pose, Settings, Vector6};
use nalgebra::Vector3;
use taut_method_tests::motion::Led;
use taut_method_tests::solids::{body, mesh, obstacle, world};
use taut_scene::shapes::cuboid;

/// A box that lands on a table askew, slides and lifts; wrenches in units of the scale: N over `scale`, N m over its square.
fn slide(scale: f64, away: Vector3<f64>) -> Vec<Vector6> {
    let block = |half: [f64; 3]| mesh(cuboid(half.map(|x| x * scale)));
    let place = Pose::translation(away.x, away.y, away.z - 0.05 * scale);
    let table = obstacle("table", block([0.5, 0.5, 0.05]), place);
    let world = world(body(block([0.02, 0.02, 0.01])), [table]);
    let mut settings = Settings::for_size(0.04 * scale);
    settings.force_limit = 1e9;
    settings.torque_limit = 1e9;
    if let Some(adaptation) = &mut settings.adaptation {
        adaptation.threshold *= scale;
    }
    let at = |k: u32| {
        let t = f64::from(k) * 1e-3;
        let place = Vector3::new(0.05 * t, 0.01, 0.018 - 0.012 * (9.0 * t).sin()) * scale;
        Pose::new(place + away, Vector3::new(0.0, 0.1 * t, 0.3 * t))
    };
    let mut led = Led::in_world(world, &settings, at(0));
    let wrenches = (0..500).map(|k| {
        let sample = led.step(f64::from(k) * 1e-3, &at(k));
        assert!(
            sample.gap_min >= settings.minimum_gap,
            "{:e}",
            sample.gap_min
        );
        let mut wrench = sample.wrench / scale;
        wrench.fixed_rows_mut::<3>(3).scale_mut(1.0 / scale);
        wrench
    });
    wrenches.collect()
}

fn greatest_difference(a: &[Vector6], b: &[Vector6]) -> f64 {
    let size = a.iter().map(|w| w.norm()).fold(0.0, f64::max);
    let difference = |(a, b): (&Vector6, &Vector6)| (a - b).norm();
    assert!(size > 1.0, "the box never pressed: {size}");
    a.iter().zip(b).map(difference).fold(0.0, f64::max) / size
}

#[test]
fn a_scene_a_thousand_times_smaller_or_larger_feels_the_same() {
    let one = slide(1.0, Vector3::zeros());
    for scale in [1e-3, 1e3] {
        let difference = greatest_difference(&one, &slide(scale, Vector3::zeros()));
        println!("scale {scale}: {difference:e}");
        assert!(difference <= 1e-3, "scale {scale}: {difference:e}");
    }
}

#[test]
fn a_scene_a_kilometre_away_feels_the_same() {
    let here = slide(1.0, Vector3::zeros());
    let difference = greatest_difference(&here, &slide(1.0, Vector3::new(1000.0, -700.0, 400.0)));
    println!("a kilometre away: {difference:e}");
    assert!(difference <= 1e-3, "{difference:e}");
}
