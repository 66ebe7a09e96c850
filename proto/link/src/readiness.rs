//! Waiting for a datagram to the microsecond.
//!
//! The server's one UDP socket is non-blocking for the broadcast thread, so that its receiving thread cannot use a read timeout; and a read timeout
//! is as coarse as the system's tick, a few milliseconds, which is too coarse for a node that waits to be released. Both ask the system's `poll`.

use std::{net::UdpSocket, time::Duration};

/// Waits until `socket` has a datagram or `timeout` is over; may also return early. Whether there is one.
#[cfg(unix)]
pub(crate) fn wait_readable(socket: &UdpSocket, timeout: Duration) -> bool {
    use std::os::fd::AsRawFd;
    let mut request = libc::pollfd {
        fd: socket.as_raw_fd(),
        events: libc::POLLIN,
        revents: 0,
    };
    let ready = poll(&mut request, timeout);
    if ready < 0 {
        // A signal came, or the system is out of memory: the caller loops, at a rate that harms nobody.
        std::thread::sleep(Duration::from_millis(1));
    }
    ready > 0
}

#[cfg(target_os = "linux")]
fn poll(request: &mut libc::pollfd, timeout: Duration) -> libc::c_int {
    let timeout = libc::timespec {
        tv_sec: timeout.as_secs().min(i32::MAX as u64) as libc::time_t,
        tv_nsec: libc::c_long::from(timeout.subsec_nanos() as i32),
    };
    #[allow(unsafe_code, reason = "std has no poll for a socket")]
    // SAFETY: one valid pollfd and a valid timespec live through the call, no signal mask is given; the descriptor is open because its socket is
    // borrowed by the caller.
    unsafe {
        libc::ppoll(request, 1, &raw const timeout, std::ptr::null())
    }
}

#[cfg(all(unix, not(target_os = "linux")))]
fn poll(request: &mut libc::pollfd, timeout: Duration) -> libc::c_int {
    let milliseconds = timeout.as_micros().div_ceil(1000);
    let milliseconds = libc::c_int::try_from(milliseconds).unwrap_or(libc::c_int::MAX);
    #[allow(unsafe_code, reason = "std has no poll for a socket")]
    // SAFETY: `request` is one valid pollfd that lives through the call; the descriptor is open because its socket is borrowed by the caller.
    unsafe {
        libc::poll(request, 1, milliseconds)
    }
}

/// Waits a moment: without `poll` the socket is asked once per millisecond.
#[cfg(not(unix))]
pub(crate) fn wait_readable(_socket: &UdpSocket, timeout: Duration) -> bool {
    std::thread::sleep(timeout.min(Duration::from_millis(1)));
    true
}
