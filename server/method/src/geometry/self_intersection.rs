//! Whether a closed surface runs through itself. For set-up and checks.

use std::ops::ControlFlow;

use nalgebra::Point3;

use super::distance::triangles_intersect;
use super::mesh::Mesh;
use super::tree::Node;

/// Faces on the same side of their common edge lie on each other if the cosine between them is above this.
const FOLDED: f64 = 1.0 - 1e-12;
/// Heights over a triangle below this share of the longest side are none: faces of one plane, cut up and rounded.
const FLAT: f64 = 1e-9;
/// Heights below this share of the coordinates are their rounding: some units in the last place.
const COORDINATE_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Two triangles of the mesh that meet elsewhere than at corners and edges where both have vertices; `None` when there are none.
pub fn self_intersection(mesh: &Mesh) -> Option<[u32; 2]> {
    let mut found = None;
    self_intersections(
        mesh,
        |_| {},
        |pair| {
            found = Some(pair);
            ControlFlow::Break(())
        },
    );
    found
}

/// All of them, until `visit` has enough. `done` is told after each triangle how many there were.
pub(super) fn self_intersections(
    mesh: &Mesh,
    mut done: impl FnMut(usize),
    mut visit: impl FnMut([u32; 2]) -> ControlFlow<()>,
) {
    let mut stack = Vec::new();
    for a in 0..mesh.triangles().len() as u32 {
        if partners(mesh, a, &mut stack, &mut visit).is_break() {
            return;
        }
        done(a as usize + 1);
    }
}

/// The triangles after `a` that meet it elsewhere.
fn partners(
    mesh: &Mesh,
    a: u32,
    stack: &mut Vec<u32>,
    visit: &mut impl FnMut([u32; 2]) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let corners = mesh.corners(a);
    let (low, high) = (
        corners[0].inf(&corners[1]).inf(&corners[2]),
        corners[0].sup(&corners[1]).sup(&corners[2]),
    );
    let near = |node: &Node| {
        let (from, to) = (node.center - node.half, node.center + node.half);
        !(0..3).any(|k| from[k] > high[k] || to[k] < low[k])
    };
    let mut flow = ControlFlow::Continue(());
    mesh.tree().for_triangles(stack, near, |b| {
        if b > a && meet_elsewhere(mesh, a, b) {
            flow = visit([a, b]);
        }
        flow.is_continue()
    });
    flow
}

fn meet_elsewhere(mesh: &Mesh, a: u32, b: u32) -> bool {
    let (on_a, on_b) = (mesh.triangles()[a as usize], mesh.triangles()[b as usize]);
    // By place, not by number: surfaces that touch at a vertex or an edge may each have their own there.
    let place = |v: u32| mesh.vertices()[v as usize];
    let own = |t: [u32; 3], other: [u32; 3]| {
        t.into_iter()
            .filter(move |v| !other.iter().any(|w| v == w || place(*v) == place(*w)))
    };
    match own(on_a, on_b).count() {
        3 => triangles_intersect(&mesh.corners(a), &mesh.corners(b)),
        // One corner in common: the opposite side of either may run through the other.
        2 => {
            let side = |t, other| {
                let mut ends = own(t, other).map(|v| mesh.vertices()[v as usize]);
                ends.next().zip(ends.next())
            };
            let hits = |ends: Option<(Point3<f64>, Point3<f64>)>, t: u32| {
                ends.is_some_and(|(p, q)| segment_meets(&p, &q, &mesh.corners(t)))
            };
            hits(side(on_a, on_b), b) || hits(side(on_b, on_a), a)
        }
        // An edge in common: one on the other.
        1 => {
            let apex = |t, other| own(t, other).next().map(place);
            let mut edge = on_a
                .into_iter()
                .map(place)
                .filter(|p| Some(*p) != apex(on_a, on_b));
            let (Some(from), Some(to)) = (edge.next(), edge.next()) else {
                return true;
            };
            let along = to - from;
            let arm = |p: Point3<f64>| {
                let arm = p - from;
                (arm - along * (arm.dot(&along) / along.norm_squared())).normalize()
            };
            let arms = [apex(on_a, on_b), apex(on_b, on_a)].map(|p| p.map(arm));
            matches!(arms, [Some(a), Some(b)] if a.dot(&b) > FOLDED)
        }
        _ => true, // the same three corners
    }
}

/// Whether a segment meets a triangle, by the signs of volumes. One in its plane, or off it by less than [`FLAT`] and rounding, does not.
fn segment_meets(p: &Point3<f64>, q: &Point3<f64>, t: &[Point3<f64>; 3]) -> bool {
    let volume = |a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>| {
        (b - a).cross(&(c - a)).dot(&(d - a))
    };
    let side = |x: &Point3<f64>| {
        let arms = [t[1] - t[0], t[2] - t[0], x - t[0]];
        let longest = arms.iter().map(|arm| arm.norm()).fold(0.0, f64::max);
        let reach = t.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
        let least = (FLAT * longest + COORDINATE_ROUNDING * reach) * longest * longest;
        let volume = volume(&t[0], &t[1], &t[2], x);
        if volume.abs() <= least { 0.0 } else { volume }
    };
    let sides = [p, q].map(side);
    if sides[0] * sides[1] > 0.0 || sides == [0.0, 0.0] {
        return false;
    }
    let turns = [0, 1, 2].map(|k| volume(p, q, &t[k], &t[(k + 1) % 3]));
    turns.iter().all(|v| *v >= 0.0) || turns.iter().all(|v| *v <= 0.0)
}
