//! The point of a mesh's surface nearest to a point, and one-sided distances between surfaces. For set-up and checks.
//!
//! | symbol | name in code | unit | meaning                                                                  |
//! |--------|--------------|------|--------------------------------------------------------------------------|
//! | d(x)   |              | m    | distance of x from the second surface                                    |
//! | d_k(x) |              | m    | distance of x from its triangle k: d <= d_k, and d_k is convex           |
//!
//! Over a triangle d_k is greatest at a corner. So `max_corners d_k` bounds d there for any k; pieces are cut in four until a k is found for which it is
//! small, or the piece is.

use nalgebra::Point3;

use super::distance::closest_on_triangle;
use super::mesh::Mesh;
use super::tree::Node;

/// A bound this share above the largest distance seen is close enough.
const ACCURACY: f64 = 0.05;
/// Distances below this share of the limit are not told apart.
const FLOOR: f64 = 0.25;
/// Most pieces of one triangle; what is left then counts with the bound that it has.
const MAX_PIECES: u32 = 200_000;
/// Rounding of a distance relative to the largest coordinate.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestOnMesh {
    /// m.
    pub distance: f64,
    /// A triangle that holds it.
    pub triangle: u32,
}

/// The nearest point of `mesh` to `p`. `guess` is any triangle, best a near one.
pub fn nearest_on_mesh(mesh: &Mesh, p: &Point3<f64>, guess: u32) -> NearestOnMesh {
    let mut best = to_triangle(mesh, p, guess);
    let nodes = mesh.tree().nodes();
    descend(mesh, nodes, 0, p, &mut best);
    NearestOnMesh {
        distance: best.0.sqrt(),
        triangle: best.1,
    }
}

fn descend(mesh: &Mesh, nodes: &[Node], i: u32, p: &Point3<f64>, best: &mut (f64, u32)) {
    let node = &nodes[i as usize];
    if node.is_leaf() {
        let found = to_triangle(mesh, p, node.triangle);
        if found.0 < best.0 {
            *best = found;
        }
        return;
    }
    let mut children =
        [i + 1, node.second].map(|child| (squared_distance(&nodes[child as usize], p), child));
    if children[1].0 < children[0].0 {
        children.swap(0, 1);
    }
    for (at_least, child) in children {
        if at_least < best.0 {
            descend(mesh, nodes, child, p, best);
        }
    }
}

fn squared_distance(node: &Node, p: &Point3<f64>) -> f64 {
    let outside = (p - node.center).abs() - node.half;
    outside.sup(&nalgebra::Vector3::zeros()).norm_squared()
}

fn to_triangle(mesh: &Mesh, p: &Point3<f64>, t: u32) -> (f64, u32) {
    let closest = closest_on_triangle(p, &mesh.corners(t)).point;
    ((closest - p).norm_squared(), t)
}

/// A bound on the distance of any point of one surface from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneSidedDistance {
    /// No point of the first surface is farther from the second, m. Rigorous, rounding included.
    pub at_most: f64,
    /// Some point is this far, m.
    pub at_least: f64,
}

/// Bounds the distance of the points of `from` to `to`; gives up, with what it knows, as soon as some point is farther than `limit` (m).
/// `done` is told after each triangle how many there were.
pub fn one_sided_distance(
    from: &Mesh,
    to: &Mesh,
    limit: f64,
    mut done: impl FnMut(usize),
) -> OneSidedDistance {
    let mut search = OneSided {
        to,
        limit,
        at_most: 0.0,
        at_least: 0.0,
        pieces: Vec::new(),
    };
    for t in 0..from.triangles().len() {
        search.triangle(from.corners(t as u32));
        if search.at_least > limit {
            break;
        }
        done(t + 1);
    }
    let reach = |mesh: &Mesh| {
        let corners = mesh.bounding_box();
        corners.iter().map(|p| p.coords.amax()).fold(0.0, f64::max)
    };
    let at_most = if search.at_least > limit {
        f64::INFINITY
    } else {
        search.at_most + ROUNDING * (reach(from) + reach(to))
    };
    OneSidedDistance {
        at_most,
        at_least: search.at_least,
    }
}

struct OneSided<'a> {
    to: &'a Mesh,
    limit: f64,
    at_most: f64,
    at_least: f64,
    pieces: Vec<[Corner; 3]>,
}

/// A point of the first surface, and the nearest of the second.
#[derive(Clone, Copy)]
struct Corner {
    at: Point3<f64>,
    nearest: NearestOnMesh,
}

impl OneSided<'_> {
    fn corner(&mut self, at: Point3<f64>, guess: u32) -> Corner {
        let nearest = nearest_on_mesh(self.to, &at, guess);
        self.at_least = self.at_least.max(nearest.distance);
        Corner { at, nearest }
    }

    fn triangle(&mut self, corners: [Point3<f64>; 3]) {
        let first = self.corner(corners[0], 0);
        let guess = first.nearest.triangle;
        let piece = [
            first,
            self.corner(corners[1], guess),
            self.corner(corners[2], guess),
        ];
        self.pieces.push(piece);
        let mut seen = 0;
        while let Some(piece) = self.pieces.pop() {
            if self.at_least > self.limit {
                self.pieces.clear();
                return;
            }
            seen += 1;
            let bound = self.bound(&piece);
            let fine = bound <= self.at_least.max(FLOOR * self.limit) * (1.0 + ACCURACY);
            if fine || seen > MAX_PIECES {
                self.at_most = self.at_most.max(bound);
                continue;
            }
            let [a, b, c] = piece;
            let mut middle = |p: &Corner, q: &Corner| {
                self.corner(nalgebra::center(&p.at, &q.at), p.nearest.triangle)
            };
            let (ab, bc, ca) = (middle(&a, &b), middle(&b, &c), middle(&c, &a));
            self.pieces
                .extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
    }

    /// The least over the corners' triangles of the largest distance at a corner.
    fn bound(&self, piece: &[Corner; 3]) -> f64 {
        let over = |k: u32| {
            piece
                .iter()
                .map(|c| to_triangle(self.to, &c.at, k).0)
                .fold(0.0, f64::max)
        };
        piece
            .iter()
            .map(|c| over(c.nearest.triangle))
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }
}
