//! The constraint set: what the god-object loop hands to the coupling loop, as one value.
//!
//! | symbol      | name in code                             | unit | meaning                                      |
//! |-------------|------------------------------------------|------|----------------------------------------------|
//! | I_k         | [`NonPenetrationConstraint::point`]      | m    | contact point on the obstacle, world         |
//! | n_k         | [`NonPenetrationConstraint::normal`]     | –    | unit, obstacle to god-object, world          |
//! | g_k         | [`NonPenetrationConstraint::gap`]        | m    | distance between the two features, >= 0      |
//! | J_k         | [`contact_jacobian`]                     |      | `[n; r x n]`, `r = I - G`                    |
//! | h_k         | `gap - rest_distance`                    | m    | what the gap may still close by              |
//!
//! Source: Ortega et al. 2007, Sections 4.2 and 5. Rows with a gap are look-ahead constraints, beyond the paper.

use nalgebra::{Point3, Vector3};

use super::{FeaturePair, Separation};
use crate::prepared_rows::PreparedRows;
use crate::spatial::{Pose, Vector6, six};

/// A half-space of accelerations that one pair of facing features allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonPenetrationConstraint {
    /// The persistent id: which features face each other.
    pub features: FeaturePair,
    /// Contact point on the obstacle, world, m. Where a corner would meet a face that it is not over yet: on the plane of that face.
    pub point: Point3<f64>,
    /// Unit normal, from the obstacle to the god-object, world.
    pub normal: Vector3<f64>,
    /// Distance between the features, m.
    pub gap: f64,
    /// How the distance changes when the body turns.
    pub separation: Separation,
    /// How far the obstacle's point at the contact went in the update that made the set, world, m: zero for what stands still.
    pub obstacle_displacement: Vector3<f64>,
    /// Interpolated normal where the surface is shaded, Section 6.1.
    pub shading_normal: Option<Vector3<f64>>,
}

impl NonPenetrationConstraint {
    /// How far the obstacle came along the normal in that update, m: negative where it gave way.
    pub fn approach(&self) -> f64 {
        self.normal.dot(&self.obstacle_displacement)
    }
}

/// A god-object pose and the constraints that hold there; replaced as a whole, never in part.
#[derive(Debug, Default)]
pub struct ConstraintSet {
    /// Counts the sets; 0 is the set at the start.
    pub sequence: u64,
    /// Pose of the body's own frame at which the constraints hold.
    pub god_object_pose: Pose,
    /// When it was published, s, on the clock of the times that the coupling is given; `None` where that is not known. Rows of obstacles that move go
    /// on with them from then; without it, from when the coupling first sees the set.
    pub published: Option<f64>,
    /// Rows in ascending order of their features.
    pub constraints: Vec<NonPenetrationConstraint>,
    /// Smallest distance between the bodies, m; infinite when none is within the activation distance.
    pub gap_min: f64,
    /// The capacity did not hold every row: the nearest were kept or, where rows are chosen, those of the body's motion and of the device's pose.
    pub truncated: bool,
    /// Every facing pair nearer than this was looked at, m: rows of pairs farther apart may be missing. Infinite without an obstacle.
    pub complete_within: f64,
    /// Most by which a facing pair without a row, of those nearer than `complete_within` and of those found along surfaces that conform, is
    /// violated by a motion that the rows were chosen for, m; zero for a full set. Those motions are the projected ways to the device's pose at the update, and to poses that lie off it by
    /// the activation distance and the device's last path, along and about each axis. The way to a pose that is a metric distance d off one
    /// of these violates pair k by at most `|J_k| d` more, in the inverse metric: projections bring nothing farther apart. Infinite where one of the
    /// projections has no certificate, and where rows of one found no room.
    pub reduction_error: f64,
    /// The rows made ready for the coupling, see [`ConstraintSet::prepare`].
    pub(crate) prepared: PreparedRows,
}

impl ConstraintSet {
    /// An empty set that holds `capacity` rows without allocating.
    pub fn with_capacity(capacity: usize) -> Self {
        Self {
            constraints: Vec::with_capacity(capacity),
            gap_min: f64::INFINITY,
            prepared: PreparedRows::with_capacity(capacity),
            ..Self::default()
        }
    }
}

impl ConstraintSet {
    /// Bound on the error of the force by the rows that were left out, N, where `normal_forces` is the sum of the contacts' forces, N, and
    /// `stiffness` is k_h k_s m, N/m. It holds for the motions that [`Self::reduction_error`] speaks of, where the full set would let no point
    /// of the body go further than `complete_within` less the rest distance: every pair that holds it there is then nearer.
    ///
    /// Let mu be the multipliers of the full set: its Lagrangian is strongly convex, and the reduced answer costs no more than the full one, so that
    /// `|a' - a|^2 <= 2 k_s e sum(mu)` in the metric, e the error; and the forces are `k_h mu`.
    pub fn force_error_bound(&self, stiffness: f64, normal_forces: f64) -> f64 {
        if self.reduction_error == f64::INFINITY {
            return f64::INFINITY; // without contact forces, too: nothing is known of them
        }
        (2.0 * stiffness * self.reduction_error * normal_forces).sqrt()
    }
}

// By hand for `clone_from`: the copy into a shared buffer reuses its memory.
impl Clone for ConstraintSet {
    fn clone(&self) -> Self {
        let mut copy = Self::with_capacity(self.constraints.capacity());
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, source: &Self) {
        self.sequence = source.sequence;
        self.god_object_pose = source.god_object_pose;
        self.published = source.published;
        self.constraints.clone_from(&source.constraints);
        self.gap_min = source.gap_min;
        self.truncated = source.truncated;
        self.complete_within = source.complete_within;
        self.reduction_error = source.reduction_error;
        self.prepared.copy_from(&source.prepared);
    }
}

/// The row `[n^T, (r x n)^T]` with `r = point - reference_point`, all in world axes.
#[inline]
pub fn contact_jacobian(
    normal: &Vector3<f64>,
    point: &Point3<f64>,
    reference_point: &Point3<f64>,
) -> Vector6 {
    six(normal, &(point - reference_point).cross(normal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_that_is_not_known_bounds_no_force() {
        let mut set = ConstraintSet::with_capacity(0);
        set.reduction_error = f64::INFINITY;
        assert_eq!(set.force_error_bound(1000.0, 0.0), f64::INFINITY);
        set.reduction_error = 1e-6;
        assert_eq!(set.force_error_bound(1000.0, 0.0), 0.0);
    }
}
