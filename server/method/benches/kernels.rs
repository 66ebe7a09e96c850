//! The kernels of an update: `cargo bench -p god-object --bench kernels`. Wall-clock time.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;
#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/projection_support/mod.rs"]
mod projection_support;

use divan::{Bencher, black_box};
use geometry_shapes::{fine_hole, fine_peg, icosphere, mesh, read_ply};
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, meshes_intersect,
    time_of_impact,
};
use god_object::constraint::collect_contacts;
use god_object::nalgebra::{Point3, Vector3};
use god_object::quasi_statics::{Projector, SolverKind};
use god_object::spatial::six;
use god_object::{Mesh, Pose};
use projection_support::{FAMILIES, Random, hand_motion, hand_sized_metric, rows_of};

/// Problems of one size that a bench goes round.
const PROBLEMS: usize = 128;
const ROWS: [usize; 5] = [4, 12, 30, 60, 1000];
/// Pairs of meshes, and how far apart contacts are collected, m.
const PAIRS: [&str; 3] = [
    "spheres 5,120",
    "bunnies 27,000",
    "peg 27,000 in hole 27,000",
];
const ACTIVATION: f64 = 1e-4;

fn main() {
    divan::main();
}

fn project(bencher: Bencher, rows: usize, warm: bool) {
    let metric = hand_sized_metric();
    let random = &mut Random(1);
    let mut projector = Projector::new(SolverKind::ActiveSet, rows);
    let problems: Vec<_> = (0..PROBLEMS)
        .map(|k| {
            let rows = rows_of(k % FAMILIES.len(), rows, k % 2 == 0, random);
            let last = hand_motion(random);
            let active: Vec<u32> = if warm {
                let answer = projector.project(&metric, &last, &rows, &[]);
                answer.active.iter().map(|row| row.row).collect()
            } else {
                Vec::new()
            };
            // The next tick: the hand has moved by a hundredth.
            (rows, last + hand_motion(random) * 0.01, active)
        })
        .collect();
    let mut k = 0;
    bencher.bench_local(|| {
        let (rows, a_u, active) = &problems[k % PROBLEMS];
        k += 1;
        black_box(projector.project(&metric, black_box(a_u), rows, active))
    });
}

#[divan::bench(args = ROWS)]
fn projection_cold(bencher: Bencher, rows: usize) {
    project(bencher, rows, false);
}

#[divan::bench(args = ROWS)]
fn projection_warm(bencher: Bencher, rows: usize) {
    project(bencher, rows, true);
}

fn pairs() -> Vec<&'static str> {
    let bunnies = read_ply("bunny_27k.ply").is_some();
    PAIRS
        .into_iter()
        .filter(|name| bunnies || *name != PAIRS[1])
        .collect()
}

/// Two meshes, and a motion of the first that hits the second.
fn pair(name: &str) -> (Mesh, Mesh, Motion) {
    let motion = |start: Pose, way: Vector3<f64>| Motion {
        start,
        displacement: six(&way, &Vector3::new(0.004, 0.008, -0.003)),
        reference_point: Point3::origin(),
    };
    if name == PAIRS[0] {
        let ball = mesh(icosphere(0.05, 4));
        let start = Pose::translation(0.1007, 0.0, 0.0);
        (
            ball.clone(),
            ball,
            motion(start, Vector3::new(-2e-3, 1e-3, 0.0)),
        )
    } else if name == PAIRS[1] {
        let bunny = mesh(read_ply(PAIRS_MESH).expect("listed when it is there"));
        // From the surface: as far as the motion towards the middle is free, less half a millimetre.
        let far = motion(
            Pose::translation(0.2, 0.02, 0.0),
            Vector3::new(-0.2, -0.02, 0.0),
        );
        let reached = far.pose_at(impact(&bunny, &bunny, &far));
        let start = Pose::translation(5e-4, 0.0, 0.0) * reached;
        (
            bunny.clone(),
            bunny,
            motion(start, Vector3::new(-2e-3, 1e-3, 0.0)),
        )
    } else {
        (
            mesh(fine_peg(10e-3, 30e-3, 120, 112)),
            mesh(fine_hole(10.1e-3, 30e-3, 25e-3, 120, 109)),
            motion(Pose::identity(), Vector3::new(2e-4, 0.0, 2e-3)),
        )
    }
}

const PAIRS_MESH: &str = "bunny_27k.ply";

fn impact(body: &Mesh, obstacle: &Mesh, motion: &Motion) -> f64 {
    let found = time_of_impact(
        body,
        motion,
        obstacle,
        &Pose::identity(),
        &AdvancementSettings::default(),
        &mut CollisionWorkspace::new(),
        &mut Work::default(),
    );
    match found {
        TimeOfImpact::Separated => 1.0,
        TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
        TimeOfImpact::Overlapping => 0.0,
    }
}

/// Without hints from an update before.
#[divan::bench(args = pairs())]
fn time_of_impact_cold(bencher: Bencher, name: &str) {
    let (body, obstacle, motion) = pair(name);
    bencher.bench_local(|| black_box(impact(&body, &obstacle, black_box(&motion))));
}

/// With the contacts of the same place as hints, as in a body that slides.
#[divan::bench(args = pairs())]
fn time_of_impact_warm(bencher: Bencher, name: &str) {
    let (body, obstacle, motion) = pair(name);
    let mut workspace = CollisionWorkspace::new();
    bencher.bench_local(|| {
        black_box(time_of_impact(
            &body,
            black_box(&motion),
            &obstacle,
            &Pose::identity(),
            &AdvancementSettings::default(),
            &mut workspace,
            &mut Work::default(),
        ))
    });
}

#[divan::bench(args = pairs())]
fn collect(bencher: Bencher, name: &str) {
    let (body, obstacle, motion) = pair(name);
    let reached = motion.pose_at(impact(&body, &obstacle, &motion));
    let mut workspace = CollisionWorkspace::new();
    let mut contacts = Vec::with_capacity(1024);
    bencher.bench_local(|| {
        contacts.clear();
        black_box(collect_contacts(
            &body,
            black_box(&reached),
            &obstacle,
            &Pose::identity(),
            0,
            ACTIVATION,
            &mut workspace,
            &mut contacts,
            &mut Work::default(),
        ))
    });
}

#[divan::bench(args = pairs())]
fn intersection(bencher: Bencher, name: &str) {
    let (body, obstacle, motion) = pair(name);
    let reached = motion.pose_at(impact(&body, &obstacle, &motion));
    bencher.bench_local(|| {
        black_box(meshes_intersect(
            &body,
            black_box(&reached),
            &obstacle,
            &Pose::identity(),
        ))
    });
}

/// Checks, topology and tree of a mesh of 27,000 triangles.
#[divan::bench(sample_count = 20, sample_size = 1)]
fn mesh_of_27_000_triangles(bencher: Bencher) {
    let soup = fine_peg(10e-3, 30e-3, 120, 112);
    bencher
        .with_inputs(|| soup.clone())
        .bench_local_values(mesh);
}
