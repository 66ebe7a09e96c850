//! Faces of more than three corners, made into triangles.
//!
//! A fan around the first corner where that covers the polygon; else ear clipping, in the coordinate plane that the polygon is most parallel to.
//!
//! Source: Meisters 1975, "Polygons have ears".

use nalgebra::{Point3, Vector3};

use super::{Fault, RawMesh};

/// Twice the area of a triangle, in squares of the polygon's size, that counts as none: far above rounding in double precision.
const NO_AREA: f64 = 1e-12;
/// The same, for sides that cross: above the rounding of files in single precision.
const CROSSING: f64 = 1e-7;
/// Most corners of a polygon that is no fan. Looking for sides that cross takes time by their square.
const MAX_CORNERS: usize = 2000;

type Point = [f64; 2];

/// The polygons of a mesh that holds them as fans: the vertices may come later in the file.
#[derive(Debug, Default)]
pub(super) struct Polygons(Vec<Polygon>);

#[derive(Debug)]
struct Polygon {
    /// Place of its first triangle in the mesh.
    first: usize,
    corners: usize,
    /// Number in the file, as its format counts.
    number: usize,
    line: Option<usize>,
}

impl Polygons {
    /// Appends a face of at least three corners to the mesh.
    pub(super) fn push(
        &mut self,
        mesh: &mut RawMesh,
        corners: &[u32],
        number: usize,
        line: Option<usize>,
    ) {
        if corners.len() > 3 {
            self.0.push(Polygon {
                first: mesh.triangles.len(),
                corners: corners.len(),
                number,
                line,
            });
        }
        mesh.push_polygon(corners);
    }

    /// Replaces the fans that do not cover their polygons. All indices must be in range.
    pub(super) fn triangulate(&self, mesh: &mut RawMesh) -> Result<(), Fault> {
        let mut corners: Vec<u32> = Vec::new();
        let mut points = Vec::new();
        for polygon in &self.0 {
            let of_mesh = &mut mesh.triangles[polygon.first..][..polygon.corners - 2];
            corners.clear();
            corners.extend(&of_mesh[0][..2]);
            corners.extend(of_mesh.iter().map(|triangle| triangle[2]));
            points.clear();
            points.extend(corners.iter().map(|c| mesh.vertices[*c as usize]));
            let ears = ears_unless_fan(&points).map_err(|why| Fault {
                line: polygon.line,
                text: format!("face {} {why}", polygon.number),
            })?;
            for (place, ear) in of_mesh.iter_mut().zip(ears.unwrap_or_default()) {
                *place = ear.map(|c| corners[c]);
            }
        }
        Ok(())
    }
}

/// The triangles of a polygon, as places in it.
pub(super) fn triangles(points: &[Point3<f64>]) -> Result<Vec<[usize; 3]>, String> {
    Ok(ears_unless_fan(points)?.unwrap_or_else(|| fan(points.len()).collect()))
}

/// The triangles of a polygon of so many corners around its first one.
fn fan(corners: usize) -> impl Iterator<Item = [usize; 3]> {
    (2..corners).map(|c| [0, c - 1, c])
}

/// The triangles of a polygon that its fan does not cover; `None` if it does.
fn ears_unless_fan(points: &[Point3<f64>]) -> Result<Option<Vec<[usize; 3]>>, String> {
    let corners = points.len();
    let Some(first) = points.first().filter(|_| corners > 3) else {
        return Ok(None);
    };
    let size = points
        .iter()
        .map(|p| (p - first).amax())
        .fold(0.0, f64::max);
    if !(size > 0.0 && size.is_finite()) {
        return Ok(None); // a point; or beyond what an import takes
    }
    let local: Vec<Vector3<f64>> = points.iter().map(|p| (p - first) / size).collect();
    let area = |[a, b, c]: [usize; 3]| (local[b] - local[a]).cross(&(local[c] - local[a]));
    let normal: Vector3<f64> = fan(corners).map(area).sum();
    if normal.amax() <= NO_AREA {
        let flat = fan(corners).all(|triangle| area(triangle).amax() <= NO_AREA);
        return if flat {
            Ok(None)
        } else {
            Err(not_simple(corners))
        };
    }
    let plane = normal.iamax();
    let (u, v) = ((plane + 1) % 3, (plane + 2) % 3);
    let (u, v) = if normal[plane] > 0.0 { (u, v) } else { (v, u) };
    let flat: Vec<Point> = local.iter().map(|p| [p[u], p[v]]).collect();
    if is_covered_by_fan(&flat) {
        return Ok(None);
    }
    if corners > MAX_CORNERS {
        return Err(format!(
            "has {corners} corners and is not convex; export the mesh as triangles"
        ));
    }
    let ears = if crosses_itself(&flat) {
        None
    } else {
        ears(&flat)
    };
    ears.map(Some).ok_or_else(|| not_simple(corners))
}

fn not_simple(corners: usize) -> String {
    format!(
        "of {corners} corners is no simple polygon: its sides cross or lie on each other; repair it, or export the mesh as triangles"
    )
}

/// Twice the area, positive for anticlockwise corners.
fn area(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether no triangle of the fan is turned over and the fan goes round its corner once at most.
fn is_covered_by_fan(points: &[Point]) -> bool {
    let mut angle = 0.0;
    for [a, b, c] in fan(points.len()).map(|t| t.map(|c| points[c])) {
        let twice = area(a, b, c);
        if twice < -NO_AREA {
            return false;
        }
        let along = (b[0] - a[0]) * (c[0] - a[0]) + (b[1] - a[1]) * (c[1] - a[1]);
        if twice > NO_AREA {
            angle += twice.atan2(along);
        }
    }
    angle <= std::f64::consts::TAU
}

/// Whether two segments cross, each ending on both sides of the other.
fn cross([a, b]: [Point; 2], [c, d]: [Point; 2], least: f64) -> bool {
    let apart = |p: f64, q: f64| p.min(q) < -least && p.max(q) > least;
    apart(area(a, b, c), area(a, b, d)) && apart(area(c, d, a), area(c, d, b))
}

fn crosses_itself(points: &[Point]) -> bool {
    let side = |i: usize| [points[i], points[(i + 1) % points.len()]];
    (0..points.len()).any(|i| (0..i).any(|j| cross(side(i), side(j), CROSSING)))
}

/// The triangles of a polygon whose sides do not cross; `None` if one of them cannot be cut off.
fn ears(points: &[Point]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut ears = Vec::with_capacity(points.len() - 2);
    let mut at = 0; // going on from the last ear keeps the triangles apart from each other
    while left.len() > 3 {
        let count = left.len();
        let around = |i: usize| [(i + count - 1) % count, i % count, (i + 1) % count];
        let corners = |i: usize| around(i).map(|place| left[place]);
        let is_flat = |i: &usize| {
            let [a, b, c] = corners(*i).map(|c| points[c]);
            area(a, b, c).abs() <= NO_AREA
        };
        let ear = (at..at + count)
            .find(|i| is_ear(points, &left, corners(*i)))
            .or_else(|| (0..count).find(is_flat))?;
        ears.push(corners(ear));
        left.remove(ear % count);
        at = ear % count;
    }
    ears.push([left[0], left[1], left[2]]);
    let [a, b, c] = ears.last()?.map(|c| points[c]);
    (area(a, b, c) >= -NO_AREA).then_some(ears)
}

/// Whether the triangle can be cut off: it is not turned over, and nothing else of the polygon lies in it.
fn is_ear(points: &[Point], left: &[usize], corners: [usize; 3]) -> bool {
    let [a, b, c] = corners.map(|c| points[c]);
    if area(a, b, c) <= NO_AREA {
        return false;
    }
    // A corner may be there twice, where a hole is joined to the outline.
    let is_inside = |p: Point| {
        let clear = ![a, b, c].contains(&p);
        clear && area(a, b, p) >= 0.0 && area(b, c, p) >= 0.0 && area(c, a, p) >= 0.0
    };
    let next = left.iter().cycle().skip(1);
    !left.iter().zip(next).any(|(from, to)| {
        let (from, to) = (points[*from], points[*to]);
        is_inside(from) || cross([a, c], [from, to], NO_AREA)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_plane(corners: &[Point]) -> Vec<Point3<f64>> {
        // x + y + z = 0, in metres around a place off the origin.
        let place = |[u, v]: &Point| Point3::new(1.0 + u, 2.0 + v, 3.0 - u - v);
        corners.iter().map(place).collect()
    }

    /// The triangles lie in the polygon: none is turned over, and their areas add up to its own.
    fn judge(corners: &[Point]) -> Vec<[usize; 3]> {
        let found = triangles(&in_plane(corners)).unwrap();
        assert_eq!(found.len(), corners.len() - 2);
        let areas = found.iter().map(|t| t.map(|c| corners[c]));
        let areas: Vec<f64> = areas.map(|[a, b, c]| area(a, b, c)).collect();
        assert!(areas.iter().all(|a| *a >= -1e-9), "{areas:?}");
        let whole: f64 = fan(corners.len())
            .map(|t| t.map(|c| corners[c]))
            .map(|[a, b, c]| area(a, b, c))
            .sum();
        assert!((areas.iter().sum::<f64>() - whole).abs() < 1e-9);
        found
    }

    #[test]
    fn a_convex_polygon_keeps_its_fan() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(judge(&square), [[0, 1, 2], [0, 2, 3]]);
        let in_line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        assert_eq!(judge(&in_line), [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn concave_polygons_are_covered_from_every_corner_and_side() {
        let arrow = vec![[0.0, 0.0], [2.0, -1.0], [1.0, 0.0], [2.0, 1.0]];
        let angle = vec![
            [0.0, 0.0],
            [2.0, 0.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [0.0, 2.0],
        ];
        let comb = (0..12)
            .rev()
            .map(|i| [f64::from(i), if i % 2 == 0 { 1.0 } else { 5.0 }]);
        let comb: Vec<Point> = [[0.0, 0.0], [11.0, 0.0]].into_iter().chain(comb).collect();
        // A square with a square hole, joined by a bridge.
        let frame = vec![
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        for polygon in [arrow, angle, comb, frame] {
            for first in 0..polygon.len() {
                let mut turned = polygon.clone();
                turned.rotate_left(first);
                let _ = judge(&turned);
            }
        }
    }

    #[test]
    fn polygons_that_cross_themselves_are_refused() {
        let bow = vec![[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let star = (0..5).map(|i| f64::from(2 * i) * std::f64::consts::TAU / 5.0);
        let star: Vec<Point> = star.map(|angle| [angle.cos(), angle.sin()]).collect();
        for polygon in [bow, star] {
            let why = triangles(&in_plane(&polygon)).unwrap_err();
            assert!(why.contains("is no simple polygon"), "{why}");
        }
    }

    #[test]
    fn what_has_no_area_or_no_size_stays_a_fan() {
        for corners in [
            [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]],
            [[0.0; 2]; 4],
        ] {
            assert_eq!(judge(&corners), [[0, 1, 2], [0, 2, 3]]);
        }
        let far = [1.0, -1.0, 1.0, -1.0].map(|s| Point3::new(s * 1e308, 1e308 * s, s));
        assert!(triangles(&far).is_ok());
    }
}
