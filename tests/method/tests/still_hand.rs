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
                    let all = std::env::var("ALL").is_ok();
                    if all && step > 0.3 || !all && (step > 1e-4 || way > 1e-3) {
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

#[test]
fn explore_slides() {
    let pegs = [PEGS[0], PEGS[1], PEGS[2], PEGS[3], PEGS[4], ("short capsule", r#"capsule = { radius = 0.01, half_length = 0.01, axis = "y" }"#, "0.0101")];
    for (name, peg, hole) in pegs {
        for mu in [0.1, 0.3, 0.6] {
            let hole = format!(r#"box_with_hole = {{ half_extents = [0.03, 0.03, 0.03], radius = {hole}, facets = 66, axis = "y" }}"#);
            let built = scene(peg, &hole, &format!("surface = {{ friction = {mu} }}"), "");
            let (mut low, mut high): (f64, f64) = (9.0, 0.0);
            let mut text = String::new();
            for (k, speed) in [0.003, 0.02, 0.1].into_iter().enumerate() {
                for seed in 0..3 {
                    let mut random = Random(seed * 31 + k as u64);
                    let turn = random.unit() * 6.283;
                    let aside = Vector3::new(turn.cos(), 0.0, turn.sin()) * 2.5e-3;
                    let mut built = built.clone();
                    built.start = Pose::identity();
                    let mut led = Led::new(&built);
                    let (mut l, mut h): (f64, f64) = (9.0, 0.0);
                    let travel = 0.008_f64.min(speed * 1.0);
                    let end = 0.5 + travel / speed + 0.3;
                    for i in 0..(end * 1000.0) as u32 {
                        let t = f64::from(i) * 1e-3;
                        let along = -(speed * (t - 0.5)).clamp(0.0, travel);
                        let at = aside * (t / 0.4).min(1.0) + Vector3::new(0.0, along, 0.0);
                        let w = led.step(t, &Pose::from_parts(at.into(), UnitQuaternion::identity())).wrench;
                        let n = w[0].hypot(w[2]);
                        // Sliding, once the hand has pulled by more than sticks.
                        if t > 0.5 && -along * 1000.0 > 1.3 * mu * n {
                            l = l.min(w[1].abs() / n / mu);
                            h = h.max(w[1].abs() / n / mu);
                        }
                    }
                    text += &format!(" {l:.3}-{h:.3}");
                    low = low.min(l);
                    high = high.max(h);
                }
            }
            println!("{name:13} mu {mu}: {low:.3} to {high:.3} of mu N; {text}");
        }
    }
}

#[test]
fn explore_item4() {
    let q = UnitQuaternion::from_quaternion(god_object::nalgebra::Quaternion::new(0.49856, -0.04668, -0.07538, 0.86231));
    for (shape, z, surf) in [(r#"cylinder = { radius = 0.004, half_length = 0.015, axis = "x" }"#, 0.030439, ""), ("box = { half_extents = [0.015, 0.008, 0.006] }", 0.032439, "surface = { shading = { crease_angle = 0.6 } }")] {
        let built = scene(shape, OBSTACLES[4].1, surf, "");
        let at = |z: f64| Pose::from_parts(Vector3::new(-0.000866, -0.001427, z).into(), q);
        let mut built = built.clone();
        built.start = at(0.08);
        let mut led = Led::new(&built);
        let mut last: Option<Vector6> = None;
        let mut worst = (0.0, 0);
        for k in 0..1000 {
            let w = led.step(f64::from(k) * 1e-3, &between(&at(0.08), &at(z), (f64::from(k) / 400.0).min(1.0))).wrench;
            if let Some(l) = last { let d = (w - l).fixed_rows::<3>(0).norm(); if d > worst.0 { worst = (d, k); } if d > 0.15 { println!("{k} {:.3?} {d:.3}", w.as_slice()); } }
            last = Some(w);
        }
        println!("worst {worst:?}");
    }
}

#[test]
fn explore_turned() {
    let count: u64 = std::env::var("COUNT").ok().and_then(|c| c.parse().ok()).unwrap_or(6);
    for surface in ["", "surface = { friction = 0.3 }", "surface = { shading = { crease_angle = 0.6 } }"] {
        let mut all = (0.0_f64, 0, 0);
        for (o, obstacle) in OBSTACLES {
            for (b, body) in BODIES {
                let exact_obstacle = !obstacle.contains("facets") && !obstacle.contains("subdiv") && !obstacle.contains("box");
                if surface.contains("shading") && exact_obstacle { continue; }
                let built = scene(body, obstacle, surface, "");
                let (mut worst, mut off, mut rows) = (0.0_f64, 0, 0);
                for seed in 0..count {
                    let mut random = Random(seed * 7919 + 13);
                    let [from, to] = landing(&built, &mut random);
                    let r = random.rotation();
                    let turn = Pose::from_parts(Vector3::zeros().into(), r);
                    let mut a = built.clone();
                    a.start = from;
                    let mut t = built.clone();
                    t.start = turn * from;
                    for obstacle in &mut t.world.obstacles { obstacle.pose = turn * obstacle.pose; }
                    let (mut a, mut t) = (Led::new(&a), Led::new(&t));
                    // Down, then across.
                    let across = Pose::from_parts((to.translation.vector + Vector3::new(0.01, 0.007, 0.0)).into(), to.rotation);
                    for k in 0..800 {
                        let time = f64::from(k) * 1e-3;
                        let d = if k < 400 { between(&from, &to, time / 0.4) } else { between(&to, &across, (time - 0.4) / 0.4) };
                        let (wa, wt) = (a.step(time, &d).wrench, t.step(time, &(turn * d)).wrench);
                        let (fa, ft) = (wa.fixed_rows::<3>(0).into_owned(), r.inverse() * wt.fixed_rows::<3>(0).into_owned());
                        let d = (fa - ft).norm();
                        rows += 1;
                        if d > 0.01 * fa.norm().max(0.5) { off += 1; }
                        worst = worst.max(d);
                    }
                }
                all = (all.0.max(worst), all.1 + off, all.2 + rows);
                if worst > 1e-3 {
                    println!("{b:10} on {o:10} {surface:30}: worst {worst:.2e} N, {off} of {rows} rows off by 1 %");
                }
            }
        }
        println!("ALL {surface}: {all:?}");
    }
}

#[test]
fn explore_turned_one() {
    let find = |list: &[(&'static str, &'static str)], name: &str| list.iter().find(|(n, _)| *n == name).unwrap().1;
    let var = |n: &str, d: &str| std::env::var(n).unwrap_or(d.into());
    let (b, o) = (var("B", "mesh ball"), var("O", "capsule"));
    let built = scene(find(&BODIES, &b), find(&OBSTACLES, &o), &var("SURF", ""), &var("MORE", ""));
    println!("rounds {}", built.settings.implicit_rounds);
    let mut shown = 0;
    for seed in 0..6 {
        let mut random = Random(seed * 7919 + 13);
        let [from, to] = landing(&built, &mut random);
        let r = random.rotation();
        let turn = Pose::from_parts(Vector3::zeros().into(), r);
        let across = Pose::from_parts((to.translation.vector + Vector3::new(0.01, 0.007, 0.0)).into(), to.rotation);
        let mut make = |turn: Pose| {
            let mut b = built.clone();
            b.start = turn * from;
            for obstacle in &mut b.world.obstacles { obstacle.pose = turn * obstacle.pose; }
            let world = std::sync::Arc::new(b.world.clone());
            (god_object::GodObject::new(world.clone(), b.settings, b.start).unwrap(), god_object::Coupling::new(&world, &b.settings))
        };
        let mut two = [make(Pose::identity()), make(turn)];
        let turns = [Pose::identity(), turn];
        let mut before: Vec<String> = vec![];
        let mut prev = 0.0;
        for k in 0..800 {
            let time = f64::from(k) * 1e-3;
            let d = if k < 400 { between(&from, &to, time / 0.4) } else { between(&to, &across, (time - 0.4) / 0.4) };
            let mut f = vec![];
            let mut lines = vec![];
            for i in 0..2 {
                let (g, c) = &mut two[i];
                let rep = g.step(&(turns[i] * d), None);
                let set = g.constraint_set();
                let out = c.step(time, &(turns[i] * d), set);
                let force = turns[i].rotation.inverse() * out.wrench.fixed_rows::<3>(0).into_owned();
                let back = turns[i].inverse() * g.pose();
                f.push(force);
                lines.push(format!("{seed} {k} [{i}] F {:.4?} at {:.7?} q {:.6?} substeps {} active {} {:?}", force.as_slice(), back.translation.vector.as_slice(), back.rotation.coords.as_slice(), rep.substeps, out.active, out.status));
                let mut near: Vec<_> = set.constraints.iter().filter(|r| r.gap < 2e-4).collect();
                near.sort_by(|a, b| a.gap.total_cmp(&b.gap));
                for r in near.iter().take(6) {
                    lines.push(format!("      {:?}/{:?} n {:.5?} gap {:.3e}", r.features.on_body, r.features.on_obstacle, (turns[i].rotation.inverse() * r.normal).as_slice(), r.gap));
                }
            }
            let diff = (f[0] - f[1]).norm();
            if diff > 0.02 && prev < 0.02 && shown < 3 {
                shown += 1;
                println!("{}\n{}\n== diff {diff}", before.join("\n"), lines.join("\n"));
            }
            prev = diff;
            before = lines;
        }
    }
}
