//! Golden vectors: the bytes of one sample of everything that travels, in `golden.txt`. A change here, of a layout that was released, is a new protocol
//! version; the layout of version 4 is that of release 0.2.0, and grows until then.
//!
//! A datagram's line is the whole sealed datagram under the key material 00 01 02 .. 1b, epoch 0x01020304, sender 5, sequence 0, 1, 2 ..;
//! a message's line is its frame on the stream; a mesh's line is its blob.

use crate::samples::*;
use taut_proto::{
    Finish, Look, Looks, MeshBlob, Panorama, Texture, TextureUse, Textures, Wrap,
    mesh_blob::{MeshHash, Positions},
    seal::{KEY_MATERIAL_BYTES, Opener, Sealer},
};

const GOLDEN: &str = include_str!("golden.txt");

fn material() -> [u8; KEY_MATERIAL_BYTES] {
    std::array::from_fn(|i| i as u8)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn mesh() -> MeshBlob {
    let positions = Positions::F32(vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    must(MeshBlob::new(
        positions,
        vec![[0, 1, 2]],
        Some(vec![[0.0, 0.0, 1.0]; 3]),
    ))
}

/// Every line of the golden file as this build makes it.
fn made() -> Vec<(String, String)> {
    let sealer = Sealer::new(&material(), 0x0102_0304, 5);
    let mut lines = Vec::new();
    let mut line = |name: String, bytes: &[u8]| lines.push((name, hex(bytes)));
    for (name, payload) in datagrams() {
        line(format!("datagram/{name}"), &sealed(&sealer, &payload));
    }
    for (name, message) in messages() {
        line(format!("message/{name}"), &must(message.to_frame()));
    }
    let finish = |roughness| Finish {
        roughness,
        metallic: 1.0,
    };
    let texture = must(Texture::new(
        (2, 1),
        vec![[255, 0, 0, 255], [0, 0, 255, 128]],
    ))
    .encode();
    let finished = must(mesh().with_finish(finish(0.5)));
    let patched = must(mesh().with_looks(Looks {
        list: vec![Look {
            colour: [1.0, 0.5, 0.0],
            finish: finish(0.25),
        }],
        of_triangles: vec![0],
    }));
    let pictured = must(patched.clone().with_textures(Textures {
        list: vec![TextureUse {
            texture: MeshHash::of(&texture),
            wrap: [Wrap::Mirror, Wrap::Clamp],
        }],
        of_looks: vec![Some(0)],
        coordinates: vec![[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]],
    }));
    let panorama = Panorama::from_fn(|column, row| [column as f32, row as f32, 0.5]).encode();
    let triangle = must(mesh().encode());
    line("mesh/hash".to_owned(), &MeshHash::of(&triangle).bytes);
    line("mesh/triangle".to_owned(), &triangle);
    for (name, mesh) in [("finish", finished), ("looks", patched)] {
        line(format!("mesh/triangle-with-{name}"), &must(mesh.encode()));
    }
    line("texture/two-texels".to_owned(), &texture);
    line(
        "mesh/triangle-with-textures".to_owned(),
        &must(pictured.encode()),
    );
    line("panorama/hash".to_owned(), &MeshHash::of(&panorama).bytes);
    line("panorama/first-texels".to_owned(), &panorama[..16]);
    lines
}

/// After a meant change of layout, with the version raised if it was released: `cargo test -p taut-proto --test all golden:: -- --ignored`.
#[test]
#[ignore = "writes the golden file"]
fn write_the_golden_file() {
    let lines = made()
        .iter()
        .map(|(name, bytes)| format!("{name} {bytes}\n"))
        .collect::<String>();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden.txt");
    std::fs::write(path, lines).unwrap_or_else(|error| panic!("{path}: {error}"));
}

#[test]
fn everything_that_travels_has_the_bytes_of_the_golden_file() {
    let golden: Vec<_> = GOLDEN
        .lines()
        .filter_map(|line| line.split_once(' '))
        .collect();
    let made = made();
    for (name, bytes) in &made {
        let expected = golden
            .iter()
            .find(|(of, _)| of == name)
            .map(|(_, bytes)| *bytes);
        assert_eq!(
            Some(bytes.as_str()),
            expected,
            "{name}: the layout changed; if meant, raise PROTOCOL_VERSION where it was released, and write the new line"
        );
    }
    assert_eq!(golden.len(), made.len(), "every golden line has its sample");
}

#[test]
fn the_header_is_laid_out_as_documented() {
    let (_, heartbeat) = &made()[3];
    // magic, version, kind, epoch, sender, flags, sequence, length, reserved.
    assert!(heartbeat.starts_with("5748" /* 0x4857 */), "{heartbeat}");
    assert_eq!(
        &heartbeat[..48],
        concat!(
            "5748",
            "04",
            "07",
            "04030201",
            "0500",
            "0000",
            "0300000000000000",
            "0000",
            "0000"
        )
    );
    assert_eq!(heartbeat.len(), 2 * (24 + 16));
}

#[test]
fn golden_datagrams_open() {
    let mut opener = Opener::new(&material(), 0x0102_0304, 5);
    for (name, payload) in datagrams() {
        let golden = GOLDEN
            .lines()
            .find_map(|line| line.strip_prefix(&format!("datagram/{name} ")))
            .unwrap_or_default();
        let bytes: Vec<u8> = (0..golden.len() / 2)
            .filter_map(|i| u8::from_str_radix(&golden[2 * i..2 * i + 2], 16).ok())
            .collect();
        let opened = opener
            .open(&bytes)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(opened.payload, payload, "{name}");
    }
}
