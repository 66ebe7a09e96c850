//! How far the points of one surface are from another, as a rigorous bound. For set-up and checks.
//!
//! | symbol | name in code | unit | meaning                                                                  |
//! |--------|--------------|------|--------------------------------------------------------------------------|
//! | d(x)   |              | m    | distance of x from the second surface                                    |
//! | d_k(x) |              | m    | distance of x from its triangle k: d <= d_k, and d_k is convex           |
//!
//! Over a convex piece d_k is greatest at a corner, so `max_corners d_k` bounds d there for any k. A piece is cut along the sides of the triangle
//! nearest to its middle, as seen across the piece: what is over that triangle is bounded by it, the rest goes on. Where that is not enough, it is cut in four.
//! Strips narrower than [`STRIP`] are left out: they lie that near to a neighbour, and the bound grows by as much.

use std::collections::VecDeque;

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::mesh::Mesh;
use super::nearest::{nearest_on_mesh, to_triangle};

/// A bound this share above the largest distance seen is close enough, unless the limit lies between the two.
const ACCURACY: f64 = 0.05;
/// Distances below this share of the limit are not told apart.
const FLOOR: f64 = 0.1;
/// Most pieces of one triangle; what is left then counts with the bound that it has.
const MAX_PIECES: u32 = 100_000;
/// A triangle over less of a piece than this share is not cut along.
const WORTH_CUTTING: f64 = 0.1;
/// Width of strips that are left out, as a share of the limit.
const STRIP: f64 = 1e-9;
/// Rounding of a distance relative to the largest coordinate.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Parts of a piece that is cut three times: at most 8 within, and 2 + 4 + 8 without.
type Parts = ArrayVec<Piece, 16>;

/// A piece of a triangle.
type Piece = [Point3<f64>; 3];

/// A bound on the distance of any point of one surface from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneSidedDistance {
    /// No point of the first surface is farther from the second, m. Rigorous, rounding included; infinite where the search gave up.
    pub at_most: f64,
    /// Some point is this far, m.
    pub at_least: f64,
}

/// Bounds the distance of the points of `from` to `to`; gives up, with what it knows, as soon as some point is farther than `limit` (m). The bound is
/// above the limit only where some point is, or lies within 1e-4 of it.
/// `done` is told after each triangle how many there were.
pub fn one_sided_distance(
    from: &Mesh,
    to: &Mesh,
    limit: f64,
    mut done: impl FnMut(usize),
) -> OneSidedDistance {
    let rounding = ROUNDING * (from.reach() + to.reach());
    let mut search = OneSided {
        to,
        limit,
        // What is added to the bound at the end does not lift it over the limit: strips count before they are known, as many as there can be.
        decided: limit * (1.0 - f64::from(MAX_PIECES) * STRIP) - rounding,
        at_most: 0.0,
        at_least: 0.0,
        pieces: VecDeque::new(),
        strips: 0,
    };
    let mut guess = 0;
    let used = (0..from.vertices().len() as u32).filter(|v| from.vertex_owner(*v).is_some());
    for v in used {
        let nearest = nearest_on_mesh(to, &from.vertices()[v as usize], guess);
        guess = nearest.triangle;
        search.at_least = search.at_least.max(nearest.distance);
    }
    for t in 0..from.triangles().len() {
        search.triangle(from.corners(t as u32), from.face_normal(t as u32));
        if search.has_given_up() {
            break;
        }
        done(t + 1);
    }
    let at_most = if search.has_given_up() {
        f64::INFINITY
    } else {
        search.at_most + f64::from(search.strips) * STRIP * limit + rounding
    };
    OneSidedDistance {
        at_most,
        at_least: search.at_least,
    }
}

struct OneSided<'a> {
    to: &'a Mesh,
    limit: f64,
    /// Bounds up to this one are surely within the limit, m.
    decided: f64,
    at_most: f64,
    at_least: f64,
    /// What is left of a triangle, the largest pieces first: a point beyond the limit is met before the pieces where the distance is just the limit.
    pieces: VecDeque<Piece>,
    /// Most strips left out of one triangle.
    strips: u32,
}

impl OneSided<'_> {
    /// Some point is beyond the limit, or a piece within rounding of it is cut too often to tell.
    fn has_given_up(&self) -> bool {
        self.at_least.max(self.at_most) > self.limit
    }

    fn triangle(&mut self, corners: Piece, normal: &Vector3<f64>) {
        self.pieces.clear();
        self.pieces.push_back(corners);
        let (mut seen, mut strips, mut guess) = (0, 0, 0);
        while let Some(piece) = self.pieces.pop_front() {
            if self.has_given_up() {
                return;
            }
            if is_strip(&piece, STRIP * self.limit) {
                strips += 1;
                continue;
            }
            seen += 1;
            let middle = Point3::from((piece[0].coords + piece[1].coords + piece[2].coords) / 3.0);
            let nearest = nearest_on_mesh(self.to, &middle, guess);
            guess = nearest.triangle;
            self.at_least = self.at_least.max(nearest.distance);
            if self.accept(&piece, guess, seen) {
                continue;
            }
            // What lies over the nearest triangle is bounded by it.
            let (inside, outside) = self.over(&piece, guess, normal);
            let covered: f64 = inside.iter().map(doubled_area).sum();
            let cut_helps = covered > WORTH_CUTTING * doubled_area(&piece) && !outside.is_empty();
            if !cut_helps {
                self.pieces.extend(quarters(&piece));
                continue;
            }
            self.pieces.extend(outside);
            for part in inside {
                if !self.accept(&part, guess, seen) {
                    self.pieces.extend(quarters(&part));
                }
            }
        }
        self.strips = self.strips.max(strips);
    }

    /// Cuts a piece along the sides of triangle `k`, seen along `normal`, into what is over it and what is not.
    fn over(&self, piece: &Piece, k: u32, normal: &Vector3<f64>) -> (Parts, Parts) {
        let (mut inside, mut outside) = (Parts::new(), Parts::new());
        inside.push(*piece);
        let corners = self.to.corners(k);
        // Seen from behind, the sides' outer sides change.
        let turn = self.to.face_normal(k).dot(normal).signum();
        for side in 0..3 {
            let out = (corners[(side + 1) % 3] - corners[side]).cross(normal) * turn;
            let mut kept = Parts::new();
            for part in &inside {
                cut(part, &corners[side], &out, |p, is_out| {
                    if is_out {
                        outside.push(p);
                    } else {
                        kept.push(p);
                    }
                });
            }
            inside = kept;
        }
        (inside, outside)
    }

    /// Takes the bound of a piece by triangle `k` if it is close enough, or if there are too many pieces.
    fn accept(&mut self, piece: &Piece, k: u32, seen: u32) -> bool {
        let bound = piece
            .iter()
            .map(|c| to_triangle(self.to, c, k).0)
            .fold(0.0, f64::max)
            .sqrt();
        // Where the limit lies between bound and distance, the piece is cut until one of them is on the other's side.
        let close = bound <= self.at_least.max(FLOOR * self.limit) * (1.0 + ACCURACY);
        let fine = close && (bound <= self.decided || self.decided < FLOOR * self.limit);
        if fine || seen > MAX_PIECES {
            self.at_most = self.at_most.max(bound);
        }
        fine || seen > MAX_PIECES
    }
}

/// Whether the least height of the piece is below `width`.
fn is_strip(piece: &Piece, width: f64) -> bool {
    let [a, b, c] = piece;
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    doubled_area(piece) <= width * longest
}

fn doubled_area([a, b, c]: &Piece) -> f64 {
    (b - a).cross(&(c - a)).norm()
}

/// Cuts a piece by the plane through `point` with normal `out`; hands on the parts, and whether they are beyond it.
fn cut(piece: &Piece, point: &Point3<f64>, out: &Vector3<f64>, mut found: impl FnMut(Piece, bool)) {
    let heights = piece.map(|p| out.dot(&(p - point)));
    for beyond in [false, true] {
        let mut corners: ArrayVec<Point3<f64>, 4> = ArrayVec::new();
        for k in 0..3 {
            let (h, next) = (heights[k], heights[(k + 1) % 3]);
            if (h > 0.0) == beyond {
                corners.push(piece[k]);
            }
            if (h > 0.0) != (next > 0.0) {
                corners.push(piece[k] + (piece[(k + 1) % 3] - piece[k]) * (h / (h - next)));
            }
        }
        for k in 2..corners.len() {
            found([corners[0], corners[k - 1], corners[k]], beyond);
        }
    }
}

fn quarters([a, b, c]: &Piece) -> [Piece; 4] {
    let (ab, bc, ca) = (
        nalgebra::center(a, b),
        nalgebra::center(b, c),
        nalgebra::center(c, a),
    );
    [[*a, ab, ca], [*b, bc, ab], [*c, ca, bc], [ab, bc, ca]]
}
