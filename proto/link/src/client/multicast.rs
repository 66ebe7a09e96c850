//! States from the group: a thread that listens, and tells the server whether it hears.

use super::hot::{Hot, nothing_came};
use crate::multicast::{interface_to, join_again, listener};
use socket2::Socket;
use std::{
    io,
    net::{SocketAddr, SocketAddrV4, UdpSocket},
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    confirmation::Trust,
    control::{ControlMessage, StatesBy},
    header::MAX_DATAGRAM_BYTES,
    multicast::{MulticastWatch, StatePath},
};

/// How often the watch is asked while nothing comes.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// How often the membership is renewed.
const REJOIN_PERIOD: Duration = Duration::from_secs(30);

/// Starts listening to `group`, for a client whose own path leads to `server`.
pub(crate) fn start(hot: Arc<Hot>, group: SocketAddr, server: SocketAddr) {
    let SocketAddr::V4(group) = group else {
        return; // the server offers groups of IPv4 only
    };
    let spawned = std::thread::Builder::new()
        .name("taut-multicast".to_owned())
        .spawn(move || {
            if let Err(error) = listen(&hot, group, server) {
                tracing::warn!(%group, "states come by unicast: multicast cannot be heard ({error})");
            }
        });
    if let Err(error) = spawned {
        tracing::warn!("states come by unicast: no thread for multicast ({error})");
    }
}

fn listen(hot: &Hot, group: SocketAddrV4, server: SocketAddr) -> io::Result<()> {
    let interface = interface_to(server)?;
    let socket = Arc::new(listener(group, interface)?);
    socket.set_read_timeout(Some(LOOK_PERIOD))?;
    let receiver: UdpSocket = socket.try_clone()?.into();
    let mut watch = MulticastWatch::default();
    let mut generation = None;
    let mut unsaid = None;
    let mut joined = Instant::now();
    let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
    while !hot.is_over() {
        match receiver.recv(&mut buffer) {
            Ok(length) => {
                let now = Instant::now();
                if hot.receive_multicast(&buffer[..length], now) {
                    watch.heard(hot.inbound.local_ns(now));
                }
            }
            Err(error) if nothing_came(&error) => {}
            Err(_) => std::thread::sleep(LOOK_PERIOD), // soft, but no reason to spin
        }
        let now = Instant::now();
        let newest = hot.group.roster().map(|roster| roster.generation);
        if std::mem::replace(&mut generation, newest) != newest {
            watch.rekeyed();
        }
        // What a busy stream does not take is said at the next look.
        unsaid = unsaid
            .or_else(|| ask(hot, &mut watch, group, now))
            .filter(|words| !hot.post(ControlMessage::StatesBy(*words)));
        if now.duration_since(joined) >= REJOIN_PERIOD {
            joined = now;
            renew(&socket, group, interface);
        }
    }
    Ok(())
}

/// Turns to the way that the watch or the confirmations ask for; what the server is to be told of it.
fn ask(
    hot: &Hot,
    watch: &mut MulticastWatch,
    group: SocketAddrV4,
    now: Instant,
) -> Option<StatesBy> {
    let now_ns = hot.inbound.local_ns(now);
    if let Some(trust) = hot.inbound.take_lost_trust(now_ns) {
        return leave(hot, watch, group, trust, now_ns);
    }
    let path = watch.wish(now_ns, hot.inbound.heard_ns())?;
    let multicast = path == StatePath::Multicast;
    watch.asked(path, now_ns);
    hot.inbound.follow_group(multicast);
    match path {
        StatePath::Multicast => tracing::info!(%group, "states come by multicast"),
        StatePath::Unicast => {
            hot.inbound.counters.multicast_lost.one();
            tracing::warn!(%group, "multicast fell silent while the server lives: states come by unicast again");
        }
    }
    Some(StatesBy {
        multicast,
        forged: false,
    })
}

/// Turns to unicast, because what came by the group is not to be trusted. Its states are not taken any more already.
fn leave(
    hot: &Hot,
    watch: &mut MulticastWatch,
    group: SocketAddrV4,
    trust: Trust,
    now_ns: u64,
) -> Option<StatesBy> {
    let counters = &hot.inbound.counters;
    let forged = matches!(trust, Trust::Forged { .. });
    match trust {
        Trust::Kept => return None,
        Trust::Forged { tick } => {
            counters.states_forged.one();
            watch.forged();
            tracing::error!(%group, tick, "a member of the group forges the server's states: states come by unicast until the group's keys change");
        }
        Trust::Unconfirmed => {
            counters.states_unconfirmed.one();
            tracing::warn!(%group, "the server did not confirm what came by multicast: states come by unicast again");
        }
        Trust::Unheard => {
            counters.multicast_lost.one();
            tracing::warn!(%group, "multicast brings none of the server's states: states come by unicast again");
        }
    }
    watch.asked(StatePath::Unicast, now_ns);
    Some(StatesBy {
        multicast: false,
        forged,
    })
}

fn renew(socket: &Socket, group: SocketAddrV4, interface: std::net::Ipv4Addr) {
    if let Err(error) = join_again(socket, group, interface) {
        tracing::debug!(%group, "the membership was not renewed: {error}");
    }
}
