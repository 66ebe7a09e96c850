//! Times god-object updates of two bunnies that slide: `cargo run --release --example update_timing -- [subdivisions] [steps] [work budget, nominal us]`.
//!
//! The device presses one bunny 1 to 3 mm into the other and slides it around it, 0.5 to 3 mm and up to half a degree in
//! a step, on a path of fixed seed. Times are CPU time of the thread. Each subdivision makes four triangles of one: 27,000,
//! 108,000, 432,000, 1,728,000. The mesh is read from `TAUT_DATA` or `../shared/data`.
#![allow(
    clippy::disallowed_methods,
    reason = "a measurement reads files and arguments; the method does not"
)]

#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;
mod update_support;

use std::sync::Arc;

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::constraint::{Contact, collect_contacts};
use god_object::geometry::mass_properties;
use god_object::nalgebra::Vector3;
use god_object::spatial::{at_reference_point, pose_difference};
use god_object::{Body, GodObject, Mesh, Obstacle, Pose, Settings, Surface, World};
use update_support::{Hand, report, subdivided, thread_cpu_us};

const SIZE: f64 = 0.15;
const STEPS: usize = 2500;
/// Updates before the body has come to the obstacle.
const APPROACH: usize = 60;
/// The motion made is prolonged by this, to see what it would have met.
const PROLONGED: f64 = 1.5;

/// One update: where the body was and came to, and what the device wanted.
struct Update {
    before: Pose,
    after: Pose,
    device: Pose,
}

fn main() {
    let argument = |k: usize, default: usize| {
        std::env::args().nth(k).map_or(default, |a| {
            a.parse()
                .expect("arguments: [subdivisions] [steps] [work budget]")
        })
    };
    let (levels, steps) = (argument(1, 0), argument(2, STEPS));
    let Some(soup) = geometry_shapes::read_ply("bunny_27k.ply") else {
        return;
    };
    let (vertices, triangles) = subdivided(&soup, levels as u32);
    let before = thread_cpu_us();
    let mesh = Mesh::new(vertices, triangles).expect("the bunny is closed");
    println!(
        "{} triangles, mesh built in {:.2} s; {steps} updates",
        mesh.triangles().len(),
        (thread_cpu_us() - before) * 1e-6
    );
    let world = world_of(mesh);
    let budget = std::env::args().nth(3).map(|_| argument(3, 0) as u64);
    let updates = run(&world, steps, budget);
    let body = &world.body;
    let around = |pose: &Pose| at_reference_point(pose, &body.reference_point);
    let way = |from: &Pose, to: &Pose, share: f64| Motion {
        start: around(from),
        displacement: pose_difference(&around(to), &around(from), &Vector3::zeros()) * share,
        reference_point: body.reference_point,
    };
    let settings = Settings::for_size(SIZE);
    for (name, prolonged) in [
        ("TOI, along the way made", true),
        ("TOI, at the device", false),
    ] {
        let motions = updates.iter().map(|u| {
            let motion = if prolonged {
                way(&u.before, &u.after, PROLONGED)
            } else {
                way(&u.before, &u.device, settings.k_s)
            };
            (u.before, motion)
        });
        time_searches(name, &world, &settings, motions);
    }
    time_collection(&world, &settings, &updates);
}

fn world_of(mesh: Mesh) -> Arc<World> {
    let solid = mass_properties(&mesh);
    Arc::new(World {
        body: Body {
            primitive: None,
            mesh: mesh.clone(),
            mass: 0.5,
            inertia: solid.inertia_per_density * (0.5 / solid.volume),
            reference_point: solid.centroid,
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "bunny".into(),
            mesh,
            pose: Pose::identity(),
            surface: Surface::default(),
        }],
    })
}

/// The whole update, along the hand's path.
fn run(world: &Arc<World>, steps: usize, work_budget: Option<u64>) -> Vec<Update> {
    let start = Pose::new(Vector3::new(0.16, 0.02, 0.0), Vector3::new(0.0, 2.0, 0.0));
    let settings = Settings {
        work_budget,
        ..Settings::for_size(SIZE)
    };
    let mut god_object =
        GodObject::new(Arc::clone(world), settings, start).expect("apart at the start");
    let mut hand = Hand::new(start, 1);
    let (mut times, mut updates) = (Vec::new(), Vec::new());
    let mut work = Work::default();
    let (mut contacts, mut substeps, mut unfinished, mut failures) = (0, 0, 0, 0);
    let mut least = f64::INFINITY;
    for k in 0..APPROACH + steps {
        let before = *god_object.pose();
        let device = hand.next(&before);
        let clock = thread_cpu_us();
        let done = god_object.step(&device, None);
        let time = thread_cpu_us() - clock;
        if k < APPROACH {
            continue;
        }
        times.push(time);
        work += done.work;
        contacts += done.contacts;
        substeps += done.substeps;
        unfinished += u32::from(done.unfinished);
        failures += done.solver_failures;
        least = least.min(done.gap_min);
        updates.push(Update {
            before,
            after: *god_object.pose(),
            device,
        });
    }
    let path: f64 = updates
        .iter()
        .map(|u| (u.after.translation.vector - u.before.translation.vector).norm())
        .sum();
    report("update", &mut times);
    let each = |n: u64| n as f64 / steps as f64;
    println!(
        "{:>28}  {:.1} sub-steps, {:.1} contacts, path {path:.2} m, least gap {least:.2e} m, {unfinished} unfinished, {failures} failures",
        "",
        each(u64::from(substeps)),
        each(contacts as u64)
    );
    println!(
        "{:>28}  each: {:.0} node pairs, {:.0} triangle pairs, {:.0} feature pairs, {:.1} advancement steps; nominal {:.0} us",
        "",
        each(work.node_pairs),
        each(work.triangle_pairs),
        each(work.feature_pairs),
        each(work.advancement_steps),
        each(work.nominal_us())
    );
    updates
}

/// Time of impact alone. The contacts at the start are collected first, as in an update.
fn time_searches(
    name: &str,
    world: &World,
    settings: &Settings,
    motions: impl Iterator<Item = (Pose, Motion)>,
) {
    let advancement = AdvancementSettings {
        minimum_gap: settings.minimum_gap,
        gap_tolerance: settings.gap_tolerance,
        max_iterations: settings.max_advancement_steps,
        ..AdvancementSettings::default()
    };
    let (body, obstacle) = (&world.body.mesh, &world.obstacles[0]);
    let mut workspace = CollisionWorkspace::new();
    let mut contacts = Vec::with_capacity(settings.max_constraints);
    let (mut times, mut work, mut hits, mut limits) = (Vec::new(), Work::default(), 0, 0);
    let mut free = 0.0;
    for (before, motion) in motions {
        collect(
            world,
            settings.activation_distance,
            &before,
            &mut workspace,
            &mut contacts,
            &mut Work::default(),
        );
        let mut search = |motion: &Motion, work: &mut Work| {
            time_of_impact(
                body,
                motion,
                &obstacle.mesh,
                &obstacle.pose,
                &advancement,
                &mut workspace,
                work,
            )
        };
        // In an update, the search before ended here.
        let still = Motion {
            displacement: motion.displacement * 0.0,
            ..motion
        };
        let _ = search(&still, &mut Work::default());
        let clock = thread_cpu_us();
        let found = search(&motion, &mut work);
        times.push(thread_cpu_us() - clock);
        match found {
            TimeOfImpact::Separated => free += 1.0,
            TimeOfImpact::Impact { time } => {
                hits += 1;
                free += time;
            }
            TimeOfImpact::IterationLimit { time } => {
                limits += 1;
                free += time;
            }
            TimeOfImpact::Overlapping => panic!("the bodies never overlap"),
        }
    }
    let count = times.len();
    report(name, &mut times);
    let each = |n: u64| n as f64 / count as f64;
    println!(
        "{:>28}  {hits} of {count} hit, {limits} limits, {:.3} of the way free; each: {:.0} node pairs, {:.1} triangle pairs, {:.1} advancement steps",
        "",
        free / count as f64,
        each(work.node_pairs),
        each(work.triangle_pairs),
        each(work.advancement_steps)
    );
}

/// Collection alone, at the poses reached: within the activation distance, and within a look-ahead of 3 mm.
fn time_collection(world: &World, settings: &Settings, updates: &[Update]) {
    for (name, distance) in [
        ("collect, activation", settings.activation_distance),
        ("collect, 3 mm more", settings.activation_distance + 3e-3),
    ] {
        let mut workspace = CollisionWorkspace::new();
        let mut contacts = Vec::with_capacity(settings.max_constraints);
        let (mut times, mut work, mut found) = (Vec::new(), Work::default(), 0);
        for update in updates {
            let clock = thread_cpu_us();
            collect(
                world,
                distance,
                &update.after,
                &mut workspace,
                &mut contacts,
                &mut work,
            );
            times.push(thread_cpu_us() - clock);
            found += contacts.len();
        }
        report(name, &mut times);
        let each = |n: u64| n as f64 / updates.len() as f64;
        println!(
            "{:>28}  {:.1} contacts; each: {:.0} node pairs, {:.0} triangle pairs, {:.0} feature pairs",
            "",
            each(found as u64),
            each(work.node_pairs),
            each(work.triangle_pairs),
            each(work.feature_pairs)
        );
    }
}

fn collect(
    world: &World,
    distance: f64,
    pose: &Pose,
    workspace: &mut CollisionWorkspace,
    contacts: &mut Vec<Contact>,
    work: &mut Work,
) {
    let obstacle = &world.obstacles[0];
    contacts.clear();
    let _ = collect_contacts(
        &world.body.mesh,
        pose,
        &obstacle.mesh,
        &obstacle.pose,
        0,
        distance,
        workspace,
        contacts,
        work,
    );
}
