//! What comes from the network under the protocol of taut.

use std::cell::RefCell;

use taut_proto::{
    Assembler, ConstraintPart, ControlMessage, Header, Kind, MeshBlob, PROTOCOL_VERSION, Panorama,
    Payload, Texture,
    control::{LENGTH_BYTES, MAX_FRAME_BYTES},
    header::{HEADER_BYTES, MAX_PAYLOAD_BYTES, TAG_BYTES},
};

use crate::samples::{golden, golden_opener};

/// Most parts that one input is divided into.
const MAX_PARTS: usize = 8;

/// A whole datagram: header, then the payload as if it were open. What is read is written again as the same header.
pub(crate) fn datagram(bytes: &[u8]) {
    let Ok(header) = Header::parse(bytes) else {
        return;
    };
    assert_eq!(header.to_bytes(), bytes[..HEADER_BYTES]);
    check_payload(header.kind, &bytes[HEADER_BYTES..bytes.len() - TAG_BYTES]);
}

/// A kind's code, then a payload: what is read is written again, and that is read as the same.
pub(crate) fn payload(bytes: &[u8]) {
    let Some((code, payload)) = bytes.split_first() else {
        return;
    };
    if let Some(kind) = kind_of(*code) {
        check_payload(kind, payload);
    }
}

/// The kind of this code, if there is one: read as a receiver reads it, so that new kinds are known here at once.
fn kind_of(code: u8) -> Option<Kind> {
    let mut datagram = [0; HEADER_BYTES + TAG_BYTES];
    let empty = Header {
        version: PROTOCOL_VERSION,
        kind: Kind::Heartbeat,
        epoch: 0,
        sender: 0,
        flags: 0,
        sequence: 0,
        length: 0,
    };
    datagram[..HEADER_BYTES].copy_from_slice(&empty.to_bytes());
    datagram[3] = code;
    Header::parse(&datagram).ok().map(|header| header.kind)
}

/// Decoding rounds nothing twice: once read and written, the bytes stay as they are.
fn check_payload(kind: Kind, bytes: &[u8]) {
    let Ok(read) = Payload::decode(kind, bytes) else {
        return;
    };
    assert_eq!(read.kind(), kind);
    let mut buffer = [0; 2 * MAX_PAYLOAD_BYTES];
    let written = match read.encode_into(&mut buffer) {
        Ok(length) => &buffer[..length],
        Err(error) => panic!("{kind:?} was read and cannot be written: {error}"),
    };
    let again = Payload::decode(kind, written)
        .unwrap_or_else(|error| panic!("{kind:?} was written and cannot be read: {error}"));
    let mut buffer = [0; 2 * MAX_PAYLOAD_BYTES];
    let length = again.encode_into(&mut buffer).unwrap_or(usize::MAX);
    assert_eq!(Some(written), buffer.get(..length), "{kind:?} drifts");
}

/// A datagram to an opener that knows the golden key: what opens is golden, bit by bit, and opens once.
pub(crate) fn opener(bytes: &[u8]) {
    let mut opener = golden_opener();
    if opener.open(bytes).is_ok() {
        assert!(
            golden("datagram/").iter().any(|genuine| genuine == bytes),
            "a datagram that nobody sealed was opened"
        );
        assert!(opener.open(bytes).is_err(), "opened twice");
    }
}

/// Parts of constraint sets in a row, each with its length in two bytes before it, put together.
pub(crate) fn constraint_parts(bytes: &[u8]) {
    thread_local! {
        static ASSEMBLER: RefCell<Option<Box<Assembler>>> = const { RefCell::new(None) };
    }
    ASSEMBLER.with_borrow_mut(|kept| {
        // One per thread: its buffers are as large as the largest set. Sets of an earlier input must not harm a later one.
        let assembler = kept.get_or_insert_with(|| Box::new(Assembler::new()));
        let mut rest = bytes;
        for _ in 0..MAX_PARTS {
            let Some((length, after)) = rest.split_first_chunk::<2>() else {
                break;
            };
            let length = usize::from(u16::from_le_bytes(*length)).min(after.len());
            let (part, after) = after.split_at(length);
            rest = after;
            if let Ok(part) = taut_proto::codec::decode::<ConstraintPart>(part) {
                let _ = assembler.take(&part);
            }
        }
        if let Some(set) = assembler.newest() {
            assert!(set.rows.len() <= taut_proto::constraints::MAX_SET_ROWS);
        }
    });
}

/// A frame of a control stream: what is read is written again, and that is read as the same.
pub(crate) fn control(bytes: &[u8]) {
    let Some((length, body)) = bytes.split_first_chunk::<LENGTH_BYTES>() else {
        return;
    };
    let Ok(length) = ControlMessage::frame_length(*length, MAX_FRAME_BYTES) else {
        return;
    };
    let Ok(message) = ControlMessage::from_frame_body(&body[..length.min(body.len())]) else {
        return;
    };
    let frame = message
        .to_frame()
        .unwrap_or_else(|error| panic!("{} cannot be written: {error}", message.name()));
    let again = ControlMessage::from_frame_body(&frame[LENGTH_BYTES..]);
    assert_eq!(again.as_ref(), Ok(&message));
}

/// A mesh as it travels: what is read is written as the same bytes.
pub(crate) fn mesh_blob(bytes: &[u8]) {
    if let Ok(mesh) = MeshBlob::decode(bytes) {
        assert_eq!(mesh.encode().as_deref(), Ok(bytes));
        let vertices = mesh.positions().len();
        let mut corners = mesh.triangles().iter().flatten();
        assert!(corners.all(|index| (*index as usize) < vertices));
    }
}

/// The light around a scene as it travels: what is read is written as the same bytes, and all of it is finite.
pub(crate) fn panorama(bytes: &[u8]) {
    if let Ok(light) = Panorama::decode(bytes) {
        assert_eq!(light.encode(), bytes);
        for texel in 0..Panorama::WIDTH * Panorama::HEIGHT {
            let light = light.light(texel % Panorama::WIDTH, texel / Panorama::WIDTH);
            assert!(light.iter().all(|part| part.is_finite() && *part >= 0.0));
        }
    }
}

/// A picture on surfaces as it travels: what is read is written as the same bytes, and can be made smaller.
pub(crate) fn texture(bytes: &[u8]) {
    if let Ok(texture) = Texture::decode(bytes) {
        assert_eq!(texture.encode(), bytes);
        let ((width, height), half) = (texture.size(), texture.halved().size());
        assert_eq!(half, ((width / 2).max(1), (height / 2).max(1)));
    }
}

pub(crate) fn texture_seeds() -> Vec<Vec<u8>> {
    golden("texture/")
}

pub(crate) fn panorama_seeds() -> Vec<Vec<u8>> {
    vec![Panorama::from_fn(|column, row| [column as f32, row as f32, 0.5]).encode()]
}

pub(crate) fn datagram_seeds() -> Vec<Vec<u8>> {
    golden("datagram/")
}

/// Opened golden datagrams, their kind's code in front.
pub(crate) fn payload_seeds() -> Vec<Vec<u8>> {
    opened()
        .filter_map(|(code, payload)| {
            let mut seed = vec![0; 2 * MAX_PAYLOAD_BYTES];
            seed[0] = code;
            let length = payload.encode_into(&mut seed[1..]).ok()?;
            seed.truncate(1 + length);
            Some(seed)
        })
        .collect()
}

/// What the golden datagrams carry, with the codes of their kinds.
fn opened() -> impl Iterator<Item = (u8, Payload)> {
    let mut opener = golden_opener();
    let opened = move |datagram: Vec<u8>| Some((datagram[3], opener.open(&datagram).ok()?.payload));
    golden("datagram/").into_iter().filter_map(opened)
}

pub(crate) fn part_seeds() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    for (_, payload) in opened() {
        let Payload::Constraints(part) = payload else {
            continue;
        };
        let first = ConstraintPart {
            part: 0,
            first_row: 0,
            rows: part.rows[..2].iter().copied().collect(),
            ..part.clone()
        };
        let alone = ConstraintPart {
            parts: 1,
            rows_in_set: 2,
            ..first.clone()
        };
        seeds.extend([in_a_row(&[first, part]), in_a_row(&[alone])]);
    }
    seeds
}

fn in_a_row(parts: &[ConstraintPart]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for part in parts {
        let mut buffer = [0; 2 * MAX_PAYLOAD_BYTES];
        if let Ok(length) = taut_proto::codec::encode_into(part, &mut buffer) {
            bytes.extend_from_slice(&(length as u16).to_le_bytes());
            bytes.extend_from_slice(&buffer[..length]);
        }
    }
    bytes
}

pub(crate) fn control_seeds() -> Vec<Vec<u8>> {
    golden("message/")
}

pub(crate) fn mesh_blob_seeds() -> Vec<Vec<u8>> {
    golden("mesh/triangle")
}
