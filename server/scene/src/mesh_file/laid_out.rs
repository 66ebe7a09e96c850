//! Where the triangles of a mesh lie in the pictures of their materials, and what colour those have there on the whole.

use nalgebra::Vector3;

use super::RawMesh;
use super::body_textures::{Corners, Pictures};
use super::material::Material;

/// How often all triangles together are looked at for their colour, about: a mean of so many is good to an 8-bit step.
const LOOKS: f64 = 65_536.0;
/// Most looks along a side of one triangle.
const MOST_ALONG: usize = 64;

/// Triangles in the pictures of their materials.
pub(super) struct LaidOut {
    /// For each triangle, in its order; of one without a texture they are 0.
    pub(super) coordinates: Vec<Corners>,
    /// Mean linear light of the pictures over the triangles of each material; `None` without a texture.
    pub(super) means: Vec<Option<[f64; 3]>>,
}

/// Places the triangles of the `runs` by the coordinates that the file has: as many as triangles, or none that can be used. What is lost goes to `lost`.
pub(super) fn lay_out(
    (mesh, runs): (&RawMesh, &[(Option<usize>, usize)]),
    of_file: &[Corners],
    (materials, pictures): (&[Material], &Pictures),
    lost: &mut Vec<String>,
) -> LaidOut {
    let of_file = Some(of_file).filter(|all| all.len() == mesh.triangles.len());
    let along = (LOOKS / mesh.triangles.len().max(1) as f64).sqrt();
    let along = (along as usize).clamp(1, MOST_ALONG);
    let room = if pictures.is_empty() {
        0
    } else {
        mesh.triangles.len()
    };
    let mut coordinates = vec![Corners::default(); room];
    let mut sums = vec![(Vector3::zeros(), 0.0); materials.len()];
    let mut unplaced = vec![0_usize; materials.len()];
    let mut first = 0;
    for (material, count) in runs {
        let run = first..first + count;
        first = run.end;
        let Some((place, texture)) = material.and_then(|m| Some((m, pictures.of(m)?))) else {
            continue;
        };
        for triangle in run {
            let corners = of_file.map(|all| all[triangle]);
            let used = &materials[place].picture;
            let corners = corners.map(|c| used.as_ref().map_or(c, |used| c.map(|c| used.place(c))));
            let corners = corners.filter(|c| c.as_flattened().iter().all(|x| x.is_finite()));
            unplaced[place] += usize::from(corners.is_none());
            coordinates[triangle] = corners.unwrap_or_default();
            let [a, b, c] = mesh.triangles[triangle].map(|v| mesh.vertices[v as usize]);
            let area = (b - a).cross(&(c - a)).norm();
            let (sum, weight) = &mut sums[place];
            *sum += area
                * mean(&coordinates[triangle], along, |at| {
                    pictures.light(texture, at)
                });
            *weight += area;
        }
    }
    for (material, count) in materials
        .iter()
        .zip(unplaced)
        .filter(|(_, count)| *count > 0)
    {
        let name = material
            .picture
            .as_ref()
            .map_or("", |used| used.source.name());
        lost.push(format!(
            "its texture \"{name}\" on {count} triangles that have no texture coordinates"
        ));
    }
    let means = sums.into_iter();
    let means = means.map(|(sum, weight)| (weight > 0.0).then(|| (sum / weight).into()));
    LaidOut {
        coordinates,
        means: means.collect(),
    }
}

/// The mean over the middles of the triangles that a triangle makes when each of its sides is cut in as many parts.
fn mean(corners: &Corners, along: usize, light: impl Fn([f64; 2]) -> [f64; 3]) -> Vector3<f64> {
    let [a, b, c] = corners.map(|corner| nalgebra::Vector2::from(corner).cast::<f64>());
    let part = 1.0 / along as f64;
    let at = |i: usize, j: usize, off: f64| {
        let at = a + (b - a) * ((i as f64 + off) * part) + (c - a) * ((j as f64 + off) * part);
        Vector3::from(light(at.into()))
    };
    let mut sum = Vector3::zeros();
    for i in 0..along {
        for j in 0..along - i {
            sum += at(i, j, 1.0 / 3.0);
            if i + j + 1 < along {
                sum += at(i, j, 2.0 / 3.0);
            }
        }
    }
    sum * (part * part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_over_a_triangle_is_that_of_a_linear_light() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.25, 2.0]];
        for along in [1, 2, 7] {
            let found = mean(&corners, along, |[u, v]| [u, v, 1.0]);
            let exact = Vector3::new(1.25 / 3.0, 2.0 / 3.0, 1.0);
            assert!((found - exact).norm() < 1e-12, "{along}: {found}");
        }
    }
}
