//! Times updates of a peg as an exact cylinder beside the same peg of 27,000 triangles: `cargo run --release --example primitive_timing`.
//!
//! The hole has 27,000 triangles, or 288. Both pegs get the same device poses, update by update in turn, so that their ratio does not depend on
//! what else the machine does. Percentiles over updates, us.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "a measurement needs a clock; the method itself has none"
)]

use std::sync::Arc;
use std::time::Instant;

use god_object::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use god_object::{Body, GodObject, Mesh, Obstacle, Pose, Primitive, Settings, Surface, World};

const RADIUS: f64 = 10e-3;
const HALF_PEG: f64 = 30e-3;
const CLEARANCE: f64 = 0.5e-3;
const UPDATES: u32 = 600;

fn main() {
    let peg = tube(120, 112, None);
    for (around, along) in [(120, 109), (72, 1)] {
        let hole = tube(around, along, Some(RADIUS + CLEARANCE));
        let triangles = hole.triangles().len();
        let mut exact = start(Some(cylinder()), &peg, &hole);
        let mut faceted = start(None, &peg, &hole);
        let mut times = [Vec::new(), Vec::new()];
        let mut rows = [0, 0];
        for k in 0..UPDATES {
            let device = hand(f64::from(k) / f64::from(UPDATES));
            for (i, god_object) in [&mut exact, &mut faceted].into_iter().enumerate() {
                let started = Instant::now();
                let report = god_object.step(&device, None);
                times[i].push(started.elapsed().as_secs_f64() * 1e6);
                rows[i] = rows[i].max(report.contacts);
            }
        }
        let apart = (exact.pose().translation.vector - faceted.pose().translation.vector).norm();
        println!(
            "hole of {triangles} triangles; the pegs end {:.1} um apart",
            apart * 1e6
        );
        for (name, (times, rows)) in ["cylinder", "27,000 triangles"]
            .iter()
            .zip(times.iter_mut().zip(rows))
        {
            times.sort_by(f64::total_cmp);
            let at = |share: f64| times[(share * (times.len() - 1) as f64) as usize];
            println!(
                "  {name:>17}: p50 {:9.1}  p99 {:9.1}  max {:9.1} us, at most {rows} rows",
                at(0.5),
                at(0.99),
                at(1.0)
            );
        }
    }
}

/// Goes in, is pushed aside and round, tilts, and turns.
fn hand(t: f64) -> Pose {
    let ramp = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
    let depth = 0.062 * (1.0 - ramp(0.0, 0.4));
    let push = 2e-3 * ramp(0.3, 0.5);
    let around = 4.0 * ramp(0.5, 1.0);
    let tilt = 0.02 * (10.0 * ramp(0.6, 1.0)).sin();
    Pose::from_parts(
        Vector3::new(push * around.cos(), push * around.sin(), depth).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(tilt, 0.0, 2.0 * ramp(0.7, 1.0))),
    )
}

fn cylinder() -> Primitive {
    Primitive::Cylinder {
        ends: [
            Point3::new(0.0, 0.0, -HALF_PEG),
            Point3::new(0.0, 0.0, HALF_PEG),
        ],
        radius: RADIUS,
    }
}

fn start(primitive: Option<Primitive>, peg: &Mesh, hole: &Mesh) -> GodObject {
    let world = World {
        body: Body {
            mesh: peg.clone(),
            primitive,
            mass: 1.0,
            inertia: Matrix3::identity() * 3e-4,
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            name: "hole".into(),
            mesh: hole.clone(),
            primitive: None,
            pose: Pose::identity(),
            surface: Surface::default(),
        }],
    };
    GodObject::new(Arc::new(world), Settings::for_size(0.06), hand(0.0)).expect("a free start")
}

/// A prism about z cut `along` times, or a ring around a prismatic hole of this apothem.
fn tube(around: u32, along: u32, hole: Option<f64>) -> Mesh {
    let mut vertices = Vec::new();
    let circumradius = hole.map_or(RADIUS, |apothem| {
        apothem / (std::f64::consts::PI / f64::from(around)).cos()
    });
    let outer = if hole.is_some() { 3.0 * RADIUS } else { 0.0 };
    for i in 0..around {
        let u = std::f64::consts::TAU * (f64::from(i) + 0.3) / f64::from(around);
        for k in 0..=along {
            let z = HALF_PEG * (2.0 * f64::from(k) / f64::from(along) - 1.0);
            vertices.push(Point3::new(
                circumradius * u.cos(),
                circumradius * u.sin(),
                z,
            ));
        }
        if hole.is_some() {
            for z in [-HALF_PEG, HALF_PEG] {
                vertices.push(Point3::new(outer * u.cos(), outer * u.sin(), z));
            }
        }
    }
    let column = along + 1 + if hole.is_some() { 2 } else { 0 };
    let at = |i: u32, k: u32| (i % around) * column + k;
    let mut triangles = Vec::new();
    for i in 0..around {
        for k in 0..along {
            let q = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            if hole.is_some() {
                triangles.extend([[q[0], q[2], q[1]], [q[0], q[3], q[2]]]);
            } else {
                triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            }
        }
        if hole.is_some() {
            let (low, high) = (along + 1, along + 2);
            let mut quad = |q: [u32; 4]| triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            quad([at(i, low), at(i + 1, low), at(i + 1, high), at(i, high)]);
            quad([at(i, along), at(i, high), at(i + 1, high), at(i + 1, along)]);
            quad([at(i, 0), at(i + 1, 0), at(i + 1, low), at(i, low)]);
        } else {
            let middle = vertices.len() as u32;
            triangles.extend([
                [middle, at(i + 1, 0), at(i, 0)],
                [middle + 1, at(i, along), at(i + 1, along)],
            ]);
        }
    }
    if hole.is_none() {
        vertices.extend([-HALF_PEG, HALF_PEG].map(|z| Point3::new(0.0, 0.0, z)));
    }
    Mesh::new(vertices, triangles).expect("closed")
}
