//! Closest points of two segments.
//!
//! Source: Ericson, Real-Time Collision Detection, 2005, Section 5.1.9; parallel segments as in Lumelsky 1985.

use nalgebra::{Point3, Vector3};

/// Closest points of segments `p0 p1` and `q0 q1`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClosestOnEdges {
    /// Fraction along the first segment, in [0, 1].
    pub(super) on_first: f64,
    /// Fraction along the second segment, in [0, 1].
    pub(super) on_second: f64,
    /// From the point on the second to the point on the first, m.
    pub(super) difference: Vector3<f64>,
}

/// Closest points of two segments; any pair of closest points where there are many, or where a segment is a point.
///
/// Each fraction is the exact optimum for the other one, so that nearly parallel segments lose no distance.
#[inline]
pub(super) fn closest_on_edges(p: [&Point3<f64>; 2], q: [&Point3<f64>; 2]) -> ClosestOnEdges {
    let (u, v, r) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, e, b) = (u.norm_squared(), v.norm_squared(), u.dot(&v));
    let (c, f) = (u.dot(&r), v.dot(&r));
    let denominator = a * e - b * b;

    let mut s = if denominator > 0.0 {
        ((b * f - c * e) / denominator).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = fraction(b * s + f, e);
    // The optimum of each for the other; twice, since a clamped fraction moves its partner.
    s = fraction(b * t - c, a);
    t = fraction(b * s + f, e);
    ClosestOnEdges {
        on_first: s,
        on_second: t,
        difference: r + u * s - v * t,
    }
}

/// `numerator / squared_length` in [0, 1]; 0 for a segment that is a point.
#[inline]
fn fraction(numerator: f64, squared_length: f64) -> f64 {
    if squared_length > 0.0 {
        (numerator / squared_length).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64, y: f64, z: f64) -> Point3<f64> {
        Point3::new(x, y, z)
    }

    #[test]
    fn crossing_segments_meet_at_their_crossing() {
        let c = closest_on_edges(
            [&p(-1.0, 0.0, 0.0), &p(1.0, 0.0, 0.0)],
            [&p(0.5, -1.0, 0.2), &p(0.5, 3.0, 0.2)],
        );
        assert!((c.on_first - 0.75).abs() < 1e-15 && (c.on_second - 0.25).abs() < 1e-15);
        assert!((c.difference - Vector3::new(0.0, 0.0, -0.2)).norm() < 1e-15);
    }

    #[test]
    fn parallel_and_collapsed_segments_have_their_distance() {
        let parallel = closest_on_edges(
            [&p(0.0, 0.0, 0.0), &p(1.0, 0.0, 0.0)],
            [&p(0.5, 1.0, 0.0), &p(2.0, 1.0, 0.0)],
        );
        assert!((parallel.difference.norm() - 1.0).abs() < 1e-15);
        let apart = closest_on_edges(
            [&p(0.0, 0.0, 0.0), &p(1.0, 0.0, 0.0)],
            [&p(4.0, 4.0, 0.0), &p(5.0, 4.0, 0.0)],
        );
        assert!((apart.difference.norm() - 5.0).abs() < 1e-14);
        let points = closest_on_edges(
            [&p(0.0, 0.0, 0.0), &p(0.0, 0.0, 0.0)],
            [&p(0.0, 3.0, 4.0), &p(0.0, 3.0, 4.0)],
        );
        assert!((points.difference.norm() - 5.0).abs() < 1e-15);
    }
}
