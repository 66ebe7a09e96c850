//! How a client gets in, and its control plane while it is in.

use super::{
    LinkEvent, downstream,
    gate::{act_of_message, demand},
    joining::{Joining, Lost},
    receive::receive,
    session::{Admitted, Session},
    shared::{Admission, Refused, Shared},
};
use crate::{
    binding,
    framing::{
        CLOSE_BYE, CLOSE_PROTOCOL, CLOSE_REFUSED, CLOSE_REPLACED, ReadMessageError, close_text,
        read_message, read_whole_message, write_frame, write_message,
    },
    lock::lock,
};
use quinn::{Connection, RecvStream, SendStream};
use std::{sync::Arc, time::Duration};
use taut_proto::{
    Act, DecodeError, Refusal, Role, Transport, Untrusted, VersionRange,
    control::{
        ControlMessage, Hello, MAX_FRAME_BYTES, MAX_NODE_NAME_BYTES, MeshHeader, RefusalCode,
        Welcome,
    },
    membership::Pace,
    proof::{Claim, Grant, JoinSecret},
    revocation::{JoinPolicy, ShutOut},
};
use tokio::time::{sleep, timeout};

/// Time for a client to join.
const JOIN_TIMEOUT: Duration = Duration::from_secs(3);
/// Time for a refused client to read why.
const REFUSAL_TIMEOUT: Duration = Duration::from_millis(500);
/// Reports and log lines of a client that are read per second, and after a pause at once. A node reports once a second; a bridge in trouble
/// logs some dozen lines.
const MESSAGES_PER_SECOND: u64 = 100;
/// See [`MESSAGES_PER_SECOND`].
const MESSAGE_BURST: u64 = 256;
/// Time for one of these to come, once it has begun.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(3);
/// Priority of a mesh's stream, below that of control, which has 0.
const MESH_PRIORITY: i32 = -1;
/// Bytes of a mesh that are written at a time: 1 ms at the pace of all meshes.
const MESH_CHUNK_BYTES: usize = 64 << 10;
/// Time for a client to take one of these.
const STALL_TIMEOUT: Duration = Duration::from_secs(10);
/// Most bytes of a Hello: nobody has proven anything yet.
const MAX_HELLO_BYTES: usize = 1024;

/// Lets clients in until the endpoint closes.
///
/// An address first proves that it receives what is sent to it (QUIC Retry), and counts for the limits from then on: whoever names the addresses of
/// others uses up nothing of theirs.
pub(crate) async fn run(shared: Arc<Shared>, endpoint: quinn::Endpoint) {
    while let Some(incoming) = endpoint.accept().await {
        if !incoming.remote_address_validated() {
            shared.counters.address_checks.one();
            let _ = incoming.retry(); // fails only for an address that has proven itself
            continue;
        }
        let Some((attempt, lost)) = Joining::begin(&shared, incoming.remote_address().ip()) else {
            shared.counters.turned_away.one();
            shared.counters.refused.one();
            incoming.refuse();
            continue;
        };
        let shared = shared.clone();
        tokio::spawn(async move {
            if let Some((entry, send, recv)) = joined(&shared, incoming, attempt, lost).await {
                attend(&shared, entry, send, recv).await;
            }
        });
    }
}

/// A client on the list; dropped, it is off it again. So a join that is given up on the way leaves no session behind.
struct Entry {
    shared: Arc<Shared>,
    session: Arc<Session>,
}

impl Drop for Entry {
    fn drop(&mut self) {
        self.shared.sessions.remove(self.session.number);
    }
}

/// Lets a client join within its time, and while nobody has taken its place.
async fn joined(
    shared: &Arc<Shared>,
    incoming: quinn::Incoming,
    attempt: Joining,
    lost: Lost,
) -> Option<(Entry, SendStream, RecvStream)> {
    tokio::select! {
        biased;
        joined = timeout(JOIN_TIMEOUT, join(shared, incoming, attempt)) => joined.ok().flatten(),
        Err(_) = lost => None,
    }
}

/// Hello to Welcome; `None` if the client is not let in.
async fn join(
    shared: &Arc<Shared>,
    incoming: quinn::Incoming,
    mut attempt: Joining,
) -> Option<(Entry, SendStream, RecvStream)> {
    let connection = incoming.await.ok()?;
    let (mut send, mut recv) = connection.accept_bi().await.ok()?;
    let mut node = Untrusted::default();
    let outcome = match read_message(&mut recv, MAX_HELLO_BYTES, shared.versions).await {
        Ok(ControlMessage::Hello(hello)) => {
            node.clone_from(&hello.node);
            admit(shared, &connection, hello, &mut attempt)
        }
        Ok(other) => Err((
            RefusalCode::BadHello,
            format!("its first message is {}, not Hello", other.name()),
        )),
        Err(ReadMessageError::Decode(error @ DecodeError::WrongVersion { .. })) => {
            shared.counters.wrong_version.one();
            Err((RefusalCode::WrongVersion, error.to_string()))
        }
        Err(error) => Err((RefusalCode::BadHello, error.to_string())),
    };
    let (session, welcome) = match outcome {
        Ok(admitted) => admitted,
        Err((code, text)) => {
            if code == RefusalCode::WrongKey {
                attempt.wrong_proof();
            }
            drop(attempt); // it is over for the limits before the client has read why
            refuse(shared, &connection, send, node, code, text).await;
            return None;
        }
    };
    let entry = Entry {
        shared: shared.clone(),
        session,
    };
    let (session, version) = (&entry.session, entry.session.version);
    let welcome = ControlMessage::Welcome(welcome);
    write_message(&mut send, &welcome, version).await.ok()?;
    let content = &shared.content;
    write_frame(&mut send, &content.scene, version).await.ok()?;
    if session.role.may(Act::GetWrenches) {
        write_frame(&mut send, &content.coupling, version)
            .await
            .ok()?;
    }
    Some((entry, send, recv))
}

fn claim_of(hello: &Hello) -> Claim<'_> {
    Claim {
        role: hello.role,
        node: hello.node.raw(),
        grant: hello.grant,
    }
}

/// The secret that the client has proven, and whether it is of the second cluster key.
fn proven_secret(shared: &Shared, hello: &Hello, binding: &[u8; 32]) -> Option<(JoinSecret, bool)> {
    let claim = claim_of(hello);
    let also = shared.also.as_ref().filter(|also| also.counts());
    let keys = [Some(&shared.key), also.map(|also| &also.key)];
    keys.into_iter()
        .flatten()
        .map(|key| key.join_secret(claim.role, claim.node, claim.grant))
        .zip([false, true])
        .find(|(secret, _)| secret.verify_client(&hello.proof, binding, claim))
}

fn check_name(node: &Untrusted) -> Result<(), Refused> {
    let name = node.raw();
    if name.trim().is_empty() || name.len() > MAX_NODE_NAME_BYTES || !node.is_printable() {
        let text = format!(
            "a node's name has 1 to {MAX_NODE_NAME_BYTES} printable bytes: choose another (--node)"
        );
        return Err((RefusalCode::BadHello, text));
    }
    Ok(())
}

/// Refuses whom the workbench does not let in, and who would take a screen's name.
fn check_rules(shared: &Shared, policy: &JoinPolicy, hello: &Hello) -> Result<(), Refused> {
    let name = hello.node.raw();
    policy.check(claim_of(hello)).map_err(|shut_out| {
        shared.counters.shut_out.one();
        let code = match shut_out {
            ShutOut::Role(_) => RefusalCode::RoleClosed,
            ShutOut::Revoked(_) => RefusalCode::Revoked,
        };
        (code, shut_out.to_string())
    })?;
    // Who may choose his name must not take a screen's.
    let is_any_node = matches!(hello.grant, Grant::AnyNode { .. });
    if is_any_node
        && hello.role != Role::Render
        && shared.content.nodes.iter().any(|node| node == name)
    {
        let text = format!(
            "\"{}\" is a render node of the workbench: choose another name (--node)",
            hello.node
        );
        return Err((RefusalCode::NameTaken, text));
    }
    Ok(())
}

/// Checks a Hello and makes the session.
fn admit(
    shared: &Arc<Shared>,
    connection: &Connection,
    hello: Hello,
    attempt: &mut Joining,
) -> Result<(Arc<Session>, Welcome), Refused> {
    let bad = |text: String| (RefusalCode::BadHello, text);
    let binding = binding::proof_binding(connection).map_err(|error| bad(error.to_string()))?;
    let claim = claim_of(&hello);
    let Some((secret, by_also_key)) = proven_secret(shared, &hello, &binding) else {
        shared.counters.wrong_key.one();
        let text = "its secret is not one of this workbench: its cluster key or credential (--key) is damaged or forged, make it again with `taut keys`";
        return Err((RefusalCode::WrongKey, text.to_owned()));
    };
    if !attempt.proven() {
        return Err(bad("it came too late among many: try again".to_owned()));
    }
    // From here on the name is one that may be shown, whatever it is part of.
    check_name(&hello.node)?;
    let Some(version) = shared.versions.highest_common(hello.versions) else {
        return Err(bad("it speaks no version that is spoken here".to_owned())); // told when it was read
    };
    // Held until the session is there: a revocation meanwhile waits, and then finds it.
    let policy = lock(&shared.policy);
    check_rules(shared, &policy, &hello)?;
    let name = hello.node.raw();
    let now_ns = shared.clock.now_ns();
    let Admission { session, replaced } =
        shared.sessions.admit(name, hello.role, now_ns, |number| {
            let keys = binding::hot_keys(connection, version, shared.epoch, number, true)
                .map_err(|error| error.to_string())?;
            let admitted = Admitted {
                number,
                node: name.to_owned(),
                role: hello.role,
                grant: hello.grant,
                transport: hello.transport,
                rate_hz: hello.rate_hz,
                joined_ns: now_ns,
                after_event: shared.discrete.newest(),
                version,
                is_newest: version == shared.versions.max(),
                by_also_key,
                offers: hello.offers,
            };
            Ok(Session::new(admitted, connection.clone(), keys))
        })?;
    if let Some(old) = replaced {
        let reason = format!(
            "a new node named \"{}\" took the place of this silent one",
            old.node
        );
        old.connection.close(CLOSE_REPLACED, reason.as_bytes());
        shared.tell_left(&old, reason);
    }
    let welcome = Welcome {
        version,
        proof: secret.server_proof(&binding, claim),
        session: session.number,
        epoch: shared.epoch,
        udp_port: shared.udp_port,
        session_time_ns: now_ns,
        node_timeout_ms: shared.node_timeout_ms,
    };
    Ok((session, welcome))
}

async fn refuse(
    shared: &Shared,
    connection: &Connection,
    mut send: SendStream,
    node: Untrusted,
    code: RefusalCode,
    text: String,
) {
    shared.counters.refused.one();
    tracing::info!(address = %connection.remote_address(), %node, ?code, "client refused: {text}");
    let refusal = Refusal {
        code,
        version: shared.versions.max(),
        text: text.as_str().into(),
    };
    shared.tell(LinkEvent::Refused {
        address: connection.remote_address(),
        node,
        code,
        text: text.clone(),
    });
    let refusal_sent = async {
        let version = refusal.version;
        if write_message(&mut send, &ControlMessage::Refused(refusal), version)
            .await
            .is_ok()
            && send.finish().is_ok()
        {
            connection.closed().await; // the client closes when it has read why
        }
    };
    if timeout(REFUSAL_TIMEOUT, refusal_sent).await.is_err() {
        tracing::debug!("a refused client did not close");
    }
    connection.close(CLOSE_REFUSED, text.as_bytes());
}

/// The session from Welcome to the end.
async fn attend(shared: &Arc<Shared>, entry: Entry, send: SendStream, mut recv: RecvStream) {
    let session = &entry.session;
    shared.counters.joined.one();
    tracing::info!(node = session.node, role = ?session.role, transport = ?session.transport, "client joined");
    shared.tell(LinkEvent::Joined(session.status(shared.clock.now_ns())));

    let connection = &session.connection;
    let reason = tokio::select! {
        reason = read_control(shared, session, &mut recv) => reason,
        reason = serve_meshes(shared, session) => reason,
        reason = read_datagrams(shared, session) => reason,
        reason = downstream::tell(shared, session, send) => reason,
    };
    connection.close(CLOSE_BYE, b"");
    // A session that was replaced is gone already, and told.
    if shared.sessions.remove(session.number) {
        tracing::info!(node = session.node, "client left: {reason}");
        shared.tell_left(session, reason);
    }
}

/// Reports and log lines until the client says goodbye; returns why it ended.
async fn read_control(shared: &Shared, session: &Session, recv: &mut RecvStream) -> String {
    let mut pace = Pace::new(MESSAGES_PER_SECOND, MESSAGE_BURST);
    loop {
        let spoken = VersionRange::only(session.version);
        let message = read_whole_message(recv, MAX_FRAME_BYTES, spoken, MESSAGE_TIMEOUT).await;
        at_pace(shared, &mut pace).await;
        let message = match message {
            Ok(message) => message,
            Err(error @ (ReadMessageError::Decode(_) | ReadMessageError::Stalled)) => {
                return broken(session, &error.to_string());
            }
            Err(ReadMessageError::Ended(_)) => {
                let error = session.connection.closed().await;
                return close_text(&error, "the node");
            }
        };
        let Some(act) = act_of_message(&message) else {
            return broken(session, &format!("a client sent {}", message.name()));
        };
        if let Err(reason) = demand(shared, session, act) {
            return reason;
        }
        match message {
            ControlMessage::Stats(stats) => {
                session.report(stats.clone(), shared);
                shared.tell(LinkEvent::Stats {
                    node: session.node.clone(),
                    stats,
                });
            }
            ControlMessage::Log(event) => shared.tell(LinkEvent::Log {
                node: session.node.clone(),
                event,
            }),
            ControlMessage::Arm(request) => {
                if let Some(take) = shared.arm.get() {
                    take(request.arm);
                }
                shared.tell(LinkEvent::Arm {
                    node: session.node.clone(),
                    arm: request.arm,
                });
            }
            ControlMessage::StatesBy(states) => session.take_states_by(states, shared),
            ControlMessage::Bye(bye) => return bye.reason.to_string(),
            other => return broken(session, &format!("a client sent {}", other.name())),
        }
    }
}

/// Waits until another message may be taken. Who sends faster is read later, and finds its stream full: it loses its own reports, and
/// nobody else's.
async fn at_pace(shared: &Shared, pace: &mut Pace) {
    let now_ns = shared.clock.now_ns();
    let at_ns = pace.book(now_ns, 1);
    if at_ns > now_ns {
        shared.counters.control_delayed.one();
        sleep(Duration::from_nanos(at_ns - now_ns)).await;
    }
}

fn broken(session: &Session, reason: &str) -> String {
    session.connection.close(CLOSE_PROTOCOL, reason.as_bytes());
    reason.to_owned()
}

/// One stream per mesh, until the connection ends.
async fn serve_meshes(shared: &Arc<Shared>, session: &Session) -> String {
    loop {
        match session.connection.accept_bi().await {
            Ok((send, recv)) => {
                if let Err(reason) = demand(shared, session, Act::GetMeshes) {
                    return reason;
                }
                let (shared, version) = (shared.clone(), session.version);
                // Ends with the connection; the number of streams is limited by the transport.
                tokio::spawn(async move { serve_mesh(&shared, version, send, recv).await });
            }
            Err(error) => return close_text(&error, "the node"),
        }
    }
}

async fn serve_mesh(shared: &Shared, version: u8, mut send: SendStream, mut recv: RecvStream) {
    let spoken = VersionRange::only(version);
    let reading = read_message(&mut recv, MAX_HELLO_BYTES, spoken);
    let request = timeout(JOIN_TIMEOUT, reading).await;
    let Ok(Ok(ControlMessage::MeshRequest(request))) = request else {
        return; // dropping the stream resets it
    };
    // Everything else goes first. Fails only if the stream is gone, and then writing fails, too.
    let _ = send.set_priority(MESH_PRIORITY);
    let mesh = shared.content.blobs.get(&request.hash);
    let header = MeshHeader {
        hash: request.hash,
        length: mesh.map_or(0, |bytes| bytes.len() as u32), // MAX_MESH_BYTES is far below 2^32
    };
    let header = ControlMessage::MeshHeader(header);
    if write_message(&mut send, &header, version).await.is_err() {
        return;
    }
    if let Some(bytes) = mesh
        && write_paced(shared, &mut send, bytes).await.is_err()
    {
        return;
    }
    let _ = send.finish(); // fails only if the client is gone
}

/// Writes `bytes` at the pace that all meshes share; an error if the client is gone, or takes nothing for [`STALL_TIMEOUT`].
async fn write_paced(shared: &Shared, send: &mut SendStream, bytes: &[u8]) -> Result<(), ()> {
    for chunk in bytes.chunks(MESH_CHUNK_BYTES) {
        let now_ns = shared.clock.now_ns();
        let at_ns = lock(&shared.mesh_pace).book(now_ns, chunk.len() as u64);
        if at_ns > now_ns {
            sleep(Duration::from_nanos(at_ns - now_ns)).await;
        }
        match timeout(STALL_TIMEOUT, send.write_all(chunk)).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) | Err(_) => return Err(()),
        }
    }
    Ok(())
}

/// Hot plane over QUIC; a client on UDP sends none here.
async fn read_datagrams(shared: &Shared, session: &Arc<Session>) -> String {
    loop {
        match session.connection.read_datagram().await {
            Ok(datagram) if session.transport == Transport::QuicDatagram => {
                receive(shared, session, &datagram, None, shared.clock.now_ns());
            }
            Ok(_) => shared.counters.garbage.one(),
            Err(error) => return close_text(&error, "the node"),
        }
    }
}
