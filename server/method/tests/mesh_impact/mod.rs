//! The search for the time of impact of two meshes, as the tests of collision ask for it.

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::geometry::Mesh;
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, Vector6};
use proptest::prelude::*;

pub(crate) const SETTINGS: AdvancementSettings = AdvancementSettings {
    minimum_gap: 1e-6,
    gap_tolerance: 1e-7,
    max_iterations: 200,
    interval_edges: 0.5,
    max_intervals: 64,
};

pub(crate) fn search(
    body: &Mesh,
    motion: &Motion,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
) -> TimeOfImpact {
    time_of_impact(
        body,
        motion,
        obstacle,
        obstacle_pose,
        &SETTINGS,
        &mut CollisionWorkspace::new(),
        &mut Work::default(),
    )
}

/// A motion of the body frame itself.
pub(crate) fn straight(start: Pose, displacement: Vector6) -> Motion {
    Motion {
        start,
        displacement,
        reference_point: Point3::origin(),
    }
}

/// Vectors whose components are less than `range`.
pub(crate) fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-range..range, -range..range, -range..range].prop_map(Vector3::from)
}
