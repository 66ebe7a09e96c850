//! Every number of every message has a range: listed in `docs/numbers.md`, refused beyond it by name.

use crate::samples::*;
use taut_proto::{
    DecodeError, EdgeCoupling, EncodeError, HeadSample, HotState, InputSample, Payload, PoseF64,
    barrier::{Arrive, ReleaseHead},
    codec::{decode, encode_onto},
    coupling::EdgeSine,
    header::MAX_PAYLOAD_BYTES,
    range::{MAX_NODE_PERIOD_US, MAX_PERIOD_US, numbers},
    time::TimeRequest,
};

const PAGE: &str = include_str!("../../docs/numbers.md");
const BEGIN: &str = "<!-- numbers: begin -->\n";
const END: &str = "<!-- numbers: end -->\n";

fn table() -> String {
    let mut table = "| number | range |\n| --- | --- |\n".to_owned();
    for number in numbers() {
        table += &format!("| `{}` | {} |\n", number.name, number.bounds.text);
    }
    table
}

/// The page before, in, and after the table.
fn parts() -> (&'static str, &'static str, &'static str) {
    let (before, rest) = PAGE.split_once(BEGIN).expect("the page has a table");
    let (table, after) = rest.split_once(END).expect("the table ends");
    (before, table, after)
}

/// After a change of a range: `cargo test -p taut-proto --test all numbers:: -- --ignored`.
#[test]
#[ignore = "writes the page"]
fn write_the_page() {
    let (before, _, after) = parts();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/numbers.md");
    let page = format!("{before}{BEGIN}{}{END}{after}", table());
    std::fs::write(path, page).unwrap_or_else(|error| panic!("{path}: {error}"));
}

#[test]
fn the_page_lists_every_number_with_its_range() {
    assert_eq!(parts().1, table(), "write it anew: see `write_the_page`");
    let mut names: Vec<_> = numbers().map(|number| number.name).collect();
    let all = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all, "each once");
}

/// The sample with its bytes at `at` replaced, read.
fn bent(payload: &Payload, at: usize, with: &[u8]) -> Result<Payload, DecodeError> {
    let mut bytes = bytes_of(payload);
    bytes[at..at + with.len()].copy_from_slice(with);
    Payload::decode(payload.kind(), &bytes)
}

#[test]
fn the_last_number_of_a_kind_is_refused_by_name() {
    let far = u64::MAX.to_le_bytes();
    let arrive = Payload::Arrive(arrive());
    assert_eq!(refused(bent(&arrive, 0, &far)), "Arrive.term");
    assert_eq!(refused(bent(&arrive, 8, &far)), "Arrive.frame");
    let end = bytes_of(&arrive).len();
    let period = u32::MAX.to_le_bytes();
    assert_eq!(refused(bent(&arrive, end - 4, &period)), "Arrive.period_us");
    let release = Payload::Release(release());
    assert_eq!(refused(bent(&release, 0, &far)), "ReleaseHead.term");
    assert_eq!(
        refused(bent(&release, 26, &far[..4])),
        "ReleaseHead.period_us"
    );
    let hot = Payload::Hot(hot());
    assert_eq!(refused(bent(&hot, 0, &far)), "HotState.sample_time_ns");
    assert_eq!(refused(bent(&hot, 8, &far)), "HotState.tick");
    let ask = Payload::TimeRequest(TimeRequest { client_sent: 1 });
    assert_eq!(refused(bent(&ask, 0, &far)), "TimeRequest.client_sent");
    // A set of this number would overtake every other for ever.
    let set = Payload::Constraints(part());
    assert_eq!(refused(bent(&set, 0, &far)), "SetHead.sequence");
}

#[test]
fn what_nobody_takes_nobody_sends() {
    let sent = |payload: &Payload| payload.encode_into(&mut [0; MAX_PAYLOAD_BYTES]).err();
    let out = |number| Some(EncodeError::OutOfRange { number });
    let mut state: HotState = hot();
    state.tools[0].god_object.position[0] = 1e7;
    assert_eq!(sent(&Payload::Hot(state)), out("PoseF32.position"));
    let head = HeadSample {
        sample_time_ns: 1,
        index: u64::MAX,
        pose: PoseF64::IDENTITY,
    };
    assert_eq!(sent(&Payload::Head(head)), out("HeadSample.index"));
    let input = InputSample {
        sample_time_ns: 1,
        clock_uncertainty_ns: 1,
        index: 1,
        pose: PoseF64 {
            rotation: [2.0, 0.0, 0.0, 0.0],
            ..PoseF64::IDENTITY
        },
        velocity: [0.0; 6],
        buttons: 0,
        flags: 0,
        rendered: [0.0; 6],
        set_made_ns: 0,
    };
    assert_eq!(sent(&Payload::Input(input)), out("PoseF64.rotation"));
    let arrive = Arrive {
        period_us: MAX_NODE_PERIOD_US + 1,
        ..Arrive::default()
    };
    assert_eq!(sent(&Payload::Arrive(arrive)), out("Arrive.period_us"));
}

/// The bytes of the sample of a coupling with a number at `at` replaced, read.
fn bent_coupling(at: usize, with: &[u8]) -> &'static str {
    let mut bytes = Vec::new();
    assert_eq!(encode_onto(&coupling(), &mut bytes), Ok(()));
    bytes[at..at + with.len()].copy_from_slice(with);
    refused(decode::<EdgeCoupling>(&bytes))
}

#[test]
fn a_coupling_that_no_scene_has_is_refused_by_name() {
    for (at, value, number) in [
        (0, 0.0, "EdgeCoupling.mass"),
        (8, 1e25, "EdgeCoupling.inertia"),
        (80, -1e7, "EdgeCoupling.reference_point"),
        (104, 0.0, "EdgeCoupling.radius"),
        (112, 1.01, "EdgeSettings.k_s"),
        (120, -2000.0, "EdgeSettings.k_h"),
        (128, 1e4, "EdgeSettings.damping_time"),
        (137, 0.0, "EdgeSettings.radius_of_gyration"),
        (146, -1.0, "EdgeAdaptation.duration"),
        (154, 1e-3, "EdgeAdaptation.threshold"),
        (164, 1e300, "EdgeSettings.force_limit"),
        (172, 0.0, "EdgeSettings.torque_limit"),
        (180, -1.0, "EdgeSettings.rest_distance"),
        (212, 1e7, "EdgeSettings.look_ahead_limit"),
    ] {
        assert_eq!(bent_coupling(at, &f64::to_le_bytes(value)), number);
    }
    for (at, value, number) in [
        (236, 0, "EdgeSettings.max_constraints"),
        (236, 1025, "EdgeSettings.max_constraints"),
        (240, u32::MAX, "EdgeSettings.max_substeps"),
        (244, 4, "EdgeSettings.implicit_rounds"),
        (248, 0, "EdgeSettings.max_advancement_steps"),
    ] {
        assert_eq!(bent_coupling(at, &u32::to_le_bytes(value)), number);
    }
    let sent = |coupling: &EdgeCoupling| encode_onto(coupling, &mut Vec::new()).err();
    let out = |number| Some(EncodeError::OutOfRange { number });
    let mut odd = coupling();
    odd.obstacles[0].friction = -0.1;
    assert_eq!(sent(&odd), out("EdgeSurface.friction"));
    let mut odd = coupling();
    odd.set_rate_hz = 0.0;
    assert_eq!(sent(&odd), out("EdgeCoupling.set_rate_hz"));
    let mut odd = coupling();
    odd.obstacles[0].sine = odd.obstacles[0].sine.map(|sine| EdgeSine {
        axis: [1.1, 0.0, 0.0],
        ..sine
    });
    assert_eq!(sent(&odd), out("EdgeSine.axis"));
}

#[test]
fn the_ends_of_a_range_are_in_it() {
    let head = ReleaseHead {
        term: 1 << 61,
        frame: 1 << 61,
        period_us: MAX_PERIOD_US,
        ..ReleaseHead::default()
    };
    let mut bytes = Vec::new();
    assert_eq!(encode_onto(&head, &mut bytes), Ok(()));
    assert_eq!(decode::<ReleaseHead>(&bytes), Ok(head));
}

#[test]
fn nobody_is_waited_for_who_is_not_there() {
    let head = ReleaseHead {
        waited: 0b100,
        members: [1, 2].into_iter().collect(),
        ..ReleaseHead::default()
    };
    let mut bytes = Vec::new();
    assert_eq!(encode_onto(&head, &mut bytes), Ok(()));
    let read = decode::<ReleaseHead>(&bytes);
    assert!(matches!(read, Err(DecodeError::Inconsistent { .. })));
}
