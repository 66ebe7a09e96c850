//! What a tracker says of one sensor: its pose, and if it can its velocity.
//!
//! | field    | bytes | meaning                                                         |
//! |----------|-------|-----------------------------------------------------------------|
//! | sensor   | 4     | number of the sensor, from 0                                    |
//! | filler   | 4     | so that the numbers are aligned; the sensor's number once more  |
//! | position | 3 × 8 | the tracker's unit, by custom metres                            |
//! | rotation | 4 × 8 | quaternion x y z w                                              |
//! | interval | 8     | velocity only: the time in which `rotation` turns it, s         |

use crate::PayloadError;
use crate::message::Fields;

/// The type of a [`PoseReport`].
pub const POSE: &str = "vrpn_Tracker Pos_Quat";
/// The type of a [`VelocityReport`].
pub const VELOCITY: &str = "vrpn_Tracker Velocity";

/// A client asks how the tracker stands in the room.
pub const REQUEST_TO_ROOM: &str = "vrpn_Tracker Request_Tracker_To_Room";
/// The answer: [`to_room`].
pub const TO_ROOM: &str = "vrpn_Tracker To_Room";
/// A client asks where the sensors are on what is tracked.
pub const REQUEST_UNIT_TO_SENSOR: &str = "vrpn_Tracker Request_Unit_To_Sensor";
/// The answer, one for each sensor: [`unit_to_sensor`].
pub const UNIT_TO_SENSOR: &str = "vrpn_Tracker Unit_To_Sensor";

/// Neither moved nor turned: position, then quaternion x y z w.
const NOT_MOVED: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// The payload of [`TO_ROOM`] of a tracker whose poses are those of the room: position and rotation, 56 bytes.
#[must_use]
pub fn to_room() -> Vec<u8> {
    let bytes = NOT_MOVED.iter().flat_map(|number| number.to_be_bytes());
    bytes.collect()
}

/// The payload of [`UNIT_TO_SENSOR`] of a sensor that is itself what is tracked: as a [`PoseReport`].
#[must_use]
pub fn unit_to_sensor(sensor: i32) -> Vec<u8> {
    encoded(sensor, NOT_MOVED.iter(), PoseReport::BYTES)
}

/// Where a sensor is, in the tracker's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseReport {
    /// Which sensor, from 0.
    pub sensor: i32,
    /// In the tracker's unit.
    pub position: [f64; 3],
    /// Quaternion x y z w, as it came: of any norm.
    pub rotation: [f64; 4],
}

/// How fast a sensor moves, in the tracker's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityReport {
    /// Which sensor, from 0.
    pub sensor: i32,
    /// The tracker's unit per second.
    pub linear: [f64; 3],
    /// Quaternion x y z w of the rotation within [`Self::interval`].
    pub rotation: [f64; 4],
    /// s.
    pub interval: f64,
}

impl PoseReport {
    /// Bytes of the payload.
    pub const BYTES: usize = 64;

    /// Reads a payload. The numbers may be anything, NaN included.
    ///
    /// # Errors
    /// [`PayloadError`] where it is shorter than [`Self::BYTES`].
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let mut fields = Fields(payload);
        sensor_and_numbers(&mut fields)
            .map(|(sensor, position, rotation)| Self {
                sensor,
                position,
                rotation,
            })
            .ok_or(PayloadError::of(payload, "tracker pose"))
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let numbers = self.position.iter().chain(&self.rotation);
        encoded(self.sensor, numbers, Self::BYTES)
    }
}

impl VelocityReport {
    /// Bytes of the payload.
    pub const BYTES: usize = 72;

    /// Reads a payload. The numbers may be anything, NaN included.
    ///
    /// # Errors
    /// [`PayloadError`] where it is shorter than [`Self::BYTES`].
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let mut fields = Fields(payload);
        (|| {
            let (sensor, linear, rotation) = sensor_and_numbers(&mut fields)?;
            Some(Self {
                sensor,
                linear,
                rotation,
                interval: fields.f64()?,
            })
        })()
        .ok_or(PayloadError::of(payload, "tracker velocity"))
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let numbers = self.linear.iter().chain(&self.rotation);
        encoded(self.sensor, numbers.chain([&self.interval]), Self::BYTES)
    }
}

fn sensor_and_numbers(fields: &mut Fields<'_>) -> Option<(i32, [f64; 3], [f64; 4])> {
    let sensor = fields.i32()?;
    let _filler = fields.i32()?;
    Some((sensor, fields.f64s()?, fields.f64s()?))
}

fn encoded<'a>(sensor: i32, numbers: impl Iterator<Item = &'a f64>, bytes: usize) -> Vec<u8> {
    let mut payload = Vec::with_capacity(bytes);
    payload.extend_from_slice(&sensor.to_be_bytes());
    payload.extend_from_slice(&sensor.to_be_bytes());
    for number in numbers {
        payload.extend_from_slice(&number.to_be_bytes());
    }
    payload
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn reports_come_back(
            sensor in any::<i32>(),
            linear in any::<[f64; 3]>(),
            rotation in any::<[f64; 4]>(),
            interval in any::<f64>(),
        ) {
            let pose = PoseReport { sensor, position: linear, rotation }.encode();
            let velocity = VelocityReport { sensor, linear, rotation, interval }.encode();
            prop_assert_eq!((pose.len(), velocity.len()), (PoseReport::BYTES, VelocityReport::BYTES));
            // Byte for byte, so that NaN counts as well.
            prop_assert_eq!(PoseReport::decode(&pose).expect("valid").encode(), pose.clone());
            prop_assert_eq!(VelocityReport::decode(&velocity).expect("valid").encode(), velocity.clone());
            prop_assert!(PoseReport::decode(&pose[1..]).is_err());
            prop_assert!(VelocityReport::decode(&velocity[1..]).is_err());
        }
    }
}
