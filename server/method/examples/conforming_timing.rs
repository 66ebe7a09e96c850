//! Times updates and forces of conforming contact: `cargo run --release --example conforming_timing -- [filter] [reference stride] [pace] [work budget, nominal us]`.
//!
//! A peg of 27,000 triangles in a hole of 27,000 triangles at three clearances, exact and with vertices perturbed by a micrometre, and a
//! nut on its bolt where `TAUT_DATA` or `../shared/data` has them. The device inserts, pushes sideways, tilts, slides along and turns at 1 kHz.
//! Forces are those for the device pose one millisecond after the set; every few steps they are held against the projection
//! on every facing pair within reach. Times are CPU time of the thread; the nominal work says the same on every machine, busy or not.
#![allow(
    clippy::disallowed_methods,
    reason = "a measurement reads files and arguments; the method does not"
)]

#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;

use std::sync::Arc;

use geometry_shapes::{Soup, data_dir, mesh, read_ply, roughened};
use god_object::collision::{CollisionWorkspace, Work};
use god_object::constraint::{Contact, collect_contacts, contact_jacobian};
use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use god_object::quasi_statics::{HalfSpace, Projector, SolverKind};
use god_object::spatial::{angular, at_reference_point, linear, pose_difference, six};
use god_object::{
    Body, Coupling, GodObject, Mesh, Obstacle, Pose, Settings, Surface, Vector6, World,
};
use rustix::time::{ClockId, clock_gettime};

const RADIUS: f64 = 10e-3;
const HALF_PEG: f64 = 30e-3;
const HALF_HOLE: f64 = 25e-3;
const AROUND: u32 = 120;
const PEG_ALONG: u32 = 112;
const HOLE_ALONG: u32 = 109;
/// Candidates of the reference: every facing pair within reach.
const EVERY: usize = 1 << 18;
/// Forces below this are not compared relatively, N.
const LEAST_FORCE: f64 = 0.5;

fn main() {
    let filter = std::env::args().nth(1).unwrap_or_default();
    let stride = std::env::args()
        .nth(2)
        .map_or(20, |s| s.parse().expect("a stride"));
    let pace: u32 = std::env::args()
        .nth(3)
        .map_or(1, |s| s.parse().expect("a pace"));
    for clearance in [0.5e-3, 0.1e-3, 0.05e-3] {
        for noise in [0.0, 1e-6] {
            let name = format!("peg {:.2} mm, noise {:.0} um", clearance * 1e3, noise * 1e6);
            if !name.contains(&filter) {
                continue;
            }
            let obstacle_pose =
                Pose::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.7, -0.4, 1.1));
            let peg = mesh(roughened(fine_peg(), noise, 1));
            let hole = mesh(roughened(fine_hole(RADIUS + clearance), noise, 2));
            let path: Vec<Pose> = (0..2200 / pace)
                .map(|k| obstacle_pose * hand(f64::from(k * pace) * 1e-3))
                .collect();
            measure(&name, peg, hole, obstacle_pose, 0.06, &path, stride);
        }
    }
    if "nut on bolt".contains(&filter) {
        let assembly = |file: &str| read_ply(&format!("assembly/{file}"));
        if let (Some(nut), Some(bolt), Some(path)) =
            (assembly("nut_m24.ply"), assembly("bolt_m24.ply"), trace())
        {
            measure(
                "nut on bolt",
                mesh(nut),
                mesh(bolt),
                Pose::identity(),
                0.04,
                &path,
                stride,
            );
        }
    }
}

/// Pose of the peg in the hole's frame at time `t`, s: inserted, pushed sideways, tilted, slid along, turned.
fn hand(t: f64) -> Pose {
    let ramp = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
    let z = 0.06 * (1.0 - ramp(0.0, 0.35)) + 0.018 * (20.0 * ramp(0.9, 1.5) * 0.6).sin();
    // 2 mm to the side, and around slowly.
    let push = 2e-3 * ramp(0.35, 0.4);
    let direction = 0.4 + 3.0 * ramp(0.45, 2.2);
    let tremor = 0.05e-3 * (60.0 * t).sin();
    let tilt = 0.03 * (std::f64::consts::TAU * ramp(0.6, 0.9)).sin() + 2e-3 * (47.0 * t).sin();
    let turn = 2.0 * ramp(1.5, 2.2);
    let turned = UnitQuaternion::from_scaled_axis(Vector3::new(tilt, 0.5 * tilt, 0.0))
        * UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
    Pose::from_parts(
        Vector3::new(
            push * direction.cos() + tremor,
            push * direction.sin() - tremor,
            z,
        )
        .into(),
        turned,
    )
}

/// A prism whose sides are cut along the axis, too.
fn fine_peg() -> Soup {
    let mut vertices = vec![
        Point3::new(0.0, 0.0, -HALF_PEG),
        Point3::new(0.0, 0.0, HALF_PEG),
    ];
    let mut triangles = Vec::new();
    let at = |i: u32, k: u32| 2 + (i % AROUND) * (PEG_ALONG + 1) + k;
    for i in 0..AROUND {
        let u = std::f64::consts::TAU * f64::from(i) / f64::from(AROUND);
        for k in 0..=PEG_ALONG {
            let z = HALF_PEG * (2.0 * f64::from(k) / f64::from(PEG_ALONG) - 1.0);
            vertices.push(Point3::new(RADIUS * u.cos(), RADIUS * u.sin(), z));
        }
        triangles.extend([
            [0, at(i + 1, 0), at(i, 0)],
            [1, at(i, PEG_ALONG), at(i + 1, PEG_ALONG)],
        ]);
        for k in 0..PEG_ALONG {
            let q = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    (vertices, triangles)
}

/// A ring-shaped block whose inner wall is cut along the axis, too.
fn fine_hole(inner: f64) -> Soup {
    let outer = 3.0 * RADIUS;
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let column = HOLE_ALONG + 3;
    let at = |i: u32, k: u32| (i % AROUND) * column + k;
    for i in 0..AROUND {
        // Facets of hole and peg are not aligned.
        let u = std::f64::consts::TAU * (f64::from(i) + 0.3) / f64::from(AROUND);
        let mut push = |r: f64, z: f64| vertices.push(Point3::new(r * u.cos(), r * u.sin(), z));
        for k in 0..=HOLE_ALONG {
            push(
                inner,
                HALF_HOLE * (2.0 * f64::from(k) / f64::from(HOLE_ALONG) - 1.0),
            );
        }
        push(outer, -HALF_HOLE);
        push(outer, HALF_HOLE);
        let (low, high) = (HOLE_ALONG + 1, HOLE_ALONG + 2);
        let mut quad = |q: [u32; 4]| triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        for k in 0..HOLE_ALONG {
            quad([at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)]);
        }
        quad([
            at(i, HOLE_ALONG),
            at(i, high),
            at(i + 1, high),
            at(i + 1, HOLE_ALONG),
        ]);
        quad([at(i, high), at(i, low), at(i + 1, low), at(i + 1, high)]);
        quad([at(i, low), at(i, 0), at(i + 1, 0), at(i + 1, low)]);
    }
    (vertices, triangles)
}

/// Every tenth row of the nut's trace.
fn trace() -> Option<Vec<Pose>> {
    let file = data_dir()?.join("assembly/nut_bolt_m24_trace.csv");
    let text = std::fs::read_to_string(file).ok()?;
    let rows = text.lines().skip(1).step_by(10).map(|line| {
        let n: Vec<f64> = line
            .split(',')
            .map(|x| x.parse().expect("a number"))
            .collect();
        Pose::from_parts(
            Vector3::new(n[1], n[2], n[3]).into(),
            UnitQuaternion::from_quaternion(Quaternion::new(n[4], n[5], n[6], n[7])),
        )
    });
    Some(rows.collect())
}

fn measure(
    name: &str,
    body: Mesh,
    obstacle: Mesh,
    obstacle_pose: Pose,
    size: f64,
    path: &[Pose],
    stride: usize,
) {
    println!(
        "{name}: {} and {} triangles",
        body.triangles().len(),
        obstacle.triangles().len()
    );
    let solid = mass_properties(&body);
    let world = Arc::new(World {
        body: Body {
            primitive: None,
            mesh: body,
            mass: 1.0,
            inertia: solid.inertia_per_density / solid.volume,
            reference_point: solid.centroid,
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "hole".into(),
            mesh: obstacle,
            pose: obstacle_pose,
            surface: Surface::default(),
        }],
    });
    let work_budget = std::env::args()
        .nth(4)
        .map(|s| s.parse().expect("a work budget"));
    let settings = Settings {
        work_budget,
        adaptation: None,
        force_limit: 1e3,
        torque_limit: 1e3,
        ..Settings::for_size(size)
    };
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object =
        GodObject::new(Arc::clone(&world), settings, path[0]).expect("a free start");
    let mut every = Every::new(settings);
    let (mut update, mut force, mut rows, mut lengths) = (vec![], vec![], vec![], vec![]);
    let mut nominal = vec![];
    let (mut errors, mut relative, mut torques, mut reference_rows) =
        (vec![], vec![], vec![], vec![]);
    let (mut substeps, mut unfinished, mut arrivals, mut truncated) = (0, 0, 0, 0);
    let mut work = Work::default();
    let mut known: Vec<god_object::constraint::FeaturePair> = Vec::new();
    for (k, pair) in path.windows(2).enumerate() {
        let clock = cpu_us();
        let report = god_object.step(&pair[0], None);
        update.push(cpu_us() - clock);
        work += report.work;
        nominal.push(report.work.nominal_us() as f64);
        substeps += report.substeps;
        unfinished += u32::from(report.unfinished);
        let set = god_object.constraint_set();
        let clock = cpu_us();
        let felt = coupling.step(k as f64 * 1e-3, &pair[1], set);
        force.push(cpu_us() - clock);
        rows.push(set.constraints.len() as f64);
        truncated += u32::from(set.truncated);
        arrivals += set
            .constraints
            .iter()
            .filter(|row| known.binary_search(&row.features).is_err())
            .count();
        known.clear();
        known.extend(set.constraints.iter().map(|row| row.features));
        let lag = (pair[0].translation.vector - god_object.pose().translation.vector).norm();
        lengths.push(lag * 1e6);
        if k.is_multiple_of(stride) {
            let (expected, count) = every.force(&world, god_object.pose(), &pair[1]);
            let error = felt.wrench - expected;
            errors.push(linear(&error).norm());
            torques.push(angular(&error).norm());
            relative
                .push(100.0 * linear(&error).norm() / linear(&expected).norm().max(LEAST_FORCE));
            reference_rows.push(count as f64);
        }
    }
    percentiles("update, us", &mut update);
    percentiles("work, nominal us", &mut nominal);
    percentiles("force, us", &mut force);
    percentiles("rows", &mut rows);
    percentiles("rows within reach", &mut reference_rows);
    percentiles("force error, N", &mut errors);
    percentiles("force error, %", &mut relative);
    percentiles("torque error, N m", &mut torques);
    percentiles("device from body, um", &mut lengths);
    let each = |n: f64| n / path.len() as f64;
    println!(
        "{:>24}  {:.1} sub-steps, {:.1} new rows, {unfinished} unfinished, {truncated} truncated; each: {:.0} node pairs, {:.0} triangle pairs, {:.0} feature pairs, {:.0} advancement steps, {:.1} projections",
        "",
        each(f64::from(substeps)),
        each(arrivals as f64),
        each(work.node_pairs as f64),
        each(work.triangle_pairs as f64),
        each(work.feature_pairs as f64),
        each(work.advancement_steps as f64),
        each(work.projections as f64),
    );
}

/// The force by every facing pair within reach.
struct Every {
    settings: Settings,
    workspace: CollisionWorkspace,
    contacts: Vec<Contact>,
    rows: Vec<HalfSpace>,
    projector: Projector,
}

impl Every {
    fn new(settings: Settings) -> Self {
        Self {
            settings,
            workspace: CollisionWorkspace::with_candidates(2 * EVERY),
            contacts: Vec::with_capacity(EVERY),
            rows: Vec::with_capacity(EVERY),
            projector: Projector::new(SolverKind::ActiveSet, EVERY),
        }
    }

    fn force(&mut self, world: &World, pose: &Pose, device: &Pose) -> (Vector6, usize) {
        let body = &world.body;
        let obstacle = &world.obstacles[0];
        let at = at_reference_point(pose, &body.reference_point);
        let difference = pose_difference(
            &at_reference_point(device, &body.reference_point),
            &at,
            &Vector3::zeros(),
        );
        // No point moves further than this: a pair further apart cannot hold anything.
        let radius = body.mesh.radius_about(&body.reference_point);
        let reach = linear(&difference).norm()
            + radius * angular(&difference).norm()
            + 2.0 * self.settings.rest_distance;
        self.contacts.clear();
        let collected = collect_contacts(
            &body.mesh,
            pose,
            &obstacle.mesh,
            &obstacle.pose,
            0,
            reach,
            &mut self.workspace,
            &mut self.contacts,
            &mut Work::default(),
        );
        assert!(!collected.truncated, "the reference holds every pair");
        let center = Point3::from(at.translation.vector);
        let k_s = self.settings.k_s;
        self.rows.clear();
        self.rows.extend(self.contacts.iter().map(|c| HalfSpace {
            jacobian: contact_jacobian(&c.normal, &c.point_on_obstacle, &center),
            bound: (k_s * (self.settings.rest_distance - c.gap)).min(0.0),
        }));
        let metric = body
            .metric(self.settings.rotation_metric, pose)
            .expect("a metric");
        let unconstrained = difference * k_s;
        let projection = self
            .projector
            .project(&metric, &unconstrained, &self.rows, &[]);
        let change = projection.acceleration - unconstrained;
        let wrench = metric.mass_matrix_times(&change) * self.settings.k_h;
        (six(&linear(&wrench), &angular(&wrench)), self.rows.len())
    }
}

fn cpu_us() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

fn percentiles(name: &str, values: &mut [f64]) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize];
    println!(
        "{name:>24}: p50 {:10.3}  p99 {:10.3}  p99.9 {:10.3}  max {:10.3}",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}
