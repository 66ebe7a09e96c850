//! Files of every format, as exporters write them.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::solids::{Point, Soup};

/// Single precision: 12 bytes of normal, corners, 2 bytes of attributes.
pub(crate) fn stl(soup: &Soup) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((soup.len() as u32).to_le_bytes());
    for triangle in soup {
        bytes.extend([0; 12]);
        for c in triangle.iter().flatten() {
            bytes.extend((*c as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

pub(crate) fn stl_text(soup: &Soup) -> Vec<u8> {
    let mut text = String::from("solid part\n");
    for triangle in soup {
        text += "facet normal 0 0 0\nouter loop\n";
        for [x, y, z] in triangle {
            writeln!(text, "vertex {x:e} {y:e} {z:e}").unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid part\n").into_bytes()
}

/// Each triangle with vertices of its own.
pub(crate) fn obj_soup(soup: &Soup) -> Vec<u8> {
    let mut text = String::new();
    for [x, y, z] in soup.iter().flatten() {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for t in 0..soup.len() {
        writeln!(text, "f {} {} {}", 3 * t + 1, 3 * t + 2, 3 * t + 3).unwrap();
    }
    text.into_bytes()
}

/// Equal corners shared, double precision.
pub(crate) fn ply(soup: &Soup) -> Vec<u8> {
    let mut places: HashMap<[u64; 3], u32> = HashMap::new();
    let mut vertices: Vec<Point> = Vec::new();
    let triangles: Vec<[u32; 3]> = soup
        .iter()
        .map(|t| {
            t.map(|p| {
                *places
                    .entry(p.map(|c| (c + 0.0).to_bits()))
                    .or_insert_with(|| {
                        vertices.push(p);
                        vertices.len() as u32 - 1
                    })
            })
        })
        .collect();
    ply_of(&vertices, &triangles)
}

/// Each triangle with vertices of its own.
pub(crate) fn ply_soup(soup: &Soup) -> Vec<u8> {
    let vertices: Vec<Point> = soup.iter().flatten().copied().collect();
    let first = |t: usize| 3 * t as u32;
    let triangles: Vec<[u32; 3]> = (0..soup.len())
        .map(|t| [first(t), first(t) + 1, first(t) + 2])
        .collect();
    ply_of(&vertices, &triangles)
}

/// No faces.
pub(crate) fn ply_points(points: &[Point]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        points.len()
    )
    .into_bytes();
    points
        .iter()
        .flatten()
        .for_each(|c| bytes.extend(c.to_le_bytes()));
    bytes
}

fn ply_of(vertices: &[Point], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    );
    for [x, y, z] in vertices {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(text, "3 {a} {b} {c}").unwrap();
    }
    text.into_bytes()
}

/// One node, one primitive without indices, its buffer within the container.
pub(crate) fn glb(soup: &Soup) -> Vec<u8> {
    let positions: Vec<f32> = soup.iter().flatten().flatten().map(|c| *c as f32).collect();
    let bytes: Vec<u8> = positions.iter().flat_map(|c| c.to_le_bytes()).collect();
    let bound = |k: usize, pick: fn(f32, f32) -> f32| {
        positions
            .iter()
            .skip(k)
            .step_by(3)
            .copied()
            .reduce(pick)
            .unwrap()
    };
    let (low, high) = (
        [0, 1, 2].map(|k| bound(k, f32::min)),
        [0, 1, 2].map(|k| bound(k, f32::max)),
    );
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"buffers":[{{"byteLength":{0}}}],"bufferViews":[{{"buffer":0,"byteLength":{0}}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":{1},"type":"VEC3","min":{low:?},"max":{high:?}}}]}}"#,
        bytes.len(),
        positions.len() / 3
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }
    let chunk =
        |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
    let chunks = [chunk(b"JSON", json.as_bytes()), chunk(b"BIN\0", &bytes)].concat();
    let length = (12 + chunks.len() as u32).to_le_bytes();
    [b"glTF\x02\0\0\0", &length[..], &chunks].concat()
}
