//! Waiting for a socket that never blocks its senders.
//!
//! The server's one UDP socket is non-blocking for the broadcast thread, so its receiving thread cannot use a read timeout: it asks `poll`.

use std::{net::UdpSocket, time::Duration};

/// Waits until `socket` has a datagram or `timeout` is over; may also return early.
#[cfg(unix)]
pub(crate) fn wait_readable(socket: &UdpSocket, timeout: Duration) {
    use std::os::fd::AsRawFd;
    let mut request = libc::pollfd {
        fd: socket.as_raw_fd(),
        events: libc::POLLIN,
        revents: 0,
    };
    let milliseconds = libc::c_int::try_from(timeout.as_millis()).unwrap_or(libc::c_int::MAX);
    #[allow(unsafe_code, reason = "std has no poll for a non-blocking socket")]
    // SAFETY: `request` is one valid pollfd that lives through the call; the descriptor is open because `socket` is borrowed.
    let ready = unsafe { libc::poll(&mut request, 1, milliseconds) };
    if ready < 0 {
        // A signal came, or the system is out of memory: the caller loops, at a rate that harms nobody.
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Waits a moment: without `poll` the socket is asked once per millisecond.
#[cfg(not(unix))]
pub(crate) fn wait_readable(_socket: &UdpSocket, timeout: Duration) {
    std::thread::sleep(timeout.min(Duration::from_millis(1)));
}
