//! A device sample that is answered again, on a newer set, is no motion: passivity and the muting of textures go on from sample to sample.

use crate::support;

use god_object::nalgebra::Vector3;
use god_object::{Coupling, Pose, Settings, SineTexture, Texture, Vector6, World};

const TICK: f64 = 1e-3;

/// The wrenches that are newest when the next sample comes, and the coupling at the end. With `sets_between` a new set comes between any two samples,
/// as the coupling loop sees it: sample, set, sample, set.
fn felt(
    world: &World,
    settings: &Settings,
    sets_between: bool,
    device: impl Fn(u64) -> Pose,
) -> (Vec<Vector6>, Coupling) {
    let mut set = support::floor(settings);
    let mut coupling = Coupling::new(world, settings);
    let wrenches = (0..300)
        .map(|sample| {
            let (time, pose) = (TICK * sample as f64, device(sample));
            let first = coupling.answer(time, sample, &pose, &set).wrench;
            if !sets_between {
                return first;
            }
            set.sequence += 1;
            let again = coupling.answer(time + 0.4 * TICK, sample, &pose, &set);
            assert!((again.wrench - first).norm() <= 1e-12 * first.norm());
            again.wrench
        })
        .collect();
    (wrenches, coupling)
}

fn passive() -> Settings {
    Settings {
        passive: true,
        adaptation: None,
        ..Settings::for_size(0.1)
    }
}

/// The hand begins inside the floor, so that its way out would be paid by nobody.
fn out_of_the_floor(sample: u64) -> Pose {
    Pose::translation(0.0, 0.0, -5e-3 + 2e-5 * sample as f64)
}

#[test]
fn new_sets_between_samples_leave_passivity_as_it_is() {
    let world = support::box_on_table();
    let settings = passive();
    let (right, once) = felt(&world, &settings, false, out_of_the_floor);
    let (looped, twice) = felt(&world, &settings, true, out_of_the_floor);
    assert!(right.iter().any(|wrench| wrench.norm() > 1.0));
    for (sample, (a, b)) in right.iter().zip(&looped).enumerate() {
        assert!((a - b).norm() <= 1e-12 * a.norm(), "{sample}: {a} {b}");
    }
    let [once, twice] = [once, twice].map(|coupling| *coupling.energy().expect("observed"));
    // Free of charge it would be half of 1000 N/m times 5 mm squared: 12.5 mJ.
    assert!(once.highest() < 1e-3, "{} J", once.highest());
    assert!((once.given() - twice.given()).abs() < 1e-12);
    assert_eq!(once.moved(), twice.moved());
}

#[test]
fn the_work_between_two_samples_is_that_of_the_last_force_before_the_second() {
    let world = support::box_on_table();
    let settings = passive();
    let mut coupling = Coupling::new(&world, &settings);
    let mut set = support::floor(&settings);
    let at = |z: f64| Pose::translation(0.0, 0.0, z);
    let first = coupling.answer(0.0, 7, &at(-4e-3), &set).wrench;
    set.sequence += 1;
    set.constraints[0].gap += 1e-3;
    let second = coupling.answer(0.4 * TICK, 7, &at(-4e-3), &set).wrench;
    assert!(second[2] > 0.1 && second[2] < 0.9 * first[2]);
    let _ = coupling.answer(TICK, 8, &at(-5e-3), &set);
    let given = coupling.energy().expect("observed").given();
    assert!((given + 1e-3 * second[2]).abs() < 1e-12, "{given} J");
}

#[test]
fn a_force_that_cannot_be_computed_ends_the_work_of_the_one_before_it_at_its_sample() {
    let world = support::box_on_table();
    let settings = passive();
    let mut coupling = Coupling::new(&world, &settings);
    let set = support::floor(&settings);
    let mut broken = support::floor(&settings);
    broken.sequence = 1;
    broken.god_object_pose = Pose::translation(f64::NAN, 0.0, 0.0);
    let at = |z: f64| Pose::translation(0.0, 0.0, z);
    let held = coupling.answer(0.0, 0, &at(-4e-3), &set).wrench;
    let none = coupling.answer(TICK, 1, &at(-5e-3), &broken).wrench;
    assert_eq!(none, Vector6::zeros());
    let _ = coupling.answer(2.0 * TICK, 2, &at(-9e-3), &broken);
    let given = coupling.energy().expect("observed").given();
    assert!((given + 1e-3 * held[2]).abs() < 1e-12, "{given} J");
}

#[test]
fn new_sets_between_samples_leave_a_muted_texture_muted() {
    let mut world = World::clone(&support::box_on_table());
    world.obstacles[0].pose = Pose::identity();
    world.obstacles[0].surface.texture = Some(Texture::Sine(SineTexture {
        axis: Vector3::x(),
        wavelength: 1e-3,
        amplitude: 0.2,
    }));
    let settings = Settings {
        adaptation: None,
        ..Settings::for_size(0.1)
    };
    for (step, muted) in [(0.6e-3, true), (0.13e-3, false)] {
        let slide = |sample: u64| Pose::translation(step * sample as f64, 0.0, -2e-3);
        let (right, _) = felt(&world, &settings, false, slide);
        let (looped, _) = felt(&world, &settings, true, slide);
        let sideways = right[1..].iter().map(|wrench| wrench[0].abs());
        assert_eq!(sideways.fold(0.0, f64::max) < 1e-9, muted);
        for (sample, (a, b)) in right.iter().zip(&looped).enumerate() {
            assert!((a - b).norm() <= 1e-12 * a.norm(), "{sample}: {a} {b}");
        }
    }
}
