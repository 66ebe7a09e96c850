//! Pairs that a row's pair turns into where it slides off its feature.
//!
//! In the corner of two walls the rows of both hold, but only the one under the foot faces. A motion that crosses the corner would
//! find the other wall by running into it, and the next would run back into the first: to and fro, because no projection knew both. So it is for a force:
//! in a hollow of facets the normal turns as the body slides, and a set without the facets beside would turn it an update late.

use arrayvec::ArrayVec;
use nalgebra::Point3;

use super::At;
use crate::constraint::reentrant::{Foot, foot_from, for_faces};
use crate::constraint::{Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::spatial::{Vector6, angular, linear};

/// Most neighbours of one feature: faces across the sides of a face and across theirs, or edges that go on at either end of an edge.
const MAX_NEIGHBOURS: usize = 9;
/// An edge goes on in another one that turns by less than the angle of this cosine.
const GOES_ON: f64 = 0.5;

/// Where a motion of the body brings the vertex of a pair of vertex and face, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Arrival {
    /// The pair is none of vertex and face.
    OfNoVertex,
    /// Past a side of its face that stands out.
    Off,
    /// Over the face of this pair, the same or one that it turned into.
    Over(FeaturePair),
}

impl Arrival {
    pub(super) fn of(at: &At, pair: &FeaturePair, motion: &Vector6) -> Self {
        let (mesh, pose) = at.obstacle(usize::from(pair.obstacle));
        let body = &at.world.body.mesh;
        let way = |p: &Point3<f64>| linear(motion) + angular(motion).cross(&(p - at.center()));
        match (pair.on_body, pair.on_obstacle) {
            (Feature::Vertex(v), Feature::Face(t)) => {
                let x = at.pose * body.vertices()[v as usize];
                let arrived = pose.inverse_transform_point(&(x + way(&x)));
                Self::over(mesh, t, &arrived, |face| FeaturePair {
                    on_obstacle: Feature::Face(face),
                    ..*pair
                })
            }
            (Feature::Face(t), Feature::Vertex(w)) => {
                let y = pose * mesh.vertices()[w as usize];
                let arrived = at.pose.inverse_transform_point(&(y - way(&y)));
                Self::over(body, t, &arrived, |face| FeaturePair {
                    on_body: Feature::Face(face),
                    ..*pair
                })
            }
            _ => Self::OfNoVertex,
        }
    }

    fn over(mesh: &Mesh, t: u32, arrived: &Point3<f64>, pair: impl Fn(u32) -> FeaturePair) -> Self {
        let foot = foot_from(mesh, t, |t| mesh.corners(t), arrived);
        foot.map_or(Self::Off, |Foot { face, .. }| Self::Over(pair(face)))
    }
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
        Feature::Edge(e) => {
            for end in [0, 1] {
                go_on(mesh, e, end, &mut found);
            }
        }
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
    use super::*;
    use crate::constraint::reentrant::tests::notched;

    /// A vertex that goes from over one half of a ridge to over the other turns into the face there across a notch, and is off across a peak.
    #[test]
    fn what_crosses_a_notch_turns_into_the_other_side_and_what_crosses_a_peak_is_off() {
        for (depth, turns) in [(0.1, true), (-0.1, false)] {
            let mesh = notched(depth);
            let pair = |face: u32| FeaturePair {
                obstacle: 0,
                on_body: Feature::Vertex(0),
                on_obstacle: Feature::Face(face),
            };
            let over = |from: u32, x: f64| {
                let arrived = Point3::new(x, 0.5, -0.5);
                Arrival::over(&mesh, from, &arrived, pair)
            };
            let on_the_left = |t: &u32| {
                let x: f64 = mesh.corners(*t).iter().map(|p| p.x).sum();
                mesh.face_normal(*t).z > 0.1 && x < 0.0
            };
            let faces = (0..mesh.triangles().len() as u32).filter(on_the_left);
            let left = faces.filter(|t| over(*t, -0.4) == Arrival::Over(pair(*t)));
            let arrivals: Vec<(u32, Arrival)> = left.map(|t| (t, over(t, 0.4))).collect();
            let turned = |(from, arrival): &(u32, Arrival)| match arrival {
                Arrival::Over(pair) => pair.on_obstacle != Feature::Face(*from),
                _ => false,
            };
            let off = |(_, arrival): &(u32, Arrival)| *arrival == Arrival::Off;
            assert!(!arrivals.is_empty(), "{depth}");
            assert_eq!(arrivals.iter().all(turned), turns, "{depth}: {arrivals:?}");
            assert_eq!(arrivals.iter().all(off), !turns, "{depth}: {arrivals:?}");
        }
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
