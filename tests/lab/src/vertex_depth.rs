//! How deep the corners of a body are in a convex solid: a closed form for recipes, which shares nothing with collision detection.

use god_object::{Mesh, Pose};
use nalgebra::{Point3, Vector3};

/// A convex solid: where `normal . x <= offset` for every plane, world frame, m.
#[derive(Clone, Debug)]
pub(crate) struct Convex {
    planes: Vec<(Vector3<f64>, f64)>,
}

impl Convex {
    /// A box along the axes between two corners.
    pub(crate) fn cuboid(low: Point3<f64>, high: Point3<f64>) -> Self {
        let planes = (0..3).flat_map(|axis| {
            let unit = Vector3::from_fn(|row, _| f64::from(u8::from(row == axis)));
            [(unit, high[axis]), (-unit, -low[axis])]
        });
        Self {
            planes: planes.collect(),
        }
    }

    /// How far a point is from the nearest plane, from inside; 0 outside.
    pub(crate) fn depth(&self, point: &Point3<f64>) -> f64 {
        self.planes
            .iter()
            .map(|(normal, offset)| offset - normal.dot(&point.coords))
            .fold(f64::INFINITY, f64::min)
            .max(0.0)
    }

    /// The deepest vertex of a mesh at a pose.
    pub(crate) fn deepest(&self, mesh: &Mesh, world_from_body: &Pose) -> f64 {
        mesh.vertices()
            .iter()
            .map(|vertex| self.depth(&(world_from_body * vertex)))
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_to_the_nearest_face_and_none_outside() {
        let solid = Convex::cuboid(Point3::origin(), Point3::new(1.0, 2.0, 3.0));
        assert_eq!(solid.depth(&Point3::new(0.25, 1.0, 1.0)), 0.25);
        assert_eq!(solid.depth(&Point3::new(0.5, 1.9, 1.5)), 2.0 - 1.9);
        assert_eq!(solid.depth(&Point3::new(0.5, 2.1, 1.5)), 0.0);
    }
}
