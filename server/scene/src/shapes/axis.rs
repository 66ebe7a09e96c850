//! The axis of a shape and the two directions across it.

use nalgebra::{Point3, Vector3};

/// A coordinate axis of the body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axis {
    /// x.
    X,
    /// y, the axis of the paper's peg and hole.
    #[default]
    Y,
    /// z.
    Z,
}

impl Axis {
    /// The unit vector.
    pub fn unit(self) -> Vector3<f64> {
        match self {
            Self::X => Vector3::x(),
            Self::Y => Vector3::y(),
            Self::Z => Vector3::z(),
        }
    }

    /// The point at `along` on the axis and `(u, v)` across it, where u, v, axis are right-handed: about z they are x
    /// and y, about x they are y and z, about y they are z and x.
    pub(super) fn point(self, u: f64, v: f64, along: f64) -> Point3<f64> {
        match self {
            Self::X => Point3::new(along, u, v),
            Self::Y => Point3::new(v, along, u),
            Self::Z => Point3::new(u, v, along),
        }
    }

    /// Takes a vector in x, y, z apart as `[u, v, along]`.
    pub(crate) fn split(self, vector: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = vector;
        match self {
            Self::X => [y, z, x],
            Self::Y => [z, x, y],
            Self::Z => [x, y, z],
        }
    }
}

/// Cosine and sine of the `k`-th of `n` directions, the first one along u. Exact along the axes.
pub(super) fn direction(k: usize, n: usize) -> (f64, f64) {
    let quarter = |i: usize| [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][i % 4];
    if (4 * k).is_multiple_of(n) {
        return quarter(4 * k / n);
    }
    let angle = std::f64::consts::TAU * k as f64 / n as f64;
    (angle.cos(), angle.sin())
}
