//! Levels of detail: fewer triangles for bodies whose own are smaller than a pixel.
//!
//! All levels of a mesh share its vertices, each takes about half of the triangles of the one before, and each has a bound of its error. The
//! coarsest is drawn whose error nobody sees, so that a picture costs what it shows and not what the file holds. They are made beside the
//! drawing: until they are there, and for small meshes, every triangle is drawn.
//!
//! Source of the simplification: quadric errors of position and normal (Garland and Heckbert 1997; Hoppe 1999), as meshoptimizer has them.

use std::ops::Range;
use std::sync::mpsc::{Receiver, channel};

use meshopt::{SimplifyOptions, VertexDataAdapter};
use nalgebra::Vector3;

use crate::normals::Shaded;

/// Largest error of what is drawn, in pixels (texels of a shadow map).
pub(crate) const UNSEEN_PIXELS: f64 = 0.5;

/// A level of fewer triangles than this gains nothing.
const FEWEST_TRIANGLES: usize = 5_000;
/// A level that keeps more than this share of the one before is not worth its memory: the mesh has no smaller form.
const MOST_KEPT: f64 = 0.75;
/// No level is off by more than this share of the mesh's size: what would be drawn with it is a few pixels large.
const MOST_ERROR: f32 = 0.01;
/// Where a picture slips on a surface, as it does where fewer triangles carry it, levels are sought within this first, then within twice as much and so on
/// up to [`MOST_ERROR`]: a slip counts as a place that is off as far. What is less is lost in the rounding of quadrics in single precision, about the root
/// of 1e-7.
const LEAST_SLIP: f32 = MOST_ERROR / 16.0;
/// A normal that is off by 1 counts as much as a place that is off by this share of the mesh's size: on a body of 500 pixels half of a pixel is as
/// much as 6 degrees.
const NORMAL_WEIGHT: f32 = 0.01;
/// The quadric's error is a mean over the faces around: the farthest point was up to 1.1 times as far off (seven kinds of surfaces, `tests/detail.rs`; 7.6
/// times without regularisation).
const FARTHEST: f32 = 1.5;

/// Indices of all levels over the same vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    /// Three places in the vertices for each triangle.
    pub indices: Vec<u32>,
    /// The whole mesh first, then fewer and fewer triangles.
    pub levels: Vec<Level>,
}

/// One level.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Its part of the indices.
    pub indices: Range<u32>,
    /// How far it may be from the whole mesh, in the mesh's unit.
    pub error: f32,
}

impl Level {
    /// The whole mesh.
    pub(crate) fn whole(shaded: &Shaded) -> Self {
        Self {
            indices: 0..shaded.indices.len() as u32,
            error: 0.0,
        }
    }
}

impl Detail {
    /// The levels of a mesh.
    pub fn of(shaded: &Shaded) -> Self {
        let Shaded {
            vertices, indices, ..
        } = shaded;
        let mut all = Self {
            indices: indices.clone(),
            levels: vec![Level::whole(shaded)],
        };
        let coordinates = &shaded.coordinates;
        let is_textured = !coordinates.is_empty();
        let mut flat: Vec<f32> = Vec::new();
        for (place, (position, normal, _)) in vertices.iter().enumerate() {
            flat.extend(position.iter().chain(normal));
            flat.extend(coordinates.get(place).into_iter().flatten());
        }
        let stride = size_of::<f32>() * if is_textured { 8 } else { 6 };
        let Ok(places) = VertexDataAdapter::new(bytemuck::cast_slice(&flat), stride, 0) else {
            return all; // vertices of a whole number of bytes each are always taken
        };
        let attributes = flat.get(3..).unwrap_or_default();
        let size = meshopt::simplify_scale(&places);
        let mut weights = vec![NORMAL_WEIGHT; 3];
        if is_textured {
            weights.extend([length_of_texture(shaded) / size.max(f32::MIN_POSITIVE); 2]);
        }
        let free = vec![false; vertices.len()];
        let mut most = if is_textured { LEAST_SLIP } else { MOST_ERROR };
        let mut fewer = indices.clone();
        let mut error = 0.0;
        while has_levels(fewer.len()) {
            let mut further = 0.0;
            let next = meshopt::simplify_with_attributes_and_locks(
                &fewer,
                &places,
                attributes,
                &weights,
                stride,
                &free,
                fewer.len() / 6 * 3,
                most,
                SimplifyOptions::RegularizeLight,
                Some(&mut further),
            );
            if next.len() as f64 > MOST_KEPT * fewer.len() as f64 {
                if most >= MOST_ERROR {
                    break;
                }
                most *= 2.0;
                continue;
            }
            if is_textured {
                further = most; // what was found is of the places alone, and not of the picture on them
            }
            error += FARTHEST * further * size;
            fewer = meshopt::optimize_vertex_cache(&next, vertices.len());
            let first = all.indices.len() as u32;
            all.indices.extend(&fewer);
            all.levels.push(Level {
                indices: first..all.indices.len() as u32,
                error,
            });
        }
        all
    }
}

/// Length on the surface that a texture's side takes, in the mesh's unit: the root of the ratio of areas. 0 where none has one.
fn length_of_texture(shaded: &Shaded) -> f32 {
    let (mut surface, mut picture) = (0.0_f64, 0.0_f64);
    for triangle in shaded.indices.chunks_exact(3) {
        let corner = |i: usize| triangle[i] as usize;
        let [a, b, c] = [0, 1, 2].map(|i| shaded.coordinates[corner(i)].map(f64::from));
        let [p, q, r] =
            [0, 1, 2].map(|i| Vector3::from(shaded.vertices[corner(i)].0).cast::<f64>());
        let covered = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
        if covered > 0.0 {
            surface += (q - p).cross(&(r - p)).norm();
            picture += covered;
        }
    }
    if picture > 0.0 {
        (surface / picture).sqrt() as f32
    } else {
        0.0
    }
}

/// Whether a mesh of so many indices is large enough for a coarser level.
fn has_levels(indices: usize) -> bool {
    indices >= 2 * 3 * FEWEST_TRIANGLES
}

/// Place of the coarsest level that is off by at most `error`, in the mesh's unit.
pub(crate) fn coarsest(levels: &[Level], error: f64) -> usize {
    let good = |level: &Level| f64::from(level.error) <= error; // false for NaN
    levels.iter().rposition(good).unwrap_or(0)
}

/// Makes the levels of large meshes on a thread of its own. Each arrives with the place of its mesh; the last is followed by the end.
pub(crate) fn made_beside(meshes: Vec<(usize, Shaded)>) -> Receiver<(usize, Detail)> {
    let (done, levels) = channel();
    let large: Vec<_> = meshes
        .into_iter()
        .filter(|(_, shaded)| has_levels(shaded.indices.len()))
        .collect();
    if !large.is_empty() {
        let make = move || {
            for (place, shaded) in large {
                if done.send((place, Detail::of(&shaded))).is_err() {
                    return; // nobody draws it any more
                }
            }
        };
        // Where no thread can be had, every triangle is drawn.
        let _ = std::thread::Builder::new()
            .name("levels of detail".to_owned())
            .spawn(make);
    }
    levels
}
