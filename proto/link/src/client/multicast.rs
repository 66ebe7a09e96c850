//! States from the group: a thread that listens, and tells the server whether it hears.

use super::hot::Hot;
use crate::multicast::{interface_to, join_again, listener};
use socket2::Socket;
use std::{
    io,
    net::{SocketAddr, SocketAddrV4, UdpSocket},
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
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
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
                ) => {}
            Err(_) => std::thread::sleep(LOOK_PERIOD), // soft, but no reason to spin
        }
        let now = Instant::now();
        ask(hot, &mut watch, group, now);
        if now.duration_since(joined) >= REJOIN_PERIOD {
            joined = now;
            renew(&socket, group, interface);
        }
    }
    Ok(())
}

fn ask(hot: &Hot, watch: &mut MulticastWatch, group: SocketAddrV4, now: Instant) {
    let now_ns = hot.inbound.local_ns(now);
    let Some(path) = watch.wish(now_ns, hot.inbound.heard_ns()) else {
        return;
    };
    let multicast = path == StatePath::Multicast;
    if !hot.post(ControlMessage::StatesBy(StatesBy { multicast })) {
        return; // the control stream is busy: asked again at the next look
    }
    watch.asked(path, now_ns);
    match path {
        StatePath::Multicast => tracing::info!(%group, "states come by multicast"),
        StatePath::Unicast => {
            hot.inbound.counters.multicast_lost.one();
            tracing::warn!(%group, "multicast fell silent while the server lives: states come by unicast again");
        }
    }
}

fn renew(socket: &Socket, group: SocketAddrV4, interface: std::net::Ipv4Addr) {
    if let Err(error) = join_again(socket, group, interface) {
        tracing::debug!(%group, "the membership was not renewed: {error}");
    }
}
