//! How a client gets in: name to address, QUIC, Hello, Welcome, scene.

use super::{
    ClientLink, ClientOptions, control,
    group::GroupEnd,
    hot::{Hot, Path, any_port_for},
    inbound::Inbound,
    link::AtJoin,
    meshes::Meshes,
    pictures::{self, PictureSlot},
};
use crate::{
    DEFAULT_QUIC_PORT, LinkError, binding,
    framing::{
        CLOSE_BYE, CLOSE_REFUSED, ReadMessageError, close_text, peer_text, read_message,
        write_message,
    },
    pinning::PinnedServer,
    transport,
};
use quinn::{Connection, ConnectionError, Endpoint, RecvStream, SendStream};
use std::{
    net::{Ipv6Addr, SocketAddr},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};
use taut_proto::{
    Act, CouplingOffer, DecodeError, Refusal, SceneDescription, Transport, VersionRange,
    control::{ControlMessage, Hello, MAX_FRAME_BYTES, Offers, RefusalCode, Welcome},
    proof::Claim,
};
use tokio::time::{Instant, sleep_until, timeout, timeout_at};

/// Distance between attempts where the network says at once that nobody is there.
const RETRY_PERIOD: Duration = Duration::from_millis(200);

/// How long an address is given before the next one is tried, and the same one anew: the first packet of an attempt goes out again after 0.3 s
/// and after 0.9 s.
const ATTEMPT: Duration = Duration::from_millis(1500);
/// What a server may tell as the silence after which it is to be given up.
const NODE_TIMEOUTS_MS: std::ops::RangeInclusive<u32> = 100..=60_000;

/// Joins a server's session: proves the key, takes the scene, starts receiving.
///
/// Runs on the current tokio runtime, which must live as long as the link; over UDP, states arrive in a thread named `taut-states`.
pub async fn connect(options: ClientOptions) -> Result<ClientLink, LinkError> {
    let meshes = Arc::new(Meshes::new(options.mesh_cache.clone()));
    connect_with(options, meshes).await
}

/// The same with the meshes that earlier sessions brought.
pub(crate) async fn connect_with(
    options: ClientOptions,
    meshes: Arc<Meshes>,
) -> Result<ClientLink, LinkError> {
    // Nobody is asked for what the key does not allow.
    options.key.secret_for(options.role, &options.node)?;
    let (endpoint, connection, joined) = get_in_in_time(&options).await?;
    let Joined {
        welcome,
        description,
        coupling,
        send,
        recv,
    } = joined;
    let (version, epoch, session) = (welcome.version, welcome.epoch, welcome.session);
    let (sealer, opener) = binding::hot_keys(&connection, version, epoch, session, false)?;
    let path = match options.transport {
        Transport::QuicDatagram => Path::Quic,
        Transport::Udp => Path::udp(SocketAddr::new(
            connection.remote_address().ip(),
            welcome.udp_port,
        ))?,
    };
    let hot = Arc::new(Hot::new(
        connection,
        sealer,
        Inbound::new(opener, options.role),
        GroupEnd::new(welcome.epoch, welcome.session),
        path,
        options.priority,
        welcome.version,
    ));
    hot.clone().start()?;
    tokio::spawn(control::listen(hot.clone(), recv, options.rate_hz == 0));
    let pictures = PictureSlot::default();
    if options.pictures {
        let connection = hot.connection.clone();
        tokio::spawn(pictures::listen(connection, hot.version, pictures.clone()));
    }
    meshes.keep_only(&description);
    Ok(ClientLink::new(
        options.server,
        endpoint,
        hot,
        AtJoin {
            session: welcome.session,
            epoch: welcome.epoch,
            node_timeout: Duration::from_millis(
                welcome
                    .node_timeout_ms
                    .clamp(*NODE_TIMEOUTS_MS.start(), *NODE_TIMEOUTS_MS.end())
                    .into(),
            ),
            description,
            coupling,
        },
        meshes,
        pictures,
        send,
    ))
}

/// Finds the server and joins, within the time that the options give for it.
async fn get_in_in_time(
    options: &ClientOptions,
) -> Result<(Endpoint, Connection, Joined), LinkError> {
    let deadline = Instant::now() + options.connect_timeout;
    let unreachable = || LinkError::Unreachable {
        server: options.server.clone(),
        seconds: options.connect_timeout.as_secs_f64(),
    };
    let addresses = timeout_at(deadline, resolve(&options.server))
        .await
        .map_err(|_| unreachable())??;
    let turned_away = AtomicBool::new(false);
    timeout_at(deadline, get_in(options, &addresses, &turned_away))
        .await
        .map_err(|_| match turned_away.load(Ordering::Relaxed) {
            true => LinkError::TurnedAway {
                server: options.server.clone(),
                seconds: options.connect_timeout.as_secs_f64(),
            },
            false => unreachable(),
        })?
}

/// Addresses of `host:port`, IPv4 first; without a port, the default one.
async fn resolve(server: &str) -> Result<Vec<SocketAddr>, LinkError> {
    let bad = || LinkError::BadAddress {
        server: server.to_owned(),
    };
    // A number with colons and without brackets is an IPv6 address without port.
    let complete = if let Ok(address) = server.parse::<Ipv6Addr>() {
        format!("[{address}]:{DEFAULT_QUIC_PORT}")
    } else if server.starts_with('[') && server.ends_with(']') {
        format!("{server}:{DEFAULT_QUIC_PORT}")
    } else {
        match server.rsplit_once(':') {
            Some((host, port))
                if !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port != 0) =>
            {
                server.to_owned()
            }
            Some(_) => return Err(bad()),
            None if server.trim().is_empty() => return Err(bad()),
            None => format!("{server}:{DEFAULT_QUIC_PORT}"),
        }
    };
    let unknown = |reason: String| LinkError::UnknownHost {
        server: server.to_owned(),
        reason,
    };
    let mut addresses: Vec<_> = tokio::net::lookup_host(complete)
        .await
        .map_err(|error| unknown(error.to_string()))?
        .collect();
    if addresses.is_empty() {
        return Err(unknown("it has no address".to_owned()));
    }
    addresses.sort_by_key(SocketAddr::is_ipv6);
    Ok(addresses)
}

/// Reaches the server and joins. Where it ends the connection without an answer, as it does when others come in between, that is no other thing than not
/// to be let in to begin with: tried again. The caller sets the deadline.
async fn get_in(
    options: &ClientOptions,
    addresses: &[SocketAddr],
    turned_away: &AtomicBool,
) -> Result<(Endpoint, Connection, Joined), LinkError> {
    loop {
        let attempt = Instant::now();
        let (endpoint, connection) = reach(options, addresses, turned_away).await?;
        match join(options, &connection).await {
            Ok(joined) => return Ok((endpoint, connection, joined)),
            Err(_) if is_unanswered(&connection, turned_away) => {
                sleep_until(attempt + RETRY_PERIOD).await;
            }
            Err(error) => {
                connection.close(CLOSE_REFUSED, b"not joined");
                endpoint.wait_idle().await; // ends with the connection's closing handshake, at most three round trips
                return Err(error);
            }
        }
    }
}

/// Whether the connection is over and nobody has said why; notes where it is the server that ended it.
fn is_unanswered(connection: &Connection, turned_away: &AtomicBool) -> bool {
    let by_server = match connection.close_reason() {
        Some(ConnectionError::ApplicationClosed(close)) if close.error_code == CLOSE_BYE => true,
        Some(ConnectionError::ConnectionClosed(_)) => true,
        Some(ConnectionError::TimedOut | ConnectionError::Reset) => false,
        _ => return false,
    };
    turned_away.fetch_or(by_server, Ordering::Relaxed);
    true
}

/// Tries the addresses in turn, again and again; the caller sets the deadline. A server that just starts is reached too.
async fn reach(
    options: &ClientOptions,
    addresses: &[SocketAddr],
    turned_away: &AtomicBool,
) -> Result<(Endpoint, Connection), LinkError> {
    let pinned = Arc::new(PinnedServer::new(options.key.pin()));
    let config = transport::client_config(pinned.clone(), options.idle_timeout)?;
    let name = transport::server_name(pinned.pin());
    loop {
        let round = Instant::now();
        for address in addresses {
            let Ok(endpoint) = Endpoint::client(any_port_for(*address)) else {
                continue; // this machine has no such address family
            };
            let Ok(connecting) = endpoint.connect_with(config.clone(), *address, &name) else {
                continue;
            };
            let Ok(connected) = timeout(ATTEMPT, connecting).await else {
                continue; // nobody there
            };
            match connected {
                Ok(connection) => return Ok((endpoint, connection)),
                Err(ConnectionError::TransportError(error)) => {
                    let server = options.server.clone();
                    return Err(match pinned.stranger() {
                        Some(found) => LinkError::WrongServer {
                            server,
                            wanted: pinned.pin(),
                            found,
                        },
                        None => LinkError::Protocol {
                            server,
                            reason: peer_text(&error),
                        },
                    });
                }
                // It is there, and will not listen yet: try again.
                Err(ConnectionError::ConnectionClosed(_)) => {
                    turned_away.store(true, Ordering::Relaxed);
                }
                Err(_) => {} // nobody there: try again
            }
        }
        sleep_until(round + RETRY_PERIOD).await;
    }
}

/// What a client knows once it is in.
struct Joined {
    welcome: Welcome,
    description: SceneDescription,
    /// For a device bridge.
    coupling: Option<CouplingOffer>,
    send: SendStream,
    /// What else the server tells.
    recv: RecvStream,
}

/// Hello to scene, and to the coupling for a device bridge.
async fn join(options: &ClientOptions, connection: &Connection) -> Result<Joined, LinkError> {
    let opened = connection.open_bi().await;
    let (mut send, mut recv) = opened.map_err(|error| lost(options, &error))?;
    let binding = binding::proof_binding(connection)?;
    let (grant, secret) = options.key.secret_for(options.role, &options.node)?;
    let claim = Claim {
        role: options.role,
        node: &options.node,
        grant,
    };
    let hello = Hello {
        versions: options.versions,
        node: options.node.as_str().into(),
        role: options.role,
        transport: options.transport,
        rate_hz: options.rate_hz,
        proof: secret.client_proof(&binding, claim),
        grant,
        offers: match options.pictures {
            true => Offers::PICTURES,
            false => Offers::NONE,
        },
    };
    let welcome = greet(options, connection, hello, (&mut send, &mut recv)).await?;
    // Now the server must prove the secret, too: its certificate alone says only that it holds its own key.
    if !secret.verify_server(&welcome.proof, &binding, claim) {
        return Err(LinkError::WrongKey {
            server: options.server.clone(),
        });
    }
    let agreed = VersionRange::only(welcome.version);
    let description = match expect(options, connection, &mut recv, agreed).await? {
        ControlMessage::Scene(description) => description,
        other => return Err(undue(options, &other, "scene")),
    };
    let coupling = match options.role.may(Act::GetWrenches) {
        true => match expect(options, connection, &mut recv, agreed).await? {
            ControlMessage::Coupling(offer) => Some(offer),
            other => return Err(undue(options, &other, "coupling")),
        },
        false => None,
    };
    Ok(Joined {
        welcome,
        description,
        coupling,
        send,
        recv,
    })
}

/// Says Hello and hears whether the server lets the client in.
async fn greet(
    options: &ClientOptions,
    connection: &Connection,
    hello: Hello,
    (send, recv): (&mut SendStream, &mut RecvStream),
) -> Result<Welcome, LinkError> {
    let hello = ControlMessage::Hello(hello);
    if write_message(send, &hello, options.versions.max())
        .await
        .is_err()
    {
        return Err(lost(options, &connection.closed().await));
    }
    match expect(options, connection, recv, options.versions).await? {
        ControlMessage::Welcome(welcome) if options.versions.contains(welcome.version) => {
            Ok(welcome)
        }
        ControlMessage::Welcome(welcome) => Err(LinkError::WrongVersion {
            server: options.server.clone(),
            theirs: welcome.version,
            ours: options.versions,
        }),
        ControlMessage::Refused(refusal) => Err(refused(options, refusal)),
        other => {
            let reason = format!("it answers Hello with {}", other.name());
            Err(protocol(options, reason))
        }
    }
}

fn lost(options: &ClientOptions, error: &ConnectionError) -> LinkError {
    LinkError::Closed {
        server: options.server.clone(),
        reason: close_text(error, "the server"),
    }
}

async fn expect(
    options: &ClientOptions,
    connection: &Connection,
    recv: &mut RecvStream,
    spoken: VersionRange,
) -> Result<ControlMessage, LinkError> {
    match read_message(recv, MAX_FRAME_BYTES, spoken).await {
        Ok(message) => Ok(message),
        Err(ReadMessageError::Decode(DecodeError::WrongVersion { theirs, ours })) => {
            Err(LinkError::WrongVersion {
                server: options.server.clone(),
                theirs: theirs.max(),
                ours,
            })
        }
        Err(ReadMessageError::Decode(error)) => Err(protocol(options, error.to_string())),
        Err(error @ ReadMessageError::Stalled) => Err(protocol(options, error.to_string())),
        Err(ReadMessageError::Ended(reason)) => Err(LinkError::Closed {
            server: options.server.clone(),
            reason: connection
                .close_reason()
                .map_or(reason, |error| close_text(&error, "the server")),
        }),
    }
}

fn refused(options: &ClientOptions, refusal: Refusal) -> LinkError {
    let server = options.server.clone();
    match refusal.code {
        RefusalCode::WrongKey => LinkError::WrongKey { server },
        RefusalCode::WrongVersion => LinkError::WrongVersion {
            server,
            theirs: refusal.version,
            ours: options.versions,
        },
        code => LinkError::Refused {
            server,
            code,
            text: refusal.text,
        },
    }
}

fn undue(options: &ClientOptions, message: &ControlMessage, due: &str) -> LinkError {
    let reason = format!("it sends {} where the {due} is due", message.name());
    protocol(options, reason)
}

fn protocol(options: &ClientOptions, reason: String) -> LinkError {
    LinkError::Protocol {
        server: options.server.clone(),
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::Ipv4Addr;
    use taut_proto::{ClusterKey, Role};

    /// Ends the first connections without a word, before or after the handshake, and answers the next one.
    async fn answers_at_last(endpoint: Endpoint, silent: usize) -> Option<()> {
        for number in 0.. {
            let incoming = endpoint.accept().await?;
            if number < silent && number % 2 == 0 {
                let connecting = incoming.accept().ok()?;
                drop(connecting);
                continue;
            }
            let connection = incoming.await.ok()?;
            let (mut send, mut recv) = connection.accept_bi().await.ok()?;
            if number < silent {
                continue;
            }
            let hello = read_message(&mut recv, 1024, VersionRange::SUPPORTED).await;
            assert!(matches!(hello, Ok(ControlMessage::Hello(_))), "{hello:?}");
            let version = VersionRange::SUPPORTED.max();
            let refusal = ControlMessage::Refused(Refusal {
                code: RefusalCode::Full,
                version,
                text: "no room".into(),
            });
            write_message(&mut send, &refusal, version).await.ok()?;
            connection.closed().await;
            return Some(());
        }
        None
    }

    #[tokio::test]
    async fn a_server_that_dies_while_a_node_joins_is_not_there_and_turns_nobody_away() {
        let key = ClusterKey::generate().expect("a key");
        let config = transport::server_config(&key, None, Duration::from_secs(10));
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let (reached, died) = tokio::sync::oneshot::channel();
        // A runtime of its own, so that all of it stops at once.
        let machine = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .expect("a runtime");
        let endpoint = {
            let _within = machine.enter();
            Endpoint::server(config.expect("a key"), any).expect("a port")
        };
        let address = endpoint.local_addr().expect("bound").to_string();
        machine.spawn(async move {
            let connection = endpoint.accept().await.expect("a node").await;
            let _ = reached.send(());
            std::future::pending::<()>().await;
            drop(connection);
        });
        let mut options = ClientOptions::new(address, key, Role::Observer, "watcher");
        (options.connect_timeout, options.idle_timeout) =
            (Duration::from_secs(3), Duration::from_secs(1));
        let node = tokio::spawn(connect(options));
        died.await.expect("reached");
        machine.shutdown_background();
        let error = node.await.expect("no panic").map(|_| ()).expect_err("dead");
        assert!(matches!(error, LinkError::Unreachable { .. }), "{error}");
    }

    #[tokio::test]
    async fn a_connection_that_ends_without_an_answer_is_no_answer() {
        let key = ClusterKey::generate().expect("a key");
        let config = transport::server_config(&key, None, Duration::from_secs(10));
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let endpoint = Endpoint::server(config.expect("a key"), any).expect("a port");
        let address = endpoint.local_addr().expect("bound").to_string();
        let server = tokio::spawn(answers_at_last(endpoint, 4));
        let mut options = ClientOptions::new(address, key, Role::Observer, "watcher");
        (options.connect_timeout, options.idle_timeout) =
            (Duration::from_secs(60), Duration::from_secs(10));
        let answer = connect(options).await.map(|_| ());
        let refused = matches!(
            answer,
            Err(LinkError::Refused {
                code: RefusalCode::Full,
                ..
            })
        );
        assert!(refused, "{answer:?}");
        assert_eq!(server.await.expect("no panic"), Some(()));
    }
}
