//! Pairs that a row's pair turns into where it slides off its feature.
//!
//! In the corner of two walls the rows of both hold, but only the one under the foot faces. A motion that crosses the corner would
//! find the other wall by running into it, and the next would run back into the first: to and fro, because no projection knew both. So it is for a force:
//! in a hollow of facets the normal turns as the body slides, and a set without the facets beside would turn it an update late.

use arrayvec::ArrayVec;
use nalgebra::Point3;

use super::At;
use crate::constraint::reentrant::{foot_from, for_faces};
use crate::constraint::{Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::spatial::{Vector6, angular, linear};

/// Most neighbours of one feature: faces across the sides of a face and across theirs, or edges that go on at either end of an edge.
const MAX_NEIGHBOURS: usize = 9;
/// An edge goes on in another one that turns by less than the angle of this cosine.
const GOES_ON: f64 = 0.5;

/// Calls `each` for the pairs that one turns into on its way by `motion`, to first order: a vertex comes over another face, or a crossing of edges past an
/// end of one, where that goes on. For none where it stays between the ends of its features, or leaves them past a side that stands out.
pub(super) fn for_turned(
    at: &At,
    pair: &FeaturePair,
    motion: &Vector6,
    mut each: impl FnMut(FeaturePair),
) {
    let (obstacle, pose) = at.obstacle(usize::from(pair.obstacle));
    let body = &at.world.body.mesh;
    let way = |p: &Point3<f64>| linear(motion) + angular(motion).cross(&(p - at.center()));
    // Where vertices of the body arrive, in the obstacle's frame.
    let arrived = |v: u32| {
        let x = at.pose * body.vertices()[v as usize];
        pose.inverse_transform_point(&(x + way(&x)))
    };
    match (pair.on_body, pair.on_obstacle) {
        (Feature::Vertex(v), Feature::Face(t)) => {
            if let Some(face) = face_under(obstacle, t, &arrived(v)) {
                each(FeaturePair {
                    on_obstacle: Feature::Face(face),
                    ..*pair
                });
            }
        }
        (Feature::Face(t), Feature::Vertex(w)) => {
            let y = pose * obstacle.vertices()[w as usize];
            let arrived = at.pose.inverse_transform_point(&(y - way(&y)));
            if let Some(face) = face_under(body, t, &arrived) {
                each(FeaturePair {
                    on_body: Feature::Face(face),
                    ..*pair
                });
            }
        }
        (Feature::Edge(e), Feature::Edge(f)) => {
            let of_body = body.edges()[e as usize].vertices.map(arrived);
            let of_obstacle = obstacle.edges()[f as usize].vertices;
            let of_obstacle = of_obstacle.map(|w| obstacle.vertices()[w as usize]);
            let [within_body, within_obstacle] = within_ends(of_body, of_obstacle);
            for on_body in past(body, e, within_body) {
                each(FeaturePair { on_body, ..*pair });
            }
            for on_obstacle in past(obstacle, f, within_obstacle) {
                each(FeaturePair {
                    on_obstacle,
                    ..*pair
                });
            }
        }
        _ => {}
    }
}

/// The face that a point is over, from face `t` on; `None` past a side that stands out.
fn face_under(mesh: &Mesh, t: u32, point: &Point3<f64>) -> Option<u32> {
    let foot = foot_from(mesh, t, point);
    foot.map(|foot| foot.face)
}

/// Of two segments, on this side of which of their ends the lines through them are nearest to each other.
fn within_ends(first: [Point3<f64>; 2], second: [Point3<f64>; 2]) -> [[bool; 2]; 2] {
    let (u, v, r) = (
        first[1] - first[0],
        second[1] - second[0],
        first[0] - second[0],
    );
    let (a, e, b) = (u.norm_squared(), v.norm_squared(), u.dot(&v));
    let (c, f) = (u.dot(&r), v.dot(&r));
    // Places along the segments, times the determinant; false for NaN.
    let determinant = a * e - b * b;
    [b * f - c * e, a * f - b * c].map(|at| [at >= 0.0, at <= determinant])
}

/// The edges in which edge `e` goes on beyond those of its ends that something is not within.
fn past(mesh: &Mesh, e: u32, within: [bool; 2]) -> ArrayVec<Feature, MAX_NEIGHBOURS> {
    let mut found = ArrayVec::new();
    for end in (0..2).filter(|end| !within[*end]) {
        go_on(mesh, e, end, &mut found);
    }
    found
}

/// Calls `each` for the pairs of one of the features with a neighbour of the other.
pub(super) fn for_neighbours(
    body: &Mesh,
    obstacle: &Mesh,
    pair: &FeaturePair,
    mut each: impl FnMut(FeaturePair),
) {
    for on_obstacle in neighbours(obstacle, pair.on_obstacle) {
        each(FeaturePair {
            on_obstacle,
            ..*pair
        });
    }
    for on_body in neighbours(body, pair.on_body) {
        each(FeaturePair { on_body, ..*pair });
    }
}

/// Faces across the sides of a face, and theirs; edges in which an edge goes on.
fn neighbours(mesh: &Mesh, feature: Feature) -> ArrayVec<Feature, MAX_NEIGHBOURS> {
    let mut found = ArrayVec::new();
    match feature {
        Feature::Face(t) => {
            across(mesh, t, &mut found);
            for k in 0..found.len() {
                if let Feature::Face(s) = found[k] {
                    across(mesh, s, &mut found);
                }
            }
            found.retain(|face| *face != feature);
        }
        Feature::Edge(e) => found = past(mesh, e, [false; 2]),
        _ => {}
    }
    found
}

/// Adds the faces across the sides of a face.
fn across(mesh: &Mesh, t: u32, found: &mut ArrayVec<Feature, MAX_NEIGHBOURS>) {
    for e in mesh.triangle_edges(t) {
        let edge = &mesh.edges()[e as usize];
        let [left, right] = edge.faces;
        let face = Feature::Face(if left == t { right } else { left });
        if !found.contains(&face) && found.try_push(face).is_err() {
            return;
        }
    }
}

/// The convex edges in which edge `e` goes on beyond its end `end`.
fn go_on(mesh: &Mesh, e: u32, end: usize, found: &mut ArrayVec<Feature, MAX_NEIGHBOURS>) {
    let vertices = mesh.edges()[e as usize].vertices;
    let (v, from) = (vertices[end], vertices[1 - end]);
    let apex = mesh.vertices()[v as usize];
    let way = apex - mesh.vertices()[from as usize];
    for_faces(mesh, v, |face, k| {
        let before = (k + 2) % 3;
        let side = mesh.triangle_edges(face)[before];
        let on = mesh.corners(face)[before] - apex;
        let straight = way.dot(&on) > GOES_ON * way.norm() * on.norm();
        let goes_on = side != e && mesh.edges()[side as usize].is_convex() && straight;
        (goes_on && found.try_push(Feature::Edge(side)).is_err()).then_some(())
    });
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use nalgebra::Vector3;

    use super::*;
    use crate::constraint::reentrant::tests::notched;

    /// A vertex that goes from over one half of a ridge to over the other turns into the face there across a notch, and is off across a peak.
    #[test]
    fn what_crosses_a_notch_turns_into_the_other_side_and_what_crosses_a_peak_is_off() {
        for (depth, turns) in [(0.1, true), (-0.1, false)] {
            let mesh = notched(depth);
            let under = |from: u32, x: f64| face_under(&mesh, from, &Point3::new(x, 0.5, -0.5));
            let on_the_left = |t: &u32| {
                let x: f64 = mesh.corners(*t).iter().map(|p| p.x).sum();
                mesh.face_normal(*t).z > 0.1 && x < 0.0
            };
            let faces = (0..mesh.triangles().len() as u32).filter(on_the_left);
            let left = faces.filter(|t| under(*t, -0.4) == Some(*t));
            let arrivals: Vec<(u32, Option<u32>)> = left.map(|t| (t, under(t, 0.4))).collect();
            let turned = |(from, to): &(u32, Option<u32>)| to.is_some_and(|to| to != *from);
            let off = |(_, to): &(u32, Option<u32>)| to.is_none();
            assert!(!arrivals.is_empty(), "{depth}");
            assert_eq!(arrivals.iter().all(turned), turns, "{depth}: {arrivals:?}");
            assert_eq!(arrivals.iter().all(off), !turns, "{depth}: {arrivals:?}");
        }
    }

    /// Crossed at any angle, by a line above it: a place before the first end, one between the ends and one past the second.
    #[test]
    fn lines_are_nearest_within_segments_or_past_an_end() {
        let segment = [Point3::new(1.0, 2.0, 3.0), Point3::new(2.0, 2.0, 3.0)];
        for angle in [0.1, 0.7, FRAC_PI_2, 2.5, -1.0] {
            let along = Vector3::new(f64::cos(angle), f64::sin(angle), 0.0);
            for (place, expected) in [
                (-0.1, [false, true]),
                (0.5, [true; 2]),
                (1.1, [true, false]),
            ] {
                let crossed = segment[0] + (segment[1] - segment[0]) * place + Vector3::z();
                let other = [crossed - along * 0.2, crossed + along * 0.5];
                assert_eq!(within_ends(segment, other), [expected, [true; 2]]);
                assert_eq!(within_ends(other, segment), [[true; 2], expected]);
                let short = [crossed + along * 0.1, crossed + along * 0.5];
                assert_eq!(within_ends(short, segment), [[false, true], expected]);
            }
        }
        let nan = [Point3::origin() * f64::NAN, Point3::origin()];
        assert_eq!(within_ends(nan, segment), [[false; 2]; 2]);
    }

    #[test]
    fn an_edge_goes_on_in_the_one_in_line_with_it() {
        let mesh = notched(0.1);
        let ridge = |ends: [u32; 2]| {
            let found = mesh
                .edges()
                .iter()
                .position(|e| e.vertices == ends || e.vertices == [ends[1], ends[0]]);
            found.expect("an edge of the ridge") as u32
        };
        let (left, right) = (ridge([2, 5]), ridge([5, 8]));
        let found = neighbours(&mesh, Feature::Edge(left));
        assert_eq!(found.as_slice(), [Feature::Edge(right)]);
    }
}
