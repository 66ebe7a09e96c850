//! Lines, crossings and corners on the surface of a screen.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector2, Vector3};
use taut_screens::OutputMesh;

use crate::view::Screen;

/// Most points of a surface that lines are drawn over, each way: between them it is flat to the eye.
const MOST: usize = 96;
/// Smallest area that has a side, m².
const LEAST_AREA: f64 = 1e-12;

/// What the points of a map are rounded by, over the distance of lines or the size of a triangle.
const ROUNDING: f64 = 1e-5;

/// A grid of points, row by row from the lower left.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    columns: usize,
    rows: usize,
    points: Vec<Point3<f64>>,
}

/// A piece of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) from: Point3<f64>,
    pub(super) to: Point3<f64>,
    /// Unit vector in the surface, across the line.
    pub(super) side: Vector3<f64>,
}

impl Surface {
    /// A flat screen.
    pub(super) fn flat(screen: &Screen) -> Self {
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        Self {
            columns: 2,
            rows: 2,
            points: corners.map(|(x, y)| screen.point(x, y)).to_vec(),
        }
    }

    /// The surface of a mesh, with fewer points where it has many.
    pub(super) fn of(mesh: &OutputMesh) -> Self {
        let thinned = |count: usize| {
            let stride = count.div_ceil(MOST).max(1);
            let mut kept: Vec<usize> = (0..count).step_by(stride).collect();
            if kept.last() != Some(&(count - 1)) {
                kept.push(count - 1);
            }
            kept
        };
        let (columns, rows) = (thinned(mesh.columns), thinned(mesh.rows));
        let places = rows
            .iter()
            .flat_map(|r| columns.iter().map(move |c| (*c, *r)));
        Self {
            columns: columns.len(),
            rows: rows.len(),
            points: places
                .map(|(c, r)| Point3::from(mesh.node(c, r).target).cast())
                .collect(),
        }
    }

    fn point(&self, column: usize, row: usize) -> Point3<f64> {
        self.points[row * self.columns + column]
    }

    /// How far it reaches, m, along the screen's axes.
    pub(super) fn extent(&self, screen: &Screen) -> Vector2<f64> {
        let places = self.points.iter().map(|p| screen.place(p).xy());
        let boxes = places.map(|p| (p, p));
        let around = boxes.reduce(|(low, high), (p, q)| (low.inf(&p), high.sup(&q)));
        around.map_or_else(Vector2::zeros, |(low, high)| high - low)
    }

    /// Corners of its cells: lower left, lower right, upper right, upper left.
    pub(super) fn cells(&self) -> impl Iterator<Item = [Point3<f64>; 4]> + '_ {
        (1..self.rows).flat_map(move |r| {
            (1..self.columns).map(move |c| {
                [
                    self.point(c - 1, r - 1),
                    self.point(c, r - 1),
                    self.point(c, r),
                    self.point(c - 1, r),
                ]
            })
        })
    }

    fn triangles(&self) -> impl Iterator<Item = [Point3<f64>; 3]> + '_ {
        self.cells().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
    }

    /// Pieces of the lines on which the place along an axis of the screen (0: across, 1: up) is a multiple of `step`, of those multiples that
    /// are kept.
    pub(super) fn lines(
        &self,
        screen: &Screen,
        axis: usize,
        step: f64,
        keep: impl Fn(i64) -> bool,
    ) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for corners in self.triangles() {
            let values = corners.map(|p| screen.place(&p)[axis] / step);
            let (low, high) = (
                values.iter().copied().fold(f64::INFINITY, f64::min),
                values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            );
            for k in (low.ceil() as i64..=high.floor() as i64).filter(|k| keep(*k)) {
                let level = k as f64;
                // Each edge counts its lower end, so that a line through a corner crosses two edges.
                let crossings = [0, 1, 2].into_iter().filter_map(|i| {
                    let (u, v) = (values[i], values[(i + 1) % 3]);
                    ((u <= level) != (v <= level)).then(|| {
                        let along = (level - u) / (v - u);
                        corners[i] + (corners[(i + 1) % 3] - corners[i]) * along
                    })
                });
                let ends: Vec<Point3<f64>> = crossings.collect();
                if let [from, to] = ends[..] {
                    pieces.extend(piece(from, to, &corners));
                }
            }
        }
        pieces
    }

    /// Along both edges from each corner, this far.
    pub(super) fn corner_marks(&self, length: f64) -> Vec<Piece> {
        let (last, top) = (self.columns - 1, self.rows - 1);
        let mut pieces = Vec::new();
        for (column, row) in [(0, 0), (last, 0), (0, top), (last, top)] {
            let inward =
                |from: usize, i: usize, count: usize| if from == 0 { i } else { count - i };
            let across: Vec<_> = (0..=last)
                .map(|i| self.point(inward(column, i, last), row))
                .collect();
            let upward: Vec<_> = (0..=top)
                .map(|i| self.point(column, inward(row, i, top)))
                .collect();
            for (edge, other) in [(&across, &upward), (&upward, &across)] {
                let mut left = length;
                for ends in edge.windows(2) {
                    let whole = (ends[1] - ends[0]).norm();
                    if left <= 0.0 || whole <= 0.0 {
                        break;
                    }
                    let to = ends[0] + (ends[1] - ends[0]) * (left / whole).min(1.0);
                    pieces.extend(piece(ends[0], to, &[ends[0], ends[1], other[1]]));
                    left -= whole;
                }
            }
        }
        pieces
    }

    /// Where the lines at multiples of `step` cross: the multiples, across and up, and the point.
    pub(super) fn crossings(&self, screen: &Screen, step: f64) -> BTreeMap<[i64; 2], Point3<f64>> {
        let mut found = BTreeMap::new();
        for corners in self.triangles() {
            let places = corners.map(|p| screen.place(&p).xy() / step);
            let low = places[0].inf(&places[1]).inf(&places[2]);
            let high = places[0].sup(&places[1]).sup(&places[2]);
            for across in (low.x - ROUNDING).ceil() as i64..=(high.x + ROUNDING).floor() as i64 {
                for upward in (low.y - ROUNDING).ceil() as i64..=(high.y + ROUNDING).floor() as i64
                {
                    let wanted = Vector2::new(across as f64, upward as f64);
                    if let Some(point) = within(&places, &corners, &wanted) {
                        found.insert([across, upward], point);
                    }
                }
            }
        }
        found
    }
}

/// A piece in the plane of a triangle; `None` where there is no such plane or no length.
fn piece(from: Point3<f64>, to: Point3<f64>, corners: &[Point3<f64>; 3]) -> Option<Piece> {
    let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let side = (to - from).cross(&normal);
    let (length, area) = (side.norm(), normal.norm());
    (area > LEAST_AREA && length > LEAST_AREA * area).then(|| Piece {
        from,
        to,
        side: side / length,
    })
}

/// The point of a triangle at a place, if it is in it.
fn within(
    places: &[Vector2<f64>; 3],
    corners: &[Point3<f64>; 3],
    wanted: &Vector2<f64>,
) -> Option<Point3<f64>> {
    let (u, v, w) = (
        places[1] - places[0],
        places[2] - places[0],
        wanted - places[0],
    );
    let area = u.perp(&v);
    let (b, c) = (w.perp(&v) / area, u.perp(&w) / area); // not finite where seen edge-on: not within
    let inside = b >= -ROUNDING && c >= -ROUNDING && b + c <= 1.0 + ROUNDING;
    inside.then(|| corners[0] + (corners[1] - corners[0]) * b + (corners[2] - corners[0]) * c)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correction::tests::surface;

    fn wall() -> Screen {
        let corners = [[-0.9, 0.0, 0.0], [0.9, 0.0, 0.0], [-0.9, 0.0, 1.2]].map(Point3::from);
        Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen")
    }

    /// A wall that bulges away from the viewer.
    fn bulge() -> Surface {
        Surface::of(&surface((41, 21), |s, t| {
            let deep = 0.3 * (s * std::f32::consts::PI).sin();
            [1.8 * s - 0.9, deep, 1.2 * t]
        }))
    }

    #[test]
    fn lines_lie_at_their_multiples_from_edge_to_edge() {
        for surface in [Surface::flat(&wall()), bulge()] {
            for axis in [0, 1] {
                let pieces = surface.lines(&wall(), axis, 0.1, |k| k == 5);
                let mut length = 0.0;
                for Piece { from, to, side } in &pieces {
                    for end in [from, to] {
                        assert!((wall().place(end)[axis] - 0.5).abs() < 1e-9, "{end}");
                    }
                    assert!((side.norm() - 1.0).abs() < 1e-9);
                    assert!(side.dot(&(to - from)).abs() < 1e-9);
                    length += wall()
                        .place(to)
                        .xy()
                        .metric_distance(&wall().place(from).xy());
                }
                let whole = [wall().height(), wall().width()][axis];
                assert!((length - whole).abs() < 1e-6, "{length} of {whole}");
            }
        }
    }

    #[test]
    fn every_crossing_is_found_once_and_lies_on_the_surface() {
        let crossings = bulge().crossings(&wall(), 0.5);
        assert_eq!(crossings.len(), 4 * 3, "{crossings:?}");
        for ([across, upward], point) in crossings {
            let place = wall().place(&point);
            assert!((place.x - 0.5 * across as f64).abs() < 1e-5);
            assert!((place.y - 0.5 * upward as f64).abs() < 1e-5);
            let deep = 0.3 * (place.x / 1.8 * std::f64::consts::PI).sin();
            assert!((point.y - deep).abs() < 2e-3, "{point}");
        }
    }

    #[test]
    fn corner_marks_begin_at_the_corners_and_have_their_length() {
        for surface in [Surface::flat(&wall()), bulge()] {
            let marks = surface.corner_marks(0.1);
            let length: f64 = marks.iter().map(|m| (m.to - m.from).norm()).sum();
            assert!((length - 8.0 * 0.1).abs() < 1e-6, "{length}");
            for corner in [wall().point(0.0, 0.0), wall().point(1.0, 1.0)] {
                let from = marks.iter().filter(|m| (m.from - corner).norm() < 1e-6);
                assert_eq!(from.count(), 2);
            }
        }
    }
}
