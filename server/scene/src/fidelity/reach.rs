//! Where a body comes that is taken along the hand's path: what is elsewhere is not met.

use god_object::nalgebra::Point3;
use god_object::{Mesh, Pose};

/// The box about all places of the body, in one frame, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Reach {
    /// Of a body along poses between which it goes straight, `depth`, m, away from them at most; `None`
    /// without a pose.
    #[must_use]
    pub fn of(body: &Mesh, path: &[Pose], depth: f64) -> Option<Self> {
        let [low, high] = body.bounding_box();
        let corners = (0..8).map(|corner: u32| {
            let of = |axis: usize| {
                if corner >> axis & 1 == 0 {
                    low[axis]
                } else {
                    high[axis]
                }
            };
            Point3::new(of(0), of(1), of(2))
        });
        let corners: Vec<Point3<f64>> = corners.collect();
        let places = path
            .iter()
            .flat_map(|pose| corners.iter().map(move |corner| pose * corner));
        let around = places.fold(None, |found: Option<[Point3<f64>; 2]>, at| {
            let [low, high] = found.unwrap_or([at, at]);
            Some([low.inf(&at), high.sup(&at)])
        });
        around.map(|[low, high]| Self {
            low: low.map(|x| x - depth),
            high: high.map(|x| x + depth),
        })
    }

    /// The part of a convex polygon, or of a segment, that is within; in the frame of the box. Empty where
    /// none is.
    #[must_use]
    pub fn clipped(&self, corners: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut left = corners.to_vec();
        for axis in 0..3 {
            for (side, limit) in [(1.0, self.high[axis]), (-1.0, -self.low[axis])] {
                left = beneath(&left, |point| limit - side * point[axis]);
            }
        }
        left
    }
}

/// The part of a convex polygon or segment where `room` is not negative. Source: Sutherland and Hodgman 1974.
fn beneath(corners: &[Point3<f64>], room: impl Fn(&Point3<f64>) -> f64) -> Vec<Point3<f64>> {
    let mut left = Vec::new();
    for (k, from) in corners.iter().enumerate() {
        let to = &corners[(k + 1) % corners.len()];
        let (here, there) = (room(from), room(to));
        if here >= 0.0 {
            left.push(*from);
        }
        if (here < 0.0) != (there < 0.0) {
            left.push(from + (to - from) * (here / (here - there)));
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn what_the_body_passes_is_within_and_what_is_beside_is_not() {
        let raw = shapes::cuboid([0.01; 3]);
        let body = Mesh::new(raw.vertices, raw.triangles).expect("a closed shape");
        let path = [0.0, 0.1].map(|x| Pose::translation(x, 0.0, 0.0));
        let reach = Reach::of(&body, &path, 1e-3).expect("a path");
        let at = |x: f64, y: f64| [Point3::new(x, y, -1.0), Point3::new(x, y, 1.0)];
        let length = |x: f64, y: f64| {
            let left = reach.clipped(&at(x, y));
            left.iter()
                .flat_map(|a| left.iter().map(move |b| (a - b).norm()))
                .fold(0.0, f64::max)
        };
        assert!((length(0.05, 0.0105) - 0.022).abs() < 1e-12);
        assert_eq!(length(0.05, 0.0115), 0.0);
        assert_eq!(length(0.1115, 0.0), 0.0);
        assert_eq!(Reach::of(&body, &[], 1e-3), None);
        // A large triangle across it leaves its whole cut.
        let wide = [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[x, y]| Point3::new(x, y, 0.0));
        let cut = reach.clipped(&wide);
        let area: f64 = (1..cut.len() - 1)
            .map(|i| 0.5 * (cut[i] - cut[0]).cross(&(cut[i + 1] - cut[0])).norm())
            .sum();
        assert!((area - 0.122 * 0.022).abs() < 1e-12);
    }
}
