//! One frictional contact as the cone solver sees it: a normal and two tangents in whitened coordinates.
//!
//! | symbol    | name in code    | unit        | meaning                                                        |
//! |-----------|-----------------|-------------|----------------------------------------------------------------|
//! | y         | `y`             | m kg^(1/2)  | `L^T (a - a_u)`, the correction, with `M = L L^T`              |
//! | j_n       | `normal`        | kg^(-1/2)   | `L^-1 J_n`                                                     |
//! | j_t       | `tangents`      | kg^(-1/2)   | `L^-1 J_t`, two orthogonal directions of the contact plane     |
//! | c_n       | `slack`         | m           | `J_n a_u - b`                                                  |
//! | c_t       | `slip`          | m           | `J_t (a_u - a_0) - t u`, a_0: where the contact stuck last, u: where its obstacle went since |
//! | lambda_n  | `load`          | N s^2       | normal multiplier, >= 0                                        |
//! | lambda_t  | `grip`          | N s^2       | tangential multipliers, norm at most `mu lambda_n`             |

use nalgebra::Vector3;

use crate::spatial::Vector6;

/// One contact of the cone problem.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConeContact {
    pub(super) coefficient: f64,
    pub(super) normal: Vector6,
    pub(super) tangents: [Vector6; 2],
    pub(super) slack: f64,
    pub(super) slip: [f64; 2],
    /// What the obstacle moved along the tangents in the set's update, m.
    pub(super) obstacle: [f64; 2],
    pub(super) load: f64,
    pub(super) grip: [f64; 2],
    /// Multiplier that a unit of penetration or slip costs, the others held, kg.
    pub(super) normal_step: f64,
    pub(super) tangent_step: f64,
}

impl ConeContact {
    /// A contact without load. `None` when a row is degenerate.
    pub(super) fn new(
        coefficient: f64,
        normal: Vector6,
        tangents: [Vector6; 2],
        slack: f64,
        slip: [f64; 2],
        obstacle: [f64; 2],
    ) -> Option<Self> {
        // The larger eigenvalue of the tangents' 2 x 2 block: a step of its inverse converges, and one number for both
        // directions keeps the cone round.
        let (a, b) = (tangents[0].norm_squared(), tangents[1].norm_squared());
        let mixed = tangents[0].dot(&tangents[1]);
        let largest = 0.5 * (a + b) + (0.25 * (a - b) * (a - b) + mixed * mixed).sqrt();
        let (normal_step, tangent_step) = (1.0 / normal.norm_squared(), 1.0 / largest);
        let usable = normal_step.is_finite() && tangent_step.is_finite();
        usable.then_some(Self {
            coefficient,
            normal,
            tangents,
            slack,
            slip,
            obstacle,
            load: 0.0,
            grip: [0.0; 2],
            normal_step,
            tangent_step,
        })
    }

    /// Tangential displacement since the contact stuck, m, at the correction `y`.
    #[inline]
    pub(super) fn slip_at(&self, y: &Vector6) -> [f64; 2] {
        [0, 1].map(|i| self.slip[i] + self.tangents[i].dot(y))
    }

    /// Largest tangential multiplier, N s^2.
    #[inline]
    pub(super) fn limit(&self) -> f64 {
        self.coefficient * self.load
    }

    /// The whitened wrench of the tangential multipliers.
    #[inline]
    pub(super) fn grip_wrench(&self) -> Vector6 {
        self.tangents[0] * self.grip[0] + self.tangents[1] * self.grip[1]
    }

    /// The whitened wrench of all multipliers.
    #[inline]
    pub(super) fn wrench(&self) -> Vector6 {
        self.normal * self.load + self.grip_wrench()
    }
}

/// The point of the disc of this radius nearest to `v`.
#[inline]
pub(super) fn in_disc(v: [f64; 2], radius: f64) -> [f64; 2] {
    let norm = (v[0] * v[0] + v[1] * v[1]).sqrt();
    let inside = norm <= radius; // false for NaN
    if inside {
        v
    } else if norm > 0.0 {
        v.map(|x| x * (radius / norm))
    } else {
        [0.0; 2]
    }
}

/// Two unit vectors that are orthogonal to the unit vector `normal` and to each other.
pub(super) fn tangents_of(normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
    // The axis least along the normal: its cross product keeps its digits.
    let axis = if normal.x.abs() <= normal.y.abs() && normal.x.abs() <= normal.z.abs() {
        Vector3::x()
    } else if normal.y.abs() <= normal.z.abs() {
        Vector3::y()
    } else {
        Vector3::z()
    };
    let crossed = normal.cross(&axis);
    let first = crossed / crossed.norm();
    [first, normal.cross(&first)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_are_orthonormal_for_any_normal() {
        for normal in [
            Vector3::x(),
            -Vector3::y(),
            Vector3::z(),
            Vector3::new(1.0, 1.0, 1.0) / 3f64.sqrt(),
            Vector3::new(0.6, 0.0, -0.8),
        ] {
            let [u, v] = tangents_of(&normal);
            for (a, b, expected) in [
                (u, u, 1.0),
                (v, v, 1.0),
                (u, v, 0.0),
                (u, normal, 0.0),
                (v, normal, 0.0),
            ] {
                assert!((a.dot(&b) - expected).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn the_disc_keeps_what_is_inside_and_the_direction_of_what_is_not() {
        assert_eq!(in_disc([0.3, -0.4], 0.6), [0.3, -0.4]);
        let cut = in_disc([3.0, -4.0], 1.0);
        assert!((cut[0] - 0.6).abs() < 1e-15 && (cut[1] + 0.8).abs() < 1e-15);
        assert_eq!(in_disc([3.0, -4.0], 0.0), [0.0, 0.0]);
        assert_eq!(in_disc([f64::NAN, 0.0], 1.0), [0.0, 0.0]);
    }
}
