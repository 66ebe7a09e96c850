//! Golden vectors: the bytes of one sample of everything that travels, in `golden.txt`. A change here, of a layout that was released, is a new protocol
//! version; the layout of version 4 is that of release 0.2.0, and grows until then.
//!
//! A datagram's line is the whole sealed datagram under the key material 00 01 02 .. 1b, epoch 0x01020304, sender 5, sequence 0, 1, 2 ..;
//! a message's line is its frame on the stream; a mesh's line is its blob.

use crate::samples::*;
use taut_proto::{
    Finish, Look, Looks, MeshBlob, Panorama, Texture, TextureUse, Textures, Wrap,
    header::MAX_DATAGRAM_BYTES,
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
    MeshBlob::new(positions, vec![[0, 1, 2]], Some(vec![[0.0, 0.0, 1.0]; 3]))
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Every line of the golden file as this build makes it.
fn made() -> Vec<(String, String)> {
    let sealer = Sealer::new(&material(), 0x0102_0304, 5);
    let mut lines = Vec::new();
    for (name, payload) in datagrams() {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let datagram = sealer
            .seal(&payload, &mut buffer)
            .unwrap_or_else(|error| panic!("{error}"));
        lines.push((format!("datagram/{name}"), hex(datagram)));
    }
    for (name, message) in messages() {
        let frame = message.to_frame().unwrap_or_else(|error| panic!("{error}"));
        lines.push((format!("message/{name}"), hex(&frame)));
    }
    let blob = mesh().encode().unwrap_or_else(|error| panic!("{error}"));
    lines.push(("mesh/hash".to_owned(), MeshHash::of(&blob).to_string()));
    lines.push(("mesh/triangle".to_owned(), hex(&blob)));
    let finished = mesh().with_finish(Finish {
        roughness: 0.5,
        metallic: 1.0,
    });
    let finished = finished.unwrap_or_else(|error| panic!("{error}"));
    let blob = finished.encode().unwrap_or_else(|error| panic!("{error}"));
    lines.push(("mesh/triangle-with-finish".to_owned(), hex(&blob)));
    let patched = mesh().with_looks(Looks {
        list: vec![Look {
            colour: [1.0, 0.5, 0.0],
            finish: Finish {
                roughness: 0.25,
                metallic: 1.0,
            },
        }],
        of_triangles: vec![0],
    });
    let patched = patched.unwrap_or_else(|error| panic!("{error}"));
    let blob = patched.encode().unwrap_or_else(|error| panic!("{error}"));
    lines.push(("mesh/triangle-with-looks".to_owned(), hex(&blob)));
    let texture = Texture::new((2, 1), vec![[255, 0, 0, 255], [0, 0, 255, 128]]);
    let texture = texture.unwrap_or_else(|error| panic!("{error}")).encode();
    lines.push(("texture/two-texels".to_owned(), hex(&texture)));
    let pictured = patched.with_textures(Textures {
        list: vec![TextureUse {
            texture: MeshHash::of(&texture),
            wrap: [Wrap::Mirror, Wrap::Clamp],
        }],
        of_looks: vec![Some(0)],
        coordinates: vec![[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]],
    });
    let pictured = pictured.unwrap_or_else(|error| panic!("{error}"));
    let blob = pictured.encode().unwrap_or_else(|error| panic!("{error}"));
    lines.push(("mesh/triangle-with-textures".to_owned(), hex(&blob)));
    let panorama = Panorama::from_fn(|column, row| [column as f32, row as f32, 0.5]).encode();
    lines.push((
        "panorama/hash".to_owned(),
        MeshHash::of(&panorama).to_string(),
    ));
    lines.push(("panorama/first-texels".to_owned(), hex(&panorama[..16])));
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
