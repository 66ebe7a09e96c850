//! The closed parts of a surface, and which of them are inside out.
//!
//! A part is a set of triangles connected by edges. A part of negative volume is the wall of a cavity where material surrounds it: the winding number
//! of the other parts is one there. Elsewhere it is inside out: its faces look away from whatever touches it, and no contact would be found.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

/// Triangles of a part at whose middles the winding number is asked for, spread evenly.
const SAMPLES: usize = 8;
/// Winding numbers are whole; between whole ones the rounding of the sum is all there is.
const SURROUNDED: f64 = 0.5;

/// A closed part of a surface that is inside out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InvertedPart {
    /// Its first triangle.
    pub triangle: u32,
    /// Number of its triangles.
    pub triangles: usize,
    /// Middle of the box around it, m.
    pub center: Point3<f64>,
    /// Signed volume, m^3; negative.
    pub volume: f64,
}

/// A part of a closed surface, and how deep it lies in the others.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedPart {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// Middle of the box around it, m.
    pub center: Point3<f64>,
    /// Signed volume, m^3.
    pub volume: f64,
    /// How many other parts surround it: a part at an odd depth is the wall of a cavity.
    pub depth: usize,
}

struct Part {
    triangles: Vec<u32>,
    low: Point3<f64>,
    high: Point3<f64>,
    volume: f64,
}

/// The parts of a closed surface whose triangles agree about outside within each part, in the order of their first triangles.
/// `adjacent` names the two triangles of each edge. Which way a part looks has no influence on the depths.
pub fn closed_parts(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]>,
) -> Vec<ClosedPart> {
    let parts: Vec<Part> = connected(triangles.len(), adjacent)
        .into_iter()
        .map(|inside| measure(vertices, triangles, inside))
        .collect();
    let depth = |own: &Part| {
        let around = |other: &&Part| {
            let encloses =
                (0..3).all(|k| other.low[k] <= own.low[k] && own.high[k] <= other.high[k]);
            encloses
                && !std::ptr::eq(*other, own)
                && sample_points(vertices, triangles, own)
                    .all(|point| windings(vertices, triangles, other, &point).abs() > SURROUNDED)
        };
        parts.iter().filter(around).count()
    };
    let depths: Vec<usize> = parts.iter().map(depth).collect();
    parts
        .into_iter()
        .zip(depths)
        .map(|(part, depth)| ClosedPart {
            center: nalgebra::center(&part.low, &part.high),
            triangles: part.triangles,
            volume: part.volume,
            depth,
        })
        .collect()
}

/// The parts that are inside out, in the order of their first triangles. `adjacent` names the two triangles of each edge of a closed, consistently
/// oriented surface.
pub(super) fn inverted_parts(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]>,
) -> Vec<InvertedPart> {
    let parts: Vec<Part> = connected(triangles.len(), adjacent)
        .into_iter()
        .map(|inside| measure(vertices, triangles, inside))
        .collect();
    let inverted = |index: usize| {
        let part = &parts[index];
        let outward = part.volume > 0.0; // false for NaN
        !outward
            && sample_points(vertices, triangles, part).any(|middle| {
                winding_number(vertices, triangles, &parts, index, &middle) < SURROUNDED
            })
    };
    (0..parts.len())
        .filter(|index| inverted(*index))
        .map(|index| InvertedPart {
            triangle: parts[index].triangles[0],
            triangles: parts[index].triangles.len(),
            center: nalgebra::center(&parts[index].low, &parts[index].high),
            volume: parts[index].volume,
        })
        .collect()
}

/// Middles of some triangles of a part, spread evenly.
fn sample_points<'a>(
    vertices: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    part: &'a Part,
) -> impl Iterator<Item = Point3<f64>> + 'a {
    let step = part.triangles.len().div_ceil(SAMPLES);
    part.triangles.iter().step_by(step).map(|t| {
        let [a, b, c] = triangles[*t as usize].map(|v| vertices[v as usize].coords);
        Point3::from((a + b + c) / 3.0)
    })
}

/// Sets of triangles that are connected through pairs of neighbours, each ascending, in the order of their first triangles.
pub fn connected(count: usize, adjacent: impl Iterator<Item = [u32; 2]>) -> Vec<Vec<u32>> {
    let mut parent: Vec<u32> = (0..count as u32).collect();
    for [a, b] in adjacent {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut part_of_root = vec![u32::MAX; count];
    let mut parts: Vec<Vec<u32>> = Vec::new();
    for t in 0..count as u32 {
        let part = &mut part_of_root[root(&mut parent, t) as usize];
        if *part == u32::MAX {
            *part = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[*part as usize].push(t);
    }
    parts
}

/// The root of a union-find tree, halving the path to it.
fn root(parent: &mut [u32], mut t: u32) -> u32 {
    while parent[t as usize] != t {
        parent[t as usize] = parent[parent[t as usize] as usize];
        t = parent[t as usize];
    }
    t
}

fn measure(vertices: &[Point3<f64>], triangles: &[[u32; 3]], inside: Vec<u32>) -> Part {
    let first = vertices[triangles[inside[0] as usize][0] as usize];
    let (mut low, mut high, mut six_volumes) = (first, first, 0.0);
    for t in &inside {
        let corners = triangles[*t as usize].map(|v| vertices[v as usize]);
        for corner in &corners {
            (low, high) = (low.inf(corner), high.sup(corner));
        }
        let [a, b, c] = corners.map(|p| p - first);
        six_volumes += a.dot(&b.cross(&c));
    }
    Part {
        triangles: inside,
        low,
        high,
        volume: six_volumes / 6.0,
    }
}

/// How often the parts but `own` wind around `point`. Parts whose box does not hold it do not wind around it.
fn winding_number(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    parts: &[Part],
    own: usize,
    point: &Point3<f64>,
) -> f64 {
    let holds = |part: &Part| (0..3).all(|k| part.low[k] <= point[k] && point[k] <= part.high[k]);
    parts
        .iter()
        .enumerate()
        .filter(|(index, part)| *index != own && holds(part))
        .map(|(_, part)| windings(vertices, triangles, part, point))
        .sum()
}

/// How often one part winds around `point`.
fn windings(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    part: &Part,
    point: &Point3<f64>,
) -> f64 {
    let angles = part.triangles.iter().map(|t| {
        let corners = triangles[*t as usize].map(|v| vertices[v as usize] - point);
        solid_angle(&corners)
    });
    angles.sum::<f64>() / (4.0 * PI)
}

/// Signed solid angle of a triangle seen from the origin, sr (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
    let volume = a.dot(&b.cross(c));
    let rest = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * volume.atan2(rest)
}
