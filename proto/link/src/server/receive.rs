//! What clients send on the hot plane: time requests, signs of life, device readings. From the UDP thread and from QUIC datagrams.

use super::{DeviceInput, device_input::Taken, session::Session, shared::Shared};
use crate::readiness::wait_readable;
use std::{
    net::SocketAddr,
    sync::{Arc, atomic::Ordering},
    time::Duration,
};
use taut_proto::{
    DecodeError, Header, Payload, Role, header::MAX_DATAGRAM_BYTES, seal::OpenError,
    time::TimeResponse,
};

/// Longest sleep of the receiving thread: how soon it notices that the server stops.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// Body of the UDP receiving thread; ends when the server stops.
pub(crate) fn run_udp(shared: &Arc<Shared>) {
    let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
    while !shared.stopping.load(Ordering::Relaxed) {
        match shared.udp.recv_from(&mut buffer) {
            Ok((length, from)) => {
                let now_ns = shared.clock.now_ns();
                receive_udp(shared, &buffer[..length], from, now_ns);
            }
            // Nothing there, or an earlier datagram bounced (a client that is gone): both are soft.
            Err(_) => wait_readable(&shared.udp, STOP_CHECK),
        }
    }
}

fn receive_udp(shared: &Shared, datagram: &[u8], from: SocketAddr, now_ns: u64) {
    let header = match Header::parse(datagram) {
        Ok(header) => header,
        Err(error) => return count_bad_header(shared, error),
    };
    match shared.sessions.by_number(header.sender) {
        Some(session) => receive(shared, &session, datagram, Some(from), now_ns),
        None => shared.counters.forged.one(),
    }
}

/// Takes one datagram of `session` in, or counts why not. What is not authentic has no effect.
pub(crate) fn receive(
    shared: &Shared,
    session: &Session,
    datagram: &[u8],
    from: Option<SocketAddr>,
    now_ns: u64,
) {
    let counters = &shared.counters;
    let opened = match session.open(datagram, from, now_ns) {
        Ok(opened) => opened,
        Err(OpenError::Header(error)) => return count_bad_header(shared, error),
        // A group key proves a member, not this one: nothing under it is opened here.
        Err(OpenError::Forged | OpenError::Misplaced) => return counters.forged.one(),
        Err(OpenError::Replayed) => return counters.replayed.one(),
        Err(OpenError::Payload(_)) => return counters.garbage.one(),
    };
    counters.packets_received.one();
    match opened.payload {
        Payload::TimeRequest(request) => {
            session.send(
                &Payload::TimeResponse(TimeResponse {
                    client_sent: request.client_sent,
                    server_received: now_ns,
                    server_sent: shared.clock.now_ns(),
                }),
                shared,
            );
        }
        Payload::Heartbeat => {}
        Payload::Arrive(arrive) if session.role == Role::Render => {
            if let Some(frames) = &shared.frames {
                frames.arrive(session, &arrive, now_ns, shared);
            }
        }
        Payload::Input(sample) if session.role == Role::Device => {
            let input = DeviceInput {
                sample,
                received_ns: now_ns,
                session: session.number,
            };
            match shared.inputs.offer(input) {
                Taken::Newest => counters.inputs.one(),
                Taken::Overtaken => counters.inputs_late.one(),
                Taken::NoPose => counters.inputs_refused.one(),
            }
        }
        Payload::Input(_) => counters.inputs_refused.one(),
        // A client has no business sending these.
        Payload::Hot(_)
        | Payload::Arrive(_)
        | Payload::Release(_)
        | Payload::TimeResponse(_)
        | Payload::Wrench(_)
        | Payload::Constraints(_) => counters.garbage.one(),
    }
}

fn count_bad_header(shared: &Shared, error: DecodeError) {
    match error {
        DecodeError::WrongVersion { .. } => shared.counters.wrong_version.one(),
        _ => shared.counters.garbage.one(),
    }
}
