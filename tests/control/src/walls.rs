//! Constraint sets made by hand, and a body to hold against them: the coupling without collision detection.

use god_object::constraint::{Feature, FeaturePair, Separation};
use god_object::{ConstraintSet, NonPenetrationConstraint, Settings, World};
use nalgebra::{Point3, Vector3};
use taut_method_tests::solids::{body, mesh};
use taut_scene::shapes::cuboid;

/// Half of the longest side of [`body`], m.
pub const HALF_LENGTH: f64 = 0.05;

/// A cube of 1 kg alone.
pub fn cube() -> World {
    World {
        body: body(mesh(cuboid([HALF_LENGTH; 3]))),
        obstacles: Vec::new(),
    }
}

/// A coupling that renders `stiffness` (N/m) with 1 kg, linear up to any force.
pub fn linear(stiffness: f64) -> Settings {
    let defaults = Settings::for_size(2.0 * HALF_LENGTH);
    Settings {
        k_h: stiffness / defaults.k_s,
        adaptation: None,
        force_limit: 1e12,
        torque_limit: 1e12,
        ..defaults
    }
}

/// Contacts of a body whose reference point is at the origin: point and normal each, at rest distance, so that force begins at
/// once.
pub fn contacts(settings: &Settings, places: &[(Point3<f64>, Vector3<f64>)]) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(places.len());
    set.gap_min = settings.rest_distance;
    for (index, (point, normal)) in (0..).zip(places) {
        set.constraints.push(NonPenetrationConstraint {
            features: FeaturePair {
                obstacle: 0,
                on_body: Feature::Vertex(index),
                on_obstacle: Feature::Face(index),
            },
            point: *point,
            normal: *normal,
            gap: settings.rest_distance,
            separation: Separation::default(),
            obstacle_displacement: Vector3::zeros(),
            shading_normal: None,
        });
    }
    set
}

/// A wall that holds the reference point from both sides along x.
pub fn both_sides_of_x() -> Vec<(Point3<f64>, Vector3<f64>)> {
    vec![
        (Point3::origin(), Vector3::x()),
        (Point3::origin(), -Vector3::x()),
    ]
}

/// A wall at x = 0 that holds the reference point above it.
pub fn above_x() -> Vec<(Point3<f64>, Vector3<f64>)> {
    vec![(Point3::origin(), Vector3::x())]
}

/// Stops on both sides of a body's ends along x: they hold it in y and about z.
pub fn stops_about_z() -> Vec<(Point3<f64>, Vector3<f64>)> {
    [HALF_LENGTH, -HALF_LENGTH]
        .into_iter()
        .flat_map(|x| [1.0, -1.0].map(|side| (Point3::new(x, 0.0, 0.0), Vector3::y() * side)))
        .collect()
}
