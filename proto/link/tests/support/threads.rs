//! Threads that end with the test, and a server that dies.

use super::*;
use std::{
    net::UdpSocket,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
};
use taut_link::{RejoinPolicy, SupervisedLink};
use taut_proto::barrier::{MasterSettings, Swap};
use tokio::runtime::Runtime;

/// Fast enough for many frames, slow enough for a busy machine.
pub const PERIOD: Duration = Duration::from_millis(33);

/// Quic and UDP.
pub type Addresses = (SocketAddr, SocketAddr);

/// A thread that is stopped and waited for when this is dropped.
pub struct Worker {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    /// `body` asks now and then whether it is over.
    pub fn start(name: &str, body: impl FnOnce(&dyn Fn() -> bool) + Send + 'static) -> Worker {
        let stop = Arc::new(AtomicBool::new(false));
        let of_thread = stop.clone();
        let builder = std::thread::Builder::new().name(name.to_owned());
        let thread = must(builder.spawn(move || body(&|| of_thread.load(Ordering::SeqCst))));
        Worker {
            stop,
            thread: Some(thread),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if std::thread::panicking() {
            return; // a test that failed waits for nothing
        }
        if let Some(thread) = self.thread.take() {
            assert!(thread.join().is_ok());
        }
    }
}

/// What leads frames at [`PERIOD`].
pub fn leading(swap: Swap) -> MasterSettings {
    MasterSettings {
        swap,
        period_ns: PERIOD.as_nanos() as u64,
        slowest_ns: 1_000_000_000,
    }
}

/// Broadcasts a state of now per millisecond, each after `see` has had it, and leads frames where the server does.
pub fn broadcasting(
    server: &ServerLink,
    mut see: impl FnMut(&HotState) + Send + 'static,
) -> Vec<Worker> {
    let (mut broadcaster, clock) = (server.broadcaster(), server.clock());
    let states = Worker::start("states", move |is_over| {
        while !is_over() {
            let mut now = state(clock.now_ns() / 1_000_000 + 1);
            now.sample_time_ns = clock.now_ns();
            see(&now);
            broadcaster.send(&now);
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    let frames = server.frame_master().map(|mut master| {
        let lead = move |is_over: &dyn Fn() -> bool| master.run(is_over);
        Worker::start("frames", lead)
    });
    [states].into_iter().chain(frames).collect()
}

/// As [`wait_for`], where nothing else runs meanwhile.
pub fn until_some<T>(what: &str, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(
            start.elapsed() < 2 * PATIENCE,
            "{what}: did not happen in time"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
}

pub fn until(what: &str, mut done: impl FnMut() -> bool) {
    until_some(what, || done().then_some(()));
}

/// A runtime that a test can end before the others.
pub fn runtime() -> Runtime {
    must(
        tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build(),
    )
}

/// A server with a runtime of its own, so that it can die without a word and come back at the same place.
pub struct Mortal {
    pub runtime: Runtime,
    pub link: ServerLink,
    pub addresses: Addresses,
}

impl Mortal {
    pub fn start(options: ServerOptions, addresses: Option<Addresses>) -> Mortal {
        let runtime = runtime();
        let (quic, udp) = addresses.unwrap_or((options.quic, options.udp));
        let options = ServerOptions {
            quic,
            udp,
            ..options
        };
        let link = must(runtime.block_on(serve(options, content())));
        let addresses = (link.quic_addr(), link.udp_addr());
        Mortal {
            runtime,
            link,
            addresses,
        }
    }

    /// Its endpoint is gone before it could say anything; the addresses that it had, free.
    pub fn die(self) -> Addresses {
        self.runtime.shutdown_timeout(PATIENCE);
        drop(self.link);
        // The receiving thread ends within one wait, and frees its port.
        until("a free port", || UdpSocket::bind(self.addresses.1).is_ok());
        self.addresses
    }
}

/// A link that joins again, with nothing to prepare for a session.
pub fn supervised(
    runtime: &Runtime,
    options: ClientOptions,
    policy: RejoinPolicy,
) -> (SupervisedLink<()>, Arc<ClientLink>) {
    let prepare = |_| async { Ok::<(), LinkError>(()) };
    let joined = SupervisedLink::join(options, policy, prepare);
    let (supervised, first, ()) = must(runtime.block_on(joined));
    (supervised, first)
}

/// A client that dies without a word as soon as it was heard: its runtime goes first, so that nothing can be sent any more.
pub fn murder(options: ClientOptions) {
    tokio::task::block_in_place(|| {
        let runtime = runtime();
        let link = must(runtime.block_on(connect(options)));
        runtime.block_on(wait_until("being heard", || link.session_now().is_some()));
        runtime.shutdown_background();
        drop(link);
    });
}
