//! Counts to lengths, and the calibration that says where counting began.

use crate::{Geometry, PerString, Pose, STRINGS};

/// Encoder counts to lengths: `length = offset + metres per count * count`.
///
/// Incremental encoders know changes only. The routine: hold the grip at the centre of the frame, not turned (or in any
/// fixture whose pose is known), and calibrate. An error of that placement is an error of every later pose, of the
/// same size, which no residual shows; half a count of quantisation comes with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoders {
    metres_per_count: PerString,
    offsets: PerString,
}

impl Encoders {
    /// Encoders of which `counts` were read with the grip at `frame_from_grip`.
    #[must_use]
    pub fn calibrated(
        geometry: &Geometry,
        frame_from_grip: &Pose,
        counts: &[i32; STRINGS],
    ) -> Self {
        let lengths = geometry.lengths(frame_from_grip);
        let metres_per_count = geometry.metres_per_count;
        Self {
            metres_per_count,
            // A count stands for the middle of its interval.
            offsets: std::array::from_fn(|i| {
                lengths[i] - metres_per_count[i] * (f64::from(counts[i]) + 0.5)
            }),
        }
    }

    /// The lengths at which `counts` were read, m: the middle of each count's interval.
    #[must_use]
    pub fn lengths(&self, counts: &[i32; STRINGS]) -> PerString {
        std::array::from_fn(|i| {
            self.offsets[i] + self.metres_per_count[i] * (f64::from(counts[i]) + 0.5)
        })
    }
}
