//! Where a set of triangles is cut in two, so that both parts are thin.
//!
//! | symbol | name in code      | unit | meaning                                                                   |
//! |--------|-------------------|------|---------------------------------------------------------------------------|
//! | n      | `normal`          | –    | mean normal of a part, each triangle's by its area                        |
//! | T      | `thickness`       | m    | root mean square of the height along n of the triangles' middles          |
//! | D      | `size`            | m    | diagonal of the part's box                                                |
//!
//! Two surfaces that lie close to each other are told apart by planes, where their parts are thinner than the gap between them. So the
//! cut taken is the one with the least sum of `count D (T + flatness D)` over both parts: a round wall falls into strips along
//! its axis, as long as they are flat; a flat one, where T is zero, into squares.

use nalgebra::{Point3, Vector3};

use super::tree::{Item, center_bounds};

/// Bins of the triangles' centres along an axis.
const BINS: usize = 16;
/// How thick a part of a size counts as being at least: flat strips are cut across when they are longer than this says.
const FLATNESS: f64 = 1e-4;
/// Normals that cancel to less than this share of the area have no mean.
const LEAST_MEAN: f64 = 1e-3;

/// Partitions the items where the two parts are thinnest: the number of those in the first; `None` when they cannot be told apart.
///
/// Tried are cuts across the longest side of the box of centres, across the direction in which the surface bends most, and along it.
pub(super) fn split_by_thickness(items: &mut [Item]) -> Option<usize> {
    let (low, extent) = center_bounds(items);
    let middle = low + extent * 0.5;
    let mut all = Part::empty();
    items.iter().for_each(|i| all.add(i, &middle));
    let longest = Vector3::ith(extent.imax(), 1.0);
    let [bent, straight] = all.bends(items).unwrap_or([longest; 2]);
    let bins = [longest, bent, straight]
        .iter()
        .filter_map(|axis| Bins::along(items, axis, &middle))
        .reduce(|a, b| if b.cost < a.cost { b } else { a })?;
    // Items of the lower bins to the front.
    let mut front = 0;
    for k in 0..items.len() {
        if bins.bin_of(&items[k]) < bins.cut {
            items.swap(front, k);
            front += 1;
        }
    }
    (front > 0 && front < items.len()).then_some(front)
}

/// Sums over some triangles: box, count, area, area times normal, first and second moments of the middles.
#[derive(Clone, Copy)]
struct Part {
    low: Point3<f64>,
    high: Point3<f64>,
    count: usize,
    area: f64,
    normal: Vector3<f64>,
    first: Vector3<f64>,
    second: [f64; 6],
}

impl Part {
    fn empty() -> Self {
        Self {
            low: Point3::from(Vector3::repeat(f64::INFINITY)),
            high: Point3::from(Vector3::repeat(f64::NEG_INFINITY)),
            count: 0,
            area: 0.0,
            normal: Vector3::zeros(),
            first: Vector3::zeros(),
            second: [0.0; 6],
        }
    }

    fn add(&mut self, item: &Item, middle: &Point3<f64>) {
        let c = item.mean - middle;
        self.low = self.low.inf(&item.low);
        self.high = self.high.sup(&item.high);
        self.count += 1;
        self.area += item.area;
        self.normal += item.normal * item.area;
        self.first += c * item.area;
        for (sum, x) in self.second.iter_mut().zip(products(&c)) {
            *sum += x * item.area;
        }
    }

    fn join(&mut self, other: &Self) {
        self.low = self.low.inf(&other.low);
        self.high = self.high.sup(&other.high);
        self.count += other.count;
        self.area += other.area;
        self.normal += other.normal;
        self.first += other.first;
        for (sum, x) in self.second.iter_mut().zip(other.second) {
            *sum += x;
        }
    }

    fn cost(&self) -> f64 {
        if self.count == 0 {
            return 0.0;
        }
        let size = (self.high - self.low).norm();
        self.count as f64 * size * (self.thickness().unwrap_or(size) + FLATNESS * size)
    }

    /// Root mean square of the height along the mean normal, m; `None` where the normals cancel.
    fn thickness(&self) -> Option<f64> {
        let n = self.normal.try_normalize(LEAST_MEAN * self.area)?;
        let mean = n.dot(&self.first) / self.area;
        let [xx, yy, zz, xy, yz, zx] = self.second;
        let [nxx, nyy, nzz, nxy, nyz, nzx] = products(&n);
        let straight = nxx * xx + nyy * yy + nzz * zz;
        let mixed = nxy * xy + nyz * yz + nzx * zx;
        let square = (straight + 2.0 * mixed) / self.area;
        Some((square - mean * mean).max(0.0).sqrt())
    }

    /// The direction across the mean normal in which normals turn most, and the one across both.
    fn bends(&self, items: &[Item]) -> Option<[Vector3<f64>; 2]> {
        let n = self.normal.try_normalize(LEAST_MEAN * self.area)?;
        let other = Vector3::ith(n.iamin(), 1.0);
        let u = n.cross(&other).try_normalize(0.0)?;
        let v = n.cross(&u);
        let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
        for i in items {
            let (x, y) = (u.dot(&i.normal), v.dot(&i.normal));
            xx += x * x * i.area;
            yy += y * y * i.area;
            xy += x * y * i.area;
        }
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let bent = u * angle.cos() + v * angle.sin();
        Some([bent, n.cross(&bent)])
    }
}

/// The best cut across one axis.
struct Bins {
    axis: Vector3<f64>,
    middle: Point3<f64>,
    low: f64,
    scale: f64,
    /// First bin of the second part.
    cut: usize,
    cost: f64,
}

impl Bins {
    fn along(items: &[Item], axis: &Vector3<f64>, middle: &Point3<f64>) -> Option<Self> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for i in items {
            let place = axis.dot(&(i.center - middle));
            (low, high) = (low.min(place), high.max(place));
        }
        let scale = BINS as f64 / (high - low);
        if !scale.is_finite() {
            return None;
        }
        let mut bins = Self {
            axis: *axis,
            middle: *middle,
            low,
            scale,
            cut: 0,
            cost: f64::INFINITY,
        };
        let mut parts = [Part::empty(); BINS];
        for i in items {
            parts[bins.bin_of(i)].add(i, middle);
        }
        // A cut behind an empty bin parts the items as the one before it. Most bins are empty: most sets have few items.
        let filled = |k: &usize| parts[*k].count > 0;
        let mut above = [0.0; BINS + 1];
        let mut upper = Part::empty();
        for k in (1..BINS).rev() {
            if filled(&k) {
                upper.join(&parts[k]);
                above[k] = upper.cost();
            } else {
                above[k] = above[k + 1];
            }
        }
        let mut lower = Part::empty();
        for last in (0..BINS - 1).filter(filled) {
            lower.join(&parts[last]);
            let (cost, cut) = (lower.cost() + above[last + 1], last + 1);
            if lower.count < items.len() && cost < bins.cost {
                (bins.cost, bins.cut) = (cost, cut);
            }
        }
        (bins.cut > 0).then_some(bins)
    }

    fn bin_of(&self, item: &Item) -> usize {
        let place = self.axis.dot(&(item.center - self.middle));
        (((place - self.low) * self.scale).max(0.0) as usize).min(BINS - 1)
    }
}

/// Of the components: squares, then xy, yz, zx.
fn products(v: &Vector3<f64>) -> [f64; 6] {
    [
        v.x * v.x,
        v.y * v.y,
        v.z * v.z,
        v.x * v.y,
        v.y * v.z,
        v.z * v.x,
    ]
}
