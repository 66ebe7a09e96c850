//! The server is killed while render nodes draw in step: they go on together, led by one of them, also when that one is killed, until there is a server
//! again. Real processes; beside them a node of this test, which sees what all are told.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use taut_link::{
    ClientLink, ClientOptions, FrameStatus, FrameTurn, LinkError, RejoinPolicy, Renewal, Role,
    SupervisedLink,
};
use taut_proto::barrier::FRAMES_LEFT_OUT;
use taut_tests::patience::wait_for;
use taut_tests::workbench::TestWorkbench;
use tokio::runtime::Runtime;

use crate::support::{SMALL, draws};

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Longest wait for a node that joins or frames that are shown: a debug build on a busy machine.
const LIMIT: Duration = Duration::from_secs(60);
/// Frames per second that each node is made for: what software draws beside other tests.
const RATE: &str = "8";
/// Frames that are waited for under each leader.
const FRAMES: u64 = 20;

/// What a node's log says when it leads.
const LEADS: &str = "this node leads the frames";

/// A node of this test: takes part, draws nothing.
struct Witness {
    stop: Arc<AtomicBool>,
    frames: Arc<AtomicU64>,
    status: Arc<Mutex<FrameStatus>>,
    thread: Option<JoinHandle<()>>,
}

impl Witness {
    fn start(runtime: &Runtime, options: ClientOptions) -> Self {
        let prepare = |_: Arc<ClientLink>| async { Ok::<(), LinkError>(()) };
        let joined = SupervisedLink::join(options, RejoinPolicy::default(), prepare);
        let (supervised, mut link, ()) = runtime
            .block_on(joined)
            .unwrap_or_else(|error| panic!("{error}"));
        let mut witness = Self {
            stop: Arc::default(),
            frames: Arc::default(),
            status: Arc::default(),
            thread: None,
        };
        let (stop, frames) = (witness.stop.clone(), witness.frames.clone());
        let status = witness.status.clone();
        let body = move || {
            let mut gate = link.frame_gate(Duration::ZERO);
            while !stop.load(Ordering::SeqCst) {
                if let Some(Renewal::Session { link: next, .. }) = supervised.take_renewal() {
                    link = next;
                    gate = link.frame_gate(Duration::ZERO);
                }
                let turn = gate.turn();
                *status.lock().unwrap_or_else(PoisonError::into_inner) = gate.status();
                if turn == FrameTurn::Free {
                    std::thread::sleep(Duration::from_millis(2));
                    continue;
                }
                gate.arrive();
                if gate.wait().is_some() {
                    gate.swapped(std::time::Instant::now());
                    frames.fetch_add(1, Ordering::SeqCst);
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("witness".to_owned())
            .spawn(body);
        witness.thread = Some(thread.expect("a thread"));
        witness
    }

    fn status(&self) -> FrameStatus {
        *self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until it has shown so many more frames above a number, in step with as many nodes, itself included.
    fn show(&self, what: &str, above: u64, members: u32) {
        let mut enough = None;
        wait_for(what, LIMIT, || {
            let (status, frames) = (self.status(), self.frames.load(Ordering::SeqCst));
            let good = status.synchronised && status.members == members && status.frame > above;
            if good {
                enough = enough.or(Some(frames + FRAMES));
            } else {
                enough = None;
            }
            enough.is_some_and(|enough| frames >= enough).then_some(())
        });
    }
}

impl Drop for Witness {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            assert!(thread.join().is_ok() || std::thread::panicking());
        }
    }
}

#[test]
fn nodes_go_on_swapping_together_when_the_server_and_then_their_leader_are_killed() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.log = Some("warn,taut=info");
    if !draws(&workbench) {
        return;
    }
    workbench.set("scene", "sphere-on-plane");
    // Slower than this a node would swap on its own.
    workbench.set("frames.least_rate", 1.0);
    // A node leads after three tenths of this: more than a busy machine starves the server for.
    workbench.set("network.node_timeout", 4.0);
    let mut server = workbench.serve(&[]);
    let slow = [&SMALL[..], &["--fps", RATE]].concat();
    let mut node = |name: &str| {
        let process = workbench.join("render", name, &server, &slow);
        server.process.line_with(&[&format!("{name} joined")], 1);
        process
    };
    // In the order in which they will lead.
    let (mut front, mut table) = (node("front"), node("table"));
    let runtime = Runtime::new().expect("a runtime");
    let key = workbench.key();
    let options = ClientOptions::new(server.quic.clone(), key, Role::Render, "witness");
    let witness = Witness::start(&runtime, options);
    witness.show("frames of the server", 0, 3);
    let led_from = witness.status().frame + FRAMES_LEFT_OUT / 2;

    server.process.kill();
    front.line_with(&[LEADS], 1);
    // All three stay members only as long as they draw and arrive.
    witness.show("frames without the server", led_from, 3);
    assert!(!table.stderr().contains(LEADS), "one leads");

    let led_from = witness.status().frame + FRAMES_LEFT_OUT / 2;
    front.kill();
    table.line_with(&[LEADS], 1);
    witness.show("frames without the first leader", led_from, 2);

    let again = workbench.serve_again(&server.quic, &server.udp);
    wait_for("the witness in the next session", LIMIT, || {
        let status = witness.status();
        (status.synchronised && status.frame < led_from).then_some(())
    });
    witness.show("frames of the next server", 0, 2);
    drop(witness);

    let said = table.leave();
    assert!(said.contains("sessions: 2"), "{said}");
    let report = again.stop();
    let frames = &report["frames"];
    assert!(frames["compared"].as_u64() > Some(0), "{frames}");
    assert_eq!(frames["mismatches"], 0, "{frames}");
    assert_eq!(report["penetrations"], 0);
}
