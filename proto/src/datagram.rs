//! The payload of a datagram, by kind.

use crate::{
    Confirmation, ConstraintPart, DecodeError, EncodeError, ForceSample, HeadSample, HotState,
    InputSample, Kind, PassedForce, WrenchCommand,
    barrier::{Arrive, Release},
    codec::{decode, encode_into},
    events::EventAck,
    path::PathToken,
    time::{TimeRequest, TimeResponse},
};

/// What a datagram says.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "lives on the stack of the receiving thread, which must not allocate"
)]
pub enum Payload {
    /// State of the workbench.
    Hot(HotState),
    /// "These events I have."
    EventAck(EventAck),
    /// Asks for session time.
    TimeRequest(TimeRequest),
    /// Tells session time.
    TimeResponse(TimeResponse),
    /// A frame is drawn.
    Arrive(Arrive),
    /// A frame is to be shown, the next to be drawn.
    Release(Release),
    /// "Alive."
    Heartbeat,
    /// Device reading.
    Input(InputSample),
    /// Command to the device.
    Wrench(WrenchCommand),
    /// Part of a constraint set.
    Constraints(ConstraintPart),
    /// Where the viewer's head is.
    Head(HeadSample),
    /// Which states the server sent lately.
    Confirm(Confirmation),
    /// "Who is there?"
    PathChallenge(PathToken),
    /// "I am."
    PathResponse(PathToken),
    /// A wrench from outside.
    Force(ForceSample),
    /// The same on its way to the device.
    PassedForce(PassedForce),
}

impl Payload {
    /// Kind that the header names.
    pub fn kind(&self) -> Kind {
        match self {
            Payload::Hot(_) => Kind::Hot,
            Payload::EventAck(_) => Kind::EventAck,
            Payload::TimeRequest(_) => Kind::TimeRequest,
            Payload::TimeResponse(_) => Kind::TimeResponse,
            Payload::Arrive(_) => Kind::Arrive,
            Payload::Release(_) => Kind::Release,
            Payload::Heartbeat => Kind::Heartbeat,
            Payload::Input(_) => Kind::Input,
            Payload::Wrench(_) => Kind::Wrench,
            Payload::Constraints(_) => Kind::Constraints,
            Payload::Head(_) => Kind::Head,
            Payload::Confirm(_) => Kind::Confirm,
            Payload::PathChallenge(_) => Kind::PathChallenge,
            Payload::PathResponse(_) => Kind::PathResponse,
            Payload::Force(_) => Kind::Force,
            Payload::PassedForce(_) => Kind::PassedForce,
        }
    }

    /// Writes the payload to the front of `buffer`, returns the bytes used. No allocation.
    pub fn encode_into(&self, buffer: &mut [u8]) -> Result<usize, EncodeError> {
        match self {
            Payload::Hot(value) => encode_into(value, buffer),
            Payload::EventAck(value) => encode_into(value, buffer),
            Payload::TimeRequest(value) => encode_into(value, buffer),
            Payload::TimeResponse(value) => encode_into(value, buffer),
            Payload::Arrive(value) => encode_into(value, buffer),
            Payload::Release(value) => encode_into(value, buffer),
            Payload::Heartbeat => Ok(0),
            Payload::Input(value) => encode_into(value, buffer),
            Payload::Wrench(value) => encode_into(value, buffer),
            Payload::Constraints(value) => encode_into(value, buffer),
            Payload::Head(value) => encode_into(value, buffer),
            Payload::Force(value) => encode_into(value, buffer),
            Payload::PassedForce(value) => encode_into(value, buffer),
            Payload::Confirm(value) => encode_into(value, buffer),
            Payload::PathChallenge(value) | Payload::PathResponse(value) => {
                encode_into(value, buffer)
            }
        }
    }

    /// Reads the payload of a datagram of `kind`. No allocation.
    pub fn decode(kind: Kind, bytes: &[u8]) -> Result<Payload, DecodeError> {
        Ok(match kind {
            Kind::Hot => Payload::Hot(decode(bytes)?),
            Kind::EventAck => Payload::EventAck(decode(bytes)?),
            Kind::TimeRequest => Payload::TimeRequest(decode(bytes)?),
            Kind::TimeResponse => Payload::TimeResponse(decode(bytes)?),
            Kind::Arrive => Payload::Arrive(decode(bytes)?),
            Kind::Release => Payload::Release(decode(bytes)?),
            Kind::Heartbeat if bytes.is_empty() => Payload::Heartbeat,
            Kind::Heartbeat => return Err(DecodeError::TrailingBytes { left: bytes.len() }),
            Kind::Input => Payload::Input(decode(bytes)?),
            Kind::Wrench => Payload::Wrench(decode(bytes)?),
            Kind::Constraints => Payload::Constraints(decode(bytes)?),
            Kind::Head => Payload::Head(decode(bytes)?),
            Kind::Confirm => Payload::Confirm(decode(bytes)?),
            Kind::PathChallenge => Payload::PathChallenge(decode(bytes)?),
            Kind::PathResponse => Payload::PathResponse(decode(bytes)?),
            Kind::Force => Payload::Force(decode(bytes)?),
            Kind::PassedForce => Payload::PassedForce(decode(bytes)?),
        })
    }
}
