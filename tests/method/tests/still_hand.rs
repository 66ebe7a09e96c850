//! A hand that stands still feels a force that stands still: every shape on every other, at poses that nobody chose.

use std::path::Path;

use god_object::{Pose, Vector6, shape};
use nalgebra::{UnitQuaternion, Vector3};
use taut_method_tests::hand::Random;
use taut_method_tests::motion::Led;
use taut_scene::{BuiltScene, Scene};

/// When the hand has arrived, s.
const ARRIVED: f64 = 0.4;
/// How far below the surface it then is, m.
const DEPTH: f64 = 2e-3;
/// When it is looked at, s: after the bodies had time to come to rest.
const LOOKED_AT: [f64; 2] = [0.8, 1.1];

const BODIES: [(&str, &str); 8] = [
    ("ball", "sphere = { radius = 0.008 }"),
    (
        "rod",
        r#"capsule = { radius = 0.004, half_length = 0.015, axis = "x" }"#,
    ),
    (
        "pin",
        r#"cylinder = { radius = 0.006, half_length = 0.015, axis = "x" }"#,
    ),
    ("box", "box = { half_extents = [0.015, 0.008, 0.006] }"),
    ("mesh ball", "sphere = { radius = 0.008, subdivisions = 2 }"),
    (
        "mesh rod",
        r#"capsule = { radius = 0.004, half_length = 0.015, axis = "x", facets = 24 }"#,
    ),
    (
        "mesh pin",
        r#"cylinder = { radius = 0.006, half_length = 0.015, axis = "x", facets = 36 }"#,
    ),
    (
        "coarse pin",
        r#"cylinder = { radius = 0.01, half_length = 0.01, axis = "z", facets = 5 }"#,
    ),
];

const OBSTACLES: [(&str, &str); 9] = [
    ("plane", r#"plane = { axis = "z" }"#),
    ("ball", "sphere = { radius = 0.03 }"),
    (
        "capsule",
        r#"capsule = { radius = 0.02, half_length = 0.03, axis = "y" }"#,
    ),
    (
        "cylinder",
        r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y" }"#,
    ),
    (
        "24 facets",
        r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y", facets = 24 }"#,
    ),
    (
        "96 facets",
        r#"cylinder = { radius = 0.03, half_length = 0.06, axis = "y", facets = 96 }"#,
    ),
    ("mesh ball", "sphere = { radius = 0.03, subdivisions = 2 }"),
    ("box", "box = { half_extents = [0.03, 0.03, 0.03] }"),
    (
        "hole",
        r#"box_with_hole = { half_extents = [0.03, 0.03, 0.03], radius = 0.0105, facets = 66, axis = "y" }"#,
    ),
];

fn scene(body: &str, obstacle: &str, surface: &str, more: &str) -> BuiltScene {
    let text = format!(
        "name = \"still\"\n[god_object]\nshape = {{ {body} }}\nmass = 1.0\npose = {{ position = [0.0, 0.0, 0.2] }}\n\
         [[obstacle]]\nname = \"obstacle\"\nshape = {{ {obstacle} }}\n{surface}\n{more}"
    );
    Scene::parse("still.toml", &text, Path::new("."))
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Where the hand comes from and where it stays: `DEPTH` beyond the first touch from above, at a random place and orientation.
fn landing(built: &BuiltScene, random: &mut Random) -> [Pose; 2] {
    let rotation = random.rotation();
    let aside = |random: &mut Random| 0.012 * (2.0 * random.unit() - 1.0);
    let (x, y) = (aside(random), aside(random));
    let at = |z: f64| Pose::from_parts(Vector3::new(x, y, z).into(), rotation);
    let obstacle = &built.world.obstacles[0];
    let meet =
        |z: f64| shape::shapes_intersect(&built.world.body, &at(z), obstacle, &obstacle.pose);
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

fn between(a: &Pose, b: &Pose, share: f64) -> Pose {
    let place = a.translation.vector.lerp(&b.translation.vector, share);
    let turn = UnitQuaternion::slerp(&a.rotation, &b.rotation, share);
    Pose::from_parts(place.into(), turn)
}

/// Largest step and largest way of the wrench (N; torques by a centimetre) while the hand stands still.
fn unrest(built: &BuiltScene, [from, to]: &[Pose; 2]) -> [f64; 3] {
    let mut built = built.clone();
    built.start = *from;
    let mut led = Led::new(&built);
    let (mut first, mut last, mut step, mut way): (Option<Vector6>, Option<Vector6>, f64, f64) =
        (None, None, 0.0, 0.0);
    let mut size = 0.0;
    for k in 0..=(LOOKED_AT[1] * 1000.0) as u32 {
        let time = f64::from(k) * 1e-3;
        let device = between(from, to, (time / ARRIVED).min(1.0));
        let mut wrench = led.step(time, &device).wrench;
        wrench.fixed_rows_mut::<3>(3).scale_mut(100.0);
        if std::env::var("ALL").is_ok() || time >= LOOKED_AT[0] {
            step = step.max(last.map_or(0.0, |last| (wrench - last).norm()));
            way = way.max((wrench - *first.get_or_insert(wrench)).norm());
            last = Some(wrench);
            size = wrench.norm();
        }
    }
    [step, way, size]
}

const PEGS: [(&str, &str, &str); 5] = [
    (
        "mesh",
        r#"cylinder = { radius = 0.01, half_length = 0.03, facets = 72, axis = "y" }"#,
        "0.0105",
    ),
    (
        "tight mesh",
        r#"cylinder = { radius = 0.01, half_length = 0.03, facets = 72, axis = "y" }"#,
        "0.0101",
    ),
    (
        "exact",
        r#"cylinder = { radius = 0.01, half_length = 0.03, axis = "y" }"#,
        "0.0105",
    ),
    (
        "tight exact",
        r#"cylinder = { radius = 0.01, half_length = 0.03, axis = "y" }"#,
        "0.0101",
    ),
    (
        "capsule",
        r#"capsule = { radius = 0.01, half_length = 0.02, axis = "y" }"#,
        "0.0101",
    ),
];

fn pushed(random: &mut Random) -> [Pose; 2] {
    let mut within = |size: f64| Vector3::from_fn(|_, _| size * (2.0 * random.unit() - 1.0));
    let (aside, along, turn) = (within(3e-3), within(0.01).y, within(0.2));
    let to = Pose::new(Vector3::new(aside.x, along, aside.z), turn);
    [Pose::identity(), to]
}

#[test]
fn explore_holes() {
    let count: u64 = std::env::var("COUNT")
        .ok()
        .and_then(|c| c.parse().ok())
        .unwrap_or(16);
    for friction in ["0.0", "0.2", "0.4"] {
        for (name, peg, hole) in PEGS {
            let hole = format!(
                r#"box_with_hole = {{ half_extents = [0.03, 0.03, 0.03], radius = {hole}, facets = 66, axis = "y" }}"#
            );
            let built = scene(
                peg,
                &hole,
                &format!("surface = {{ friction = {friction} }}"),
                "",
            );
            let mut bad = vec![];
            for seed in 0..count {
                let mut random = Random(seed * 7919 + 13);
                let [step, way, size] = unrest(&built, &pushed(&mut random));
                if step > 1e-4 || way > 1e-3 {
                    bad.push(format!("{seed}:{step:.1e}/{way:.1e}/{size:.1}"));
                }
            }
            println!(
                "{name:12} friction {friction}: {} of {count}: {}",
                bad.len(),
                bad.join(" ")
            );
        }
    }
}

#[test]
fn explore() {
    let surfaces = [
        ("", ""),
        ("surface = { friction = 0.3 }", ""),
        ("surface = { shading = { crease_angle = 0.6 } }", ""),
    ];
    let count: u64 = std::env::var("COUNT")
        .ok()
        .and_then(|c| c.parse().ok())
        .unwrap_or(8);
    let only = std::env::var("ONLY").unwrap_or_default();
    for (surface, more) in surfaces {
        for (o, obstacle) in OBSTACLES {
            for (b, body) in BODIES {
                if !format!("{b} on {o} {surface}").contains(&only) {
                    continue;
                }
                let exact_obstacle = !obstacle.contains("facets")
                    && !obstacle.contains("subdiv")
                    && !obstacle.contains("box");
                if surface.contains("shading") && exact_obstacle {
                    continue;
                }
                let built = scene(body, obstacle, surface, more);
                let mut bad = vec![];
                for seed in 0..count {
                    let mut random = Random(seed * 7919 + 13);
                    let poses = landing(&built, &mut random);
                    let [step, way, size] = unrest(&built, &poses);
                    if step > 1e-4 || way > 1e-3 {
                        bad.push(format!("{seed}:{step:.1e}/{way:.1e}/{size:.1}"));
                    }
                }
                if !bad.is_empty() {
                    println!(
                        "{b:10} on {o:10} {:30}: {} of {count}: {}",
                        surface,
                        bad.len(),
                        bad.join(" ")
                    );
                }
            }
        }
    }
}

#[test]
fn trace_one() {
    let find = |list: &[(&'static str, &'static str)], name: &str| {
        list.iter().find(|(n, _)| *n == name).unwrap().1
    };
    let var = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into());
    let (b, o, seed) = (
        var("B", "box"),
        var("O", "24 facets"),
        var("SEED", "0").parse::<u64>().unwrap(),
    );
    let surface = var("SURF", "surface = { shading = { crease_angle = 0.6 } }");
    let peg = PEGS.iter().find(|(n, ..)| *n == b);
    let mut random = Random(seed * 7919 + 13);
    let (mut built, [from, to]) = if let Some((_, peg, hole)) = peg {
        let hole = format!(
            r#"box_with_hole = {{ half_extents = [0.03, 0.03, 0.03], radius = {hole}, facets = 66, axis = "y" }}"#
        );
        (scene(peg, &hole, &surface, ""), pushed(&mut random))
    } else {
        let built = scene(find(&BODIES, &b), find(&OBSTACLES, &o), &surface, "");
        let way = landing(&built, &mut random);
        (built, way)
    };
    built.start = from;
    println!("hand {from} -> {to}");
    let world = std::sync::Arc::new(built.world.clone());
    let mut god = god_object::GodObject::new(world.clone(), built.settings, built.start).unwrap();
    let mut coupling = god_object::Coupling::new(&world, &built.settings);
    let mut shaded = None;
    let (a, z) = (
        var("A", "1000").parse::<u32>().unwrap(),
        var("Z", "1012").parse::<u32>().unwrap(),
    );
    println!(
        "rest {:e} tol {:e}",
        built.settings.rest_distance, built.settings.motion_tolerance
    );
    for k in 0..=z {
        let time = f64::from(k) * 1e-3;
        let device = between(&from, &to, (time / ARRIVED).min(1.0));
        let before = *god.pose();
        let report = god.step(&device, shaded.as_ref());
        let set = god.constraint_set();
        let out = coupling.step(time, &device, set);
        shaded = out.shaded;
        if k >= a {
            let d = god.pose().translation.vector - before.translation.vector;
            let w = (god.pose().rotation * before.rotation.inverse()).scaled_axis();
            println!(
                "{k} F {:.3?} T {:.5?} moved {:.7?} {:.6?} substeps {} active {}",
                out.wrench.fixed_rows::<3>(0).as_slice(),
                out.wrench.fixed_rows::<3>(3).as_slice(),
                d.as_slice(),
                w.as_slice(),
                report.substeps,
                out.active
            );
            for r in set.constraints.iter().filter(|r| r.gap < 3e-4) {
                println!(
                    "    {:?}/{:?} p {:.5?} n {:.4?} gap {:.2e} s {:.4?}",
                    r.features.on_body,
                    r.features.on_obstacle,
                    r.point.coords.as_slice(),
                    r.normal.as_slice(),
                    r.gap,
                    r.shading_normal.map(|n| n.as_slice().to_vec())
                );
            }
        }
    }
}
