//! The parts of a surface, and which of them look the wrong way.
//!
//! A part is a set of triangles connected by edges. A part of negative volume is the wall of a cavity where material surrounds it: the winding number
//! of the other parts is one there. Elsewhere it is inside out: its faces look away from whatever touches it, and no contact would be found.

use std::f64::consts::PI;

use nalgebra::{Point3, Vector3};

/// Triangles of a part at whose middles the winding number is asked for, spread evenly.
const SAMPLES: usize = 8;
/// Solid angles that are summed to tell whether one part lies in another, where that allows more than [`SAMPLES`] points: a tenth of a second.
const MOST_ANGLES: usize = 4_000_000;
/// Winding numbers are whole; between whole ones the rounding of the sum is all there is.
const SURROUNDED: f64 = 0.5;
/// Most parts whose nesting is asked for: a second for all pairs. Importing refuses more.
const MOST_PARTS: usize = 10_000;
/// A part whose opening, closed by a fan, is larger than this share of its own area is a sheet: a half sphere has this share. It has no inside.
const MOST_OPEN: f64 = 0.5;

/// A part of a surface that looks the wrong way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InvertedPart {
    /// Its first triangle.
    pub triangle: u32,
    /// Number of its triangles.
    pub triangles: usize,
    /// Middle of the box around it, m.
    pub center: Point3<f64>,
    /// Signed volume, m^3: negative where material should be inside, positive where a cavity should be.
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

impl Part {
    /// The finding that it does, with its signed volume, m^3.
    fn looking_wrong(&self, volume: f64) -> InvertedPart {
        InvertedPart {
            triangle: self.triangles[0],
            triangles: self.triangles.len(),
            center: nalgebra::center(&self.low, &self.high),
            volume,
        }
    }
}

/// The parts of a closed surface whose triangles agree about outside within each part, in the order of their first triangles.
/// `adjacent` names the two triangles of each edge. Which way a part looks has no influence on the depths.
pub fn closed_parts(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]>,
) -> Vec<ClosedPart> {
    let parts = parts_of(vertices, triangles, adjacent);
    let depth = |own: &Part| {
        let around =
            |other: &&Part| !std::ptr::eq(*other, own) && encloses(vertices, triangles, other, own);
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

/// Whether a part lies within another. Without all of its corners and middles asked for, one that only pokes out may count as within.
fn encloses(vertices: &[Point3<f64>], triangles: &[[u32; 3]], other: &Part, own: &Part) -> bool {
    let around = (0..3).all(|k| other.low[k] <= own.low[k] && own.high[k] <= other.high[k]);
    if !around {
        return false;
    }
    let affordable = (MOST_ANGLES / other.triangles.len()).max(SAMPLES);
    let step = own.triangles.len().div_ceil(affordable);
    let surrounds =
        |point: &Point3<f64>, least: f64| windings(vertices, triangles, other, point).abs() > least;
    own.triangles.iter().step_by(step).all(|t| {
        let corners = triangles[*t as usize].map(|v| vertices[v as usize]);
        let [a, b, c] = corners.map(|p| p.coords);
        // On a face of the other the winding number is a half: parts that touch from within are within.
        surrounds(&((a + b + c) / 3.0).into(), SURROUNDED)
            && corners.iter().all(|p| surrounds(p, SURROUNDED / 2.0))
    })
}

/// How often a surface winds around a point, by the sum of the solid angles: whole off a closed surface.
pub(crate) fn surface_windings(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    point: &Point3<f64>,
) -> f64 {
    let angles = triangles
        .iter()
        .map(|t| solid_angle(&t.map(|v| vertices[v as usize] - point)));
    angles.sum::<f64>() / (4.0 * PI)
}

/// Parts that look the wrong way.
#[derive(Debug, Default)]
pub(super) struct WrongParts {
    /// They should hold material.
    pub(super) inverted: Vec<InvertedPart>,
    /// They lie in an odd number of others, and should hold none.
    pub(super) outward_walls: Vec<InvertedPart>,
}

/// The parts of a surface, open ones too, that look the wrong way, in the order of their first triangles. `adjacent` names the two triangles of each edge
/// that has two, `borders` the edges that have one and their triangles, `unclear` the triangles at other edges. A part with one of
/// those is not judged, nor is a sheet.
pub(super) fn wrong_parts(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]> + Clone,
    borders: &[([u32; 2], u32)],
    unclear: &[u32],
) -> WrongParts {
    let parts = parts_of(vertices, triangles, adjacent);
    let mut part_of = vec![0; triangles.len()];
    for (index, part) in parts.iter().enumerate() {
        part.triangles
            .iter()
            .for_each(|t| part_of[*t as usize] = index);
    }
    let mut openings: Vec<Vec<[u32; 2]>> = vec![Vec::new(); parts.len()];
    for (edge, t) in borders {
        openings[part_of[*t as usize]].push(*edge);
    }
    let mut judged = vec![true; parts.len()];
    for t in unclear {
        judged[part_of[*t as usize]] = false;
    }
    let mut wrong = WrongParts::default();
    for (index, part) in parts.iter().enumerate().filter(|(index, _)| judged[*index]) {
        let Some(volume) = closed_volume(vertices, triangles, part, &openings[index]) else {
            continue;
        };
        let around = |other: &Part| encloses(vertices, triangles, other, part);
        let depth = || {
            let others = parts
                .iter()
                .enumerate()
                .take_while(|_| parts.len() <= MOST_PARTS);
            others
                .filter(|(other, part)| *other != index && around(part))
                .count()
        };
        let found = part.looking_wrong(volume);
        let outward = volume > 0.0; // false for NaN
        let free = || {
            let mut samples = sample_points(vertices, triangles, part);
            samples.any(|p| winding_number(vertices, triangles, &parts, index, &p) < SURROUNDED)
        };
        if outward && depth() % 2 == 1 {
            wrong.outward_walls.push(found);
        } else if !outward && free() && depth() % 2 == 0 {
            wrong.inverted.push(found);
        }
    }
    wrong
}

/// The signed volume of a part whose openings are closed by one fan, m^3; `None` of a sheet. About the middle of its border, the fan adds none.
fn closed_volume(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    part: &Part,
    opening: &[[u32; 2]],
) -> Option<f64> {
    if opening.is_empty() {
        return Some(part.volume);
    }
    let at = |v: u32| vertices[v as usize];
    let sum: Vector3<f64> = opening
        .iter()
        .map(|[a, b]| at(*a).coords + at(*b).coords)
        .sum();
    let middle = Point3::from(sum / (2 * opening.len()) as f64);
    let fan: f64 = opening
        .iter()
        .map(|[a, b]| (at(*a) - middle).cross(&(at(*b) - middle)).norm())
        .sum();
    let (mut area, mut six_volumes) = (0.0, 0.0);
    for t in &part.triangles {
        let [a, b, c] = triangles[*t as usize].map(|v| at(v) - middle);
        area += (b - a).cross(&(c - a)).norm();
        six_volumes += a.dot(&b.cross(&c));
    }
    (fan <= MOST_OPEN * area).then_some(six_volumes / 6.0)
}

/// The parts that are inside out, in the order of their first triangles. `adjacent` names the two triangles of each edge of a closed, consistently
/// oriented surface.
pub(super) fn inverted_parts(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]>,
) -> Vec<InvertedPart> {
    let parts = parts_of(vertices, triangles, adjacent);
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
        .map(|index| parts[index].looking_wrong(parts[index].volume))
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

fn parts_of(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    adjacent: impl Iterator<Item = [u32; 2]>,
) -> Vec<Part> {
    let parts = connected(triangles.len(), adjacent).into_iter();
    parts
        .map(|inside| measure(vertices, triangles, inside))
        .collect()
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
