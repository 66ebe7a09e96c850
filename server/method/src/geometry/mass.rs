//! Volume, centroid and inertia of the solid inside a mesh, exactly.
//!
//! Sums the integrals of signed tetrahedra from one point to each triangle; for a tetrahedron with corners 0, a, b, c the
//! second moment is `6V/120 (a a^T + b b^T + c c^T + (a+b+c)(a+b+c)^T)`.
//! Source: F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", J. Math. Stat. 1, 2004.

use nalgebra::{Matrix3, Point3, Vector3};

use super::mesh::Mesh;

/// Integrals over the solid inside a mesh, at density one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume, m^3.
    pub volume: f64,
    /// Centre of mass, frame of the mesh, m.
    pub centroid: Point3<f64>,
    /// Inertia tensor about the centroid per density, axes of the mesh, m^5. Times density: kg m^2.
    pub inertia_per_density: Matrix3<f64>,
}

/// Volume, centroid and inertia about the centroid of a homogeneous solid.
pub fn mass_properties(mesh: &Mesh) -> MassProperties {
    // About the middle of the box: a mesh far from its origin loses no digits.
    let [low, high] = mesh.bounding_box();
    let origin = nalgebra::center(&low, &high);
    let (mut six_volumes, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for t in mesh.triangles() {
        let [a, b, c] = t.map(|v| mesh.vertices()[v as usize] - origin);
        let determinant = a.dot(&b.cross(&c));
        let sum = a + b + c;
        six_volumes += determinant;
        first += sum * (determinant / 24.0);
        second +=
            (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose())
                * (determinant / 120.0);
    }
    let volume = six_volumes / 6.0;
    let offset = first / volume;
    let about_centroid = second - offset * offset.transpose() * volume;
    MassProperties {
        volume,
        centroid: origin + offset,
        inertia_per_density: Matrix3::identity() * about_centroid.trace() - about_centroid,
    }
}
