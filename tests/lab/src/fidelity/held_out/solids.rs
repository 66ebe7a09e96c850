//! Meshes of the held-out scenes.

use god_object::nalgebra::Point3;
use taut_scene::{RawMesh, shapes};

/// A convex outline in x and z, anticlockwise as seen along y, drawn out to `half` on both sides along y, m.
pub(super) fn prism(outline: &[[f64; 2]], half: f64) -> RawMesh {
    let count = outline.len() as u32;
    let mut raw = RawMesh::default();
    for y in [-half, half] {
        let corners = outline.iter().map(|[x, z]| Point3::new(*x, y, *z));
        raw.vertices.extend(corners);
    }
    for a in 0..count {
        let b = (a + 1) % count;
        raw.triangles
            .extend([[a, a + count, b + count], [a, b + count, b]]);
    }
    for i in 1..count - 1 {
        raw.triangles
            .extend([[0, i, i + 1], [count, count + i + 1, count + i]]);
    }
    raw
}

/// A ball of triangles whose z is shorter by a factor.
pub(in crate::fidelity) fn egg(radius: f64, subdivisions: u32, flat: f64) -> RawMesh {
    let mut raw = shapes::sphere(radius, subdivisions);
    for vertex in &mut raw.vertices {
        vertex.z *= flat;
    }
    raw
}

/// A slab about the origin in x and y, whose upper side is as high as said, m, on a grid of so many cells of
/// this size, m; its lower side is `low`.
pub(super) fn relief(
    [nx, ny]: [u32; 2],
    cell: f64,
    low: f64,
    height: impl Fn(f64, f64) -> f64,
) -> RawMesh {
    let place = |i: u32, j: u32| {
        let along = |k: u32, n: u32| (f64::from(k) - 0.5 * f64::from(n)) * cell;
        (along(i, nx), along(j, ny))
    };
    let mut raw = RawMesh::default();
    for upper in [true, false] {
        for j in 0..=ny {
            for i in 0..=nx {
                let (x, y) = place(i, j);
                let z = if upper { height(x, y) } else { low };
                raw.vertices.push(Point3::new(x, y, z));
            }
        }
    }
    let under = (nx + 1) * (ny + 1);
    let at = |i: u32, j: u32| i + (nx + 1) * j;
    for j in 0..ny {
        for i in 0..nx {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            raw.triangles.extend([[a, b, c], [a, c, d]]);
            let [a, b, c, d] = [a, b, c, d].map(|v| v + under);
            raw.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    let mut rim: Vec<u32> = (0..nx).map(|i| at(i, 0)).collect();
    rim.extend((0..ny).map(|j| at(nx, j)));
    rim.extend((1..=nx).rev().map(|i| at(i, ny)));
    rim.extend((1..=ny).rev().map(|j| at(0, j)));
    for (k, p) in rim.iter().enumerate() {
        let (p, q) = (*p, rim[(k + 1) % rim.len()]);
        raw.triangles
            .extend([[p, p + under, q + under], [p, q + under, q]]);
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::Mesh;
    use god_object::geometry::mass_properties;

    fn volume(raw: RawMesh) -> f64 {
        let mesh = Mesh::new(raw.vertices, raw.triangles).expect("a closed surface");
        mass_properties(&mesh).volume
    }

    #[test]
    fn solids_are_closed_and_as_large_as_said() {
        let roof = prism(&[[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.5);
        assert!((volume(roof) - 1.0).abs() < 1e-12);
        let slab = relief([4, 3], 0.5, -1.0, |_, _| 0.0);
        assert!((volume(slab) - 3.0).abs() < 1e-12);
        let round = volume(egg(0.01, 3, 1.0));
        assert!((volume(egg(0.01, 3, 0.7)) / round - 0.7).abs() < 1e-9);
    }
}
