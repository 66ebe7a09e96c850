//! What a client may do once it is in: the one place where the server asks `taut_proto::role`, for datagrams, control messages, meshes and
//! what is sent. What is not allowed is refused, counted and told.

use super::{LinkEvent, session::Session, shared::Shared};
use crate::framing::CLOSE_PROTOCOL;
use taut_proto::{Act, ControlMessage, Payload};

/// What a client does by a datagram; `None` for what only a server sends.
pub(crate) fn act_of_datagram(payload: &Payload) -> Option<Act> {
    match payload {
        Payload::TimeRequest(_)
        | Payload::Heartbeat
        | Payload::EventAck(_)
        | Payload::PathResponse(_) => Some(Act::KeepPath),
        Payload::Input(_) => Some(Act::GiveInput),
        Payload::Head(_) => Some(Act::GiveHead),
        Payload::Force(_) => Some(Act::GiveForce),
        Payload::Arrive(_) => Some(Act::KeepFrames),
        Payload::Hot(_)
        | Payload::Release(_)
        | Payload::TimeResponse(_)
        | Payload::Wrench(_)
        | Payload::Constraints(_)
        | Payload::PassedForce(_)
        | Payload::Confirm(_)
        | Payload::PathChallenge(_) => None,
    }
}

/// What a client does by a message on its control stream; `None` for what belongs to joining, to a stream of its own, or to a server. A goodbye
/// needs no right.
pub(crate) fn act_of_message(message: &ControlMessage) -> Option<Act> {
    match message {
        ControlMessage::Stats(_) => Some(Act::Report),
        ControlMessage::Log(_) => Some(Act::Log),
        ControlMessage::Arm(_) => Some(Act::Arm),
        ControlMessage::StatesBy(_) | ControlMessage::Bye(_) => Some(Act::KeepPath),
        ControlMessage::Refused(_)
        | ControlMessage::Hello(_)
        | ControlMessage::Welcome(_)
        | ControlMessage::Scene(_)
        | ControlMessage::Coupling(_)
        | ControlMessage::Group(_)
        | ControlMessage::Events(_)
        | ControlMessage::MeshRequest(_)
        | ControlMessage::MeshHeader(_)
        | ControlMessage::PictureRequest(_)
        | ControlMessage::PictureHeader(_)
        | ControlMessage::NoPicture(_) => None,
    }
}

/// Whether `session` may do `act`; if not, that is counted, and told the first time.
pub(crate) fn permits(shared: &Shared, session: &Session, act: Act) -> bool {
    if session.role.may(act) {
        return true;
    }
    shared.counters.forbidden.one();
    if session.rights.note_forbidden(act) {
        shared.tell(LinkEvent::Forbidden {
            node: session.node.clone(),
            role: session.role,
            act,
        });
    }
    false
}

/// The same on the reliable plane, where a client that tries is sent away with the reason: `Err` is why.
pub(crate) fn demand(shared: &Shared, session: &Session, act: Act) -> Result<(), String> {
    if permits(shared, session, act) {
        return Ok(());
    }
    let reason = format!("a client of the role {} may not {act}", session.role);
    session.connection.close(CLOSE_PROTOCOL, reason.as_bytes());
    Err(reason)
}
