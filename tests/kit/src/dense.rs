//! Dense meshes from coarse ones.

use std::collections::HashMap;

use nalgebra::{Point3, Vector3};

use crate::xorshift::Random;

/// Vertices, m, and triangles.
pub type Soup = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// Each triangle in four by the middles of its sides; the new vertices leave their sides along the mean normal by a smooth
/// wave and by rough noise of `ROUGHNESS` of the side's length. The old vertices stay.
pub fn subdivided(soup: &Soup, times: u32) -> Soup {
    const ROUGHNESS: f64 = 0.03;
    const WAVE: f64 = 0.02;
    const WAVE_LENGTH: f64 = 4e-3;
    let (mut vertices, mut triangles) = soup.clone();
    for level in 0..times {
        let random = &mut Random::new(u64::from(level) + 1);
        let mut normals = vec![Vector3::zeros(); vertices.len()];
        for t in &triangles {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let doubled = (b - a).cross(&(c - a));
            t.iter().for_each(|v| normals[*v as usize] += doubled);
        }
        let mut middles = HashMap::with_capacity(triangles.len() * 3 / 2);
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for &[a, b, c] in &triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (vertices[i as usize], vertices[j as usize]);
                    let normal = (normals[i as usize] + normals[j as usize])
                        .try_normalize(0.0)
                        .unwrap_or_default();
                    let m = nalgebra::center(&p, &q);
                    let wave = m.coords.map(|x| (x / WAVE_LENGTH).sin()).sum() / 3.0;
                    let out = (WAVE * wave + ROUGHNESS * random.signed()) * (q - p).norm();
                    vertices.push(m + normal * out);
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (vertices, triangles)
}
