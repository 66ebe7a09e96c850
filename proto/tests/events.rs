//! Codes of events of the device port: kind and amount in 32 bits.

use taut_proto::state::event_code::{BUTTON_DOWN, CONTACT_ON, RESUMED, safety, safety_of};

#[test]
fn a_code_carries_kind_and_thousandths() {
    for kind in 0..=u8::MAX {
        for (value, carried) in [
            (0.0, 0.0),
            (0.021, 0.021),
            (-2.5, 2.5),
            (23.456_4, 23.456),
            (1e9, 65.535),
            (f64::INFINITY, 65.535),
            (f64::NAN, 0.0),
        ] {
            let (found, amount) = safety_of(safety(kind, value)).expect("a code of the port");
            assert_eq!(found, kind);
            assert!((amount - carried).abs() < 1e-12, "{value}: {amount}");
        }
    }
}

#[test]
fn other_codes_are_none_of_the_port() {
    for code in [0, CONTACT_ON, BUTTON_DOWN | 3 << 16, RESUMED, 0x200] {
        assert_eq!(safety_of(code), None);
    }
}
