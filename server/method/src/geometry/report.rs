//! What a triangle surface is like, sound or broken: the figures behind `check`.

use std::collections::HashSet;

use nalgebra::{Point3, Vector3};

use super::mesh::{face_normal, signed_volume};
use super::parts::{InvertedPart, wrong_parts};
use super::topology::sorted_sides;

/// Findings about vertices and triangles as they come from a file. Works for meshes that [`Mesh`](super::Mesh) refuses.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Every edge has at least two triangles, and there is a triangle.
    pub watertight: bool,
    /// Wherever two triangles share an edge they agree about outside, and every part that has an inside has it there.
    pub oriented: bool,
    /// Parts that are inside out, no cavities of others. A part with holes counts as if they were closed; sheets, and parts that do not agree about
    /// outside, are none.
    pub inverted_parts: Vec<InvertedPart>,
    /// Parts that lie in an odd number of others and look outward, though they are walls of cavities.
    pub outward_walls: Vec<InvertedPart>,
    /// Triangles without area, with an index out of range or with a corner that is not finite.
    pub degenerate_faces: usize,
    /// Triangles with the same three corners as an earlier one, in any order.
    pub duplicate_faces: usize,
    /// Edges with one triangle.
    pub border_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges along which two triangles run the same way.
    pub misoriented_edges: usize,
    /// Signed volume, m^3; means the inside only where the surface is watertight and oriented.
    pub volume: f64,
    /// Least height of a triangle with area, m; infinite when there is none.
    pub smallest_feature: f64,
    /// Where the first of each fault is.
    pub places: MeshPlaces,
}

/// Where the first fault of each kind is, m, in the mesh's frame: the middle of an edge or of a triangle. `None` where there is no such fault.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeshPlaces {
    /// A triangle without area; `None` as well where its corners are no points.
    pub degenerate: Option<Point3<f64>>,
    /// A triangle with the corners of an earlier one.
    pub duplicate: Option<Point3<f64>>,
    /// An edge with one triangle.
    pub border: Option<Point3<f64>>,
    /// An edge with more than two triangles.
    pub non_manifold: Option<Point3<f64>>,
    /// An edge along which two triangles run the same way.
    pub misoriented: Option<Point3<f64>>,
}

impl MeshReport {
    /// Looks at a surface. Triangles that name no vertex or have no area are counted and left out of the rest.
    pub fn of(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let names_vertices = |t: &&[u32; 3]| {
            t.iter().all(|v| {
                vertices
                    .get(*v as usize)
                    .is_some_and(|p| p.iter().all(|c| c.is_finite()))
            })
        };
        let named: Vec<[u32; 3]> = triangles.iter().filter(names_vertices).copied().collect();
        let with_area = |t: &&[u32; 3]| face_normal(&t.map(|v| vertices[v as usize])).is_some();
        let sound: Vec<[u32; 3]> = named.iter().filter(with_area).copied().collect();

        let mut seen = HashSet::new();
        let duplicate = |t: &&[u32; 3]| {
            let mut corners = **t;
            corners.sort_unstable();
            !seen.insert(corners)
        };
        let duplicates: Vec<&[u32; 3]> = sound.iter().filter(duplicate).collect();
        let sides = count_sides(&sound);
        let middle = |corners: &[u32]| {
            let sum: Vector3<f64> = corners.iter().map(|v| vertices[*v as usize].coords).sum();
            Point3::from(sum / corners.len() as f64)
        };
        let places = MeshPlaces {
            degenerate: named.iter().find(|t| !with_area(t)).map(|t| middle(t)),
            duplicate: duplicates.first().map(|t| middle(&t[..])),
            border: sides.borders.first().map(|(edge, _)| middle(edge)),
            non_manifold: sides.first_crowded.map(|edge| middle(&edge)),
            misoriented: sides.first_misoriented.map(|edge| middle(&edge)),
        };
        let wrong = wrong_parts(
            vertices,
            &sound,
            sides.adjacent.iter().copied(),
            &sides.borders,
            &sides.unclear,
        );
        let volume = if sound.is_empty() {
            0.0
        } else {
            signed_volume(vertices, &sound)
        };
        let heights = sound
            .iter()
            .map(|t| least_height(&t.map(|v| vertices[v as usize])));
        Self {
            triangles: triangles.len(),
            vertices: vertices.len(),
            watertight: sides.borders.is_empty() && !sound.is_empty(),
            oriented: sides.misoriented == 0
                && !sound.is_empty()
                && wrong.inverted.is_empty()
                && wrong.outward_walls.is_empty(),
            inverted_parts: wrong.inverted,
            outward_walls: wrong.outward_walls,
            degenerate_faces: triangles.len() - sound.len(),
            duplicate_faces: duplicates.len(),
            border_edges: sides.borders.len(),
            non_manifold_edges: sides.crowded,
            misoriented_edges: sides.misoriented,
            volume,
            smallest_feature: heights.fold(f64::INFINITY, f64::min),
            places,
        }
    }

    /// Whether the method can use the surface: closed, oriented, 2-manifold, without degenerate or duplicate faces.
    pub fn is_sound(&self) -> bool {
        self.watertight
            && self.oriented
            && self.degenerate_faces == 0
            && self.duplicate_faces == 0
            && self.non_manifold_edges == 0
    }
}

#[derive(Default)]
struct Sides {
    crowded: usize,
    misoriented: usize,
    first_crowded: Option<[u32; 2]>,
    first_misoriented: Option<[u32; 2]>,
    /// Edges with one triangle, and that triangle.
    borders: Vec<([u32; 2], u32)>,
    /// The two triangles at each edge that has two.
    adjacent: Vec<[u32; 2]>,
    /// Triangles at edges with more, or that do not agree there: what they bound is not known.
    unclear: Vec<u32>,
}

/// What the edges are like.
fn count_sides(triangles: &[[u32; 3]]) -> Sides {
    let all = sorted_sides(triangles);
    let mut sides = Sides::default();
    for edge in all.chunk_by(|a, b| (a.low, a.high) == (b.low, b.high)) {
        let ends = [edge[0].low, edge[0].high];
        match edge {
            [one] => sides.borders.push((ends, one.triangle)),
            [a, b] => {
                if a.forward == b.forward {
                    sides.misoriented += 1;
                    sides.first_misoriented.get_or_insert(ends);
                    sides.unclear.extend([a.triangle, b.triangle]);
                }
                sides.adjacent.push([a.triangle, b.triangle]);
            }
            _ => {
                sides.crowded += 1;
                sides.first_crowded.get_or_insert(ends);
                sides.unclear.extend(edge.iter().map(|side| side.triangle));
            }
        }
    }
    sides
}

/// Doubled area over the longest side.
fn least_height(t: &[Point3<f64>; 3]) -> f64 {
    let sides = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let longest = sides.iter().map(|s| s.norm()).fold(0.0, f64::max);
    sides[0].cross(&sides[1]).norm() / longest
}
