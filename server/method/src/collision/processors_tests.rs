//! The answers are the same, whatever vectors the processor has.

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use pulp::Arch;

use super::{AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact};
use crate::geometry::Mesh;
use crate::spatial::{Pose, six};

/// The level that every processor has, and those above it that this one has.
fn levels() -> Vec<Arch> {
    let mut all = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    {
        all.extend(pulp::x86::V3::try_new().map(Arch::V3));
        all.extend(pulp::x86::V4::try_new().map(Arch::V4));
    }
    #[cfg(not(target_arch = "x86_64"))]
    all.push(Arch::new());
    all
}

/// A ball of about 0.1 m with bumps, closed and turned outward.
pub(crate) fn bumpy_ball(rings: u32, sides: u32) -> Mesh {
    let mut vertices = vec![Point3::new(0.0, 0.0, 0.1), Point3::new(0.0, 0.0, -0.1)];
    for ring in 1..rings {
        for side in 0..sides {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let around = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let radius = 0.1 + 0.01 * (5.0 * polar).sin() * (3.0 * around).cos();
            let (z, rho) = (radius * polar.cos(), radius * polar.sin());
            vertices.push(Point3::new(rho * around.cos(), rho * around.sin(), z));
        }
    }
    let at = |ring: u32, side: u32| 2 + (ring - 1) * sides + side % sides;
    let mut triangles = Vec::new();
    for side in 0..sides {
        triangles.push([0, at(1, side), at(1, side + 1)]);
        triangles.push([1, at(rings - 1, side + 1), at(rings - 1, side)]);
        for ring in 1..rings - 1 {
            let (a, b) = (at(ring, side), at(ring, side + 1));
            let (c, d) = (at(ring + 1, side), at(ring + 1, side + 1));
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    Mesh::new(vertices, triangles).expect("a ball")
}

#[test]
fn the_same_searches_find_the_same_to_the_bit_with_any_vectors() {
    let (body, obstacle) = (bumpy_ball(24, 30), bumpy_ball(31, 37));
    let search = |processor: Arch| -> Vec<(TimeOfImpact, u64, u64)> {
        let mut workspace = CollisionWorkspace::new();
        workspace.turned.set_processor(processor);
        let motion = |k: usize| {
            let u = k as f64;
            let from = Vector3::new((1.3 * u).sin(), (0.7 * u).cos(), (2.1 * u).sin());
            let turn = Vector3::new((0.9 * u).cos(), (1.7 * u).sin(), (0.3 * u).cos());
            Motion {
                start: Pose::from_parts(
                    Translation3::from(from.normalize() * 0.28),
                    UnitQuaternion::from_scaled_axis(turn),
                ),
                displacement: six(&(-from.normalize() * 0.2), &(1.2 * turn)),
                reference_point: Point3::new(0.01, 0.0, 0.02),
            }
        };
        (0..60)
            .map(|k| {
                let mut work = Work::default();
                let found = time_of_impact(
                    &body,
                    &motion(k),
                    &obstacle,
                    &Pose::identity(),
                    &AdvancementSettings::default(),
                    &mut workspace,
                    &mut work,
                );
                (found, work.node_pairs, work.triangle_pairs)
            })
            .collect()
    };
    let answers: Vec<_> = levels().into_iter().map(search).collect();
    let hits = answers[0]
        .iter()
        .filter(|(found, ..)| matches!(found, TimeOfImpact::Impact { .. }));
    assert!(hits.count() > 30);
    for others in &answers[1..] {
        assert_eq!(&answers[0], others);
    }
}
