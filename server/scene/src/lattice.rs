//! Sites of a body-centred cubic lattice, and the surface on which a function that is known at them has a value.
//!
//! The lattice falls into tetrahedra of one shape: two neighbouring sites of one of its two cubic grids, and two of the four sites of the other that surround
//! the middle between them. Within each the function counts as linear, so the surface is closed, touches itself nowhere and has no edge of more than two triangles.
//!
//! | symbol | name | unit |
//! | --- | --- | --- |
//! | a | pitch: distance of neighbouring sites of one grid | m |
//!
//! Source: S. L. Chan, E. O. Purisima, *A New Tetrahedral Tesselation Scheme for Isosurface Generation*, Computers and Graphics 22, 1998.

use std::collections::HashMap;

use nalgebra::Point3;

use crate::mesh_file::RawMesh;

/// Radius of the ball around a tetrahedron, in pitches: sqrt(5) / 4.
///
/// A function that changes by at most 1 per metre differs from its linear interpolation within the tetrahedron by at most this times a: at p, with the shares l_i of
/// the corners v_i, by at most sum l_i |v_i - p| <= sqrt(sum l_i |v_i - p|^2) = sqrt(R^2 - |p - c|^2) <= R, where c is the middle of that ball and R its radius.
pub(crate) const INTERPOLATION: f64 = 0.559_016_994_374_947_5;

/// A site, in halves of the pitch: all three even, or all three odd.
pub(crate) type Site = [i32; 3];

/// The sites beside one, one of each two opposite ones: along the axes, where the distance is a, and across, where it is sqrt(3) / 2 a.
const WAYS: [Site; 7] = [
    [2, 0, 0],
    [0, 2, 0],
    [0, 0, 2],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

/// The 14 sites beside one.
pub(crate) fn beside(site: Site) -> impl Iterator<Item = Site> {
    WAYS.into_iter().flat_map(move |way| {
        [
            std::array::from_fn(|k| site[k] + way[k]),
            std::array::from_fn(|k| site[k] - way[k]),
        ]
    })
}

/// The site that is nearest to a place, which is given in halves of the pitch.
pub(crate) fn nearest_site(place: [f64; 3]) -> Site {
    let even = place.map(|c| 2 * (c / 2.0).round() as i32);
    let odd = place.map(|c| 2 * (c / 2.0).floor() as i32 + 1);
    let apart = |site: Site| -> f64 {
        let each = site.iter().zip(place);
        each.map(|(s, c)| (f64::from(*s) - c).powi(2)).sum()
    };
    if apart(even) <= apart(odd) { even } else { odd }
}

/// Values at sites, each with all sites beside it that are needed.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    pub(crate) sites: Vec<Site>,
    /// Of each site; the surface is where it is 0, and inside it is below. None is 0.
    pub(crate) values: Vec<f64>,
    pub(crate) index: HashMap<Site, u32>,
}

impl Samples {
    /// A function at all sites of a box, from the site `low` to the site `high`; values nearer to 0 than `least` become it.
    pub(crate) fn of_box(low: Site, high: Site, least: f64, value: impl Fn(Site) -> f64) -> Self {
        let mut samples = Self::default();
        let along = |axis: usize| low[axis]..=high[axis];
        for (z, y) in along(2).flat_map(|z| along(1).map(move |y| (z, y))) {
            for site in along(0).map(|x| [x, y, z]) {
                let parity = site.map(|c| c.rem_euclid(2));
                if parity == [0; 3] || parity == [1; 3] {
                    samples.add(site, value(site), least);
                }
            }
        }
        samples
    }

    /// Adds a site that is not there yet; a value nearer to 0 than `least` becomes it.
    pub(crate) fn add(&mut self, site: Site, value: f64, least: f64) {
        self.index.insert(site, self.sites.len() as u32);
        self.sites.push(site);
        self.values.push(if value < 0.0 {
            value.min(-least)
        } else {
            value.max(least)
        });
    }

    /// The surface, triangles seen from where the values are above 0. `place` is where a site is, m. Sites below 0 must have all sites beside them.
    pub(crate) fn surface(&self, place: impl Fn(Site) -> Point3<f64>) -> RawMesh {
        let mut surface = Surface {
            samples: self,
            place,
            vertex_on: vec![[u32::MAX; WAYS.len()]; self.sites.len()],
            mesh: RawMesh::default(),
        };
        for site in &self.sites {
            // The tetrahedra of a pair of sites of the even grid; those of the odd grid are the same ones.
            if site[0] % 2 == 0 {
                (0..3).for_each(|axis| surface.add_around(*site, axis));
            }
        }
        surface.mesh
    }
}

struct Surface<'s, P> {
    samples: &'s Samples,
    place: P,
    /// For each site and way from it: the vertex on that edge.
    vertex_on: Vec<[u32; WAYS.len()]>,
    mesh: RawMesh,
}

impl<P: Fn(Site) -> Point3<f64>> Surface<'_, P> {
    /// The four tetrahedra around the edge from a site along an axis.
    fn add_around(&mut self, site: Site, axis: usize) {
        let at = |along: i32, left: i32, up: i32| {
            let mut other = site;
            other[axis] += along;
            other[(axis + 1) % 3] += left;
            other[(axis + 2) % 3] += up;
            self.samples.index.get(&other).copied()
        };
        let ring = [(1, 1), (-1, 1), (-1, -1), (1, -1)].map(|(left, up)| at(1, left, up));
        let ends = [at(0, 0, 0), at(2, 0, 0)];
        // A tetrahedron with a site that is not there is outside.
        let [Some(a), Some(b)] = ends else { return };
        for k in 0..4 {
            if let (Some(c), Some(d)) = (ring[k], ring[(k + 1) % 4]) {
                self.add([a, b, c, d]);
            }
        }
    }

    /// What is in one tetrahedron. Its corners are right-handed: seen from the first, the others run anticlockwise about the side away from it.
    fn add(&mut self, corners: [u32; 4]) {
        let inside = corners.map(|i| self.samples.values[i as usize] < 0.0);
        // Even permutations, which bring the sites inside to the front.
        let order = match inside {
            [true, false, false, false] | [false, true, true, true] => [0, 1, 2, 3],
            [false, true, false, false] | [true, false, true, true] => [1, 0, 3, 2],
            [false, false, true, false] | [true, true, false, true] => [2, 3, 0, 1],
            [false, false, false, true] | [true, true, true, false] => [3, 2, 1, 0],
            [true, true, false, false] => [0, 1, 2, 3],
            [false, false, true, true] => [2, 3, 0, 1],
            [true, false, true, false] => [0, 2, 3, 1],
            [false, true, false, true] => [1, 3, 2, 0],
            [true, false, false, true] => [0, 3, 1, 2],
            [false, true, true, false] => [1, 2, 0, 3],
            _ => return,
        };
        let [a, b, c, d] = order.map(|k| corners[k]);
        match inside.iter().filter(|inside| **inside).count() {
            1 => {
                let triangle = [[a, b], [a, c], [a, d]].map(|edge| self.vertex(edge));
                self.mesh.triangles.push(triangle);
            }
            3 => {
                let triangle = [[a, b], [a, d], [a, c]].map(|edge| self.vertex(edge));
                self.mesh.triangles.push(triangle);
            }
            _ => {
                let [p, q, r, s] = [[a, c], [a, d], [b, d], [b, c]].map(|edge| self.vertex(edge));
                let apart = |u: u32, v: u32| {
                    let [u, v] = [u, v].map(|v| self.mesh.vertices[v as usize]);
                    (u - v).norm_squared()
                };
                let two = if apart(p, r) <= apart(q, s) {
                    [[p, q, r], [p, r, s]]
                } else {
                    [[p, q, s], [q, r, s]]
                };
                self.mesh.triangles.extend(two);
            }
        }
    }

    /// The vertex between two sites, one inside and one outside.
    fn vertex(&mut self, [a, b]: [u32; 2]) -> u32 {
        let [from, to] = [a, b].map(|i| self.samples.sites[i as usize]);
        let way = |from: Site, to: Site| -> Option<usize> {
            let way = std::array::from_fn(|k| to[k] - from[k]);
            WAYS.iter().position(|known| *known == way)
        };
        let (owner, way) = match (way(from, to), way(to, from)) {
            (Some(way), _) => (a, way),
            (None, way) => (b, way.unwrap_or_default()),
        };
        let known = self.vertex_on[owner as usize][way];
        if known != u32::MAX {
            return known;
        }
        let [low, high] = [a, b].map(|i| self.samples.values[i as usize]);
        let [p, q] = [from, to].map(&self.place);
        let new = self.mesh.vertices.len() as u32; // below 14 times the number of sites, which the caller bounds
        self.mesh.vertices.push(p + (q - p) * (low / (low - high)));
        self.vertex_on[owner as usize][way] = new;
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_site_has_the_number_and_the_distances_of_its_neighbours() {
        for site in [[0, 0, 0], [3, -1, 5]] {
            let mut all: Vec<Site> = beside(site).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), 14);
            for other in all {
                let parity = other.map(|c| c.rem_euclid(2));
                assert!(parity == [0; 3] || parity == [1; 3], "{other:?}");
                let square: i32 = (0..3).map(|k| (other[k] - site[k]).pow(2)).sum();
                assert!(square == 3 || square == 4);
            }
        }
    }

    #[test]
    fn the_nearest_site_is_that_of_all() {
        let mut seed = 1_u64;
        for _ in 0..2000 {
            let place = [0; 3].map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (seed >> 40) as f64 / f64::from(1 << 24) * 12.0 - 6.0
            });
            let apart = |site: Site| -> f64 {
                (0..3)
                    .map(|k| (f64::from(site[k]) - place[k]).powi(2))
                    .sum()
            };
            let range = || -9..=9;
            let all =
                range().flat_map(|x| range().flat_map(move |y| range().map(move |z| [x, y, z])));
            let sites =
                all.filter(|s: &Site| s.iter().all(|c| c.rem_euclid(2) == s[0].rem_euclid(2)));
            let least = sites.map(apart).fold(f64::INFINITY, f64::min);
            assert_eq!(apart(nearest_site(place)), least);
            // No site is farther than the radius of the ball around a tetrahedron.
            assert!(least.sqrt() / 2.0 <= INTERPOLATION);
        }
    }
}
