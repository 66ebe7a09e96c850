//! Height maps: slopes of a periodic height field, filtered to what the update rate can carry.
//!
//! | symbol   | name in code | unit | meaning                                                              |
//! |----------|--------------|------|----------------------------------------------------------------------|
//! | h        | `heights`    | –    | 0 to 1, row by row; u runs along a row, v from row to row            |
//! | A        | `amplitude`  | m    | height of 1                                                          |
//! | p        | `tile`       | m    | length of one period in u; texels are square                         |
//! | grad h   | `slopes`     | 1/texel | central differences, sampled bilinearly                           |
//!
//! A tip that covers more than half a wavelength in one update feels a tone that is not there. The slopes are therefore kept
//! at halved resolutions, too (each the mean of four texels), and those are taken in which the tip covers at most one texel in one
//! update; what is finer is muted. Source: Ortega et al. 2007, Section 6.2; the pyramid is Williams' (1983).

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::texture_coordinates::TextureCoordinates;
use crate::constraint::Feature;

/// How sharply one of the three projections takes over from another: power of the normal's components.
const BLEND_POWER: i32 = 4;
/// Texels that a tip may cover in one update: the finest wave of a level is two texels long.
const TEXELS_PER_UPDATE: f64 = 1.0;

/// Slopes at one resolution, per texel of the finest.
#[derive(Clone, Debug, PartialEq)]
struct Level {
    width: usize,
    height: usize,
    slopes: Vec<[f32; 2]>,
}

/// Precomputed slopes of a periodic height field, at every resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    levels: Vec<Level>,
}

/// Why an array of heights is no height map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HeightMapError {
    /// The number of heights is not width times height, or there are fewer than two in a row or column.
    #[error("{count} heights make no map of {width} x {height}; both sides need at least 2")]
    Size {
        /// Heights given.
        count: usize,
        /// Texels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A height is not a finite number.
    #[error("height number {index} is not a finite number")]
    NotFinite {
        /// Its place, counted from 0.
        index: usize,
    },
}

impl HeightMap {
    /// A map of `width` heights in a row, rows one after the other, 0 to 1 for the deepest and the highest.
    pub fn new(width: usize, heights: &[f64]) -> Result<Self, HeightMapError> {
        let height = heights.len().checked_div(width).unwrap_or(0);
        if width < 2 || height < 2 || width * height != heights.len() {
            return Err(HeightMapError::Size {
                count: heights.len(),
                width,
                height,
            });
        }
        if let Some(index) = heights.iter().position(|h| !h.is_finite()) {
            return Err(HeightMapError::NotFinite { index });
        }
        let at = |u: usize, v: usize| heights[(v % height) * width + u % width];
        let slope = |u: usize, v: usize| {
            [
                (0.5 * (at(u + 1, v) - at(u + width - 1, v))) as f32,
                (0.5 * (at(u, v + 1) - at(u, v + height - 1))) as f32,
            ]
        };
        let finest = Level {
            width,
            height,
            slopes: (0..heights.len())
                .map(|i| slope(i % width, i / width))
                .collect(),
        };
        let mut levels = vec![finest];
        while let Some(coarser) = levels.last().and_then(Level::halved) {
            levels.push(coarser);
        }
        Ok(Self { levels })
    }

    /// Texels in a row.
    pub fn width(&self) -> usize {
        self.levels[0].width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.levels[0].height
    }

    /// d(h)/d(u, v) per texel at a place in texels, periodic; `covered` are the texels that the tip covers in one update.
    pub fn slope(&self, u: f64, v: f64, covered: f64) -> [f64; 2] {
        let finite = u.is_finite() && v.is_finite() && covered.is_finite();
        if !finite {
            return [0.0; 2];
        }
        // Level k has texels of 2^k; between two levels both are mixed, past the last the rest fades out.
        let wanted = (covered / TEXELS_PER_UPDATE).max(1.0).log2();
        let (below, share) = (wanted.floor(), wanted - wanted.floor());
        let level = |k: f64| {
            self.levels
                .get(k as usize)
                .map_or([0.0; 2], |level| level.at(u / k.exp2(), v / k.exp2(), k))
        };
        let fine = level(below);
        if share == 0.0 {
            return fine;
        }
        let coarse = level(below + 1.0);
        [0, 1].map(|i| fine[i] * (1.0 - share) + coarse[i] * share)
    }
}

impl Level {
    /// Bilinear, periodic. Texel centres of a coarser level lie between those of the finer one.
    fn at(&self, u: f64, v: f64, level: f64) -> [f64; 2] {
        let offset = 0.5 * (1.0 - (-level).exp2());
        let place = |x: f64, count: usize| {
            let x = (x - offset).rem_euclid(count as f64);
            let low = (x.floor() as usize) % count;
            (low, (low + 1) % count, x - x.floor())
        };
        let (u0, u1, s) = place(u, self.width);
        let (v0, v1, t) = place(v, self.height);
        let slope = |u: usize, v: usize| self.slopes[v * self.width + u].map(f64::from);
        let (a, b, c, d) = (slope(u0, v0), slope(u1, v0), slope(u0, v1), slope(u1, v1));
        [0, 1]
            .map(|i| (a[i] * (1.0 - s) + b[i] * s) * (1.0 - t) + (c[i] * (1.0 - s) + d[i] * s) * t)
    }

    /// Half the resolution; `None` when a side is odd or would fall below two texels.
    fn halved(&self) -> Option<Self> {
        let even = self.width.is_multiple_of(2) && self.height.is_multiple_of(2);
        if !even || self.width < 4 || self.height < 4 {
            return None;
        }
        let (width, height) = (self.width / 2, self.height / 2);
        let at = |u: usize, v: usize| self.slopes[v * self.width + u];
        let mean = |u: usize, v: usize| {
            let four = [
                at(2 * u, 2 * v),
                at(2 * u + 1, 2 * v),
                at(2 * u, 2 * v + 1),
                at(2 * u + 1, 2 * v + 1),
            ];
            [0, 1].map(|i| 0.25 * four.iter().map(|slope| slope[i]).sum::<f32>())
        };
        Some(Self {
            width,
            height,
            slopes: (0..width * height)
                .map(|i| mean(i % width, i / width))
                .collect(),
        })
    }
}

/// A height map on a surface, by triplanar lookup: it is projected along each axis of the obstacle, and the three are blended by the
/// normal. No coordinates on the mesh are needed, and the blend is continuous around edges.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMapTexture {
    /// The slopes; shared, as the same map may lie on many obstacles.
    pub map: Arc<HeightMap>,
    /// Length of one period in u, m.
    pub tile: f64,
    /// Height of a 1 in the map, m.
    pub amplitude: f64,
}

impl HeightMapTexture {
    /// The gradient of the height (m/m, obstacle frame) at a point (m, obstacle frame) with this unit normal, for a
    /// tip that covers `covered` metres in one update.
    pub fn gradient(
        &self,
        point: &Point3<f64>,
        normal: &Vector3<f64>,
        covered: f64,
    ) -> Vector3<f64> {
        let texel = self.tile / self.map.width() as f64;
        let weights = normal.map(|n| n.abs().powi(BLEND_POWER));
        let sum = weights.sum();
        let steepness = self.amplitude / texel;
        let mut gradient = Vector3::zeros();
        for axis in 0..3 {
            let weight = weights[axis] / sum;
            let counts = weight > 0.0; // false for NaN
            if !counts {
                continue;
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let slope = self
                .map
                .slope(point[u] / texel, point[v] / texel, covered / texel);
            gradient[u] += weight * steepness * slope[0];
            gradient[v] += weight * steepness * slope[1];
        }
        gradient
    }
}

/// A height map on a surface, by the mesh's texture coordinates; past 0 and 1 it repeats.
#[derive(Clone, Debug, PartialEq)]
pub struct UvHeightMapTexture {
    /// The slopes; shared, as the same map may lie on many obstacles.
    pub map: Arc<HeightMap>,
    /// Where on the picture each triangle lies.
    pub coordinates: Arc<TextureCoordinates>,
    /// Height of a 1 in the map, m.
    pub amplitude: f64,
}

impl UvHeightMapTexture {
    /// The gradient of the height (m/m, obstacle frame) at a point (m, obstacle frame) of a feature of the mesh, for a
    /// tip that covers `covered` metres in one update. Zero where the feature has no texture coordinates.
    pub fn gradient(&self, feature: Feature, point: &Point3<f64>, covered: f64) -> Vector3<f64> {
        let Some(triangle) = self.coordinates.at(feature) else {
            return Vector3::zeros();
        };
        let texels = [self.map.width() as f64, self.map.height() as f64];
        let place = triangle.place(point);
        // Coordinates count from the picture's edge, slopes from the middle of its first texel.
        let [u, v] = [0, 1].map(|k| place[k] * texels[k] - 0.5);
        let per_metre = [0, 1].map(|k| triangle.along[k] * texels[k]);
        let finest = per_metre[0].norm().max(per_metre[1].norm());
        let slope = self.map.slope(u, v, covered * finest);
        (per_metre[0] * slope[0] + per_metre[1] * slope[1]) * self.amplitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn waves(width: usize, count: f64) -> HeightMap {
        let height = |i: usize| 0.5 + 0.5 * (TAU * count * (i % width) as f64 / width as f64).sin();
        let heights: Vec<f64> = (0..width * width).map(height).collect();
        HeightMap::new(width, &heights).expect("a map")
    }

    #[test]
    fn the_slope_is_that_of_the_field_and_periodic() {
        let map = waves(64, 1.0);
        for u in [0.0, 5.3, 17.0, 40.75] {
            let expected = 0.5 * TAU / 64.0 * (TAU * u / 64.0).cos();
            let [du, dv] = map.slope(u, 11.2, 0.0);
            assert!(
                (du - expected).abs() < 0.002 * 0.5 * TAU / 64.0 + 2e-4,
                "{u}: {du} {expected}"
            );
            assert!(dv.abs() < 1e-7);
            let [again, _] = map.slope(u - 640.0, 11.2 + 128.0, 0.0);
            assert!((again - du).abs() < 1e-7);
        }
    }

    #[test]
    fn what_a_fast_tip_would_alias_is_muted() {
        // Waves of 4 texels: whole at half a texel in an update, gone at 8, and no louder between.
        let map = waves(64, 16.0);
        let loudness = |covered: f64| {
            (0..64)
                .map(|i| map.slope(0.25 * f64::from(i), 3.0, covered)[0].powi(2))
                .sum::<f64>()
                .sqrt()
        };
        let slow = loudness(0.5);
        let mut last = slow;
        for covered in [1.0, 1.5, 2.0, 3.0, 4.0, 8.0, 1e6] {
            let now = loudness(covered);
            assert!(now <= last * (1.0 + 1e-12), "{covered}: {now} after {last}");
            last = now;
        }
        assert!(loudness(4.0) < 0.1 * slow, "{} of {slow}", loudness(4.0));
    }

    #[test]
    fn faces_along_the_axes_see_one_projection() {
        let texture = HeightMapTexture {
            map: Arc::new(waves(64, 1.0)),
            tile: 0.064,
            amplitude: 2e-4,
        };
        let at = Point3::new(0.003, 0.007, 0.011);
        let steepest = 2e-4 * 0.5 * TAU / 0.064;
        // u of the z projection is x, of the x projection y, of the y projection z.
        for (axis, along) in [(2, 0), (0, 1), (1, 2)] {
            let mut normal = Vector3::zeros();
            normal[axis] = -1.0;
            let gradient = texture.gradient(&at, &normal, 0.0);
            let expected = steepest * (TAU * at[along] / 0.064).cos();
            assert!((gradient[along] - expected).abs() < 0.01 * steepest);
            assert!((gradient.norm() - gradient[along].abs()) < 1e-6);
        }
    }

    #[test]
    fn broken_maps_are_refused() {
        assert!(matches!(
            HeightMap::new(3, &[0.0; 8]),
            Err(HeightMapError::Size { .. })
        ));
        assert!(matches!(
            HeightMap::new(0, &[]),
            Err(HeightMapError::Size { .. })
        ));
        assert_eq!(
            HeightMap::new(2, &[0.0, 1.0, f64::NAN, 0.0]),
            Err(HeightMapError::NotFinite { index: 2 })
        );
    }
}
