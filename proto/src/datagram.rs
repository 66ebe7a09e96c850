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

/// The kind of each payload but the empty one: the variants are named alike.
macro_rules! payloads {
    ($($kind:ident),* $(,)?) => {
        impl Payload {
            /// Kind that the header names.
            pub fn kind(&self) -> Kind {
                match self {
                    Payload::Heartbeat => Kind::Heartbeat,
                    $( Payload::$kind(_) => Kind::$kind, )*
                }
            }

            /// Writes the payload to the front of `buffer`, returns the bytes used. No allocation.
            pub fn encode_into(&self, buffer: &mut [u8]) -> Result<usize, EncodeError> {
                match self {
                    Payload::Heartbeat => Ok(0),
                    $( Payload::$kind(value) => encode_into(value, buffer), )*
                }
            }

            /// Reads the payload of a datagram of `kind`. No allocation.
            pub fn decode(kind: Kind, bytes: &[u8]) -> Result<Payload, DecodeError> {
                Ok(match kind {
                    Kind::Heartbeat if bytes.is_empty() => Payload::Heartbeat,
                    Kind::Heartbeat => return Err(DecodeError::TrailingBytes { left: bytes.len() }),
                    $( Kind::$kind => Payload::$kind(decode(bytes)?), )*
                })
            }
        }
    };
}
payloads! {
    Hot, EventAck, TimeRequest, TimeResponse, Arrive, Release, Input, Wrench, Constraints, Head, Confirm, PathChallenge, PathResponse,
    Force, PassedForce,
}
