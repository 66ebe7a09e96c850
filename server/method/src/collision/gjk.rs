//! The direction in which two convex pieces are apart, of which one is a cylinder or both are, without balls.
//!
//! Nothing depends on its accuracy but progress: every direction gives a valid lower bound of the distance. So the search ends where more accuracy would
//! bring an advance no farther.
//! Source: Gilbert, Johnson, Keerthi 1988.

use nalgebra::{Point3, Vector3};

use super::collider::Disc;
use crate::geometry::distance::closest_on_triangle;

/// Most supports looked at: smooth rims take some 20.
const MAX_SUPPORTS: u32 = 48;
/// The search ends when upper and lower bound of the distance differ by less than this share of the distance.
const RELATIVE_ACCURACY: f64 = 1e-6;
/// A direction along which this share of what is left to the distance to be kept is seen is good enough: an advance makes as much of its way.
const ENOUGH_SHARE: f64 = 0.9;
/// Two supports nearer than this, relative to their size, are one.
const SAME_POINT: f64 = 1e-28;

/// A convex piece without a ball around it, in some frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Core {
    /// Corners of a triangle, ends of a segment, or a point; the last is repeated.
    pub(super) points: [Point3<f64>; 3],
    /// Swept over them.
    pub(super) disc: Option<Disc>,
}

impl Core {
    /// The point that is farthest along `n`.
    #[inline]
    pub(super) fn farthest(&self, n: &Vector3<f64>) -> Point3<f64> {
        let mut best = self.points[0];
        for p in &self.points[1..] {
            if n.dot(&(p - best)) > 0.0 {
                best = *p;
            }
        }
        if let Some(Disc { radius, axis }) = self.disc {
            let sideways = n - axis * axis.dot(n);
            let length = sideways.norm();
            if length > 0.0 {
                best += sideways * (radius / length);
            }
        }
        best
    }
}

/// Unit direction from `still` to `mover` along which they are apart, and how many supports were looked at; NaN or any where they overlap. As good as there
/// is, or good enough: along it they are most of what they are farther apart than the distance to be kept, m, and more than the tolerance.
pub(super) fn direction(
    mover: &Core,
    still: &Core,
    [kept, tolerance]: [f64; 2],
) -> (Vector3<f64>, u64) {
    let support = |n: &Vector3<f64>| Point3::from(mover.farthest(&-n) - still.farthest(n));
    let start = mover.points[0] - still.points[0];
    let mut nearest = support(&start).coords;
    let mut simplex = Simplex {
        corners: [Point3::from(nearest); 4],
        count: 1,
    };
    let mut best = (f64::NEG_INFINITY, start / start.norm());
    let mut supports = 1;
    for _ in 0..MAX_SUPPORTS {
        supports += 1;
        let length = nearest.norm();
        let n = nearest / length;
        let next = support(&n);
        let lower = n.dot(&next.coords);
        if lower > best.0 {
            best = (lower, n);
        }
        let improves = length - lower > RELATIVE_ACCURACY * length; // false for NaN
        let above = best.0 - kept;
        let enough = above > tolerance && above >= ENOUGH_SHARE * (length - kept);
        if !improves || enough || simplex.has(&next) {
            break;
        }
        match simplex.with(next) {
            Some(closest) if closest.norm_squared() < nearest.norm_squared() => nearest = closest,
            // It overlaps, or rounding leaves no progress.
            _ => break,
        }
    }
    (best.1, supports)
}

/// A simplex of the difference of the two pieces, nearest to the origin.
struct Simplex {
    corners: [Point3<f64>; 4],
    count: usize,
}

impl Simplex {
    fn has(&self, p: &Point3<f64>) -> bool {
        self.corners[..self.count]
            .iter()
            .any(|c| (c - p).norm_squared() <= SAME_POINT * p.coords.norm_squared())
    }

    /// Takes a corner in, keeps the face nearest to the origin, and says where; `None` when the origin is inside.
    fn with(&mut self, corner: Point3<f64>) -> Option<Vector3<f64>> {
        let c = self.corners;
        match self.count {
            1 => self.take([corner, c[0], c[0]]),
            2 => self.take([corner, c[0], c[1]]),
            _ => {
                // The old face is farther than the faces at the new corner.
                let faces = [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]];
                let mut best: Option<(f64, [Point3<f64>; 3])> = None;
                let outside = origin_is_outside(&[corner, c[0], c[1], c[2]]);
                for [a, b] in faces {
                    let face = [corner, a, b];
                    let squared = closest_on_triangle(&Point3::origin(), &face)
                        .point
                        .coords
                        .norm_squared();
                    if best.is_none_or(|(least, _)| squared < least) {
                        best = Some((squared, face));
                    }
                }
                if !outside {
                    return None;
                }
                best.and_then(|(_, face)| self.take(face))
            }
        }
    }

    /// Becomes the part of the triangle that holds its point nearest to the origin.
    fn take(&mut self, face: [Point3<f64>; 3]) -> Option<Vector3<f64>> {
        let closest = closest_on_triangle(&Point3::origin(), &face);
        self.count = 0;
        for (corner, weight) in face.iter().zip(closest.barycentric) {
            if weight > 0.0 {
                self.corners[self.count] = *corner;
                self.count += 1;
            }
        }
        (self.count > 0).then_some(closest.point.coords)
    }
}

/// Whether some face separates the origin from the tetrahedron; a flat one has the origin outside.
fn origin_is_outside(t: &[Point3<f64>; 4]) -> bool {
    (0..4).any(|k| {
        let (apex, a, b, c) = (t[k], t[(k + 1) % 4], t[(k + 2) % 4], t[(k + 3) % 4]);
        let normal = (b - a).cross(&(c - a));
        let (side, origin) = (normal.dot(&(apex - a)), -normal.dot(&a.coords));
        side * origin <= 0.0
    })
}
