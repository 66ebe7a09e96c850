//! Shapes for the tests of geometry, collision and contact; a reader of test meshes; where test data lies.

mod conforming;

use std::collections::HashMap;
use std::path::PathBuf;

use god_object::geometry::Mesh;
use god_object::nalgebra::{Point3, Vector3};

pub(crate) use conforming::{fine_hole, fine_peg, roughened};

pub(crate) type Soup = (Vec<Point3<f64>>, Vec<[u32; 3]>);

pub(crate) fn mesh((vertices, triangles): Soup) -> Mesh {
    Mesh::new(vertices, triangles).expect("the shape is a closed surface")
}

/// Box with the given half sides whose faces are cut into cells[0] x cells[1] x cells[2].
pub(crate) fn grid_box(half: [f64; 3], cells: [usize; 3]) -> Soup {
    let mut index = HashMap::new();
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut vertex = |cell: [usize; 3]| {
        *index.entry(cell).or_insert_with(|| {
            let at = |k: usize| half[k] * (2.0 * cell[k] as f64 / cells[k] as f64 - 1.0);
            vertices.push(Point3::new(at(0), at(1), at(2)));
            vertices.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, cells[axis]] {
            for i in 0..cells[u] {
                for j in 0..cells[v] {
                    let mut corner = |di: usize, dj: usize| {
                        let mut cell = [0; 3];
                        (cell[axis], cell[u], cell[v]) = (side, i + di, j + dj);
                        vertex(cell)
                    };
                    let q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    if side == 0 {
                        triangles.extend([[q[0], q[2], q[1]], [q[0], q[3], q[2]]]);
                    } else {
                        triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                    }
                }
            }
        }
    }
    (vertices, triangles)
}

pub(crate) fn cuboid(half: [f64; 3]) -> Soup {
    grid_box(half, [1; 3])
}

/// Corner tetrahedron: the origin and the three unit points times `size`.
pub(crate) fn tetrahedron(size: f64) -> Soup {
    let vertices = vec![
        Point3::origin(),
        Point3::new(size, 0.0, 0.0),
        Point3::new(0.0, size, 0.0),
        Point3::new(0.0, 0.0, size),
    ];
    (vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

pub(crate) fn icosphere(radius: f64, subdivisions: u32) -> Soup {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut vertices: Vec<Vector3<f64>> = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ]
    .map(|p| Vector3::from(p) / (1.0 + g * g).sqrt())
    .to_vec();
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let m = vertices[i as usize] + vertices[j as usize];
                    vertices.push(m / m.norm());
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (
        vertices.iter().map(|v| Point3::from(v * radius)).collect(),
        triangles,
    )
}

pub(crate) fn torus(ring: f64, tube: f64, around: u32, across: u32) -> Soup {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (
                std::f64::consts::TAU * f64::from(i) / f64::from(around),
                std::f64::consts::TAU * f64::from(j) / f64::from(across),
            );
            let r = ring + tube * v.cos();
            vertices.push(Point3::new(r * u.cos(), r * u.sin(), tube * v.sin()));
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    (vertices, triangles)
}

/// Prism with `sides` sides about the z axis.
pub(crate) fn peg(radius: f64, half_length: f64, sides: u32) -> Soup {
    let mut vertices = vec![
        Point3::new(0.0, 0.0, -half_length),
        Point3::new(0.0, 0.0, half_length),
    ];
    let mut triangles = Vec::new();
    for i in 0..sides {
        let u = std::f64::consts::TAU * f64::from(i) / f64::from(sides);
        vertices.extend(
            [-half_length, half_length].map(|z| Point3::new(radius * u.cos(), radius * u.sin(), z)),
        );
        let (low, next) = (2 + 2 * i, 2 + 2 * ((i + 1) % sides));
        triangles.extend([
            [0, next, low],
            [1, low + 1, next + 1],
            [low, next, next + 1],
            [low, next + 1, low + 1],
        ]);
    }
    (vertices, triangles)
}

/// Ring-shaped block about the z axis: a hole with `sides` sides.
pub(crate) fn hole(inner: f64, outer: f64, half_length: f64, sides: u32) -> Soup {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for i in 0..sides {
        let u = std::f64::consts::TAU * f64::from(i) / f64::from(sides);
        for (r, z) in [
            (inner, -half_length),
            (inner, half_length),
            (outer, -half_length),
            (outer, half_length),
        ] {
            vertices.push(Point3::new(r * u.cos(), r * u.sin(), z));
        }
        let (a, b) = (4 * i, 4 * ((i + 1) % sides));
        for [p, q] in [[1, 0], [3, 1], [2, 3], [0, 2]] {
            triangles.extend([[a + p, b + q, a + q], [a + p, b + p, b + q]]);
        }
    }
    (vertices, triangles)
}

/// Where test data lies, when it is there.
#[allow(
    clippy::disallowed_methods,
    reason = "tests may read the environment; the method may not"
)]
pub(crate) fn data_dir() -> Option<PathBuf> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let candidates = [
        std::env::var("TAUT_DATA").ok().map(PathBuf::from),
        Some(root.join("data")),
        Some(root.join("../shared/data")),
    ];
    candidates.into_iter().flatten().find(|p| p.is_dir())
}

/// A mesh of the test data: binary little-endian PLY of float or double positions and triangles.
#[allow(
    clippy::disallowed_methods,
    reason = "tests may read files; the method may not"
)]
pub(crate) fn read_ply(name: &str) -> Option<Soup> {
    let Some(bytes) = data_dir().and_then(|d| std::fs::read(d.join(name)).ok()) else {
        taut_test_kit::left_out(format_args!("{name} is not in the test data"));
        return None;
    };
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .expect("a PLY header")
        + 11;
    let header = std::str::from_utf8(&bytes[..end]).expect("text");
    let count = |what: &str| {
        header
            .lines()
            .find_map(|l| l.strip_prefix(what))
            .and_then(|n| n.trim().parse::<usize>().ok())
            .expect("a count")
    };
    let (vertices, triangles) = (count("element vertex "), count("element face "));
    let double = header.contains("property double x");
    let width = if double { 8 } else { 4 };
    let number = |at: usize| {
        if double {
            f64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"))
        } else {
            f64::from(f32::from_le_bytes(
                bytes[at..at + 4].try_into().expect("4 bytes"),
            ))
        }
    };
    let points = (0..vertices)
        .map(|i| end + 3 * width * i)
        .map(|at| Point3::new(number(at), number(at + width), number(at + 2 * width)));
    let faces = end + 3 * width * vertices;
    let corners = (0..triangles).map(|i| {
        let at = faces + 13 * i;
        assert_eq!(bytes[at], 3, "a triangle");
        [1, 5, 9]
            .map(|k| u32::from_le_bytes(bytes[at + k..at + k + 4].try_into().expect("4 bytes")))
    });
    Some((points.collect(), corners.collect()))
}
