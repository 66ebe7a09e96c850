//! Force shading: contact normals interpolated over a triangle.
//!
//! The first pass projects on constraints with interpolated normals and gives the force; the second projects its result
//! on the true constraints and gives the motion. The first runs in the coupling loop, the second in the god-object
//! loop; a [`ShadedAcceleration`] carries the result from one to the other.
//! Source: Ortega et al. 2007, Sections 6.1.1 to 6.1.3.

use nalgebra::Vector3;

use crate::constraint::Feature;
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
    /// Edges that are creases, and vertices where some meet.
    creases: Vec<bool>,
    sharp_vertices: Vec<bool>,
}

impl ShadingNormals {
    /// Prepares the normals of a shaded obstacle; `None` when its surface is not shaded.
    pub fn of(obstacle: &Obstacle) -> Option<Self> {
        let shading = obstacle.surface.shading?;
        let mesh = &obstacle.mesh;
        let bends = mesh.edges().iter().map(|edge| edge.convexity.abs());
        let creases: Vec<bool> = bends.map(|bend| bend > shading.crease_angle).collect();
        let mut sharp_vertices = vec![false; mesh.vertices().len()];
        for (edge, _) in mesh
            .edges()
            .iter()
            .zip(&creases)
            .filter(|(_, crease)| **crease)
        {
            for vertex in edge.vertices {
                sharp_vertices[vertex as usize] = true;
            }
        }
        Some(Self {
            corners: corner_normals(mesh, shading.crease_angle),
            creases,
            sharp_vertices,
        })
    }

    /// The unit normal at a point of `feature` in `triangle`, world axes, on the same side as `true_normal`.
    ///
    /// `None` on creases and their ends, whose normal is that of the contact and of neither side; and when the interpolated normal is degenerate or
    /// turns away from the true one.
    pub fn at(
        &self,
        obstacle: &Obstacle,
        (feature, triangle): (Feature, u32),
        barycentric: &[f64; 3],
        true_normal: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let sharp = match feature {
            Feature::Edge(e) => *self.creases.get(e as usize)?,
            Feature::Vertex(v) => *self.sharp_vertices.get(v as usize)?,
            _ => false,
        };
        if sharp {
            return None;
        }
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
