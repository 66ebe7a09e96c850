//! Time of impact of single features whose vertices move along straight lines: vertex and face, edge and edge.
//!
//! For programs whose meshes deform, and for published query sets, which have such motions. The god-object's motions are rigid: [`super::time_of_impact`].
//!
//! | symbol     | name in code | unit | meaning                                                         |
//! |------------|--------------|------|-----------------------------------------------------------------|
//! | n          | `direction`  | –    | unit direction from the second feature to the first             |
//! | a_i, b_j   | `at`         | m    | vertices of the first and the second feature at `time`          |
//! | h          | `step`       | –    | step in time                                                    |
//!
//! For *any* direction n the distance at `time + h` is at least `min_ij n.(a_i - b_j) + h n.(v_i - w_j)`, which is linear in h
//! for each pair of vertices: the largest safe step is a quotient. The directions are those of the closest points and of
//! the common normal; a poor one makes the step short, never unsafe, so features without area or length need no case.
//!
//! **Rounding.** With M the largest coordinate and u half a unit in the last place of 1: a vertex at `time` is off by
//! at most 6 M u in each coordinate (difference 2 M u, product 2 M u more, sum 2 M u), a difference of two by 14 M u, its product with n
//! by 3 (14 + 3 * 2) M u = 60 M u, the length of n and the quotient by 8 u times a distance of at most 2 sqrt(3) M, and the sum of
//! times by u times a relative path of at most 4 sqrt(3) M: together less than 100 M u. `slack`, 256 M u, is kept.
//!
//! Source: Mirtich 1996 (conservative advancement); Tang et al. 2009 (directional bound).

use nalgebra::{Point3, Vector3};

use super::gaps::Gaps;
use super::impact::{AdvancementSettings, TimeOfImpact};
use crate::geometry::distance::{closest_on_edges, closest_on_triangle};

/// Rounding of a distance relative to the largest coordinate: see the file's head.
const ROUNDING: f64 = 128.0 * f64::EPSILON;

/// First impact of a vertex, `[0]`, with a face, `[1..]`, over t in [0, 1].
///
/// Never late; early where the features start within the minimum gap's rounding, or where `max_iterations` run out. What
/// touches at the start, and NaN, stops there. `interval_edges` and `max_intervals` mean nothing here.
pub fn vertex_face_time_of_impact(
    start: &[Point3<f64>; 4],
    end: &[Point3<f64>; 4],
    settings: &AdvancementSettings,
) -> TimeOfImpact {
    first_impact::<1, 3>(start, end, settings, |[p], face| {
        let normal = (face[1] - face[0]).cross(&(face[2] - face[0]));
        [p - closest_on_triangle(p, face).point, normal]
    })
}

/// First impact of an edge, `[0]` to `[1]`, with another, `[2]` to `[3]`, over t in [0, 1]; else as
/// [`vertex_face_time_of_impact`].
pub fn edge_edge_time_of_impact(
    start: &[Point3<f64>; 4],
    end: &[Point3<f64>; 4],
    settings: &AdvancementSettings,
) -> TimeOfImpact {
    first_impact::<2, 2>(start, end, settings, |p, q| {
        let closest = closest_on_edges([&p[0], &p[1]], [&q[0], &q[1]]);
        [closest.difference, (p[1] - p[0]).cross(&(q[1] - q[0]))]
    })
}

/// Vertices that move along straight lines.
struct Moving<const N: usize> {
    start: [Point3<f64>; N],
    velocities: [Vector3<f64>; N],
}

impl<const N: usize> Moving<N> {
    fn new(start: &[Point3<f64>], end: &[Point3<f64>]) -> Self {
        Self {
            start: std::array::from_fn(|i| start[i]),
            velocities: std::array::from_fn(|i| end[i] - start[i]),
        }
    }

    fn at(&self, time: f64) -> [Point3<f64>; N] {
        std::array::from_fn(|i| self.start[i] + self.velocities[i] * time)
    }
}

/// Follows the first A vertices and the other B; `directions` gives directions of any length between the features.
fn first_impact<const A: usize, const B: usize>(
    start: &[Point3<f64>; 4],
    end: &[Point3<f64>; 4],
    settings: &AdvancementSettings,
    directions: impl Fn(&[Point3<f64>; A], &[Point3<f64>; B]) -> [Vector3<f64>; 2],
) -> TimeOfImpact {
    let largest = start
        .iter()
        .chain(end)
        .flat_map(|p| p.iter())
        .fold(0.0, |m: f64, x| if x.abs() <= m { m } else { x.abs() }); // NaN stays
    let slack = ROUNDING * largest;
    let stopped = TimeOfImpact::Impact { time: 0.0 };
    let finite = (4.0 * largest).is_finite()
        && settings.minimum_gap.is_finite()
        && settings.gap_tolerance.is_finite();
    if !finite {
        return stopped;
    }
    let mut gaps = Gaps::new(settings.minimum_gap, settings.gap_tolerance, slack);
    let (first, second) = (
        Moving::<A>::new(&start[..A], &end[..A]),
        Moving::<B>::new(&start[A..], &end[A..]),
    );
    let mut time = 0.0;
    for iteration in 0..settings.max_iterations {
        let (a, b) = (first.at(time), second.at(time));
        let lines = directions(&a, &b);
        let bounds = lines.map(|line| Approach::along(&line, (&a, &first), (&b, &second)));
        let gap = bounds[0].gap.max(bounds[1].gap);
        if iteration == 0 && gap.is_nan() | (gap < gaps.stop) {
            match gaps.keeping(gap) {
                Some(kept) => gaps = kept,
                None => return stopped,
            }
        }
        let steps = bounds.map(|bound| bound.step(gaps.stop));
        let step = steps[0].max(steps[1]);
        if step >= 1.0 - time {
            return TimeOfImpact::Separated;
        }
        let apart = gap - gaps.stop > gaps.tolerance; // false for NaN
        time = (time + step).min(1.0);
        if !apart {
            return TimeOfImpact::Impact { time };
        }
    }
    TimeOfImpact::IterationLimit { time }
}

/// Heights of the first feature's vertices above the second's along a direction, and how fast they change.
struct Approach {
    heights: [f64; 4],
    speeds: [f64; 4],
    /// Least height, m; minus infinity without a direction.
    gap: f64,
}

impl Approach {
    /// Along `line`, towards the side on which the first feature lies.
    fn along<const A: usize, const B: usize>(
        line: &Vector3<f64>,
        (a, first): (&[Point3<f64>; A], &Moving<A>),
        (b, second): (&[Point3<f64>; B], &Moving<B>),
    ) -> Self {
        let mut found = Self {
            heights: [f64::INFINITY; 4],
            speeds: [0.0; 4],
            gap: f64::NEG_INFINITY,
        };
        // Scaled first: squares of small numbers vanish.
        let scale = line.amax();
        let known = scale > 0.0 && scale.is_finite(); // false for NaN
        if !known {
            return found;
        }
        let unit = (line / scale).normalize();
        let unit = if unit.dot(&(a[0] - b[0])) < 0.0 {
            -unit
        } else {
            unit
        };
        found.gap = f64::INFINITY;
        for (i, (p, v)) in a.iter().zip(&first.velocities).enumerate() {
            for (j, (q, w)) in b.iter().zip(&second.velocities).enumerate() {
                let height = unit.dot(&(p - q));
                found.heights[B * i + j] = height;
                found.speeds[B * i + j] = unit.dot(&(v - w));
                found.gap = found.gap.min(height);
            }
        }
        found
    }

    /// The longest step that keeps every height above `kept`; 0 when one is below.
    fn step(&self, kept: f64) -> f64 {
        let above = self.gap >= kept; // false for NaN
        if !above {
            return 0.0;
        }
        let mut step = f64::INFINITY;
        for (height, speed) in self.heights.iter().zip(&self.speeds) {
            if *speed < 0.0 {
                step = step.min((height - kept) / -speed);
            }
        }
        step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: AdvancementSettings = AdvancementSettings {
        minimum_gap: 1e-9,
        gap_tolerance: 1e-10,
        max_iterations: 200,
        interval_edges: 0.5,
        max_intervals: 64,
    };

    fn points(p: [[f64; 3]; 4]) -> [Point3<f64>; 4] {
        p.map(Point3::from)
    }

    #[test]
    fn a_vertex_that_falls_on_a_face_stops_above_it() {
        let start = points([
            [0.2, 0.2, 1.0],
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let mut end = start;
        end[0].z = -1.0;
        let found = vertex_face_time_of_impact(&start, &end, &SETTINGS);
        let TimeOfImpact::Impact { time } = found else {
            panic!("{found:?}")
        };
        assert!(time < 0.5 && time > 0.5 - 1.2e-9, "{time}");
        // Beside the face it passes.
        let beside = |p: [Point3<f64>; 4]| [p[0] + Vector3::x(), p[1], p[2], p[3]];
        let found = vertex_face_time_of_impact(&beside(start), &beside(end), &SETTINGS);
        assert_eq!(found, TimeOfImpact::Separated);
    }

    #[test]
    fn crossing_edges_meet_and_edges_in_one_plane_pass_beside_each_other() {
        let start = points([
            [-1.0, 0.0, 0.5],
            [1.0, 0.0, 0.5],
            [0.0, -1.0, 0.0],
            [0.0, 1.0, 0.0],
        ]);
        let lower = |p: Point3<f64>| p - Vector3::z();
        let end = [lower(start[0]), lower(start[1]), start[2], start[3]];
        let found = edge_edge_time_of_impact(&start, &end, &SETTINGS);
        assert!(
            matches!(found, TimeOfImpact::Impact { time } if time < 0.5 && time > 0.5 - 1.2e-9),
            "{found:?}"
        );
        let flat = points([
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
        ]);
        let slid = [
            flat[0] + Vector3::x(),
            flat[1] + Vector3::x(),
            flat[2],
            flat[3],
        ];
        assert_eq!(
            edge_edge_time_of_impact(&flat, &slid, &SETTINGS),
            TimeOfImpact::Separated
        );
    }

    #[test]
    fn collapsed_touching_and_nan_features_stop_or_are_bounded() {
        let same = points([[0.1; 3]; 4]);
        let moved = same.map(|p| p + Vector3::x());
        let stopped = TimeOfImpact::Impact { time: 0.0 };
        assert_eq!(
            vertex_face_time_of_impact(&same, &moved, &SETTINGS),
            stopped
        );
        assert_eq!(edge_edge_time_of_impact(&same, &moved, &SETTINGS), stopped);
        let mut nan = same;
        nan[2].y = f64::NAN;
        assert_eq!(vertex_face_time_of_impact(&same, &nan, &SETTINGS), stopped);
        // A point against a face and an edge that are points.
        let mut apart = same;
        apart[0].z += 1.0;
        let mut through = apart;
        through[0].z -= 2.0;
        let found = vertex_face_time_of_impact(&apart, &through, &SETTINGS);
        assert!(
            matches!(found, TimeOfImpact::Impact { time } if time < 0.5 && time > 0.499),
            "{found:?}"
        );
    }
}
