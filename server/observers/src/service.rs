//! A thread with a runtime of its own that ends when it is dropped.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;
use tokio::time::sleep;

/// Clients that wait to be accepted.
const BACKLOG: u32 = 64;
/// Bytes that the system keeps for a client that does not read; beyond them, its states are dropped here.
const SEND_BUFFER_BYTES: u32 = 65_536;
/// Wait after a client could not be accepted: no file handles, most likely.
pub(crate) const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// A running service. Dropped, it ends.
#[derive(Debug)]
pub(crate) struct Service {
    stop: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

/// Ends when the service is dropped.
#[derive(Clone, Debug)]
pub(crate) struct Stop(watch::Receiver<bool>);

impl Stop {
    pub(crate) async fn asked(&mut self) {
        // An error means that the service is gone: the end, too.
        let _ = self.0.wait_for(|asked| *asked).await;
    }
}

/// A runtime for a service: its sockets are opened within it, so that their faults are told at the start.
pub(crate) fn runtime() -> io::Result<Runtime> {
    Builder::new_current_thread().enable_all().build()
}

/// Listens on `address`; call it within the runtime.
pub(crate) fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = match address {
        SocketAddr::V4(_) => TcpSocket::new_v4()?,
        SocketAddr::V6(_) => TcpSocket::new_v6()?,
    };
    socket.set_reuseaddr(true)?;
    // Those who are accepted have both from here.
    socket.set_send_buffer_size(SEND_BUFFER_BYTES)?;
    socket.set_keepalive(true)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

pub(crate) async fn accepted(listener: &TcpListener) -> (TcpStream, SocketAddr) {
    loop {
        match listener.accept().await {
            Ok(client) => return client,
            Err(_) => sleep(ACCEPT_PAUSE).await,
        }
    }
}

/// A socket that dials with the same buffers as those that are accepted, and the same question whether the client is still there: one that takes its
/// poses by datagram is sent nothing over TCP for hours, and would keep its place for ever when its machine is gone.
pub(crate) fn dialling_socket() -> io::Result<TcpSocket> {
    let socket = TcpSocket::new_v4()?;
    socket.set_send_buffer_size(SEND_BUFFER_BYTES)?;
    socket.set_keepalive(true)?;
    Ok(socket)
}

impl Service {
    /// Runs what `body` makes on a thread of this name, until it ends or the service is dropped.
    pub(crate) fn start<F: Future<Output = ()>>(
        name: &str,
        runtime: Runtime,
        body: impl FnOnce(Stop) -> F + Send + 'static,
    ) -> io::Result<Self> {
        let (stop, stopped) = watch::channel(false);
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                let mut end = Stop(stopped.clone());
                runtime.block_on(async {
                    tokio::select! {
                        () = body(Stop(stopped)) => {}
                        () = end.asked() => {}
                    }
                });
                runtime.shutdown_background();
            })?;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.stop.send_replace(true);
        if let Some(thread) = self.thread.take() {
            // A panic of the service is no fault of the loops; it has been printed.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silent_clients_are_asked_by_the_system_whether_they_are_there() {
        let runtime = runtime().expect("a runtime");
        let (dialled, accepted) = runtime.block_on(async {
            let listener = listen(SocketAddr::from(([127, 0, 0, 1], 0))).expect("a free port");
            let address = listener.local_addr().expect("bound");
            let socket = dialling_socket().expect("a socket");
            let dialled = socket.connect(address).await.expect("it listens");
            let (accepted, _) = listener.accept().await.expect("a client");
            (dialled, accepted)
        });
        for stream in [dialled, accepted] {
            let stream = stream.into_std().expect("a socket");
            let socket = TcpSocket::from_std_stream(stream);
            assert_eq!(socket.keepalive().ok(), Some(true));
        }
    }
}
