//! The light around the scene, made ready for shading: what a matt surface gets of it, and what a smooth or rough one mirrors.
//!
//! The light is as if from far away, fixed to the workbench, and the same whatever the head does: it is computed once, on the
//! processor, and so alike on all nodes.
//!
//! * Matt: irradiance over pi as nine coefficients of spherical harmonics.
//!   Source: Ramamoorthi, Hanrahan 2001, "An efficient representation for irradiance environment maps".
//! * Mirrored: a cube map of five roughnesses, each the mean of the light weighted by the lobe of GGX about its direction; its
//!   other factor is fitted in frame.wgsl. Source: Karis 2013, "Real shading in Unreal Engine 4" (split sum).

use std::f32::consts::{PI, TAU};
use std::sync::{Arc, LazyLock};

use nalgebra::Vector3;
use taut_proto::Panorama;
use taut_proto::panorama::shared_exponent;

use crate::studio::studio;

/// Levels of the cube map: roughness 0, 1/4, 1/2, 3/4, 1.
pub(crate) const LEVELS: u32 = 5;
/// Texels along an edge of the sharpest level, as fine as a panorama; each further one has half as many.
pub(crate) const FACE: u32 = 64;
/// Columns of the light that each blurred level is summed from: its lobe is wider than two of them.
const SUMMED: [usize; LEVELS as usize - 1] = [128, 64, 32, 32];

/// Light around the scene. Directions are of the workbench: x to the right, y away from the viewer, z up.
#[derive(Debug, PartialEq)]
pub struct Environment {
    /// Irradiance over pi: factors of 1, y, z, x, xy, yz, 3zz - 1, xz, xx - yy of the normal.
    pub(crate) irradiance: [[f32; 4]; 9],
    /// Levels of the cube map, sharpest first: its faces +x, -x, +y, -y, +z, -z, texels by row, in shared-exponent format.
    pub(crate) levels: Vec<Vec<u32>>,
}

impl Environment {
    /// The light of a picture, brought to the mean brightness of the studio; without one, the studio.
    pub fn of(panorama: Option<&Panorama>) -> Arc<Self> {
        static STUDIO: LazyLock<Arc<Environment>> =
            LazyLock::new(|| Arc::new(Environment::new(Sphere::of(studio))));
        let Some(panorama) = panorama else {
            return STUDIO.clone();
        };
        let mut light = Sphere::read(panorama);
        let (wanted, found) = (brightness(&STUDIO.irradiance), light.irradiance());
        let found = brightness(&found);
        if found > 0.0 {
            light
                .parts
                .iter_mut()
                .for_each(|part| *part *= wanted / found);
        }
        Arc::new(Self::new(light))
    }

    fn new(light: Sphere) -> Self {
        let mut levels = vec![cube(FACE, |direction| light.at(direction))];
        for (level, columns) in (1..LEVELS).zip(SUMMED) {
            let roughness = level as f32 / (LEVELS - 1) as f32;
            let samples = light.halved_to(columns).samples();
            let samples: Vec<FlatSample> = samples.iter().map(Sample::flat).collect();
            levels.push(cube(FACE >> level, |direction| {
                blurred(&samples, (*direction).into(), roughness)
            }));
        }
        Self {
            irradiance: light.irradiance(),
            levels,
        }
    }
}

/// Mean light of all directions, as an eye weighs its colours.
fn brightness(irradiance: &[[f32; 4]; 9]) -> f32 {
    let [red, green, blue, _] = irradiance[0];
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// Light from all directions, by rows from the zenith down, as [`Panorama`] has it.
#[derive(Clone, Debug)]
struct Sphere {
    columns: usize,
    parts: Vec<Vector3<f32>>,
}

/// A direction, and the light from it times the solid angle that it stands for.
struct Sample {
    direction: Vector3<f32>,
    light: Vector3<f32>,
    solid_angle: f32,
}

/// The direction, the light and the solid angle of a [`Sample`]: millions of products of numbers take a debug build a third of the time
/// that products of vectors take.
type FlatSample = ([f32; 3], [f32; 3], f32);

impl Sample {
    fn flat(&self) -> FlatSample {
        (self.direction.into(), self.light.into(), self.solid_angle)
    }
}

impl Sphere {
    fn of(light: impl Fn(&Vector3<f32>) -> Vector3<f32>) -> Self {
        let mut sphere = Self {
            columns: Panorama::WIDTH,
            parts: Vec::new(),
        };
        let places = 0..Panorama::WIDTH * Panorama::HEIGHT;
        sphere.parts = places
            .map(|place| light(&sphere.direction(place)))
            .collect();
        sphere
    }

    fn read(panorama: &Panorama) -> Self {
        let columns = Panorama::WIDTH;
        let light = |place: usize| panorama.light(place % columns, place / columns).into();
        Self {
            columns,
            parts: (0..columns * Panorama::HEIGHT).map(light).collect(),
        }
    }

    fn rows(&self) -> usize {
        self.columns / 2
    }

    /// To the middle of a part.
    fn direction(&self, place: usize) -> Vector3<f32> {
        let (column, row) = (place % self.columns, place / self.columns);
        let azimuth = TAU * ((column as f32 + 0.5) / self.columns as f32 - 0.5);
        let elevation = PI * (0.5 - (row as f32 + 0.5) / self.rows() as f32);
        let level = elevation.cos();
        Vector3::new(
            level * azimuth.sin(),
            level * azimuth.cos(),
            elevation.sin(),
        )
    }

    /// Light from one direction, between the middles of parts.
    fn at(&self, direction: &Vector3<f32>) -> Vector3<f32> {
        let across = direction.x.atan2(direction.y) / TAU + 0.5;
        let down = 0.5 - direction.z.clamp(-1.0, 1.0).asin() / PI;
        let column = across * self.columns as f32 - 0.5;
        let row = (down * self.rows() as f32 - 0.5).clamp(0.0, (self.rows() - 1) as f32);
        let (left, above) = (column.floor(), row.floor());
        let part = |right: i64, below: usize| {
            let column = (left as i64 + right).rem_euclid(self.columns as i64) as usize;
            let row = (above as usize + below).min(self.rows() - 1);
            self.parts[row * self.columns + column]
        };
        let (x, y) = (column - left, row - above);
        (part(0, 0) * (1.0 - x) + part(1, 0) * x) * (1.0 - y)
            + (part(0, 1) * (1.0 - x) + part(1, 1) * x) * y
    }

    /// The same with so many columns: means of four parts, as often as it takes.
    fn halved_to(&self, columns: usize) -> Self {
        let mut sphere = self.clone();
        while sphere.columns > columns {
            let half = sphere.columns / 2;
            let mean = |place: usize| {
                let first = 2 * (place / half) * sphere.columns + 2 * (place % half);
                let below = first + sphere.columns;
                let four = [first, first + 1, below, below + 1];
                four.iter().map(|i| sphere.parts[*i]).sum::<Vector3<f32>>() * 0.25
            };
            sphere = Self {
                columns: half,
                parts: (0..half * half / 2).map(mean).collect(),
            };
        }
        sphere
    }

    fn samples(&self) -> Vec<Sample> {
        let rows = self.rows();
        let sample = |(place, part): (usize, &Vector3<f32>)| {
            // Of a band between two latitudes, divided by its columns.
            let height = |row: usize| (PI * (0.5 - row as f32 / rows as f32)).sin();
            let row = place / self.columns;
            let solid_angle = TAU / self.columns as f32 * (height(row) - height(row + 1));
            Sample {
                direction: self.direction(place),
                light: part * solid_angle,
                solid_angle,
            }
        };
        self.parts.iter().enumerate().map(sample).collect()
    }

    /// The nine coefficients of [`Environment::irradiance`].
    fn irradiance(&self) -> [[f32; 4]; 9] {
        let mut sums = [Vector3::zeros(); 9];
        for sample in self.samples() {
            for (sum, factor) in sums.iter_mut().zip(polynomials(&sample.direction)) {
                *sum += sample.light * factor;
            }
        }
        std::array::from_fn(|i| {
            let part: Vector3<f32> = sums[i] * WEIGHTS[i];
            [part.x, part.y, part.z, 0.0]
        })
    }
}

/// 1, y, z, x, xy, yz, 3zz - 1, xz, xx - yy: mirrors `irradiance` of frame.wgsl.
fn polynomials(n: &Vector3<f32>) -> [f32; 9] {
    let (x, y, z) = (n.x, n.y, n.z);
    let last = x * x - y * y;
    [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, last]
}

/// The squares of the harmonics' factors, 1/4pi and so on, times what a cosine keeps of each band, over pi: 1, 2/3, 1/4.
const WEIGHTS: [f32; 9] = {
    let (flat, linear) = (0.25 / PI, 0.75 / PI * 2.0 / 3.0);
    let (mixed, squares) = (3.75 / PI * 0.25, 0.312_5 / PI * 0.25);
    let rest = 0.937_5 / PI * 0.25;
    [
        flat, linear, linear, linear, mixed, mixed, squares, mixed, rest,
    ]
};

/// Mean of the light weighted as a surface of this roughness mirrors it that is looked at along its normal.
fn blurred(samples: &[FlatSample], [x, y, z]: [f32; 3], roughness: f32) -> Vector3<f32> {
    let narrow = roughness.powi(4) - 1.0; // alpha^2 - 1, alpha = roughness^2
    let ([mut red, mut green, mut blue], mut weights) = ([0.0; 3], 0.0);
    for (direction, light, solid_angle) in samples {
        let cosine = x * direction[0] + y * direction[1] + z * direction[2];
        if cosine > 0.0 {
            // The half vector's cosine is that of half the angle.
            let spread = 0.5 * (1.0 + cosine) * narrow + 1.0;
            let weight = cosine / (spread * spread);
            red += light[0] * weight;
            green += light[1] * weight;
            blue += light[2] * weight;
            weights += weight * solid_angle;
        }
    }
    Vector3::new(red, green, blue) / weights
}

/// A level of the cube map, its faces as graphics cards have them.
fn cube(side: u32, light: impl Fn(&Vector3<f32>) -> Vector3<f32>) -> Vec<u32> {
    let texel = |place: u32| {
        let (face, row, column) = (place / (side * side), place / side % side, place % side);
        let along = |i: u32| (2 * i + 1) as f32 / side as f32 - 1.0;
        let (a, b) = (along(column), along(row));
        let direction = match face {
            0 => Vector3::new(1.0, -b, -a),
            1 => Vector3::new(-1.0, -b, a),
            2 => Vector3::new(a, 1.0, b),
            3 => Vector3::new(a, -1.0, -b),
            4 => Vector3::new(a, -b, 1.0),
            _ => Vector3::new(-a, -b, -1.0),
        };
        shared_exponent(light(&direction.normalize()).into())
    };
    (0..6 * side * side).map(texel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_proto::panorama::light_of;

    fn irradiance(environment: &Environment, normal: &Vector3<f32>) -> Vector3<f32> {
        let terms = environment.irradiance.iter().zip(polynomials(normal));
        terms.map(|(c, p)| Vector3::new(c[0], c[1], c[2]) * p).sum()
    }

    fn irradiance_mean(environment: &Environment) -> Vector3<f32> {
        let [red, green, blue, _] = environment.irradiance[0];
        Vector3::new(red, green, blue)
    }

    #[test]
    fn in_even_light_every_surface_shows_that_light() {
        // A furnace of one brightness: nothing is lost and nothing is added, by any roughness.
        let furnace = Environment::new(Sphere::of(|_| Vector3::new(1.0, 0.5, 0.25)));
        for level in &furnace.levels {
            for texel in level {
                let [red, green, blue] = light_of(*texel);
                assert!(
                    (red - 1.0).abs() < 2e-3 && (green - 0.5).abs() < 2e-3,
                    "{red} {green}"
                );
                assert!((blue - 0.25).abs() < 2e-3);
            }
        }
        for normal in [Vector3::x(), Vector3::new(0.6, -0.48, 0.64)] {
            let found = irradiance(&furnace, &normal);
            assert!(
                (found - Vector3::new(1.0, 0.5, 0.25)).norm() < 1e-3,
                "{found}"
            );
        }
    }

    #[test]
    fn nine_coefficients_are_near_the_integral_over_the_half_sphere() {
        let environment = Environment::of(None);
        let samples = Sphere::of(studio).halved_to(64).samples();
        for normal in [
            Vector3::z(),
            -Vector3::z(),
            Vector3::x(),
            -Vector3::y(),
            Vector3::new(-0.48, 0.6, 0.64),
        ] {
            let lit = samples.iter().filter(|s| s.direction.dot(&normal) > 0.0);
            let integral: Vector3<f32> = lit.map(|s| s.light * s.direction.dot(&normal)).sum();
            let (exact, found) = (integral / PI, irradiance(&environment, &normal));
            // Ramamoorthi and Hanrahan: 3 % of the mean in natural light; lamps are harder.
            let mean = irradiance_mean(&environment);
            assert!(
                (found - exact).norm() < 0.06 * mean.norm(),
                "{found} {exact}"
            );
        }
    }

    #[test]
    fn a_rougher_level_is_smoother_and_as_bright() {
        let environment = Environment::of(None);
        let green = |texel: &u32| light_of(*texel)[1];
        let mut spreads = Vec::new();
        for level in &environment.levels {
            let mean = level.iter().map(green).sum::<f32>() / level.len() as f32;
            let off = level.iter().map(|t| (green(t) - mean).powi(2)).sum::<f32>();
            spreads.push((off / level.len() as f32).sqrt());
        }
        assert!(
            spreads.is_sorted_by(|sharper, rougher| sharper > rougher),
            "{spreads:?}"
        );
    }

    #[test]
    fn a_picture_is_as_bright_as_the_studio_whatever_its_unit() {
        let lit = |unit: f32| {
            Panorama::from_fn(move |column, row| {
                [
                    unit * (1.0 + column as f32 / 256.0),
                    unit,
                    unit * row as f32 / 64.0,
                ]
            })
        };
        let (dim, bright) = (
            Environment::of(Some(&lit(0.01))),
            Environment::of(Some(&lit(100.0))),
        );
        let studio = brightness(&Environment::of(None).irradiance);
        for environment in [&dim, &bright] {
            assert!((brightness(&environment.irradiance) - studio).abs() < 0.02 * studio);
        }
        let dark = Environment::of(Some(&Panorama::from_fn(|_, _| [0.0; 3])));
        assert_eq!(brightness(&dark.irradiance), 0.0);
    }
}
