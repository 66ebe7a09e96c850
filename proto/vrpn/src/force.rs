//! What a force device says: the force on the hand, and its surface contact point.
//!
//! | message   | field    | bytes | meaning                                            |
//! |-----------|----------|-------|----------------------------------------------------|
//! | [`FORCE`] | force    | 3 × 8 | N, the axes of the device's tracker                |
//! | [`SCP`]   | position | 3 × 8 | where the surface holds the tool back, the tracker's unit |
//! | [`SCP`]   | rotation | 4 × 8 | quaternion x y z w                                 |

use crate::PayloadError;
use crate::message::Fields;

/// Name of the force's type.
pub const FORCE: &str = "vrpn_ForceDevice Force";
/// Name of the surface contact point's type.
pub const SCP: &str = "vrpn_ForceDevice SCP";

/// The force that the user feels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceReport {
    /// N, the tracker's axes.
    pub force: [f64; 3],
}

/// Where the surface holds the tool back: the pose of a god-object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceContactReport {
    /// In the tracker's unit and axes.
    pub position: [f64; 3],
    /// Quaternion x y z w.
    pub rotation: [f64; 4],
}

impl ForceReport {
    /// Reads a payload.
    ///
    /// # Errors
    /// [`PayloadError`] where it is too short.
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let force = Fields(payload).f64s();
        let force = force.ok_or(PayloadError::of(payload, "force"))?;
        Ok(Self { force })
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        self.force.iter().flat_map(|n| n.to_be_bytes()).collect()
    }
}

impl SurfaceContactReport {
    /// Reads a payload.
    ///
    /// # Errors
    /// [`PayloadError`] where it is too short.
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let mut fields = Fields(payload);
        match (fields.f64s(), fields.f64s()) {
            (Some(position), Some(rotation)) => Ok(Self { position, rotation }),
            _ => Err(PayloadError::of(payload, "surface contact point")),
        }
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let numbers = self.position.iter().chain(&self.rotation);
        numbers.flat_map(|n| n.to_be_bytes()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_and_contact_points_come_back_and_short_ones_are_errors() {
        let force = ForceReport {
            force: [1.0, -2.5, 1e-3],
        };
        assert_eq!(ForceReport::decode(&force.encode()), Ok(force));
        assert!(ForceReport::decode(&force.encode()[..23]).is_err());
        let point = SurfaceContactReport {
            position: [0.1, 0.2, 0.3],
            rotation: [0.0, 0.6, 0.0, 0.8],
        };
        assert_eq!(SurfaceContactReport::decode(&point.encode()), Ok(point));
        assert!(SurfaceContactReport::decode(&point.encode()[..55]).is_err());
    }
}
