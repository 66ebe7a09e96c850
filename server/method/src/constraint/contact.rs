//! Contact: a local minimum of the distance between the body and an obstacle.

use nalgebra::{Point3, Vector3};

use super::FeaturePair;

/// Two features that face each other within the activation distance. World frame, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Which features; persistent through time.
    pub features: FeaturePair,
    /// Closest point on the body, m.
    pub point_on_body: Point3<f64>,
    /// Closest point on the obstacle, m.
    pub point_on_obstacle: Point3<f64>,
    /// Unit normal, from the obstacle to the body; taken from the features, not from the difference of the points,
    /// wherever a feature has a normal.
    pub normal: Vector3<f64>,
    /// Distance along `normal`, m, >= 0.
    pub gap: f64,
    /// A triangle of the obstacle that contains `point_on_obstacle`.
    pub obstacle_triangle: u32,
    /// Weights of that triangle's corners at `point_on_obstacle`; they sum to 1.
    pub barycentric: [f64; 3],
}

/// What a collection says about itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collected {
    /// More contacts than capacity: the nearest were kept.
    pub truncated: bool,
    /// Every contact with a smaller gap was found and kept, m: the distance asked for, less where room or work did not suffice.
    pub complete_within: f64,
    /// Pairs of triangles, and of their features, that were looked at.
    pub looked_at: u64,
    /// Smallest gap, m; infinite when no contact is within the activation distance.
    pub gap_min: f64,
}
