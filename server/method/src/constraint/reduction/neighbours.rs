//! Pairs that a row's pair turns into where it slides off its feature past a reentrant edge.
//!
//! In the corner of two walls the rows of both hold, but only the one under the foot faces. A motion that crosses the corner would
//! find the other wall by running into it, and the next would run back into the first: to and fro, because no projection knew both.

use arrayvec::ArrayVec;
use nalgebra::Point3;

use super::At;
use crate::constraint::reentrant::for_faces;
use crate::constraint::{Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::spatial::{Vector6, angular, linear};

/// Most neighbours of one feature: faces across the sides of a face and across theirs, or edges that go on at either end of an edge.
const MAX_NEIGHBOURS: usize = 9;
/// An edge goes on in another one that turns by less than the angle of this cosine.
const GOES_ON: f64 = 0.5;

/// Which sides of a face lead to a neighbour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    /// Those that do not stand out: across them the row of the neighbour is implied before it faces.
    Reentrant,
    All,
}

/// Where a vertex of a pair of vertex and face arrives by a motion of the body, to first order, in the frame of the face's mesh.
pub(super) enum Arrival {
    AtObstacle(Point3<f64>),
    AtBody(Point3<f64>),
    /// The pair is none of vertex and face.
    Unknown,
}

impl Arrival {
    pub(super) fn of(at: &At, pair: &FeaturePair, motion: &Vector6) -> Self {
        let (mesh, pose) = at.obstacle(usize::from(pair.obstacle));
        let way = |p: &Point3<f64>| linear(motion) + angular(motion).cross(&(p - at.center()));
        match (pair.on_body, pair.on_obstacle) {
            (Feature::Vertex(v), Feature::Face(_)) => {
                let x = at.pose * at.world.body.mesh.vertices()[v as usize];
                Self::AtObstacle(pose.inverse_transform_point(&(x + way(&x))))
            }
            (Feature::Face(_), Feature::Vertex(w)) => {
                let y = pose * mesh.vertices()[w as usize];
                Self::AtBody(at.pose.inverse_transform_point(&(y - way(&y))))
            }
            _ => Self::Unknown,
        }
    }

    /// How far it is then outside the face that a neighbour of the pair has, m.
    pub(super) fn over(&self, body: &Mesh, obstacle: &Mesh, features: &FeaturePair) -> Option<f64> {
        let outside = |mesh: &Mesh, face: u32, x: &Point3<f64>| {
            mesh.face_normal(face).dot(&(x - mesh.corners(face)[0]))
        };
        match (self, features.on_body, features.on_obstacle) {
            (Self::AtObstacle(x), _, Feature::Face(t)) => Some(outside(obstacle, t, x)),
            (Self::AtBody(y), Feature::Face(t), _) => Some(outside(body, t, y)),
            _ => None,
        }
    }
}

/// Calls `each` for the pairs of one of the features with a neighbour of the other.
pub(super) fn for_neighbours(
    body: &Mesh,
    obstacle: &Mesh,
    pair: &FeaturePair,
    sides: Sides,
    mut each: impl FnMut(FeaturePair),
) {
    for on_obstacle in neighbours(obstacle, pair.on_obstacle, sides) {
        each(FeaturePair {
            on_obstacle,
            ..*pair
        });
    }
    for on_body in neighbours(body, pair.on_body, sides) {
        each(FeaturePair { on_body, ..*pair });
    }
}

/// Faces across the sides of a face, and theirs; edges in which an edge goes on.
fn neighbours(mesh: &Mesh, feature: Feature, sides: Sides) -> ArrayVec<Feature, MAX_NEIGHBOURS> {
    let mut found = ArrayVec::new();
    match feature {
        Feature::Face(t) => {
            across(mesh, t, sides, &mut found);
            for k in 0..found.len() {
                if let Feature::Face(s) = found[k] {
                    across(mesh, s, sides, &mut found);
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
fn across(mesh: &Mesh, t: u32, sides: Sides, found: &mut ArrayVec<Feature, MAX_NEIGHBOURS>) {
    for e in mesh.triangle_edges(t) {
        let edge = &mesh.edges()[e as usize];
        let [left, right] = edge.faces;
        let face = Feature::Face(if left == t { right } else { left });
        let leads = sides == Sides::All || !edge.is_convex();
        if leads && !found.contains(&face) && found.try_push(face).is_err() {
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

    /// The faces at the ridge, left or right of the notch.
    fn at_ridge(mesh: &Mesh, right: bool) -> Vec<u32> {
        let of_half = |t: &u32| {
            let up = mesh.face_normal(*t).z > 0.1;
            let x: f64 = mesh.corners(*t).iter().map(|p| p.x).sum();
            up && (x > 0.0) == right
        };
        (0..mesh.triangles().len() as u32).filter(of_half).collect()
    }

    #[test]
    fn faces_lead_on_across_a_notch_and_only_of_all_sides_across_a_peak() {
        for (depth, reentrant) in [(0.1, true), (-0.1, false)] {
            let mesh = notched(depth);
            let right = at_ridge(&mesh, true);
            let crosses = |sides| {
                at_ridge(&mesh, false).iter().any(|t| {
                    neighbours(&mesh, Feature::Face(*t), sides)
                        .iter()
                        .any(|f| right.iter().any(|s| *f == Feature::Face(*s)))
                })
            };
            assert_eq!(crosses(Sides::Reentrant), reentrant, "{depth}");
            assert!(crosses(Sides::All), "{depth}");
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
        let found = neighbours(&mesh, Feature::Edge(left), Sides::Reentrant);
        assert_eq!(found.as_slice(), [Feature::Edge(right)]);
    }
}
