//! Values to bytes and back; and what is not a value.

use crate::samples::*;
use proptest::prelude::*;
use taut_proto::{
    ClientStats, ControlMessage, DecodeError, EncodeError, Finish, HotState, Kind, Look, Looks,
    MeshBlob, MeshHash, PROTOCOL_VERSION, Payload, Refusal, SceneDescription, TextureUse, Textures,
    Untrusted, VersionRange, Wrap,
    codec::{MAX_LIST, MAX_TEXT_BYTES, decode, encode_onto},
    control::{Bye, LENGTH_BYTES, MAX_FRAME_BYTES, Offers, RefusalCode},
    mesh_blob::Positions,
    stats::DrawnState,
};

fn frame_of(message: &ControlMessage) -> Vec<u8> {
    must(message.to_frame())
}

#[test]
fn every_sample_comes_back() {
    for (name, payload) in datagrams() {
        assert_eq!(
            Payload::decode(payload.kind(), &bytes_of(&payload)),
            Ok(payload),
            "{name}"
        );
    }
    for (name, message) in messages() {
        let frame = frame_of(&message);
        assert_eq!(
            ControlMessage::from_frame_body(&frame[LENGTH_BYTES..]),
            Ok(message),
            "{name}"
        );
    }
}

#[test]
fn every_truncation_is_refused() {
    for (name, payload) in datagrams() {
        let bytes = bytes_of(&payload);
        for length in 0..bytes.len() {
            assert!(
                Payload::decode(payload.kind(), &bytes[..length]).is_err(),
                "{name} cut to {length}"
            );
        }
    }
    for (name, message) in messages() {
        let frame = frame_of(&message);
        // What a Hello ends with is left out by who knows nothing of it.
        let offers =
            matches!(&message, ControlMessage::Hello(hello) if hello.offers != Offers::NONE);
        for length in LENGTH_BYTES..frame.len() - usize::from(offers) {
            assert!(
                ControlMessage::from_frame_body(&frame[LENGTH_BYTES..length]).is_err(),
                "{name} cut to {length}"
            );
        }
    }
}

#[test]
fn bytes_after_a_value_are_refused() {
    for (name, payload) in datagrams() {
        let mut bytes = bytes_of(&payload);
        bytes.push(0);
        assert_eq!(
            Payload::decode(payload.kind(), &bytes),
            Err(DecodeError::TrailingBytes { left: 1 }),
            "{name}"
        );
    }
}

#[test]
fn numbers_that_are_not_finite_travel_in_neither_direction() {
    let mut state = hot();
    state.tools[0].force[1] = f32::NAN;
    assert_eq!(state.hash(), Err(EncodeError::NotFinite));
    let good = bytes_of(&Payload::Hot(hot()));
    // The head's x: after frame (28 bytes).
    let mut bent = good.clone();
    bent[28..32].copy_from_slice(&f32::INFINITY.to_le_bytes());
    assert_eq!(decode::<HotState>(&bent), Err(DecodeError::NotFinite));
}

#[test]
fn a_count_beyond_the_bytes_that_came_is_refused_before_anything_is_taken() {
    let too_long = |what, len, max| DecodeError::TooLong { what, len, max };
    // A name of 65535 bytes in a message of two.
    let text = decode::<Untrusted>(&[0xff, 0xff]);
    assert_eq!(text, Err(too_long("text", 65535, 0)));
    // 2000 elements in four bytes.
    let list = decode::<Vec<u64>>(&[0xd0, 0x07, 0, 0]);
    assert_eq!(list, Err(too_long("list", 2000, 2)));
    // More tools than a state holds.
    let mut state = bytes_of(&Payload::Hot(hot()));
    state[20] = 3;
    let state = decode::<HotState>(&state);
    assert_eq!(state, Err(too_long("list", 3, 2)));
}

#[test]
fn what_is_too_long_is_not_sent() {
    let bye = |length: usize| {
        ControlMessage::Bye(Bye {
            reason: "x".repeat(length).into(),
        })
        .to_frame()
    };
    assert!(bye(MAX_TEXT_BYTES).is_ok());
    assert!(matches!(
        bye(MAX_TEXT_BYTES + 1),
        Err(EncodeError::TooLong { what: "text", .. })
    ));
    let stats = |length: usize| {
        ControlMessage::Stats(ClientStats {
            drawn: vec![
                DrawnState {
                    tick: 1,
                    state_hash: 2
                };
                length
            ],
            ..ClientStats::default()
        })
        .to_frame()
    };
    assert!(stats(MAX_LIST).is_ok());
    assert!(matches!(
        stats(MAX_LIST + 1),
        Err(EncodeError::TooLong { what: "list", .. })
    ));
    let mut scene = scene();
    scene.obstacles = vec![scene.god_object.clone(); MAX_LIST];
    for obstacle in &mut scene.obstacles {
        obstacle.name = "x".repeat(MAX_TEXT_BYTES).into();
    }
    assert_eq!(
        ControlMessage::Scene(scene).to_frame(),
        Err(EncodeError::BufferFull)
    );
}

#[test]
fn frames_of_impossible_length_are_refused() {
    assert_eq!(
        ControlMessage::frame_length([3, 0, 0, 0], MAX_FRAME_BYTES),
        Err(DecodeError::Truncated)
    );
    assert_eq!(
        ControlMessage::frame_length([4, 0, 0, 0], MAX_FRAME_BYTES),
        Ok(4)
    );
    assert!(matches!(
        ControlMessage::frame_length([0xff; 4], MAX_FRAME_BYTES),
        Err(DecodeError::TooLong { .. })
    ));
}

#[test]
fn another_version_is_a_typed_error_but_its_refusal_can_be_read() {
    for (name, message) in messages() {
        let mut body = frame_of(&message).split_off(LENGTH_BYTES);
        body[2] = 200;
        let read = ControlMessage::from_frame_body(&body);
        if matches!(
            name,
            "refused" | "hello" | "hello_granted" | "hello_with_pictures"
        ) {
            assert_eq!(read, Ok(message), "{name}");
        } else {
            let wrong = DecodeError::WrongVersion {
                theirs: VersionRange::only(200),
                ours: VersionRange::SUPPORTED,
            };
            assert_eq!(read, Err(wrong), "{name}");
        }
    }
    let refusal = Refusal {
        code: RefusalCode::WrongVersion,
        version: 2,
        text: String::new().into(),
    };
    let frame = frame_of(&ControlMessage::Refused(refusal));
    assert_eq!(
        frame[LENGTH_BYTES + 3],
        0,
        "its tag stays 0 in every version"
    );
}

fn tetrahedron() -> MeshBlob {
    let positions = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    must(MeshBlob::new(Positions::F64(positions), triangles, None))
}

#[test]
fn a_mesh_comes_back_in_both_precisions_with_and_without_all_its_parts() {
    let double = tetrahedron();
    let single = |p: [f64; 3]| p.map(|x| x as f32);
    let singles = double.positions_f64().into_iter().map(single).collect();
    for positions in [double.positions().clone(), Positions::F32(singles)] {
        for normals in [None, Some(vec![[0.0, 0.0, 1.0]; 4])] {
            let mesh = must(MeshBlob::new(
                positions.clone(),
                double.triangles().to_vec(),
                normals,
            ));
            let finished = must(mesh.clone().with_finish(FINISH));
            let looks = Looks {
                list: vec![look(0.25), look(1.0)],
                of_triangles: vec![0, 1, 1, 0],
            };
            let [patched, both] =
                [&mesh, &finished].map(|mesh| must(mesh.clone().with_looks(looks.clone())));
            for mesh in [mesh, finished, patched, both] {
                let bytes = must(mesh.encode());
                assert_eq!(MeshBlob::decode(&bytes), Ok(mesh));
            }
        }
    }
}

fn look(red: f32) -> Look {
    Look {
        colour: [red, 0.5, 0.0],
        finish: FINISH,
    }
}

#[test]
fn looks_that_are_not_of_the_mesh_are_refused() {
    let with = |list: Vec<Look>, of_triangles: Vec<u8>| {
        tetrahedron().with_looks(Looks { list, of_triangles })
    };
    let inconsistent = Err(DecodeError::Inconsistent { what: "mesh looks" });
    for (looks, of_triangles, what) in [
        (0, vec![], "no look"),
        (0, vec![0; 4], "no look of those named"),
        (1, vec![0; 3], "a triangle without"),
        (1, vec![0, 1, 0, 0], "no second"),
        (256, vec![0; 4], "too many"),
    ] {
        let patched = with(vec![look(1.0); looks], of_triangles);
        assert_eq!(patched, inconsistent, "{what}");
    }
    for red in [-0.01, 1.01, f32::NAN] {
        assert!(with(vec![look(red)], vec![0; 4]).is_err(), "{red}");
    }
    let good = with(vec![look(1.0); 255], vec![0, 254, 0, 0]);
    let bytes = must(must(good).encode());
    for length in 0..bytes.len() {
        let cut = MeshBlob::decode(&bytes[..length]);
        assert!(cut.is_err(), "cut to {length}");
    }
    let mut longer = bytes.clone();
    longer.push(0);
    assert!(MeshBlob::decode(&longer).is_err());
    let mut other = bytes;
    let last = other.len() - 1;
    other[last] = 255;
    assert_eq!(MeshBlob::decode(&other), inconsistent);
}

fn textures() -> Textures {
    let texture = |byte: u8, wrap| TextureUse {
        texture: MeshHash { bytes: [byte; 32] },
        wrap,
    };
    Textures {
        list: vec![
            texture(7, [Wrap::Repeat, Wrap::Clamp]),
            texture(8, [Wrap::Mirror, Wrap::Repeat]),
        ],
        of_looks: vec![Some(1), None, Some(0)],
        coordinates: vec![[[0.0, 1.0], [0.5, -2.5], [1e6, 0.25]]; 4],
    }
}

/// With three looks.
fn patched() -> MeshBlob {
    let looks = Looks {
        list: vec![look(1.0), look(0.5), look(0.25)],
        of_triangles: vec![0, 1, 2, 0],
    };
    must(tetrahedron().with_looks(looks))
}

#[test]
fn a_mesh_comes_back_with_its_textures_and_not_when_it_is_cut() {
    for finish in [None, Some(FINISH)] {
        let mut mesh = must(patched().with_textures(textures()));
        if let Some(finish) = finish {
            mesh = must(mesh.with_finish(finish));
        }
        let bytes = must(mesh.encode());
        for length in 0..bytes.len() {
            let cut = MeshBlob::decode(&bytes[..length]);
            assert!(cut.is_err(), "cut to {length}");
        }
        for more in 1..30 {
            let longer = [&bytes[..], &vec![0; more]].concat();
            assert!(MeshBlob::decode(&longer).is_err(), "{more} more");
        }
        // Looks are known to end before the textures; without their bit these are too much.
        let mut unnamed = bytes.clone();
        unnamed[4] &= !16;
        assert!(MeshBlob::decode(&unnamed).is_err());
        let mut alone = bytes.clone();
        alone[4] &= !8;
        assert!(MeshBlob::decode(&alone).is_err(), "textures without looks");
        assert_eq!(MeshBlob::decode(&bytes), Ok(mesh));
    }
}

#[test]
fn textures_that_are_not_of_the_mesh_are_refused() {
    let refused = |change: &dyn Fn(&mut Textures)| {
        let mut changed = textures();
        change(&mut changed);
        patched().with_textures(changed).is_err()
    };
    assert!(!refused(&|_| {}));
    assert!(refused(&|t| t.list.clear()));
    assert!(refused(&|t| t.list = vec![t.list[0]; 65]), "too many");
    assert!(refused(&|t| t.of_looks[0] = Some(2)), "no third");
    assert!(refused(&|t| t.of_looks.truncate(2)), "a look without");
    assert!(refused(&|t| t.coordinates.truncate(3)));
    for number in [f32::NAN, f32::INFINITY] {
        assert!(refused(&|t| t.coordinates[3][2][1] = number), "{number}");
    }
    assert!(tetrahedron().with_textures(textures()).is_err(), "no looks");
    // A way to go on that nobody knows, and a count beyond all bytes.
    let bytes = must(must(patched().with_textures(textures())).encode());
    let start = bytes.len() - (4 + 2 * 34 + 3 + 4 * 24);
    for (at, with) in [
        (start + 4 + 32, &[3][..]),
        (start, &u32::MAX.to_le_bytes()),
        (start, &[0; 4]),
        (start + 4 + 2 * 34, &[2]),
    ] {
        let mut bent = bytes.clone();
        bent[at..at + with.len()].copy_from_slice(with);
        assert!(MeshBlob::decode(&bent).is_err(), "{with:?} at {at}");
    }
}

const FINISH: Finish = Finish {
    roughness: 0.25,
    metallic: 1.0,
};

#[test]
fn a_finish_out_of_its_range_is_refused() {
    let refused = |roughness: f32| {
        let mut bytes = must(must(tetrahedron().with_finish(FINISH)).encode());
        let at = bytes.len() - 8;
        bytes[at..at + 4].copy_from_slice(&roughness.to_le_bytes());
        let decoded = MeshBlob::decode(&bytes);
        assert_eq!(
            decoded,
            tetrahedron().with_finish(Finish {
                roughness,
                ..FINISH
            })
        );
        decoded.is_err()
    };
    for roughness in [-0.01, 1.01, f32::NAN, f32::INFINITY] {
        assert!(refused(roughness), "{roughness}");
    }
    assert!(!refused(0.0) && !refused(1.0));
}

#[test]
fn a_broken_mesh_is_refused() {
    let bytes = must(tetrahedron().encode());
    for length in 0..bytes.len() {
        assert!(
            MeshBlob::decode(&bytes[..length]).is_err(),
            "cut to {length}"
        );
    }
    let bent = |at: usize, with: &[u8]| {
        let mut bytes = bytes.clone();
        bytes[at..at + with.len()].copy_from_slice(with);
        MeshBlob::decode(&bytes)
    };
    assert_eq!(bent(0, b"x"), Err(DecodeError::WrongMagic));
    let inconsistent = |what| Err(DecodeError::Inconsistent { what });
    for at in [8, 12] {
        let bent = bent(at, &u32::MAX.to_le_bytes());
        assert_eq!(bent, inconsistent("mesh length"), "{at}");
    }
    assert_eq!(
        bent(16, &f64::NAN.to_le_bytes()),
        Err(DecodeError::NotFinite)
    );
    let first_index = 16 + 4 * 24;
    let bent = bent(first_index, &4_u32.to_le_bytes());
    assert_eq!(bent, inconsistent("vertex index"));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_payload_comes_back(payload in any_payload()) {
        prop_assert_eq!(Payload::decode(payload.kind(), &bytes_of(&payload)), Ok(payload));
    }

    #[test]
    fn any_scene_comes_back(scene in any_scene()) {
        let mut bytes = Vec::new();
        prop_assert_eq!(encode_onto(&scene, &mut bytes), Ok(()));
        prop_assert_eq!(decode::<SceneDescription>(&bytes), Ok(scene));
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        for kind in [Kind::Hot, Kind::TimeRequest, Kind::TimeResponse, Kind::Heartbeat, Kind::Input, Kind::Wrench, Kind::Constraints, Kind::Arrive, Kind::Release] {
            // What can be read must be writable again, to the same bytes: no two encodings of one value, but for rounded normals.
            if let Ok(payload) = Payload::decode(kind, &bytes) && !matches!(kind, Kind::Hot | Kind::Release) {
                prop_assert_eq!(bytes_of(&payload), bytes.clone());
            }
        }
        let _ = ControlMessage::from_frame_body(&bytes);
        let _ = MeshBlob::decode(&bytes);
    }

    #[test]
    fn arbitrary_bodies_under_a_good_prefix_never_panic(tag in 0_u8..21, body in prop::collection::vec(any::<u8>(), 0..600)) {
        let mut frame = vec![0x57, 0x48, PROTOCOL_VERSION, tag];
        frame.extend(&body);
        if let Ok(message) = ControlMessage::from_frame_body(&frame) {
            // What a later version adds to Hello is not read.
            let again = frame_of(&message).split_off(LENGTH_BYTES);
            let whole = matches!(message, ControlMessage::Hello(_)) || again == frame;
            prop_assert!(whole && frame.starts_with(&again));
        }
    }

    #[test]
    fn bent_samples_never_panic(which in 0_usize..20, at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let (_, message) = messages().swap_remove(which);
        let mut body = frame_of(&message).split_off(LENGTH_BYTES);
        let at = at.index(body.len());
        body[at] = byte;
        let _ = ControlMessage::from_frame_body(&body);
    }
}
