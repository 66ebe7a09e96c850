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
    below: [u32; LANES],
}

/// What a child holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Volume {
    pub(crate) center: [f32; 3],
    pub(crate) half: [f32; 3],
    pub(crate) axis: [f32; 3],
    pub(crate) middle: f32,
    pub(crate) slab: f32,
    pub(crate) radius: f32,
    pub(crate) cosine: f32,
    pub(crate) sine: f32,
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
        cones: &[NormalCone],
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
        let mut nodes = vec![WideNode::empty()];
        nodes[0].set(0, &source.volume(0));
        nodes[0].below[0] = source.grow(0, &mut nodes);
        Self {
            nodes,
            origin: source.origin,
            reach,
        }
    }

    /// Node `index`.
    #[inline]
    pub(crate) fn node(&self, index: u32) -> &WideNode {
        &self.nodes[index as usize]
    }

    /// What a child holds.
    #[inline]
    pub(crate) fn volume(&self, child: Child) -> Volume {
        let (node, k) = (&self.nodes[child as usize / LANES], child as usize % LANES);
        let three = |lanes: &[Lanes; 3]| [lanes[0].0[k], lanes[1].0[k], lanes[2].0[k]];
        Volume {
            center: three(&node.center),
            half: three(&node.half),
            axis: three(&node.axis),
            middle: node.middle.0[k],
            slab: node.slab.0[k],
            radius: node.radius.0[k],
            cosine: node.cosine.0[k],
            sine: node.sine.0[k],
        }
    }

    /// Radius of a child's ball, m.
    #[inline]
    pub(crate) fn radius(&self, child: Child) -> f32 {
        self.nodes[child as usize / LANES].radius.0[child as usize % LANES]
    }

    /// What lies below a child.
    #[inline]
    pub(crate) fn below(&self, child: Child) -> Below {
        let below = self.nodes[child as usize / LANES].below[child as usize % LANES];
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
            below: [0; LANES],
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
    fn grow(&self, top: u32, nodes: &mut Vec<WideNode>) -> u32 {
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
        let index = nodes.len();
        nodes.push(WideNode::empty());
        for (k, child) in below[..count].iter().enumerate() {
            let volume = self.volume(*child);
            nodes[index].set(k, &volume);
            nodes[index].below[k] = self.grow(*child, nodes);
        }
        index as u32
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
