//! Prints what an update costs; asserts nothing about time.

use crate::geometry_shapes;

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::constraint::collect_contacts;
use god_object::geometry::Mesh;
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, six};

/// Attempts of a motion that hits, from each pose reached, and the contacts there; prints percentiles of the best of three.
#[allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method has none"
)]
fn measure(
    name: &str,
    body: &Mesh,
    obstacle: &Mesh,
    start: Pose,
    steps: usize,
    step: impl Fn(usize, &Pose) -> god_object::Vector6,
    activation: f64,
) {
    use std::time::Instant;
    let mut workspace = CollisionWorkspace::new();
    let settings = AdvancementSettings::default();
    let mut out = Vec::with_capacity(1024);
    let mut pose = start;
    let (mut impact, mut collect, mut sums) = (Vec::new(), Vec::new(), Work::default());
    let (mut contacts, mut hits) = (0, 0);
    for k in 0..steps {
        let motion = Motion {
            start: pose,
            displacement: step(k, &pose),
            reference_point: Point3::origin(),
        };
        let mut time = 0.0;
        let mut least = [f64::INFINITY; 2];
        let saved = workspace.clone();
        for _ in 0..3 {
            workspace.clone_from(&saved);
            let mut work = Work::default();
            let clock = Instant::now();
            let found = time_of_impact(
                body,
                &motion,
                obstacle,
                &Pose::identity(),
                &settings,
                &mut workspace,
                &mut work,
            );
            least[0] = least[0].min(clock.elapsed().as_secs_f64());
            time = match found {
                TimeOfImpact::Separated => 1.0,
                TimeOfImpact::Impact { time } => time,
                other => panic!("{other:?} at step {k}"),
            };
            let reached = motion.pose_at(time);
            out.clear();
            let clock = Instant::now();
            let collected = collect_contacts(
                body,
                &reached,
                obstacle,
                &Pose::identity(),
                0,
                activation,
                &mut workspace,
                &mut out,
                &mut work,
            );
            least[1] = least[1].min(clock.elapsed().as_secs_f64());
            assert!(
                collected.gap_min >= settings.minimum_gap,
                "{:e} {found:?} {:?}",
                collected.gap_min,
                out[0]
            );
            sums = work;
        }
        hits += usize::from(time < 1.0);
        pose = motion.pose_at(time);
        contacts += out.len();
        impact.push(least[0] * 1e6);
        collect.push(least[1] * 1e6);
    }
    for times in [&mut impact, &mut collect] {
        times.sort_by(f64::total_cmp);
    }
    let p = |t: &[f64], share: f64| t[((t.len() - 1) as f64 * share) as usize];
    println!(
        "{name}: {steps} steps, {hits} hits, {:.1} contacts; time of impact p50 {:.0} p99 {:.0} max {:.0} us; contacts p50 {:.0} p99 {:.0} max {:.0} us; last {sums:?}",
        contacts as f64 / steps as f64,
        p(&impact, 0.5),
        p(&impact, 0.99),
        p(&impact, 1.0),
        p(&collect, 0.5),
        p(&collect, 0.99),
        p(&collect, 1.0)
    );
}

#[test]
fn two_bunnies_slide() {
    let Some(soup) = geometry_shapes::read_ply("bunny_27k.ply") else {
        return;
    };
    let bunny = geometry_shapes::mesh(soup);
    for activation in [1e-4, 1.5e-3, 1e-2] {
        // Around the obstacle, always pressed towards its centre.
        let step = |k: usize, pose: &Pose| {
            let inwards = -pose.translation.vector.normalize();
            let around =
                Vector3::y().cross(&inwards) + Vector3::y() * (k as f64 * 0.05).sin() * 0.5;
            let size = 3e-4 + 2.7e-3 * (k as f64 * 0.37).sin().abs();
            six(
                &(inwards * size + around * size),
                &Vector3::new(0.006, 0.01, -0.004),
            )
        };
        measure(
            &format!("bunnies, {activation} m"),
            &bunny,
            &bunny,
            Pose::translation(0.2, 0.02, 0.0),
            300,
            step,
            activation,
        );
    }
}

#[test]
fn a_peg_moves_in_its_hole() {
    let peg = geometry_shapes::mesh(geometry_shapes::peg(8.0e-3, 0.025, 72));
    for sides in [66, 72] {
        let hole = geometry_shapes::mesh(geometry_shapes::hole(
            8.06e-3 / (std::f64::consts::PI / f64::from(sides)).cos(),
            0.025,
            0.02,
            sides,
        ));
        for activation in [1e-4, 5e-4] {
            let step = |k: usize, _: &Pose| {
                let u = k as f64 * 0.7;
                six(
                    &Vector3::new(1e-4 * u.cos(), 1e-4 * u.sin(), 2e-4 * (0.1 * u).sin()),
                    &Vector3::new(
                        1e-3 * (0.9 * u).sin(),
                        2e-3 * u.cos(),
                        0.01 * (0.3 * u).sin(),
                    ),
                )
            };
            measure(
                &format!("peg in {sides}-gon, {activation} m"),
                &peg,
                &hole,
                Pose::identity(),
                300,
                step,
                activation,
            );
        }
    }
}

/// The whole loop: a god-object held by a device that circles below the obstacle's surface.
#[test]
#[allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method has none"
)]
fn a_bunny_as_god_object_slides_on_a_bunny() {
    use god_object::{Body, GodObject, Obstacle, Settings, Surface, World};
    let Some(soup) = geometry_shapes::read_ply("bunny_27k.ply") else {
        return;
    };
    let bunny = geometry_shapes::mesh(soup);
    let solid = god_object::geometry::mass_properties(&bunny);
    let body = Body {
        mesh: bunny.clone(),
        primitive: None,
        mass: 0.5,
        inertia: solid.inertia_per_density * (0.5 / solid.volume),
        reference_point: solid.centroid,
    };
    let obstacle = Obstacle {
        name: "bunny".into(),
        mesh: bunny.clone(),
        primitive: None,
        pose: Pose::identity(),
        surface: Surface::default(),
    };
    let world = std::sync::Arc::new(World {
        body,
        obstacles: vec![obstacle],
    });
    let start = Pose::translation(0.2, 0.02, 0.0);
    let mut god_object =
        GodObject::new(world, Settings::for_size(0.15), start).expect("apart at the start");
    let (mut times, mut contacts, mut least, mut substeps, mut moved) =
        (Vec::new(), 0, f64::INFINITY, 0, 0.0);
    let steps = 100;
    for k in 0..steps {
        let u = f64::from(k) * 0.01;
        let device = Pose::new(
            Vector3::new(0.06 * u.cos(), 0.02, 0.06 * u.sin()),
            Vector3::new(0.2 * u.sin(), -u, 0.1),
        );
        let before = *god_object.pose();
        let clock = std::time::Instant::now();
        let report = god_object.step(&device, None);
        times.push(clock.elapsed().as_secs_f64() * 1e6);
        contacts += report.contacts;
        substeps += report.substeps;
        least = least.min(report.gap_min);
        moved += (before.translation.vector - god_object.pose().translation.vector).norm();
    }
    times.sort_by(f64::total_cmp);
    println!(
        "god-object bunny: {steps} updates, path {moved:.3} m, {:.1} contacts, {:.1} sub-steps, least gap {least:e}; p50 {:.0} p99 {:.0} max {:.0} us",
        contacts as f64 / f64::from(steps),
        f64::from(substeps) / f64::from(steps),
        times[times.len() / 2],
        times[times.len() * 99 / 100],
        times[times.len() - 1]
    );
    assert!(least >= 1.5e-6, "{least:e}");
}
