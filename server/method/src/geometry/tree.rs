//! Bounding-volume tree over the triangles of a mesh: boxes in the mesh's frame.
//!
//! Built once by the surface-area heuristic on binned centroids; flat arrays, first child next to its parent.

use nalgebra::{Point3, Vector3};

/// Bins of the surface-area heuristic along the longest axis.
const BINS: usize = 16;
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
struct Item {
    low: Point3<f64>,
    high: Point3<f64>,
    center: Point3<f64>,
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

    /// All nodes, the root first.
    #[inline]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
}

fn item(vertices: &[Point3<f64>], corners: &[u32; 3], triangle: u32) -> Item {
    let [a, b, c] = corners.map(|v| vertices[v as usize]);
    let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
    Item {
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
        split_by_area(items)
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

fn center_bounds(items: &[Item]) -> (Point3<f64>, Vector3<f64>) {
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

/// Partitions the items where the areas of the two boxes, weighted by their counts, are least; `None` when they cannot be told apart.
fn split_by_area(items: &mut [Item]) -> Option<usize> {
    let (low, extent) = center_bounds(items);
    let axis = extent.imax();
    let scale = BINS as f64 / extent[axis];
    if !scale.is_finite() {
        return None;
    }
    let bin_of = |i: &Item| (((i.center[axis] - low[axis]) * scale) as usize).min(BINS - 1);
    let mut bins: [Option<(Point3<f64>, Point3<f64>)>; BINS] = [None; BINS];
    let mut counts = [0_usize; BINS];
    for i in items.iter() {
        let bin = bin_of(i);
        counts[bin] += 1;
        bins[bin] =
            Some(bins[bin].map_or((i.low, i.high), |(l, h)| (l.inf(&i.low), h.sup(&i.high))));
    }
    let cost_of = |range: std::ops::Range<usize>| {
        let count: usize = counts[range.clone()].iter().sum();
        let joined = bins[range]
            .iter()
            .flatten()
            .copied()
            .reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        joined.map(|(l, h)| half_area(&(h - l)) * count as f64)
    };
    let mut best: Option<(f64, usize)> = None;
    for cut in 1..BINS {
        if let (Some(left), Some(right)) = (cost_of(0..cut), cost_of(cut..BINS)) {
            let cost = left + right;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, cut));
            }
        }
    }
    let (_, cut) = best?;
    // Items of the lower bins to the front.
    let mut front = 0;
    for k in 0..items.len() {
        if bin_of(&items[k]) < cut {
            items.swap(front, k);
            front += 1;
        }
    }
    (front > 0 && front < items.len()).then_some(front)
}

fn half_area(sides: &Vector3<f64>) -> f64 {
    sides.x * sides.y + sides.y * sides.z + sides.z * sides.x
}
