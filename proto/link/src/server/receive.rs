//! What clients send on the hot plane: time requests, signs of life, readings of device and head. From the UDP thread and from QUIC datagrams.
//!
//! Before any cryptography: the header must be ours, its epoch this server's and its sender a session; a datagram from elsewhere than where
//! that session is known to be counts against the rate of its source and of all unknown sources together. After it: the session's own rate.

use super::{
    force_input::TakenForce,
    gate::{act_of_datagram, permits},
    readings::{Reading, Taken},
    session::Session,
    shared::Shared,
};
use crate::{lock::lock, readiness::wait_readable};
use std::{net::SocketAddr, sync::Arc, time::Duration};
use taut_proto::{
    Act, DecodeError, Header, Payload,
    header::MAX_DATAGRAM_BYTES,
    seal::OpenError,
    time::{TimeRequest, TimeResponse},
};

/// Longest sleep of the receiving thread: how soon it notices that the server stops.
const STOP_CHECK: Duration = Duration::from_millis(50);

/// Body of the UDP receiving thread; ends when the server stops.
pub(crate) fn run_udp(shared: &Arc<Shared>) {
    let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
    while !shared.is_stopping() {
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
    if !shared.versions.contains(header.version) {
        return shared.counters.wrong_version.one();
    }
    if header.epoch != shared.epoch {
        return shared.counters.forged.one();
    }
    let Some(session) = shared.sessions.by_number(header.sender) else {
        return shared.counters.forged.one();
    };
    if !session.is_at(from) && !lock(&shared.unknown).admit(from, now_ns) {
        return shared.counters.flooded.one();
    }
    receive(shared, &session, datagram, Some(from), now_ns);
}

/// Takes one datagram of `session` in, or counts why not. What is not authentic has no effect.
pub(crate) fn receive(
    shared: &Shared,
    session: &Arc<Session>,
    datagram: &[u8],
    from: Option<SocketAddr>,
    now_ns: u64,
) {
    let counters = &shared.counters;
    let known_at = session.udp_address();
    let (opened, challenge) = match session.open(datagram, from, now_ns) {
        Ok(opened) => opened,
        Err(OpenError::Header(error)) => return count_bad_header(shared, error),
        // A group key proves a member, not this one: nothing under it is opened here.
        Err(OpenError::Forged | OpenError::Misplaced) => return counters.forged.one(),
        Err(OpenError::Replayed) => return counters.replayed.one(),
        Err(OpenError::Payload(_)) => {
            // Its seal was good: a source of forces that says what is no wrench is stopped, not only overheard.
            if session.role.may(Act::GiveForce) {
                shared.forces.spoil(session.number, now_ns);
                counters.forces_refused.one();
            }
            return counters.garbage.one();
        }
    };
    // Only what is authentic counts against a session's rate: nobody else can use it up by naming its address.
    if !session.rights.take_datagram(now_ns) {
        return counters.flooded.one();
    }
    counters.packets_received.one();
    match (challenge, from) {
        (Some(token), Some(from)) => session.challenge(token, from, shared),
        // Its first path, from where its control plane comes.
        (None, Some(from)) if known_at.is_none() && session.is_at(from) => {
            shared.device_paths.moved(session, from, shared);
        }
        _ => {}
    }
    let Some(act) = act_of_datagram(&opened.payload) else {
        return counters.garbage.one(); // a client has no business sending these
    };
    if !permits(shared, session, act) {
        if act == Act::GiveInput {
            counters.inputs_refused.one();
        }
        return;
    }
    take(shared, session, opened.payload, from, now_ns);
}

/// Does what a datagram asks for that `session` may send.
fn take(
    shared: &Shared,
    session: &Arc<Session>,
    payload: Payload,
    from: Option<SocketAddr>,
    now_ns: u64,
) {
    let counters = &shared.counters;
    match payload {
        Payload::TimeRequest(request) => tell_time(shared, session, request, now_ns),
        Payload::Arrive(arrive) => {
            if let Some(frames) = &shared.frames {
                frames.arrive(session, &arrive, now_ns, shared);
            }
        }
        Payload::EventAck(ack) => match shared.discrete.has_told(ack.newest) {
            true => session.acknowledge(ack.newest),
            // Of an event that there was not: it would end what is repeated for the others.
            false => counters.garbage.one(),
        },
        Payload::PathResponse(answer) => {
            if let Some(from) = from
                && session.take_answer(from, answer)
            {
                tracing::info!(node = session.node, "client receives at {from} now");
                shared.device_paths.moved(session, from, shared);
            }
        }
        Payload::Input(sample) => {
            let reading = reading_of(session, sample, now_ns);
            match shared.inputs.offer(reading, sample.index, &sample.pose) {
                Taken::Newest => counters.inputs.one(),
                Taken::Overtaken => counters.inputs_late.one(),
                Taken::NoPose => counters.inputs_refused.one(),
            }
        }
        Payload::Head(sample) => {
            let reading = reading_of(session, sample, now_ns);
            match shared.heads.offer(reading, sample.index, &sample.pose) {
                Taken::Newest => counters.heads.one(),
                Taken::Overtaken | Taken::NoPose => counters.heads_refused.one(),
            }
        }
        Payload::Force(sample) => match shared.forces.offer(sample, session.number, now_ns) {
            TakenForce::Newest { lost } => {
                counters.forces.one();
                counters.forces_lost.add(lost);
            }
            TakenForce::Overtaken => counters.forces_refused.one(),
        },
        Payload::Heartbeat
        | Payload::Hot(_)
        | Payload::Release(_)
        | Payload::TimeResponse(_)
        | Payload::Wrench(_)
        | Payload::Constraints(_)
        | Payload::PassedForce(_)
        | Payload::Confirm(_)
        | Payload::PathChallenge(_) => {}
    }
}

fn reading_of<S>(session: &Session, sample: S, now_ns: u64) -> Reading<S> {
    Reading {
        sample,
        received_ns: now_ns,
        session: session.number,
    }
}

fn tell_time(shared: &Shared, session: &Arc<Session>, request: TimeRequest, now_ns: u64) {
    session.roll_keys(now_ns); // twenty times a second are often enough
    session.send(
        &Payload::TimeResponse(TimeResponse {
            client_sent: request.client_sent,
            server_received: now_ns,
            server_sent: shared.clock.now_ns(),
        }),
        shared,
    );
    // Who hears the group is told what was really sent to it.
    if session.may_listen() && shared.group.is_wanted() {
        let confirmation = shared.sent_states.lately(request.client_sent);
        session.send(&Payload::Confirm(confirmation), shared);
    }
}

fn count_bad_header(shared: &Shared, error: DecodeError) {
    match error {
        DecodeError::WrongVersion { .. } => shared.counters.wrong_version.one(),
        _ => shared.counters.garbage.one(),
    }
}
