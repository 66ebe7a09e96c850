//! Bodies and obstacles for scenes that are made in code.

use std::sync::Arc;

use god_object::geometry::mass_properties;
use god_object::{Body, Mesh, Obstacle, Pose, Surface, World};
use nalgebra::Point3;
use taut_scene::RawMesh;

/// A mesh of a generated shape, which is closed.
pub fn mesh(raw: RawMesh) -> Mesh {
    Mesh::new(raw.vertices, raw.triangles).unwrap_or_else(|error| panic!("{error}"))
}

/// A homogeneous body of 1 kg; forces act at its centre of mass.
pub fn body(mesh: Mesh) -> Body {
    let solid = mass_properties(&mesh);
    Body {
        primitive: None,
        mass: 1.0,
        inertia: solid.inertia_per_density / solid.volume,
        reference_point: solid.centroid,
        mesh,
    }
}

/// An obstacle without surface properties.
pub fn obstacle(name: &str, mesh: Mesh, pose: Pose) -> Obstacle {
    Obstacle {
        primitive: None,
        name: name.into(),
        mesh,
        pose,
        surface: Surface::default(),
    }
}

/// A body among obstacles.
pub fn world(body: Body, obstacles: impl Into<Vec<Obstacle>>) -> Arc<World> {
    let obstacles = obstacles.into();
    Arc::new(World { body, obstacles })
}

/// The solid that fills the cells `filled(i, j, k)` of the grid with these planes, m. Filled cells must meet in faces or not at all.
pub fn cells(planes: [&[f64]; 3], filled: impl Fn([usize; 3]) -> bool) -> RawMesh {
    let counts = planes.map(|p| p.len() - 1);
    let is_filled = |cell: [isize; 3]| {
        let inside = (0..3).all(|a| (0..counts[a] as isize).contains(&cell[a]));
        inside && filled(cell.map(|c| c as usize))
    };
    let mut raw = RawMesh::default();
    let mut places = std::collections::HashMap::new();
    let mut vertex = |corner: [usize; 3], raw: &mut RawMesh| {
        *places.entry(corner).or_insert_with(|| {
            let at = |axis: usize| planes[axis][corner[axis]];
            raw.vertices.push(Point3::new(at(0), at(1), at(2)));
            raw.vertices.len() as u32 - 1
        })
    };
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                let cell = [i, j, k];
                if !filled(cell) {
                    continue;
                }
                for axis in 0..3 {
                    for side in [0, 1] {
                        let mut beside = cell.map(|c| c as isize);
                        beside[axis] += 2 * side as isize - 1;
                        if is_filled(beside) {
                            continue;
                        }
                        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
                            let mut corner = cell;
                            corner[axis] += side;
                            corner[u] += du;
                            corner[v] += dv;
                            vertex(corner, &mut raw)
                        });
                        let [a, b, c, d] = corners;
                        if side == 1 {
                            raw.triangles.extend([[a, b, c], [a, c, d]]);
                        } else {
                            raw.triangles.extend([[a, c, b], [a, d, c]]);
                        }
                    }
                }
            }
        }
    }
    raw
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solid_of_cells_is_closed_and_has_their_volume() {
        // A U of five unit cells.
        let raw = cells(
            [&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0], &[0.0, 1.0, 2.0]],
            |[i, _, k]| k == 0 || i != 1,
        );
        assert!((mass_properties(&mesh(raw)).volume - 5.0).abs() < 1e-12);
    }
}
