//! Mesh files of every format. Whatever is read has finite coordinates and indices in range.

use std::path::Path;

use taut_scene::{read_mesh_bytes, shapes::cuboid, write_ply};

pub(crate) fn obj(bytes: &[u8]) {
    check("/nowhere/a.obj", bytes);
}

pub(crate) fn stl(bytes: &[u8]) {
    check("/nowhere/a.stl", bytes);
}

pub(crate) fn ply(bytes: &[u8]) {
    check("/nowhere/a.ply", bytes);
}

/// Text and binary: the bytes tell. Its buffers are inside; files beside it are looked for where there are none.
pub(crate) fn gltf(bytes: &[u8]) {
    check("/nowhere/a.gltf", bytes);
}

fn check(path: &str, bytes: &[u8]) {
    match read_mesh_bytes(Path::new(path), bytes) {
        Ok(mesh) => {
            let mut corners = mesh.triangles.iter().flatten();
            assert!(corners.all(|index| (*index as usize) < mesh.vertices.len()));
            let mut coordinates = mesh.vertices.iter().flat_map(|vertex| vertex.iter());
            assert!(coordinates.all(|x| x.is_finite()));
        }
        Err(error) => assert!(error.to_string().starts_with(path), "{error}"),
    }
}

pub(crate) fn obj_seeds() -> Vec<Vec<u8>> {
    vec![
        b"# a square\no square\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3//1 4\n".to_vec(),
        b"v 0 0 0 1\nv 1e-3 0 0\nv 0 1 0\nf -3 -2 -1\n".to_vec(),
    ]
}

pub(crate) fn stl_seeds() -> Vec<Vec<u8>> {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    let mut binary = vec![b' '; 80];
    binary.extend_from_slice(&2_u32.to_le_bytes());
    for triangle in 0..2_u8 {
        for number in 0..12_u8 {
            binary.extend_from_slice(&f32::from(number % 5 + triangle).to_le_bytes());
        }
        binary.extend_from_slice(&[0; 2]);
    }
    vec![text.into(), binary]
}

pub(crate) fn ply_seeds() -> Vec<Vec<u8>> {
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment by hand\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let text = format!("{}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", head("ascii"));
    let mut big = head("binary_big_endian").into_bytes();
    for number in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        big.extend_from_slice(&number.to_be_bytes());
    }
    big.push(3);
    for index in 0..3_u32 {
        big.extend_from_slice(&index.to_be_bytes());
    }
    vec![text.into(), big, write_ply(&cuboid([1.0, 2.0, 3.0]))]
}

pub(crate) fn gltf_seeds() -> Vec<Vec<u8>> {
    // Three vertices, then three u16 indices, as a buffer within the text and as the second chunk of a GLB.
    let mut buffer = Vec::new();
    for number in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        buffer.extend_from_slice(&number.to_le_bytes());
    }
    for index in [0_u16, 1, 2, 0] {
        buffer.extend_from_slice(&index.to_le_bytes());
    }
    let text = |uri: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1],"translation":[1,2,3]}},{{"mesh":0,"scale":[2,2,2]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":4}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},{{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],"buffers":[{{{uri}"byteLength":{}}}]}}"#,
            buffer.len()
        )
    };
    let uri = format!(
        r#""uri":"data:application/octet-stream;base64,{}","#,
        base64(&buffer)
    );
    let mut json = text("").into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    let length = (12 + 8 + json.len() + 8 + buffer.len()) as u32;
    glb.extend_from_slice(&length.to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        glb.extend_from_slice(&(chunk.len() as u32).to_le_bytes());
        glb.extend_from_slice(kind);
        glb.extend_from_slice(chunk);
    }
    vec![text(&uri).into(), glb]
}

/// Source: RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or(0));
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for digit in 0..4 {
            let index = (bits >> (18 - 6 * digit)) & 63;
            let is_there = digit <= three.len();
            text.push(if is_there {
                char::from(DIGITS[index as usize])
            } else {
                '='
            });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_is_a_mesh() {
        let formats = [
            ("a.obj", obj_seeds()),
            ("a.stl", stl_seeds()),
            ("a.ply", ply_seeds()),
            ("a.gltf", gltf_seeds()),
        ];
        for (name, seeds) in formats {
            for (number, seed) in seeds.iter().enumerate() {
                let read = read_mesh_bytes(Path::new(name), seed);
                assert!(read.is_ok(), "{name}, sample {number}: {read:?}");
            }
        }
    }
}
