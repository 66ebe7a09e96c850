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
pub(crate) const FULL_DEFLECTION: f64 = 350.0;

/// One report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// The cap's displacement, counts, its own axes.
    Translation([i16; 3]),
    /// The cap's rotation.
    Rotation([i16; 3]),
    /// Both at once.
    Motion {
        /// As in [`Self::Translation`].
        translation: [i16; 3],
        /// As in [`Self::Rotation`].
        rotation: [i16; 3],
    },
    /// All buttons, bit 0 the first.
    Buttons(u64),
    /// One that has nothing to say here.
    Other(u8),
}

impl Report {
    /// Reads one report, its number first.
    ///
    /// # Errors
    /// [`ShortReport`].
    pub fn parse(bytes: &[u8]) -> Result<Self, ShortReport> {
        let short = ShortReport { bytes: bytes.len() };
        let (number, rest) = bytes.split_first().ok_or(short)?;
        match number {
            1 => {
                let translation = counts(rest).ok_or(short)?;
                Ok(match counts(&rest[6..]) {
                    Some(rotation) => Report::Motion {
                        translation,
                        rotation,
                    },
                    None => Report::Translation(translation),
                })
            }
            2 => counts(rest).map(Report::Rotation).ok_or(short),
            3 if rest.is_empty() => Err(short),
            3 => {
                let mut bits = [0; 8];
                let known = rest.len().min(bits.len());
                bits[..known].copy_from_slice(&rest[..known]);
                Ok(Report::Buttons(u64::from_le_bytes(bits)))
            }
            other => Ok(Report::Other(*other)),
        }
    }

    /// Whether it says how far the cap is deflected.
    pub(super) fn is_motion(&self) -> bool {
        matches!(
            self,
            Report::Translation(_) | Report::Rotation(_) | Report::Motion { .. }
        )
    }
}

/// A report that is shorter than its first byte says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a HID report of {bytes} bytes is too short; is this device a SpaceMouse?")]
pub struct ShortReport {
    /// Bytes that came, the first one included.
    pub bytes: usize,
}

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
    pub translation: [i16; 3],
    /// Counts, the cap's own axes.
    pub rotation: [i16; 3],
    /// A bit per button.
    pub buttons: u64,
}

impl CapState {
    /// Takes a report in.
    pub fn take(&mut self, report: &Report) {
        match *report {
            Report::Translation(counts) => self.translation = counts,
            Report::Rotation(counts) => self.rotation = counts,
            Report::Motion {
                translation,
                rotation,
            } => (self.translation, self.rotation) = (translation, rotation),
            Report::Buttons(bits) => self.buttons = bits,
            Report::Other(_) => {}
        }
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

    /// A SpaceNavigator's own bytes, from public captures (tilt about its second axis; buttons), and reports of the same form by hand.
    #[test]
    fn reports_are_read_as_the_devices_send_them() {
        for (bytes, report) in [
            (&b"\x01\0\0\0\0\0\0"[..], Report::Translation([0; 3])),
            (b"\x02\0\0\xe2\xff\0\0", Report::Rotation([0, -30, 0])),
            (b"\x03\x01\0", Report::Buttons(1)),
            (b"\x03\x03\0", Report::Buttons(3)),
            (
                b"\x01\x5e\x01\xa2\xfe\x0a\0",
                Report::Translation([350, -350, 10]),
            ),
            (
                b"\x01\x01\0\x02\0\x03\0\x04\0\xfb\xff\x06\0",
                Report::Motion {
                    translation: [1, 2, 3],
                    rotation: [4, -5, 6],
                },
            ),
            (b"\x03\0\0\0\x80", Report::Buttons(1 << 31)),
            (b"\x17\x64", Report::Other(0x17)),
        ] {
            assert_eq!(Report::parse(bytes), Ok(report), "{bytes:?}");
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
            assert_eq!(
                Report::parse(bytes),
                Err(ShortReport { bytes: bytes.len() })
            );
        }
    }

    #[test]
    fn the_workbench_s_axes_are_right_away_and_up() {
        let mut cap = CapState::default();
        // Pushed to the right, away from the user and pulled up; turned clockwise as seen from above.
        cap.take(&Report::Translation([350, -175, -700]));
        cap.take(&Report::Rotation([0, 0, 350]));
        assert_eq!(
            cap.deflection(),
            Vector6::new(1.0, 0.5, 1.0, -0.0, -0.0, -1.0)
        );
    }

    proptest! {
        #[test]
        fn no_bytes_break_it_and_no_counts_leave_the_range(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            let mut cap = CapState::default();
            if let Ok(report) = Report::parse(&bytes) {
                cap.take(&report);
            }
            prop_assert!(cap.deflection().amax() <= 1.0);
        }

        #[test]
        fn counts_come_back(translation in any::<[i16; 3]>(), rotation in any::<[i16; 3]>()) {
            let bytes = |number: u8, counts: &[i16]| -> Vec<u8> {
                std::iter::once(number).chain(counts.iter().flat_map(|c| c.to_le_bytes())).collect()
            };
            let both = [translation, rotation].concat();
            prop_assert_eq!(Report::parse(&bytes(1, &translation)), Ok(Report::Translation(translation)));
            prop_assert_eq!(Report::parse(&bytes(2, &rotation)), Ok(Report::Rotation(rotation)));
            prop_assert_eq!(Report::parse(&bytes(1, &both)), Ok(Report::Motion { translation, rotation }));
        }
    }
}
