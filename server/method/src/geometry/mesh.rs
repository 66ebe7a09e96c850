//! Mesh: a closed, outward oriented triangle surface, checked once when it is built.

use nalgebra::{Point3, Vector3};

use super::mesh_error::MeshError;
use super::normal_cone::triangle_cones;
use super::parts::inverted_parts;
use super::topology::{Edge, Topology};
use super::tree::Tree;
use super::wide_tree::WideTree;

/// A triangle whose doubled area is below this share of its longest side squared has none: some units of rounding of the
/// cross product. Slivers of CAD exports, some 1e-6 of their length high, are far above.
const ZERO_AREA: f64 = 8.0 * f64::EPSILON;
/// Most vertices or triangles: edges are named by 32 bits, and there are three sides to a triangle.
const MAX_COUNT: usize = (u32::MAX / 4) as usize;

/// A closed, consistently outward oriented, 2-manifold triangle surface in its own frame, metres.
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    face_normals: Vec<Vector3<f64>>,
    topology: Topology,
    tree: Tree,
    wide_tree: WideTree,
    identity: u64,
    bounding_box: [Point3<f64>; 2],
}

impl Mesh {
    /// Checks the surface and builds what the method asks of it: edges, rings, normals, tree.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check_numbers(&vertices, &triangles)?;
        let mut face_normals = Vec::with_capacity(triangles.len());
        for (triangle, corners) in triangles.iter().enumerate() {
            let normal = face_normal(&corners.map(|v| vertices[v as usize]));
            face_normals.push(normal.ok_or(MeshError::ZeroArea { triangle })?);
        }
        let mut topology = Topology::build(&vertices, &triangles, &face_normals)?;
        check_outward(&vertices, &triangles, &topology)?;

        let cones = triangle_cones(&vertices, &triangles, &face_normals, &mut topology);
        let tree = Tree::build(&vertices, &triangles);
        let wide_tree = WideTree::build(
            &vertices,
            &triangles,
            &face_normals,
            (&cones, &topology.owned),
            &tree,
        );
        let identity = identity(&vertices, &triangles);
        let mut bounding_box = [vertices[0]; 2];
        for v in &vertices {
            bounding_box = [bounding_box[0].inf(v), bounding_box[1].sup(v)];
        }
        Ok(Self {
            vertices,
            triangles,
            face_normals,
            topology,
            tree,
            wide_tree,
            identity,
            bounding_box,
        })
    }

    /// Vertex positions, m.
    #[inline]
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Corner indices, counter-clockwise seen from outside.
    #[inline]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corner positions of triangle `t`.
    #[inline]
    pub fn corners(&self, t: u32) -> [Point3<f64>; 3] {
        let [a, b, c] = self.triangles[t as usize];
        [
            self.vertices[a as usize],
            self.vertices[b as usize],
            self.vertices[c as usize],
        ]
    }

    /// Outward unit normal of triangle `t`.
    #[inline]
    pub fn face_normal(&self, t: u32) -> &Vector3<f64> {
        &self.face_normals[t as usize]
    }

    /// All edges.
    #[inline]
    pub fn edges(&self) -> &[Edge] {
        &self.topology.edges
    }

    /// Edges of triangle `t`; edge `k` runs between corners `k` and `k + 1`.
    #[inline]
    pub fn triangle_edges(&self, t: u32) -> [u32; 3] {
        self.topology.triangle_edges[t as usize]
    }

    /// Vertices that share an edge with vertex `v`.
    #[inline]
    pub fn neighbours(&self, v: u32) -> &[u32] {
        self.topology.ring(v)
    }

    /// The triangle that owns vertex `v` in contact collection; `None` for a vertex without triangles.
    #[inline]
    pub fn vertex_owner(&self, v: u32) -> Option<u32> {
        Some(self.topology.vertex_owner[v as usize]).filter(|t| *t != u32::MAX)
    }

    /// Features that triangle `t` owns and that can touch: bits 0-2 its corners, bits 3-5 its edges.
    #[inline]
    pub(crate) fn owned_features(&self, t: u32) -> u8 {
        self.topology.owned[t as usize]
    }

    /// The bounding-volume tree over the triangles.
    #[inline]
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// A number that meshes with other vertices or triangles do not share, but by a chance of 2^-64.
    #[inline]
    pub(crate) fn identity(&self) -> u64 {
        self.identity
    }

    /// The wide tree over the triangles.
    #[inline]
    pub(crate) fn wide_tree(&self) -> &WideTree {
        &self.wide_tree
    }

    /// Lower and upper corner of the axis-aligned box around the vertices, m.
    pub fn bounding_box(&self) -> [Point3<f64>; 2] {
        self.bounding_box
    }

    /// Largest coordinate of the bounding box, m: rounding is relative to it.
    pub(crate) fn reach(&self) -> f64 {
        let [low, high] = &self.bounding_box;
        low.coords.amax().max(high.coords.amax())
    }

    /// Bound on the distance of any vertex from `point`, m, by the bounding box: no vertex is visited.
    #[inline]
    pub fn radius_bound_about(&self, point: &Point3<f64>) -> f64 {
        let [low, high] = &self.bounding_box;
        (point - low).abs().sup(&(high - point).abs()).norm()
    }

    /// Distance of the bounding box from `point`, m, which no vertex is nearer than; none inside the box.
    #[inline]
    pub(crate) fn box_distance(&self, point: &Point3<f64>) -> f64 {
        let [low, high] = &self.bounding_box;
        let outside = (low - point).sup(&(point - high));
        outside.sup(&Vector3::zeros()).norm()
    }

    /// Greatest distance of a vertex from `point`, m.
    pub fn radius_about(&self, point: &Point3<f64>) -> f64 {
        self.vertices
            .iter()
            .map(|v| (v - point).norm_squared())
            .fold(0.0, f64::max)
            .sqrt()
    }
}

/// Hash of vertices and triangles (Fowler, Noll and Vo's, a word at a time).
fn identity(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> u64 {
    const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let coordinates = vertices.iter().flat_map(|v| v.iter()).map(|x| x.to_bits());
    let corners = triangles.iter().flatten().map(|v| u64::from(*v));
    coordinates.chain(corners).fold(OFFSET, |hash, word| {
        let mixed = (hash ^ word).wrapping_mul(PRIME);
        mixed ^ (mixed >> 32)
    })
}

fn check_numbers(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    let count = vertices.len().max(triangles.len());
    if count > MAX_COUNT {
        return Err(MeshError::TooLarge {
            count,
            limit: MAX_COUNT,
        });
    }
    if let Some(vertex) = vertices
        .iter()
        .position(|v| !v.iter().all(|c| c.is_finite()))
    {
        return Err(MeshError::VertexNotFinite { vertex });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|v| **v as usize >= vertices.len()) {
            return Err(MeshError::IndexOutOfRange {
                triangle,
                vertex,
                vertices: vertices.len(),
            });
        }
    }
    Ok(())
}

/// Every closed part looks outward, or into a cavity of another.
fn check_outward(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    topology: &Topology,
) -> Result<(), MeshError> {
    let volume = signed_volume(vertices, triangles);
    let inverted = inverted_parts(vertices, triangles, topology.edges.iter().map(|e| e.faces));
    match inverted.first() {
        Some(part) if part.triangles < triangles.len() => Err(MeshError::PartInsideOut(*part)),
        Some(_) => Err(MeshError::InsideOut { volume }),
        None => Ok(()),
    }
}

/// Outward unit normal, or `None` where the triangle has no area to rounding.
///
/// The two shortest sides make the cross product: the least cancellation in a sliver.
pub fn face_normal(corners: &[Point3<f64>; 3]) -> Option<Vector3<f64>> {
    let sides = [
        corners[1] - corners[0],
        corners[2] - corners[1],
        corners[0] - corners[2],
    ];
    let squared = sides.map(|s| s.norm_squared());
    let longest = (0..3).fold(
        0,
        |best, k| if squared[k] > squared[best] { k } else { best },
    );
    let doubled = sides[(longest + 1) % 3].cross(&sides[(longest + 2) % 3]);
    let area = doubled.norm();
    (area > ZERO_AREA * squared[longest]).then(|| doubled / area) // None for NaN
}

/// Volume inside the surface, m^3, negative when it is inside out. Summed about the first vertex.
pub(crate) fn signed_volume(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let origin = vertices[0];
    let six_volumes = triangles.iter().map(|t| {
        let [a, b, c] = t.map(|v| vertices[v as usize] - origin);
        a.dot(&b.cross(&c))
    });
    six_volumes.sum::<f64>() / 6.0
}
