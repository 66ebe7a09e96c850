//! Ports and addresses: find out early that a port is taken, and what an observer has to type.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, UdpSocket};

use crate::error::MonitorError;

/// Configuration key of the stream's port, for messages.
pub(crate) const GRPC_KEY: &str = "monitoring.grpc_port";
/// Configuration key of the web page's port, for messages.
pub(crate) const WEB_KEY: &str = "monitoring.web_port";

/// Listens on a port; the port that it got, for 0 a free one.
pub(crate) fn listen(
    bind: IpAddr,
    port: u16,
    key: &'static str,
) -> Result<(TcpListener, u16), MonitorError> {
    let address = SocketAddr::new(bind, port);
    let refused = |source| MonitorError::Listen {
        address,
        key,
        source,
    };
    let listener = TcpListener::bind(address).map_err(refused)?;
    let port = listener.local_addr().map_err(refused)?.port();
    Ok((listener, port))
}

fn reachable_on_this_machine(bind: IpAddr) -> IpAddr {
    match bind {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        IpAddr::V6(ip) if ip.is_unspecified() => IpAddr::V6(Ipv6Addr::LOCALHOST),
        ip => ip,
    }
}

/// The address that another machine would use: for "any address", the one of the default route.
pub(crate) fn reachable_by_observers(bind: IpAddr) -> IpAddr {
    if !bind.is_unspecified() {
        return bind;
    }
    // Connecting a UDP socket sends nothing; it makes the system choose the outgoing address.
    // The peer is from the range reserved for documentation (RFC 5737).
    UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))
        .and_then(|socket| {
            socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
            socket.local_addr()
        })
        .map_or_else(|_| reachable_on_this_machine(bind), |local| local.ip())
}

/// The URL of the stream, as `rerun <url>` takes it.
pub(crate) fn stream_url(host: IpAddr, grpc_port: u16) -> String {
    format!("rerun+http://{}/proxy", SocketAddr::new(host, grpc_port))
}

/// The URL of the web page that opens the stream at once.
pub(crate) fn page_url(host: IpAddr, web_port: u16, stream_url: &str) -> String {
    let page = SocketAddr::new(host, web_port);
    format!(
        "http://{page}/?hide_welcome_screen&url={}",
        percent_encoded(stream_url)
    )
}

/// Encodes everything but letters, digits and `-._~` (RFC 3986, section 2.3).
fn percent_encoded(text: &str) -> String {
    let mut encoded = String::with_capacity(3 * text.len());
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            encoded.push(char::from(byte));
        } else {
            encoded.push_str(&format!("%{byte:02X}"));
        }
    }
    encoded
}

/// Origins from which a browser may read the stream: the web page's, and rerun's own default ones.
///
/// A page is of another origin than the stream because its port differs. Listening on any address, the name that
/// the observer typed cannot be known, so any host is accepted as long as the port is the page's.
pub(crate) fn allowed_origins(bind: IpAddr, web_port: u16) -> Vec<String> {
    if bind.is_unspecified() {
        vec![format!("http://*:{web_port}")]
    } else {
        vec![format!("http://{}", SocketAddr::new(bind, web_port))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOCALHOST: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    #[test]
    fn a_taken_port_is_refused_and_named_with_its_key() {
        let taken = TcpListener::bind((LOCALHOST, 0)).unwrap();
        let port = taken.local_addr().unwrap().port();
        let message = listen(LOCALHOST, port, GRPC_KEY).unwrap_err().to_string();
        assert!(message.contains(&port.to_string()), "{message}");
        assert!(message.contains(GRPC_KEY), "{message}");
    }

    #[test]
    fn port_zero_becomes_a_port() {
        assert_ne!(listen(LOCALHOST, 0, WEB_KEY).unwrap().1, 0);
    }

    #[test]
    fn the_page_carries_the_stream_url_encoded() {
        let stream = stream_url(LOCALHOST, 9876);
        assert_eq!(stream, "rerun+http://127.0.0.1:9876/proxy");
        assert_eq!(
            page_url(LOCALHOST, 9090, &stream),
            "http://127.0.0.1:9090/?hide_welcome_screen&url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A9876%2Fproxy"
        );
    }

    #[test]
    fn ipv6_hosts_are_bracketed() {
        let host = IpAddr::V6(Ipv6Addr::LOCALHOST);
        assert_eq!(stream_url(host, 1), "rerun+http://[::1]:1/proxy");
    }

    #[test]
    fn observers_are_never_sent_to_the_unspecified_address() {
        let host = reachable_by_observers(IpAddr::V4(Ipv4Addr::UNSPECIFIED));
        assert!(!host.is_unspecified());
    }
}
