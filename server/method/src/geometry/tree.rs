//! Bounding-volume tree over the triangles of a mesh: boxes in the mesh's frame.
//!
//! Built once, from the top: each node is cut where its parts are thinnest ([`thin_parts`](super::thin_parts)). Flat arrays, first child next to
//! its parent.

use nalgebra::{Point3, Vector3};

use super::thin_parts::split_by_thickness;

/// Depth below which a subtree is halved by count, so that the depth is bounded whatever the mesh.
const HALVE_BELOW_DEPTH: usize = 48;
/// Bound on the depth of any tree: `HALVE_BELOW_DEPTH` and 32 halvings.
pub(crate) const MAX_DEPTH: usize = 80;
/// Outward rounding of boxes relative to their coordinates: some units in the last place.
const BOX_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A box, and what is inside.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Centre, m.
    pub center: Point3<f64>,
    /// Half of the sides, m, rounded up.
    pub half: Vector3<f64>,
    /// Half of the diagonal, m, rounded up.
    pub radius: f64,
    /// Second child; the first follows its parent. Zero for a leaf.
    pub second: u32,
    /// Triangle of a leaf.
    pub triangle: u32,
}

impl Node {
    /// Whether the node holds one triangle and no children.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.second == 0
    }
}

/// The tree. Node 0 is the root.
#[derive(Clone, Debug)]
pub struct Tree {
    nodes: Vec<Node>,
}

/// What the build knows of a triangle.
#[derive(Clone, Copy)]
pub(super) struct Item {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
    /// Of the box, m.
    pub(super) center: Point3<f64>,
    /// Of the corners, m.
    pub(super) mean: Point3<f64>,
    /// Unit; zero for a triangle without area.
    pub(super) normal: Vector3<f64>,
    /// Twice the area, m^2.
    pub(super) area: f64,
    triangle: u32,
}

impl Tree {
    pub(crate) fn build(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut items: Vec<Item> = triangles
            .iter()
            .enumerate()
            .map(|(t, corners)| item(vertices, corners, t as u32))
            .collect();
        let mut nodes = Vec::with_capacity(2 * triangles.len() - 1);
        grow(&mut items, 0, &mut nodes);
        Self { nodes }
    }

    /// Calls `visit` for every triangle whose boxes `keep` accepts all the way down; stops when it returns false. `stack` is scratch memory.
    pub(crate) fn for_triangles(
        &self,
        stack: &mut Vec<u32>,
        mut keep: impl FnMut(&Node) -> bool,
        mut visit: impl FnMut(u32) -> bool,
    ) {
        stack.clear();
        stack.push(0);
        while let Some(i) = stack.pop() {
            let node = &self.nodes[i as usize];
            if !keep(node) {
                continue;
            }
            if !node.is_leaf() {
                stack.extend([node.second, i + 1]);
            } else if !visit(node.triangle) {
                return;
            }
        }
    }

    /// All nodes, the root first.
    #[inline]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}

fn item(vertices: &[Point3<f64>], corners: &[u32; 3], triangle: u32) -> Item {
    let [a, b, c] = corners.map(|v| vertices[v as usize]);
    let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    let doubled = (b - a).cross(&(c - a));
    let area = doubled.norm();
    Item {
        mean: Point3::from((a.coords + b.coords + c.coords) / 3.0),
        normal: doubled.try_normalize(0.0).unwrap_or_default(),
        area,
        low,
        high,
        center: nalgebra::center(&low, &high),
        triangle,
    }
}

/// Appends the subtree of `items`.
fn grow(items: &mut [Item], depth: usize, nodes: &mut Vec<Node>) {
    let (low, high) = bounds(items);
    let index = nodes.len();
    let center = nalgebra::center(&low, &high);
    let rounding = BOX_ROUNDING * low.coords.abs().max().max(high.coords.abs().max());
    let half = (high - low) * 0.5 + Vector3::repeat(rounding);
    let radius = half.norm() * (1.0 + BOX_ROUNDING);
    nodes.push(Node {
        center,
        half,
        radius,
        second: 0,
        triangle: items[0].triangle,
    });
    if items.len() == 1 {
        return;
    }
    let split = if depth < HALVE_BELOW_DEPTH {
        split_by_thickness(items)
    } else {
        None
    };
    let split = split.unwrap_or_else(|| split_by_count(items));
    let (first, second) = items.split_at_mut(split);
    grow(first, depth + 1, nodes);
    nodes[index].second = nodes.len() as u32;
    grow(second, depth + 1, nodes);
}

fn bounds(items: &[Item]) -> (Point3<f64>, Point3<f64>) {
    items
        .iter()
        .fold((items[0].low, items[0].high), |(low, high), i| {
            (low.inf(&i.low), high.sup(&i.high))
        })
}

pub(super) fn center_bounds(items: &[Item]) -> (Point3<f64>, Vector3<f64>) {
    let first = items[0].center;
    let (low, high) = items.iter().fold((first, first), |(low, high), i| {
        (low.inf(&i.center), high.sup(&i.center))
    });
    (low, high - low)
}

fn split_by_count(items: &mut [Item]) -> usize {
    let axis = center_bounds(items).1.imax();
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        (a.center[axis], a.triangle)
            .partial_cmp(&(b.center[axis], b.triangle))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    middle
}
