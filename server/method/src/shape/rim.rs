//! Where a circle is nearest to a line.
//!
//! | symbol | name in code | unit | meaning                                                            |
//! |--------|--------------|------|--------------------------------------------------------------------|
//! | c, R   | `center`, `radius` | m | circle; `u`, `v` unit vectors in its plane                       |
//! | e, d   | `from`, `along` | m, – | a point of the line, its unit direction                          |
//! | phi    |              | rad  | `q(phi) = c + R (u cos phi + v sin phi)`                           |
//!
//! With v across the line and k = c - e without its part along d, half the slope of the squared distance over R is
//! `h(phi) = B cos phi - A sin phi + K sin phi cos phi`, A = k.u, B = k.v, K = R (d.u)^2: at most two minima.

use nalgebra::{Point3, Vector3};

use super::primitive::across;

/// Places at which the slope's sign is looked at: two minima are pi apart or nearly, or one is hardly one.
const SAMPLES: usize = 16;
/// Halvings of a bracket: ends at rounding.
const MAX_REFINEMENTS: u32 = 60;

/// A point of the circle.
#[derive(Clone, Copy, Debug)]
pub(super) struct RimPoint {
    pub(super) at: Point3<f64>,
    /// Unit, from the centre.
    pub(super) radial: Vector3<f64>,
    /// Unit, along the circle.
    pub(super) tangent: Vector3<f64>,
    /// Which side of the line's plane through the axis: tells the two minima apart.
    pub(super) upper: bool,
}

/// Calls `found` for each point of the circle that is locally nearest to the line; at most two.
pub(super) fn nearest_to_line(
    center: &Point3<f64>,
    axis: &Vector3<f64>,
    radius: f64,
    from: &Point3<f64>,
    along: &Vector3<f64>,
    mut found: impl FnMut(RimPoint),
) {
    let v = axis
        .cross(along)
        .try_normalize(f64::EPSILON)
        .unwrap_or_else(|| across(axis));
    let u = v.cross(axis);
    let k = center - from;
    let lean = along.dot(&u);
    let (a, b, bend) = (
        k.dot(&u) - k.dot(along) * lean,
        k.dot(&v),
        radius * lean * lean,
    );
    let slope = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        b * cos - a * sin + bend * sin * cos
    };
    let step = std::f64::consts::TAU / SAMPLES as f64;
    let mut before = slope(0.0);
    for i in 0..SAMPLES {
        let (low, high) = (step * i as f64, step * (i + 1) as f64);
        let after = slope(high);
        if before < 0.0 && after >= 0.0 {
            let phi = refine(low, high, slope);
            let (sin, cos) = phi.sin_cos();
            let radial = u * cos + v * sin;
            found(RimPoint {
                at: center + radial * radius,
                radial,
                tangent: v * cos - u * sin,
                upper: sin >= 0.0,
            });
        }
        before = after;
    }
}

/// The root of a slope that is negative at `low` and not at `high`.
fn refine(mut low: f64, mut high: f64, slope: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..MAX_REFINEMENTS {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if slope(middle) < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}
