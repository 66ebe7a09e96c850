//! Programs of two releases: what they agree on, and how they part where they cannot.
//!
//! `golden_version_3.txt` keeps the first messages of the release before ranges were stated, byte for byte.

use crate::samples::messages;
use taut_proto::{
    ControlMessage, DecodeError, PROTOCOL_VERSION, VersionRange,
    control::{LENGTH_BYTES, RefusalCode},
};

const VERSION_3: &str = include_str!("golden_version_3.txt");

fn range(min: u8, max: u8) -> VersionRange {
    VersionRange::new(min, max).expect("a range")
}

/// What follows the `length` field of a kept frame.
fn body_of(name: &str) -> Vec<u8> {
    let line = VERSION_3
        .lines()
        .find_map(|line| line.strip_prefix(&format!("message/{name} ")))
        .expect("kept");
    let bytes: Vec<u8> = (0..line.len() / 2)
        .map(|i| u8::from_str_radix(&line[2 * i..2 * i + 2], 16).expect("digits"))
        .collect();
    bytes[LENGTH_BYTES..].to_vec()
}

fn message(wanted: &str) -> ControlMessage {
    let (_, message) = messages()
        .into_iter()
        .find(|(name, _)| *name == wanted)
        .expect("a sample");
    message
}

#[test]
fn a_hello_of_the_release_before_is_refused_by_both_versions() {
    for name in ["hello", "hello_granted"] {
        let error = ControlMessage::from_frame_body(&body_of(name)).expect_err("no range in it");
        let wrong = DecodeError::WrongVersion {
            theirs: range(3, 3),
            ours: VersionRange::SUPPORTED,
        };
        assert_eq!(error, wrong, "{name}");
        let text = error.to_string();
        assert!(
            text.contains("version 3") && text.contains(&PROTOCOL_VERSION.to_string()),
            "{text}"
        );
    }
}

#[test]
fn a_refusal_reads_the_same_in_both_releases() {
    let Ok(ControlMessage::Refused(refusal)) = ControlMessage::from_frame_body(&body_of("refused"))
    else {
        panic!("the refusal of the release before cannot be read");
    };
    assert_eq!(refusal.code, RefusalCode::NameTaken);
    assert_eq!(refusal.text, "taken");
    // And the other way round: but for the version byte, the same value has the same bytes.
    let mut ours = ControlMessage::Refused(refusal)
        .to_frame()
        .expect("encodes")
        .split_off(LENGTH_BYTES);
    ours[2] = 3;
    assert_eq!(ours, body_of("refused"));
}

#[test]
fn a_hello_is_read_by_its_range_whatever_a_later_version_adds() {
    let ControlMessage::Hello(mut hello) = message("hello_with_pictures") else {
        panic!("a Hello");
    };
    hello.versions = range(5, 6);
    let mut body = ControlMessage::Hello(hello.clone())
        .to_frame_of(6)
        .expect("encodes")
        .split_off(LENGTH_BYTES);
    body.extend_from_slice(b"what version 6 adds");
    let read = ControlMessage::from_frame_body_of(&body, range(4, 5));
    assert_eq!(read, Ok(ControlMessage::Hello(hello)));
    // Without a common version the rest of it is not even looked at.
    body.truncate(2 + 1 + 1 + 2);
    let wrong = DecodeError::WrongVersion {
        theirs: range(5, 6),
        ours: range(3, 4),
    };
    assert_eq!(
        ControlMessage::from_frame_body_of(&body, range(3, 4)),
        Err(wrong)
    );
}

#[test]
fn after_the_join_only_the_agreed_version_is_read() {
    let message = message("welcome");
    let body = message
        .to_frame_of(5)
        .expect("encodes")
        .split_off(LENGTH_BYTES);
    let read = |ours| ControlMessage::from_frame_body_of(&body, ours);
    assert_eq!(read(VersionRange::only(5)), Ok(message));
    assert!(matches!(
        read(VersionRange::only(4)),
        Err(DecodeError::WrongVersion { .. })
    ));
}
