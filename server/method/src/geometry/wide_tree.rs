//! Wide bounding-volume tree: eight children a node, each a box, a slab, a ball and a cone of normals, in single precision.
//!
//! | symbol | name in code  | unit | meaning                                                                       |
//! |--------|---------------|------|-------------------------------------------------------------------------------|
//! | c      | `center`      | m    | centre of the box, from the tree's `origin`, mesh axes                        |
//! | a      | `axis`        | –    | mean normal of the triangles inside, unit to rounding                         |
//! | m, h   | `middle`, `slab` | m | `a.(p - c)` is in [m - h, m + h] for every point p inside                     |
//! | rho    | `radius`      | m    | `|p - c| <= rho` for every point p inside                                     |
//! | alpha  | `cosine`, `sine` | – | half-angle about a of a cone that holds the normal cones of all features inside |
//!
//! A slab is thin where the surface is nearly flat, whatever its orientation: surfaces that lie on each other are told apart
//! by slabs long before they are by boxes. Seen along a direction at angle phi from a, the slab's points reach over
//! `m cos(phi) +- (h |cos(phi)| + rho sin(phi))`.
//!
//! **Rounding.** All is relative to the middle of the mesh, so that a mesh far from its frame's origin loses nothing. The
//! centre and the axis are what single precision holds; half sides, slab, radius and angle are measured from them in double
//! precision and rounded outward by `OUTWARD`, more than one unit in the last place of either precision.

use nalgebra::{Point3, Vector3};

use super::lanes::{LANES, Lanes};
use super::normal_cone::NormalCone;
use super::tree::{Node, Tree};

/// Outward rounding of a length relative to it and to the coordinates that it is the difference of.
const OUTWARD: f64 = f32::EPSILON as f64;
const OUTWARD_DOUBLE: f64 = 8.0 * f64::EPSILON;
/// Cones are wider than computed by this, rad: the rounding of an arc tangent, and then some.
const CONE_ROUNDING: f64 = 1e-7;
/// Marks a child that is a triangle.
const TRIANGLE: u32 = 1 << 31;

/// One child of a node, by number: the node times eight, and the lane. The whole mesh is child [`ROOT`].
pub(crate) type Child = u32;
/// The child that holds the whole mesh.
pub(crate) const ROOT: Child = 0;

/// Eight children, a lane each. Lanes without a child have boxes that meet nothing.
#[derive(Clone, Debug)]
pub(crate) struct WideNode {
    pub(crate) center: [Lanes; 3],
    pub(crate) half: [Lanes; 3],
    pub(crate) axis: [Lanes; 3],
    pub(crate) middle: Lanes,
    pub(crate) slab: Lanes,
    pub(crate) radius: Lanes,
    pub(crate) cosine: Lanes,
    pub(crate) sine: Lanes,
}

/// What a child holds, once more by itself: one line of the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub(crate) struct Volume {
    pub(crate) center: [f32; 3],
    pub(crate) half: [f32; 3],
    pub(crate) axis: [f32; 3],
    pub(crate) middle: f32,
    pub(crate) slab: f32,
    pub(crate) radius: f32,
    pub(crate) cosine: f32,
    pub(crate) sine: f32,
    below: u32,
    /// Which kinds of features the triangles inside own, as the bits of [`Mesh::owned_features`](crate::Mesh::owned_features).
    owned: u32,
}

/// What lies below a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Below {
    /// The number of a node.
    Node(u32),
    /// A triangle of the mesh.
    Triangle(u32),
}

/// The tree. Node 0 has one child, the whole mesh.
#[derive(Clone, Debug)]
pub(crate) struct WideTree {
    nodes: Vec<WideNode>,
    /// The children of all nodes, by number.
    volumes: Vec<Volume>,
    /// Point of the mesh's frame from which all coordinates are taken, m.
    pub(crate) origin: Point3<f64>,
    /// Largest distance of a vertex from `origin`, m.
    pub(crate) reach: f64,
}

/// What the build reads.
struct Source<'a> {
    vertices: &'a [Point3<f64>],
    triangles: &'a [[u32; 3]],
    face_normals: &'a [Vector3<f64>],
    cones: &'a [NormalCone],
    owned: &'a [u8],
    binary: &'a [Node],
    /// Triangles in the order of the binary tree's leaves, and the range of them below each of its nodes.
    order: Vec<u32>,
    ranges: Vec<[u32; 2]>,
    origin: Point3<f64>,
}

impl WideTree {
    /// From the binary tree: each node takes its largest descendants until it has eight.
    pub(crate) fn build(
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
        face_normals: &[Vector3<f64>],
        (cones, owned): (&[NormalCone], &[u8]),
        tree: &Tree,
    ) -> Self {
        let binary = tree.nodes();
        let mut order = Vec::with_capacity(triangles.len());
        let mut ranges = vec![[0; 2]; binary.len()];
        for (index, node) in binary.iter().enumerate() {
            ranges[index][0] = order.len() as u32;
            if node.is_leaf() {
                order.push(node.triangle);
            }
        }
        // Children follow their parent: from the back, every child's range is known before its parent's.
        for index in (0..binary.len()).rev() {
            ranges[index][1] = if binary[index].is_leaf() {
                ranges[index][0] + 1
            } else {
                ranges[binary[index].second as usize][1]
            };
        }
        let source = Source {
            vertices,
            triangles,
            face_normals,
            cones,
            owned,
            binary,
            order,
            ranges,
            origin: binary[0].center,
        };
        let reach = vertices
            .iter()
            .map(|v| (v - source.origin).norm_squared())
            .fold(0.0, f64::max)
            .sqrt();
        let mut tree = Self {
            nodes: Vec::new(),
            volumes: Vec::new(),
            origin: source.origin,
            reach,
        };
        tree.add_node();
        tree.set(ROOT, source.volume(0));
        let below = source.grow(0, &mut tree);
        tree.volumes[ROOT as usize].below = below;
        tree
    }

    /// Appends a node without children; its number.
    fn add_node(&mut self) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(WideNode::empty());
        self.volumes
            .resize(self.nodes.len() * LANES, Volume::default());
        index
    }

    fn set(&mut self, child: Child, volume: Volume) {
        self.nodes[child as usize / LANES].set(child as usize % LANES, &volume);
        self.volumes[child as usize] = volume;
    }

    /// Node `index`.
    #[inline]
    pub(crate) fn node(&self, index: u32) -> &WideNode {
        &self.nodes[index as usize]
    }

    /// What a child holds.
    #[inline]
    pub(crate) fn volume(&self, child: Child) -> &Volume {
        &self.volumes[child as usize]
    }

    /// Radius of a child's ball, m.
    #[inline]
    pub(crate) fn radius(&self, child: Child) -> f32 {
        self.volumes[child as usize].radius
    }

    /// Which kinds of features the triangles below a child own.
    #[inline]
    pub(crate) fn owned(&self, child: Child) -> u8 {
        self.volumes[child as usize].owned as u8
    }

    /// What lies below a child.
    #[inline]
    pub(crate) fn below(&self, child: Child) -> Below {
        let below = self.volumes[child as usize].below;
        if below & TRIANGLE != 0 {
            Below::Triangle(below & !TRIANGLE)
        } else {
            Below::Node(below)
        }
    }
}

impl WideNode {
    fn empty() -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            center: [zero; 3],
            half: [Lanes::splat(f32::NEG_INFINITY); 3],
            axis: [zero; 3],
            middle: zero,
            slab: zero,
            radius: zero,
            cosine: zero,
            sine: zero,
        }
    }

    fn set(&mut self, k: usize, volume: &Volume) {
        for i in 0..3 {
            self.center[i].0[k] = volume.center[i];
            self.half[i].0[k] = volume.half[i];
            self.axis[i].0[k] = volume.axis[i];
        }
        self.middle.0[k] = volume.middle;
        self.slab.0[k] = volume.slab;
        self.radius.0[k] = volume.radius;
        self.cosine.0[k] = volume.cosine;
        self.sine.0[k] = volume.sine;
    }
}

impl Source<'_> {
    /// Appends what lies below node `top` of the binary tree; says what it is.
    fn grow(&self, top: u32, tree: &mut WideTree) -> u32 {
        let node = &self.binary[top as usize];
        if node.is_leaf() {
            return node.triangle | TRIANGLE;
        }
        let mut below = [top; LANES];
        let mut count = 1;
        while count < LANES {
            let widest = (0..count)
                .filter(|k| !self.binary[below[*k] as usize].is_leaf())
                .reduce(|a, b| {
                    let radius = |k: usize| self.binary[below[k] as usize].radius;
                    if radius(b) > radius(a) { b } else { a }
                });
            let Some(widest) = widest else { break };
            let opened = below[widest];
            below[widest] = opened + 1;
            below[count] = self.binary[opened as usize].second;
            count += 1;
        }
        let index = tree.add_node();
        for (child, opened) in (index * LANES as u32..).zip(&below[..count]) {
            tree.set(child, self.volume(*opened));
            tree.volumes[child as usize].below = self.grow(*opened, tree);
        }
        index
    }

    /// What node `index` of the binary tree holds, measured triangle by triangle.
    fn volume(&self, index: u32) -> Volume {
        let node = &self.binary[index as usize];
        let [from, to] = self.ranges[index as usize];
        let inside = &self.order[from as usize..to as usize];
        let center = (node.center - self.origin).map(|x| x as f32);
        let axis = self.mean_normal(inside).map(|x| x as f32);
        let (wide_center, wide_axis) = (self.origin + center.map(f64::from), axis.map(f64::from));

        let (mut low, mut high, mut radius): (f64, f64, f64) =
            (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        let mut half = Vector3::zeros();
        let mut angle: f64 = 0.0;
        for t in inside {
            for v in self.triangles[*t as usize] {
                let arm = self.vertices[v as usize] - wide_center;
                let height = wide_axis.dot(&arm);
                (low, high) = (low.min(height), high.max(height));
                radius = radius.max(arm.norm_squared());
                half = half.sup(&arm.abs());
            }
            let cone = &self.cones[*t as usize];
            let between = wide_axis
                .cross(&cone.axis)
                .norm()
                .atan2(wide_axis.dot(&cone.axis));
            angle = angle.max(between + cone.angle + CONE_ROUNDING);
        }
        // Coordinates are exact in the mesh's frame; their differences are rounded relative to them.
        let error = OUTWARD_DOUBLE * (self.origin.coords.amax() + wide_center.coords.amax());
        let outward = |length: f64| (length * (1.0 + 2.0 * OUTWARD) + error) as f32;
        let middle = (0.5 * (low + high)) as f32;
        let slab = (high - f64::from(middle)).max(f64::from(middle) - low);
        let angle = angle.min(std::f64::consts::PI);
        Volume {
            center: center.into(),
            half: half.map(outward).into(),
            axis: axis.into(),
            middle,
            slab: outward(slab + OUTWARD_DOUBLE * radius.sqrt()),
            radius: outward(radius.sqrt()),
            cosine: angle.cos() as f32,
            sine: angle.sin() as f32,
            below: 0,
            owned: inside
                .iter()
                .fold(0, |kinds, t| kinds | u32::from(self.owned[*t as usize])),
        }
    }

    /// Mean of the normals, each with its triangle's area; some unit vector where they cancel.
    fn mean_normal(&self, inside: &[u32]) -> Vector3<f64> {
        let mut sum = Vector3::zeros();
        for t in inside {
            let [a, b, c] = self.triangles[*t as usize].map(|v| self.vertices[v as usize]);
            let area = (b - a).cross(&(c - a)).norm();
            sum += self.face_normals[*t as usize] * area;
        }
        let first = self.face_normals[inside[0] as usize];
        // One triangle: its normal as it is.
        if inside.len() == 1 {
            return first;
        }
        sum.try_normalize(f64::MIN_POSITIVE).unwrap_or(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;

    /// A bumpy ball at `center`: a grid of parallels and meridians, with needles where `needles` is small.
    fn ball(center: Vector3<f64>, needles: f64) -> Mesh {
        let (rings, around) = (17_u32, 23_u32);
        let mut vertices = vec![Point3::from(center + Vector3::z())];
        for i in 1..rings {
            let u = std::f64::consts::PI * f64::from(i) / f64::from(rings);
            for j in 0..around {
                let v = std::f64::consts::TAU * f64::from(j) / f64::from(around);
                let r = 1.0 + 0.2 * (7.0 * u).sin() * (5.0 * v).cos();
                let p = Vector3::new(u.sin() * v.cos(), needles * u.sin() * v.sin(), u.cos());
                vertices.push(Point3::from(center + p * r));
            }
        }
        vertices.push(Point3::from(center - Vector3::z()));
        let at = |i: u32, j: u32| 1 + (i - 1) * around + j % around;
        let last = vertices.len() as u32 - 1;
        let mut triangles = Vec::new();
        for j in 0..around {
            triangles.push([0, at(1, j), at(1, j + 1)]);
            triangles.push([last, at(rings - 1, j + 1), at(rings - 1, j)]);
            for i in 1..rings - 1 {
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        Mesh::new(vertices, triangles).expect("a ball is closed")
    }

    /// Checks a child against all triangles below it, which it returns.
    fn below(mesh: &Mesh, child: Child) -> Vec<u32> {
        let tree = mesh.wide_tree();
        let triangles = match tree.below(child) {
            Below::Triangle(t) => vec![t],
            Below::Node(node) => (0..LANES as u32)
                .map(|k| node * LANES as u32 + k)
                .filter(|c| tree.node(node).half[0].0[*c as usize % LANES] >= 0.0)
                .flat_map(|c| below(mesh, c))
                .collect(),
        };
        let v = tree.volume(child);
        let wide = |x: [f32; 3]| Vector3::from(x.map(f64::from));
        let (center, axis) = (tree.origin + wide(v.center), wide(v.axis));
        let cone = f64::from(v.sine).atan2(f64::from(v.cosine));
        for t in &triangles {
            for p in mesh.corners(*t) {
                let arm = p - center;
                for i in 0..3 {
                    assert!(arm[i].abs() <= f64::from(v.half[i]));
                }
                assert!(arm.norm() <= f64::from(v.radius));
                assert!((axis.dot(&arm) - f64::from(v.middle)).abs() <= f64::from(v.slab));
            }
            let normal = mesh.face_normal(*t);
            let off = axis.cross(normal).norm().atan2(axis.dot(normal));
            // The single-precision cosine holds an angle near zero to 4e-4; the test of facing allows for more.
            assert!(off <= cone + 5e-4, "{off} {cone}");
        }
        triangles
    }

    #[test]
    fn every_volume_holds_what_is_below_and_every_triangle_is_there_once() {
        for (center, needles) in [
            (Vector3::zeros(), 1.0),
            (Vector3::new(1000.0, -700.0, 300.0), 1.0),
            (Vector3::new(0.1, 0.0, 0.0), 1e-5),
        ] {
            let mesh = ball(center, needles);
            let mut found = below(&mesh, ROOT);
            found.sort_unstable();
            let all: Vec<u32> = (0..mesh.triangles().len() as u32).collect();
            assert_eq!(found, all);
        }
    }
}
