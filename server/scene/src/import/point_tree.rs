//! A k-d tree of points that stays: the distance from the nearest one, exactly.
//!
//! The trees of libraries were tried: `rstar` took several times as long for each of the millions of distances of a shell.
//!
//! Source: S. Arya, D. M. Mount, *Algorithms for Fast Vector Quantization*, DCC 1993 (the distance of a cell, by what changes from its parent).

/// Points of a cell that is not cut further: they lie in a few lines of the cache.
const LEAF_POINTS: usize = 8;

/// Points, in an order in which each half of a range is one side of a plane.
pub(super) struct PointTree {
    points: Vec<[f64; 3]>,
    /// At the middle of a range: the axis across which it is cut, and where.
    planes: Vec<(u8, f64)>,
    low: [f64; 3],
    high: [f64; 3],
}

impl PointTree {
    pub(super) fn of(mut points: Vec<[f64; 3]>) -> Self {
        let mut planes = vec![(0, 0.0); points.len()];
        let [low, high] = around(&points);
        cut(&mut points, &mut planes);
        Self {
            points,
            planes,
            low,
            high,
        }
    }

    pub(super) fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The distance of a place from the nearest point; infinite if there is none.
    pub(super) fn distance(&self, place: [f64; 3]) -> f64 {
        let outside = |k: usize| place[k] - place[k].clamp(self.low[k], self.high[k]);
        let mut search = Search {
            tree: self,
            place,
            least: f64::INFINITY,
        };
        if !self.points.is_empty() {
            let outside = [0, 1, 2].map(outside);
            search.look(0, self.points.len(), outside);
        }
        search.least.sqrt()
    }
}

struct Search<'t> {
    tree: &'t PointTree,
    place: [f64; 3],
    /// Square of the least distance so far.
    least: f64,
}

impl Search<'_> {
    /// Looks at a range of points; `outside` is the way from its cell to the place.
    fn look(&mut self, begin: usize, end: usize, outside: [f64; 3]) {
        if end - begin <= LEAF_POINTS {
            for point in &self.tree.points[begin..end] {
                self.least = self
                    .least
                    .min(square([0, 1, 2].map(|k| point[k] - self.place[k])));
            }
            return;
        }
        let middle = usize::midpoint(begin, end);
        let (axis, plane) = self.tree.planes[middle];
        let axis = usize::from(axis);
        let across = self.place[axis] - plane;
        let mut far = outside;
        far[axis] = across;
        let (near_half, far_half) = if across < 0.0 {
            ([begin, middle], [middle, end])
        } else {
            ([middle, end], [begin, middle])
        };
        self.look(near_half[0], near_half[1], outside);
        if square(far) < self.least {
            self.look(far_half[0], far_half[1], far);
        }
    }
}

fn square(way: [f64; 3]) -> f64 {
    way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
}

/// Corners of the box around points; of none, one that no place is in.
fn around(points: &[[f64; 3]]) -> [[f64; 3]; 2] {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold([first; 2], |[low, high], point| {
        [
            std::array::from_fn(|k| low[k].min(point[k])),
            std::array::from_fn(|k| high[k].max(point[k])),
        ]
    })
}

/// Orders points and notes the cuts: each across the longest side of the box around its points.
fn cut(points: &mut [[f64; 3]], planes: &mut [(u8, f64)]) {
    if points.len() <= LEAF_POINTS {
        return;
    }
    let [low, high] = around(points);
    let side = |k: &u8| high[usize::from(*k)] - low[usize::from(*k)];
    let longest = (0..3).max_by(|a, b| side(a).total_cmp(&side(b)));
    let axis = longest.unwrap_or(0);
    let middle = points.len() / 2;
    let along = |point: &[f64; 3]| point[usize::from(axis)];
    points.select_nth_unstable_by(middle, |a, b| along(a).total_cmp(&along(b)));
    planes[middle] = (axis, along(&points[middle]));
    let (left, right) = points.split_at_mut(middle);
    let (left_planes, right_planes) = planes.split_at_mut(middle);
    cut(left, left_planes);
    cut(right, right_planes);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn place(range: i32) -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(-range..=range).prop_map(|p| p.map(|c| f64::from(c) / 3.0))
    }

    proptest! {
        /// On few places, so that many points are the same or in a plane.
        #[test]
        fn the_nearest_point_is_that_of_all(
            points in prop::collection::vec(place(6), 1..300),
            from in prop::collection::vec(place(20), 20),
        ) {
            let tree = PointTree::of(points.clone());
            for place in from {
                let apart = |p: &[f64; 3]| square([0, 1, 2].map(|k| p[k] - place[k]));
                let least = points.iter().map(apart).fold(f64::INFINITY, f64::min);
                prop_assert_eq!(tree.distance(place), least.sqrt());
            }
        }
    }

    #[test]
    fn no_points_are_nowhere() {
        assert_eq!(PointTree::of(Vec::new()).distance([0.0; 3]), f64::INFINITY);
    }
}
