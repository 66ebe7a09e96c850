//! Wide bounding-volume tree: eight children a node, a volume each, in single precision.
//!
//! The volumes lie component by component, so that one is tested against eight at a time ([`Volume`]).

use nalgebra::{Point3, Vector3};

use super::collapse::Collapse;
use super::lanes::{LANES, Lanes};
use super::normal_cone::NormalCone;
use super::tree::Tree;
use super::volume::{Source, Volume};
use super::wide_node::WideNode;

/// What a flat volume counts as in thickness, per radius.
const THICKNESS_PER_RADIUS: f32 = 0.01;
/// Marks a child that is a triangle.
const TRIANGLE: u32 = 1 << 31;

/// One child of a node, by number: the node times eight, and the lane. The whole mesh is child [`ROOT`].
pub(crate) type Child = u32;
/// The child that holds the whole mesh.
pub(crate) const ROOT: Child = 0;

/// What a descent asks of a child before it opens it: a quarter of a cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(16))]
struct Entry {
    radius: f32,
    thickness: f32,
    below: u32,
    owned: u8,
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
    /// What a descent asks of the children of all nodes, by number.
    entries: Vec<Entry>,
    /// Point of the mesh's frame from which the nodes' origins are taken, m.
    pub(crate) origin: Point3<f64>,
    /// Largest distance of a vertex from `origin`, m.
    pub(crate) reach: f64,
}

impl WideTree {
    /// From the binary tree ([`Collapse`]).
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
            collapse: Collapse::of(binary),
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
            entries: Vec::new(),
            origin: source.origin,
            reach,
        };
        let middle = [0.0; 3];
        tree.add_node(middle);
        let whole = source.volume(0, None, &middle);
        tree.set(ROOT, whole);
        let below = source.grow(0, &whole, &middle, &mut tree);
        tree.entries[ROOT as usize].below = below;
        tree
    }

    /// With one leaf, which is to be held.
    pub(crate) fn of_one_leaf() -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            entries: Vec::new(),
            origin: Point3::origin(),
            reach: 0.0,
        };
        tree.add_node([0.0; 3]);
        tree
    }

    /// Makes the one leaf of a tree this volume about `origin`, `reach` (m) long from there.
    pub(crate) fn hold(&mut self, origin: Point3<f64>, reach: f64, volume: &Volume) {
        (self.origin, self.reach) = (origin, reach);
        self.set(ROOT, *volume);
        self.entries[ROOT as usize].below = TRIANGLE;
    }

    /// Appends a node without children; its number.
    fn add_node(&mut self, origin: [f32; 3]) -> u32 {
        let index = self.nodes.len() as u32;
        self.nodes.push(WideNode::empty(origin));
        self.entries
            .resize(self.nodes.len() * LANES, Entry::default());
        index
    }

    fn set(&mut self, child: Child, volume: Volume) {
        self.nodes[child as usize / LANES].set(child as usize % LANES, &volume);
        self.entries[child as usize] = Entry {
            radius: volume.radius,
            thickness: volume.slab + THICKNESS_PER_RADIUS * volume.radius,
            below: 0,
            owned: volume.owned,
        };
    }

    /// Node `index`.
    #[inline]
    pub(crate) fn node(&self, index: u32) -> &WideNode {
        &self.nodes[index as usize]
    }

    /// Radius of a child's ball, m.
    #[inline]
    pub(crate) fn radius(&self, child: Child) -> f32 {
        self.entries[child as usize].radius
    }

    /// Centre of a child's ball from the tree's origin, m.
    #[inline]
    pub(crate) fn center(&self, child: Child) -> Vector3<f64> {
        let (node, lane) = (self.node(child / LANES as u32), child as usize % LANES);
        let coordinate = |i: usize| f64::from(node.origin[i]) + f64::from(node.center[i].0[lane]);
        Vector3::new(coordinate(0), coordinate(1), coordinate(2))
    }

    /// How far a child's box about its axis reaches from its centre along a unit direction, m, at most.
    #[inline]
    pub(crate) fn extent(&self, child: Child, n: &Vector3<f64>) -> f64 {
        let (node, lane) = (self.node(child / LANES as u32), child as usize % LANES);
        let wide = |v: &[Lanes; 3]| Vector3::from([0, 1, 2].map(|i| f64::from(v[i].0[lane])));
        let one = |x: &Lanes| f64::from(x.0[lane]);
        let (axis, tangent) = (wide(&node.axis), wide(&node.tangent));
        n.dot(&axis).abs() * (one(&node.middle).abs() + one(&node.slab))
            + n.dot(&tangent).abs() * one(&node.along)
            + n.dot(&axis.cross(&tangent)).abs() * one(&node.across)
    }

    /// What tells which of two volumes is to be opened: the thicker one, m; of flat ones, the larger.
    #[inline]
    pub(crate) fn thickness(&self, child: Child) -> f32 {
        self.entries[child as usize].thickness
    }

    /// Which kinds of features the triangles below a child own.
    #[inline]
    pub(crate) fn owned(&self, child: Child) -> u8 {
        self.entries[child as usize].owned
    }

    /// What lies below a child.
    #[inline]
    pub(crate) fn below(&self, child: Child) -> Below {
        let below = self.entries[child as usize].below;
        if below & TRIANGLE != 0 {
            Below::Triangle(below & !TRIANGLE)
        } else {
            Below::Node(below)
        }
    }
}

impl Source<'_> {
    /// Appends what lies below node `top` of the binary tree, whose volume is `above` in a node with this origin; says what it is.
    fn grow(&self, top: u32, above: &Volume, origin: &[f32; 3], tree: &mut WideTree) -> u32 {
        let node = &self.binary[top as usize];
        if node.is_leaf() {
            return node.triangle | TRIANGLE;
        }
        let (below, count) = self.collapse.open(top);
        let middle = [0, 1, 2].map(|i| origin[i] + above.center[i]);
        let index = tree.add_node(middle);
        for (child, opened) in (index * LANES as u32..).zip(&below[..count]) {
            let volume = self.volume(*opened, Some(above), &middle);
            tree.set(child, volume);
            tree.entries[child as usize].below = self.grow(*opened, &volume, &middle, tree);
        }
        index
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
        let node = tree.node(child / LANES as u32);
        let v = node.child(child as usize % LANES);
        let wide = |x: [f32; 3]| Vector3::from(x.map(f64::from));
        let center = tree.origin + wide(node.origin) + wide(v.center);
        let axis = wide(v.axis);
        let cone = f64::from(v.sine).atan2(f64::from(v.cosine));
        for t in &triangles {
            for p in mesh.corners(*t) {
                let arm = p - center;
                for i in 0..3 {
                    assert!(arm[i].abs() <= f64::from(v.half[i]));
                }
                assert!(arm.norm() <= f64::from(v.radius));
                assert!((axis.dot(&arm) - f64::from(v.middle)).abs() <= f64::from(v.slab));
                let tangent = wide(v.tangent);
                assert!(tangent.dot(&arm).abs() <= f64::from(v.along));
                assert!(axis.cross(&tangent).dot(&arm).abs() <= f64::from(v.across));
                assert!((tangent.norm() - 1.0).abs() < 1e-6 && axis.dot(&tangent).abs() < 1e-6);
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
