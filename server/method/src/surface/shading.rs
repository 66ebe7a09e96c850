//! Force shading: contact normals interpolated over a triangle.
//!
//! The first pass projects on constraints with interpolated normals and gives the force; the second projects its result
//! on the true constraints and gives the motion. The first runs in the coupling loop, the second in the god-object
//! loop; a [`ShadedAcceleration`] carries the result from one to the other.
//! Source: Ortega et al. 2007, Sections 6.1.1 to 6.1.3.

use nalgebra::Vector3;

use crate::geometry::corner_normals;
use crate::spatial::Vector6;
use crate::world::Obstacle;

/// An interpolated normal must keep at least this cosine with the true one; beyond, the true one is used.
const LEAST_COSINE: f64 = 0.1;

/// The result of the first pass, from the coupling loop to the god-object loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadedAcceleration {
    /// Sequence number of the constraint set that it was computed on.
    pub sequence: u64,
    /// `a_sc`: the constrained acceleration in the force-shading space, m and rad, world axes.
    pub acceleration: Vector6,
}

/// Vertex normals per triangle corner of one obstacle, with its crease angle respected.
#[derive(Clone, Debug)]
pub struct ShadingNormals {
    corners: Vec<[Vector3<f64>; 3]>,
}

impl ShadingNormals {
    /// Prepares the normals of a shaded obstacle; `None` when its surface is not shaded.
    pub fn of(obstacle: &Obstacle) -> Option<Self> {
        obstacle.surface.shading.map(|shading| Self {
            corners: corner_normals(&obstacle.mesh, shading.crease_angle),
        })
    }

    /// The unit normal at a point of `triangle`, world axes, on the same side as `true_normal`.
    ///
    /// `None` when the interpolated normal is degenerate or turns away from the true one.
    pub fn at(
        &self,
        obstacle: &Obstacle,
        triangle: u32,
        barycentric: &[f64; 3],
        true_normal: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let corners = self.corners.get(triangle as usize)?;
        let sum = corners
            .iter()
            .zip(barycentric)
            .fold(Vector3::zeros(), |sum, (normal, weight)| {
                sum + normal * *weight
            });
        let normal = obstacle.pose.rotation * sum.try_normalize(LEAST_COSINE)?;
        let agrees = normal.dot(true_normal) > LEAST_COSINE; // false for NaN
        agrees.then_some(normal)
    }
}
