//! Where a closed surface runs through itself, and whether a part of it is inside out there. For set-up and checks.
//!
//! Where two faces cross, the space about their common line falls into four regions. Across a face the winding number grows by one from its outer to its
//! inner side, so that of the region outside both faces tells the other three: it is 0 where two outward bodies overlap (0, 1, 1, 2) and -1 where a lobe
//! is inside out (-1, 0, 0, 1). Faces about a region of -1 look away from free space: whatever touches them from there meets no contact. Every such
//! region of a surface whose closed parts look outward ends at crossings, so it is found there.
//!
//! The winding number is what a ray from the crossing passes: faces left outward less faces entered.

use std::ops::ControlFlow;

use nalgebra::{Point3, Vector3};

use super::mesh::Mesh;
use super::parts::surface_windings;
use super::self_intersection::self_intersections;
use super::tree::Node;

/// A ray that passes a face nearer to its border than this share of the face may count it twice or never: another one is taken.
const BORDER: f64 = 1e-9;
/// The same share of the coordinates: a face nearer to the beginning of a ray may lie on either side of it.
const ROUNDING: f64 = 64.0 * f64::EPSILON;
/// Directions tried, each as outward normals of the two faces and along their common line. The numbers are odd so that no ray runs along the grids that
/// programs make; that all eight meet borders needs a bundle of edges at the crossing, and then its neighbours along the line answer.
const DIRECTIONS: [[f64; 3]; 8] = [
    [1.0, 1.0, 0.137],
    [1.0, 0.713, -0.291],
    [0.647, 1.0, 0.519],
    [1.0, 0.881, 0.803],
    [0.793, 1.0, -0.717],
    [1.0, 0.931, 1.619],
    [0.967, 1.0, -1.873],
    [1.0, 0.977, 3.331],
];

/// A surface touches itself or runs through itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfContact {
    /// Two triangles that meet elsewhere than at what they share: the first ones.
    pub triangles: [u32; 2],
    /// A point of both, m.
    pub place: Point3<f64>,
    /// A point, m, at a crossing where the surface is inside out; `None` where only outward parts overlap or touch.
    pub inverted: Option<Point3<f64>>,
}

/// The first place where the surface meets itself, and one where a lobe is inside out. `done` is told how many triangles were looked at.
pub fn self_contact(mesh: &Mesh, done: impl FnMut(usize)) -> Option<SelfContact> {
    let mut found: Option<SelfContact> = None;
    let mut stack = Vec::new();
    self_intersections(mesh, done, |pair| {
        let contact = found.get_or_insert_with(|| SelfContact {
            triangles: pair,
            place: common_place(mesh, pair),
            inverted: None,
        });
        contact.inverted = inverted_at(mesh, pair, &mut stack);
        match contact.inverted {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    });
    found
}

/// A point of two triangles that meet.
fn common_place(mesh: &Mesh, [a, b]: [u32; 2]) -> Point3<f64> {
    let (a, b) = (mesh.corners(a), mesh.corners(b));
    let pierced = piercings(&a, &b).chain(piercings(&b, &a)).next();
    // In one plane no side pierces the other: the middle of what their boxes have in common.
    pierced.unwrap_or_else(|| {
        let low = |t: &[Point3<f64>; 3]| t[0].inf(&t[1]).inf(&t[2]);
        let high = |t: &[Point3<f64>; 3]| t[0].sup(&t[1]).sup(&t[2]);
        nalgebra::center(&low(&a).sup(&low(&b)), &high(&a).inf(&high(&b)))
    })
}

/// Where sides of `a` run through the inside of `b`.
fn piercings<'t>(
    a: &'t [Point3<f64>; 3],
    b: &'t [Point3<f64>; 3],
) -> impl Iterator<Item = Point3<f64>> + 't {
    let normal = (b[1] - b[0]).cross(&(b[2] - b[0]));
    (0..3).filter_map(move |k| {
        let (from, to) = (a[k], a[(k + 1) % 3]);
        if b.contains(&from) || b.contains(&to) {
            return None;
        }
        let (before, after) = (normal.dot(&(from - b[0])), normal.dot(&(to - b[0])));
        let crosses = before * after <= 0.0 && before != after; // false for NaN
        if !crosses {
            return None;
        }
        let point = from + (to - from) * (before / (before - after));
        let inside = (0..3).all(|i| {
            let side = b[(i + 1) % 3] - b[i];
            side.cross(&(point - b[i])).dot(&normal) >= 0.0
        });
        inside.then_some(point)
    })
}

/// The middle of the line that two triangles have in common, if the region outside both has a negative winding number.
fn inverted_at(mesh: &Mesh, pair: [u32; 2], stack: &mut Vec<u32>) -> Option<Point3<f64>> {
    let [a, b] = pair.map(|t| mesh.corners(t));
    // The line ends where a side of one pierces the other, or at a corner of both.
    let corner = a.iter().find(|p| b.contains(p)).copied();
    let mut ends = corner
        .into_iter()
        .chain(piercings(&a, &b))
        .chain(piercings(&b, &a));
    let first = ends.next()?;
    let far = |p: &Point3<f64>| (p - first).norm_squared();
    let last = ends.max_by(|p, q| far(p).total_cmp(&far(q)))?;
    let rounding = ROUNDING * mesh.reach();
    let along = (last - first)
        .try_normalize(rounding)
        .filter(|_| far(&last) > 0.0)?; // they touch in a point
    let from = nalgebra::center(&first, &last);
    let normals = pair.map(|t| *mesh.face_normal(t));
    for [on_a, on_b, on_line] in DIRECTIONS {
        let way = normals[0] * on_a + normals[1] * on_b + along * on_line;
        // Outside both: none is where they lie on each other back to back.
        if normals.iter().any(|n| n.dot(&way) <= BORDER) {
            continue;
        }
        let Some((windings, nearest)) = windings_along(mesh, &from, &way, pair, rounding, stack)
        else {
            continue;
        };
        if windings >= 0 {
            return None;
        }
        // The ray decides for all crossings; before a surface is refused, the sum of solid angles has to say the same of a point on the way.
        let inside = from + way * (nearest / 2.0);
        let confirmed = surface_windings(mesh.vertices(), mesh.triangles(), &inside) < -0.5;
        return confirmed.then_some(from);
    }
    None
}

/// How often the surface winds around the beginning of a ray, on its side, and how far away the first face is, in lengths of `way`. The two triangles
/// `but` begin there. `None` where the ray passes a border of a face, or something else begins there, too.
fn windings_along(
    mesh: &Mesh,
    from: &Point3<f64>,
    way: &Vector3<f64>,
    but: [u32; 2],
    rounding: f64,
    stack: &mut Vec<u32>,
) -> Option<(i32, f64)> {
    let (mut windings, mut nearest, mut unclear) = (0, f64::INFINITY, false);
    let passes = |node: &Node| passes_box(from, way, &node.center, &node.half);
    mesh.tree().for_triangles(stack, passes, |t| {
        if but.contains(&t) {
            return true;
        }
        let normal = mesh.face_normal(t);
        match passes_triangle(from, way, &mesh.corners(t), normal, rounding) {
            Pass::Beside => {}
            Pass::Unclear => unclear = true,
            Pass::Through(distance) => {
                windings += if normal.dot(way) > 0.0 { 1 } else { -1 };
                nearest = nearest.min(distance);
            }
        }
        !unclear
    });
    (!unclear).then_some((windings, nearest))
}

fn passes_box(
    from: &Point3<f64>,
    way: &Vector3<f64>,
    center: &Point3<f64>,
    half: &Vector3<f64>,
) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for k in 0..3 {
        let offset = center[k] - from[k];
        if way[k] == 0.0 {
            if offset.abs() > half[k] {
                return false;
            }
            continue;
        }
        let (near, far) = ((offset - half[k]) / way[k], (offset + half[k]) / way[k]);
        enters = enters.max(near.min(far));
        leaves = leaves.min(near.max(far));
    }
    // Boxes are rounded outward, distances along the ray are not.
    enters <= leaves + BORDER * leaves.abs()
}

enum Pass {
    Beside,
    /// Too near to the border, or to the beginning.
    Unclear,
    /// So many lengths of the way off.
    Through(f64),
}

fn passes_triangle(
    from: &Point3<f64>,
    way: &Vector3<f64>,
    corners: &[Point3<f64>; 3],
    normal: &Vector3<f64>,
    rounding: f64,
) -> Pass {
    let arms = corners.map(|p| p - from);
    let turns = [0, 1, 2].map(|k| way.dot(&arms[k].cross(&arms[(k + 1) % 3])));
    let sum: f64 = turns.iter().map(|turn| turn.abs()).sum();
    let is_negative = |turn: &f64| *turn < -BORDER * sum;
    let is_positive = |turn: &f64| *turn > BORDER * sum;
    if turns.iter().any(is_negative) && turns.iter().any(is_positive) {
        return Pass::Beside;
    }
    let height = normal.dot(&arms[0]);
    let speed = normal.dot(way);
    if height.abs() <= rounding {
        return Pass::Unclear;
    }
    if height * speed < 0.0 {
        return Pass::Beside; // behind
    }
    let clear = turns.iter().all(is_negative) || turns.iter().all(is_positive);
    if clear && speed != 0.0 {
        Pass::Through(height / speed)
    } else {
        Pass::Unclear
    }
}
