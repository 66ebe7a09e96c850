//! A hand that stands still feels a force that stands still, and a scene that is turned as a whole feels the same: every shape on every other, at poses
//! that nobody chose.
//!
//! `cargo test -p taut-method-tests still_hand -- --ignored --nocapture` takes many more poses, some seven minutes.

use std::path::Path;
use std::sync::Arc;

use god_object::collision::shapes_intersect;
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use taut_method_tests::hand::Random;
use taut_method_tests::motion::Led;
use taut_scene::{BuiltScene, Prepared, Scene};

/// When the hand has arrived, s.
const ARRIVED: f64 = 0.4;
/// How far below the surface it then is, m.
const DEPTH: f64 = 2e-3;
/// When the force is looked at, s: after the body had time to come to rest.
const LOOKED_AT: [f64; 2] = [0.8, 1.1];
/// Largest step from sample to sample, and largest way, of a force that stands still, N: a four-hundredth of it, and less than a hand detects. Torques
/// count by a centimetre.
const STILL: f64 = 5e-3;
/// Forces of a scene and of the same turned agree to this share, but for this share of the samples: where a body topples, rounding decides when.
const AGREES: f64 = 0.01;
const TOPPLES: f64 = 2e-3;
/// The same by default, where updates go twice as far as with `k_s = 0.5`: where two bodies that are round and smooth slide over each other, sub-steps
/// end within some hundredths of a newton.
const SLIDES: f64 = 4e-3;

const BODIES: [&str; 8] = [
    "sphere = { radius = 0.008 }",
    r#"capsule = { radius = 0.004, half_length = 0.015, axis = "x" }"#,
    r#"cylinder = { radius = 0.006, half_length = 0.015, axis = "x" }"#,
    "box = { half_extents = [0.015, 0.008, 0.006] }",
    "sphere = { radius = 0.008, subdivisions = 2 }",
    r#"capsule = { radius = 0.004, half_length = 0.015, axis = "x", facets = 24 }"#,
    r#"cylinder = { radius = 0.006, half_length = 0.015, axis = "x", facets = 36 }"#,
    r#"cylinder = { radius = 0.01, half_length = 0.01, axis = "z", facets = 5 }"#,
];

const EXACT: [&str; 4] = [
    r#"plane = { axis = "z" }"#,
    "sphere = { radius = 0.03 }",
    r#"capsule = { radius = 0.02, half_length = 0.03, axis = "y" }"#,
    r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y" }"#,
];
const MESHES: [&str; 5] = [
    r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y", facets = 24 }"#,
    r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y", facets = 96 }"#,
    "sphere = { radius = 0.03, subdivisions = 2 }",
    "box = { half_extents = [0.03, 0.03, 0.03] }",
    r#"box_with_hole = { half_extents = [0.03, 0.03, 0.03], radius = 0.0105, facets = 66, axis = "y" }"#,
];

const FRICTION: &str = "surface = { friction = 0.3 }";
const SHADING: &str = "surface = { shading = { crease_angle = 0.6 } }";

/// Pegs, and the radius of their hole, m.
const PEGS: [(&str, f64); 6] = [
    (
        r#"cylinder = { radius = 0.01, half_length = 0.03, facets = 72, axis = "y" }"#,
        0.0105,
    ),
    (
        r#"cylinder = { radius = 0.01, half_length = 0.03, facets = 72, axis = "y" }"#,
        0.0101,
    ),
    (
        r#"cylinder = { radius = 0.01, half_length = 0.03, axis = "y" }"#,
        0.0105,
    ),
    (
        r#"cylinder = { radius = 0.01, half_length = 0.03, axis = "y" }"#,
        0.0101,
    ),
    (
        r#"capsule = { radius = 0.01, half_length = 0.02, axis = "y" }"#,
        0.0101,
    ),
    (
        r#"capsule = { radius = 0.01, half_length = 0.01, axis = "y" }"#,
        0.0101,
    ),
];

/// Every body on every obstacle with every surface that this can have. Meshes that were in the scene before are taken over.
fn each_scene(mut run: impl FnMut(&Arc<World>, &Settings, &str)) {
    let exact = EXACT.map(|obstacle| (obstacle, &["", FRICTION][..]));
    let meshes = MESHES.map(|obstacle| (obstacle, &["", FRICTION, SHADING][..]));
    let mut before = None;
    for (obstacle, surfaces) in exact.into_iter().chain(meshes) {
        for body in BODIES {
            for surface in surfaces {
                let built = scene_from(body, obstacle, surface, before.as_ref());
                let world = Arc::new(built.world);
                let name = format!("{body} on {obstacle} {surface}");
                run(&world, &built.settings, &name);
                before = Some(Prepared::new(world, built.sources));
            }
        }
    }
}

fn scene(body: &str, obstacle: &str, surface: &str) -> BuiltScene {
    scene_from(body, obstacle, surface, None)
}

fn scene_from(body: &str, obstacle: &str, surface: &str, before: Option<&Prepared>) -> BuiltScene {
    let text = format!(
        "name = \"still\"\n[god_object]\nshape = {{ {body} }}\nmass = 1.0\npose = {{ position = [0.0, 0.0, 0.2] }}\n\
         [[obstacle]]\nname = \"obstacle\"\nshape = {{ {obstacle} }}\n{surface}\n"
    );
    Scene::parse("still.toml", &text, Path::new("."))
        .and_then(|scene| scene.build_from(before))
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn peg_in_hole((peg, hole): (&str, f64), friction: f64) -> BuiltScene {
    let hole = format!(
        r#"box_with_hole = {{ half_extents = [0.03, 0.03, 0.03], radius = {hole}, facets = 66, axis = "y" }}"#
    );
    let mut built = scene(
        peg,
        &hole,
        &format!("surface = {{ friction = {friction} }}"),
    );
    built.start = Pose::identity();
    built
}

fn between(a: &Pose, b: &Pose, share: f64) -> Pose {
    let share = share.clamp(0.0, 1.0);
    let place = a.translation.vector.lerp(&b.translation.vector, share);
    Pose::from_parts(place.into(), a.rotation.slerp(&b.rotation, share))
}

/// Where the hand comes from and where it stays: [`DEPTH`] beyond the first touch from above, at a random place and orientation.
fn landing(world: &World, random: &mut Random) -> [Pose; 2] {
    let rotation = random.rotation();
    let [x, y] = [(); 2].map(|()| 0.012 * (2.0 * random.unit() - 1.0));
    let at = |z: f64| Pose::from_parts(Vector3::new(x, y, z).into(), rotation);
    let obstacle = &world.obstacles[0];
    let meet = |z: f64| shapes_intersect(&world.body, &at(z), obstacle, &obstacle.pose);
    let (mut high, mut low) = (0.08, 0.0);
    while high - low > 1e-6 {
        let middle = 0.5 * (high + low);
        if meet(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    [at(high + 0.02), at(high - DEPTH)]
}

/// From the middle of a hole: aside and askew, until the peg is wedged.
fn wedging(random: &mut Random) -> [Pose; 2] {
    let mut within = |size: f64| Vector3::from_fn(|_, _| size * (2.0 * random.unit() - 1.0));
    let (aside, along, turn) = (within(3e-3), within(0.01).y, within(0.2));
    let to = Pose::new(Vector3::new(aside.x, along, aside.z), turn);
    [Pose::identity(), to]
}

/// Largest step and largest way of the wrench while the hand stands still, N.
fn unrest(world: &Arc<World>, settings: &Settings, [from, to]: &[Pose; 2]) -> f64 {
    let mut led = Led::in_world(world.clone(), settings, *from);
    let (mut first, mut last): (Option<Vector6>, Option<Vector6>) = (None, None);
    let mut unrest = 0.0_f64;
    for k in 0..=(LOOKED_AT[1] * 1000.0) as u32 {
        let time = f64::from(k) * 1e-3;
        let mut wrench = led.step(time, &between(from, to, time / ARRIVED)).wrench;
        wrench.fixed_rows_mut::<3>(3).scale_mut(100.0);
        if time >= LOOKED_AT[0] {
            let first = first.get_or_insert(wrench);
            let step = (wrench - last.unwrap_or(wrench)).norm();
            unrest = unrest.max(step).max((wrench - *first).norm());
            last = Some(wrench);
        }
    }
    assert!(unrest.is_finite());
    unrest
}

/// Names every pose at which the force is not still.
struct Unrests {
    worst: f64,
    found: Vec<String>,
}

impl Unrests {
    fn none() -> Self {
        Self {
            worst: 0.0,
            found: vec![],
        }
    }

    fn note(&mut self, unrest: f64, what: String) {
        self.worst = self.worst.max(unrest);
        if unrest > STILL {
            self.found.push(format!("{what}: {unrest} N"));
        }
    }

    fn are_none(&self) {
        println!("{:e} N", self.worst);
        assert!(self.found.is_empty(), "{:#?}", self.found);
    }
}

fn landed(poses: impl Iterator<Item = u64> + Clone) -> Unrests {
    let mut unrests = Unrests::none();
    each_scene(|world, settings, name| {
        for seed in poses.clone() {
            let way = landing(world, &mut Random(seed));
            unrests.note(unrest(world, settings, &way), format!("{name}, {seed}"));
        }
    });
    unrests
}

fn wedged(poses: impl Iterator<Item = u64> + Clone) -> Unrests {
    let mut unrests = Unrests::none();
    for peg in PEGS {
        for friction in [0.0, 0.2, 0.4] {
            let built = peg_in_hole(peg, friction);
            let world = Arc::new(built.world);
            for seed in poses.clone() {
                let found = unrest(&world, &built.settings, &wedging(&mut Random(seed)));
                unrests.note(found, format!("{peg:?} {friction}, {seed}"));
            }
        }
    }
    unrests
}

/// Share of the samples, landing and sliding, whose forces differ when all is turned.
fn turns(poses: impl Iterator<Item = u64> + Clone, share: f64) -> f64 {
    let (mut samples, mut differ, mut worst) = (0_u32, 0_u32, 0.0_f64);
    each_scene(|world, settings, _| {
        let mut settings = *settings;
        settings.k_h *= settings.k_s / share;
        settings.k_s = share;
        for seed in poses.clone() {
            let mut random = Random(seed);
            let [from, to] = landing(world, &mut random);
            let turn = Pose::from_parts(Vector3::zeros().into(), random.rotation());
            let mut turned = World::clone(world);
            for obstacle in &mut turned.obstacles {
                obstacle.pose = turn * obstacle.pose;
            }
            let mut led = Led::in_world(world.clone(), &settings, from);
            let mut led_turned = Led::in_world(Arc::new(turned), &settings, turn * from);
            let mut across = to;
            across.translation.vector += Vector3::new(0.01, 0.007, 0.0);
            for k in 0..800 {
                let time = f64::from(k) * 1e-3;
                let device = if time < ARRIVED {
                    between(&from, &to, time / ARRIVED)
                } else {
                    between(&to, &across, (time - ARRIVED) / ARRIVED)
                };
                let force = led.step(time, &device).wrench;
                let other = led_turned.step(time, &(turn * device)).wrench;
                let force = force.fixed_rows::<3>(0).into_owned();
                let other = turn.rotation.inverse() * other.fixed_rows::<3>(0).into_owned();
                let difference = (force - other).norm();
                samples += 1;
                differ += u32::from(difference > AGREES * force.norm().max(0.5));
                worst = worst.max(difference);
            }
        }
    });
    println!("{differ} of {samples}, worst {worst:e} N");
    f64::from(differ) / f64::from(samples)
}

#[test]
fn a_body_pressed_on_another_comes_to_rest() {
    landed([1, 4, 13, 31_689, 55_446].into_iter()).are_none();
}

#[test]
fn a_peg_wedged_in_its_hole_stays_held() {
    wedged([6, 79_203, 95_041].into_iter()).are_none();
}

#[test]
fn a_scene_turned_as_a_whole_feels_the_same() {
    let share = turns([23_770].into_iter(), 0.5);
    assert!(share <= TOPPLES, "{share}");
}

#[test]
fn a_scene_turned_as_a_whole_feels_the_same_by_default() {
    let share = turns([15_851, 23_770].into_iter(), 1.0);
    assert!(share <= SLIDES, "{share}");
}

#[test]
#[ignore = "seven minutes: the same at many more poses"]
fn all_of_it_at_many_poses() {
    let (landed, wedged) = (landed(0..40), wedged(0..40));
    println!("{:#?} {:#?}", landed.found, wedged.found);
    let share = turns(0..6, 0.5);
    assert!(share <= TOPPLES, "{share}");
    landed.are_none();
    wedged.are_none();
}

#[test]
fn shading_changes_nothing_where_every_edge_is_a_crease() {
    // Pressed on a box at random places, half of them beside its upper face: over edges and corners.
    let mut worst = 0.0_f64;
    for body in BODIES {
        let [plain, shaded] = ["", SHADING].map(|surface| scene(body, MESHES[3], surface));
        for seed in 0..6 {
            let mut random = Random(seed);
            let [mut from, mut to] = landing(&plain.world, &mut random);
            let aside = Vector3::new(0.012 + 0.02 * random.unit(), 0.03 * random.unit(), 0.0);
            for pose in [&mut from, &mut to] {
                pose.translation.vector += aside;
            }
            let mut led = [&plain, &shaded].map(|built| {
                Led::new(&BuiltScene {
                    start: from,
                    ..built.clone()
                })
            });
            for k in 0..850 {
                let time = f64::from(k) * 1e-3;
                let device = between(&from, &to, time / ARRIVED);
                let [a, b] = led.each_mut().map(|led| led.step(time, &device).wrench);
                let difference = (a - b).fixed_rows::<3>(0).norm();
                // While the hand moves, the shaded motion is that of the force before.
                if time >= LOOKED_AT[0] {
                    worst = worst.max(difference);
                }
            }
        }
    }
    println!("{worst:e} N");
    assert!(worst <= STILL, "{worst} N");
}

#[test]
fn a_peg_that_is_drawn_along_its_hole_feels_coulombs_law() {
    // Facets hold the peg in a wedge: what presses on them is up to 3 % more than what the hand presses with.
    const WEDGE: std::ops::RangeInclusive<f64> = 0.97..=1.03;
    for peg in PEGS {
        for (coefficient, speed) in [(0.1, 0.1), (0.3, 0.02), (0.6, 0.003)] {
            let built = peg_in_hole(peg, coefficient);
            let mut random = Random((speed * 1e6) as u64);
            let turn = std::f64::consts::TAU * random.unit();
            let aside = Vector3::new(turn.cos(), 0.0, turn.sin()) * 2.5e-3;
            let mut led = Led::new(&built);
            let way = f64::min(speed, 0.008);
            let mut slid = 0;
            for k in 0..((0.6 + way / speed) * 1000.0) as u32 {
                let time = f64::from(k) * 1e-3;
                let along = (speed * (time - 0.5)).clamp(0.0, way);
                let at = aside * (time / ARRIVED).min(1.0) - Vector3::y() * along;
                let wrench = led.step(time, &Pose::from(at)).wrench;
                let most = coefficient * wrench[0].hypot(wrench[2]);
                // The hand has drawn by more than sticks, at 1000 N/m.
                if time > 0.5 && 1000.0 * along > 1.3 * most {
                    let share = wrench[1].abs() / most;
                    assert!(
                        WEDGE.contains(&share),
                        "{peg:?} {coefficient} {speed} m/s at {time}: {share}"
                    );
                    slid += 1;
                }
            }
            assert!(slid > 50, "{peg:?} {coefficient}: slid for {slid} ms");
        }
    }
}

#[test]
fn a_cylinder_comes_onto_an_edge_without_a_drop_of_the_force() {
    let rotation =
        UnitQuaternion::from_quaternion(Quaternion::new(0.49856, -0.04668, -0.07538, 0.86231));
    let at = |z: f64| Pose::from_parts(Vector3::new(-0.000_866, -0.001_427, z).into(), rotation);
    let body = r#"cylinder = { radius = 0.004, half_length = 0.015, axis = "x" }"#;
    let built = BuiltScene {
        start: at(0.08),
        ..scene(body, MESHES[0], "")
    };
    let mut led = Led::new(&built);
    let mut last = 0.0;
    for k in 0..800 {
        let time = f64::from(k) * 1e-3;
        let wrench = led
            .step(time, &between(&at(0.08), &at(0.030_439), time / ARRIVED))
            .wrench;
        let force = wrench.fixed_rows::<3>(0).norm();
        // The hand goes 0.124 mm a millisecond, at 1000 N/m.
        assert!(last - force <= 0.02, "{last} to {force} N at {time} s");
        last = force;
    }
    assert!(last > 3.0, "{last}");
}
