//! The HID reports of a 3Dconnexion SpaceMouse: bytes to counts.
//!
//! | first byte | bytes after it | meaning                                                          |
//! |------------|----------------|------------------------------------------------------------------|
//! | 1          | 6              | translation: three i16, little-endian, counts                    |
//! | 1          | 12             | translation, then rotation: the wireless Pro and later           |
//! | 2          | 6              | rotation                                                         |
//! | 3          | 2 to 6         | buttons: a bit each, the first in the lowest bit                 |
//! | others     |                | such as 0x17, the battery: not looked at                         |
//!
//! The cap's own axes are x to the right, y towards the user, z down. Full deflection is about 350 counts, on some up to 500.
//!
//! Sources: the drivers of VRPN (`vrpn_3DConnexion`) and of the free spacenav project, captures of a SpaceNavigator in
//! public notes. No such device was at hand: the axes' signs of rotation are those of right-handed turns about the
//! cap's axes, which these drivers agree on.

use nalgebra::{Vector3, Vector6};
use taut_plant::stack;

/// Counts that count as full deflection.
const FULL_DEFLECTION: f64 = 350.0;

fn counts(bytes: &[u8]) -> Option<[i16; 3]> {
    let (x, rest) = bytes.split_first_chunk()?;
    let (y, rest) = rest.split_first_chunk()?;
    let (z, _) = rest.split_first_chunk()?;
    Some([x, y, z].map(|count| i16::from_le_bytes(*count)))
}

/// What the reports so far add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CapState {
    /// Counts, the cap's own axes.
    translation: [i16; 3],
    rotation: [i16; 3],
    /// A bit per button, bit 0 the first.
    pub(super) buttons: u64,
}

impl CapState {
    /// Takes a report in, its number first: whether it says how far the cap is deflected. One that is too short changes nothing, and is `None`.
    pub fn take(&mut self, report: &[u8]) -> Option<bool> {
        let (number, rest) = report.split_first()?;
        match number {
            1 => {
                self.translation = counts(rest)?;
                self.rotation = counts(&rest[6..]).unwrap_or(self.rotation);
            }
            2 => self.rotation = counts(rest)?,
            3 if rest.is_empty() => return None,
            3 => {
                let mut bits = [0; 8];
                let known = rest.len().min(bits.len());
                bits[..known].copy_from_slice(&rest[..known]);
                self.buttons = u64::from_le_bytes(bits);
            }
            _ => {}
        }
        Some(matches!(number, 1 | 2))
    }

    /// Displacement over the largest, [-1, 1] per axis, linear then angular: x right, y away from the user, z up.
    #[must_use]
    pub fn deflection(&self) -> Vector6<f64> {
        // From the cap's axes half a turn about x: y away, z up; a rotation, so that rotations turn along.
        let upright = |counts: [i16; 3]| {
            let [x, y, z] = counts.map(|count| f64::from(count) / FULL_DEFLECTION);
            Vector3::new(x, -y, -z).map(|u| u.clamp(-1.0, 1.0))
        };
        stack(&upright(self.translation), &upright(self.rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Of a cap that has said something before.
    const BEFORE: CapState = CapState {
        translation: [7, 8, 9],
        rotation: [10, 11, 12],
        buttons: 0x10,
    };

    /// A SpaceNavigator's own bytes, from public captures (tilt about its second axis; buttons), and reports of the same form by hand.
    #[test]
    fn reports_are_read_as_the_devices_send_them() {
        let moved = |translation| CapState {
            translation,
            ..BEFORE
        };
        let pressed = |buttons| CapState { buttons, ..BEFORE };
        let turned = CapState {
            rotation: [0, -30, 0],
            ..BEFORE
        };
        let both = CapState {
            translation: [1, 2, 3],
            rotation: [4, -5, 6],
            ..BEFORE
        };
        for (bytes, after, is_motion) in [
            (&b"\x01\0\0\0\0\0\0"[..], moved([0; 3]), true),
            (b"\x02\0\0\xe2\xff\0\0", turned, true),
            (b"\x03\x01\0", pressed(1), false),
            (b"\x03\x03\0", pressed(3), false),
            (b"\x01\x5e\x01\xa2\xfe\x0a\0", moved([350, -350, 10]), true),
            (b"\x01\x01\0\x02\0\x03\0\x04\0\xfb\xff\x06\0", both, true),
            (b"\x03\0\0\0\x80", pressed(1 << 31), false),
            (b"\x17\x64", BEFORE, false),
        ] {
            let mut cap = BEFORE;
            assert_eq!(cap.take(bytes), Some(is_motion), "{bytes:?}");
            assert_eq!(cap, after, "{bytes:?}");
        }
    }

    #[test]
    fn short_reports_are_refused() {
        for bytes in [
            &b""[..],
            b"\x01",
            b"\x01\0\0\0\0\0",
            b"\x02\0\0\0\0\0",
            b"\x03",
        ] {
            let mut cap = BEFORE;
            assert_eq!((cap.take(bytes), cap), (None, BEFORE), "{bytes:?}");
        }
    }

    #[test]
    fn the_workbench_s_axes_are_right_away_and_up() {
        // Pushed to the right, away from the user and pulled up; turned clockwise as seen from above.
        let cap = CapState {
            translation: [350, -175, -700],
            rotation: [0, 0, 350],
            buttons: 0,
        };
        assert_eq!(
            cap.deflection(),
            Vector6::new(1.0, 0.5, 1.0, -0.0, -0.0, -1.0)
        );
    }

    proptest! {
        #[test]
        fn no_bytes_break_it_and_no_counts_leave_the_range(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            let mut cap = CapState::default();
            let _ = cap.take(&bytes);
            prop_assert!(cap.deflection().amax() <= 1.0);
        }

        #[test]
        fn counts_come_back(translation in any::<[i16; 3]>(), rotation in any::<[i16; 3]>()) {
            let bytes = |number: u8, counts: &[i16]| -> Vec<u8> {
                std::iter::once(number).chain(counts.iter().flat_map(|c| c.to_le_bytes())).collect()
            };
            let wanted = CapState { translation, rotation, ..BEFORE };
            let both = bytes(1, &[translation, rotation].concat());
            let (first, then) = (bytes(1, &translation), bytes(2, &rotation));
            for reports in [vec![both], vec![first, then]] {
                let mut cap = BEFORE;
                prop_assert!(reports.iter().all(|report| cap.take(report) == Some(true)));
                prop_assert_eq!(cap, wanted);
            }
        }
    }
}
