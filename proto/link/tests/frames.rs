//! The barrier of frames over real sockets: two nodes in step, a bad network, a node that stops, nobody who leads.
//!
//! Nothing here measures: how sharp the swaps are is told by the report of `tests/network`.

use crate::support::*;
use std::{
    collections::HashMap,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};
use taut_link::{ClientLink, FrameTurn, Role, ServerLink, ServerOptions};
use taut_proto::barrier::Swap;
use taut_test_kit::relay::{Impairment, Relay};

/// Which state each frame showed and when it was planned to be shown, by all nodes.
type Shown = Arc<Mutex<HashMap<u64, Vec<(u64, u64)>>>>;

/// A server that broadcasts and leads frames, in threads, until it is dropped.
struct Leader {
    _workers: Vec<Worker>,
    server: ServerLink,
    relay: Option<Relay>,
}

impl Leader {
    async fn start(swap: Option<Swap>, impairment: Option<Impairment>) -> Leader {
        let relayed = impairment.map(|impairment| (relay_port(), impairment));
        let server = server_with(ServerOptions {
            idle_timeout: FORGIVING,
            announced_udp_port: relayed.as_ref().map(|(port, _)| port.address().port()),
            frames: swap.map(leading),
            ..ServerOptions::loopback(key('a'))
        })
        .await;
        let relay =
            relayed.map(|(port, impairment)| start_relay(port, server.udp_addr(), impairment, 7));
        Leader {
            _workers: broadcasting(&server, |_| {}),
            server,
            relay,
        }
    }
}

/// A node that "draws" for a few milliseconds per frame.
struct Screen {
    link: Arc<ClientLink>,
    frames: Arc<AtomicU64>,
    free_turns: Arc<AtomicU64>,
    paused: Arc<AtomicBool>,
    _worker: Worker,
}

impl Screen {
    async fn start(
        leader: &Leader,
        role: Role,
        name: &str,
        draws_ms: u64,
        shown: &Shown,
    ) -> Screen {
        let link = Arc::new(client(&leader.server, role, name).await);
        let frames = Arc::<AtomicU64>::default();
        let free_turns = Arc::<AtomicU64>::default();
        let paused = Arc::<AtomicBool>::default();
        let own = (link.clone(), frames.clone(), free_turns.clone());
        let (pauses, shown) = (paused.clone(), shown.clone());
        let worker = Worker::start(name, move |is_over| {
            let (link, frames, free_turns) = own;
            let mut gate = link.frame_gate(Duration::ZERO);
            let mut last = 0;
            while !is_over() {
                while pauses.load(Ordering::SeqCst) && !is_over() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                let FrameTurn::Draw(released) = gate.turn() else {
                    free_turns.fetch_add(1, Ordering::SeqCst);
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                assert_eq!(released.state.hash(), Ok(released.state_hash));
                assert!(
                    released.planned_ns >= released.state.sample_time_ns + PERIOD.as_nanos() as u64
                );
                std::thread::sleep(Duration::from_millis(draws_ms));
                gate.arrive();
                if gate.wait().is_some() {
                    assert!(released.frame > last, "{} after {last}", released.frame);
                    last = released.frame;
                    gate.swapped(Instant::now());
                    let mut shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
                    shown
                        .entry(released.frame)
                        .or_default()
                        .push((released.state_hash, released.planned_ns));
                    frames.fetch_add(1, Ordering::SeqCst);
                }
            }
        });
        Screen {
            link,
            frames,
            free_turns,
            paused,
            _worker: worker,
        }
    }

    fn frames(&self) -> u64 {
        self.frames.load(Ordering::SeqCst)
    }

    async fn show(&self, more: u64) {
        let enough = self.frames() + more;
        wait_until("frames", || self.frames() >= enough).await;
    }
}

/// Waits until so many frames were shown by more than one node. A starved machine leaves a node behind now and then.
async fn show_together(shown: &Shown, at_least: usize) {
    wait_until("frames of both", || {
        let shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
        shown.values().filter(|states| states.len() > 1).count() >= at_least
    })
    .await;
}

/// Waits until the server has compared so many reports of what nodes drew.
async fn compare(leader: &Leader, at_least: u64) {
    wait_until("reports", || {
        let report = leader.server.frame_report().unwrap_or_default();
        report.counts.compared >= at_least
    })
    .await;
}

/// Equal frames showed equal states and had one plan, and enough of them were shown by more than one node.
fn assert_equal_frames(shown: &Shown, at_least: usize) {
    let shown = shown.lock().unwrap_or_else(PoisonError::into_inner);
    for (frame, states) in shown.iter() {
        assert!(
            states.windows(2).all(|pair| pair[0] == pair[1]),
            "frame {frame}: {states:?}"
        );
    }
    let shared = shown.values().filter(|states| states.len() > 1).count();
    assert!(
        shared >= at_least,
        "{shared} frames were shown by more than one node"
    );
}

async fn in_step(swap: Swap) {
    let leader = Leader::start(Some(swap), None).await;
    let shown = Shown::default();
    let front = Screen::start(&leader, Role::Render, "front", 3, &shown).await;
    let table = Screen::start(&leader, Role::Render, "table", 7, &shown).await;
    front.show(40).await;
    table.show(40).await;
    show_together(&shown, 30).await;
    compare(&leader, 80).await;
    // Both are waited for once they have arrived in time for a while, however busy the machine is.
    wait_until("step", || {
        let report = leader.server.frame_report().unwrap_or_default();
        report.nodes.len() == 2 && report.nodes.iter().all(|(_, skew)| skew.count >= 10)
    })
    .await;
    drop((front, table));
    assert_equal_frames(&shown, 30);
    let report = leader.server.frame_report().unwrap_or_default();
    assert_eq!(report.counts.mismatches, 0, "{report:?}");
    let names: Vec<_> = report.nodes.iter().map(|(name, _)| name.as_str()).collect();
    assert!(
        names.contains(&"front") && names.contains(&"table"),
        "{report:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_nodes_show_the_same_states_when_the_release_comes() {
    in_step(Swap::Immediate).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_nodes_show_the_same_states_at_a_planned_time() {
    in_step(Swap::Scheduled).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bad_network_costs_time_but_never_truth() {
    let impairment = Impairment {
        lost: 0.15,
        doubled: 0.1,
        swapped: 0.1,
        flipped: 0.05,
        ..Impairment::default()
    };
    let leader = Leader::start(Some(Swap::Immediate), Some(impairment)).await;
    let shown = Shown::default();
    let front = Screen::start(&leader, Role::Render, "front", 2, &shown).await;
    let table = Screen::start(&leader, Role::Render, "table", 5, &shown).await;
    front.show(80).await;
    table.show(80).await;
    show_together(&shown, 50).await;
    compare(&leader, 160).await;
    drop((front, table));
    assert!(leader.relay.as_ref().map_or(0, lost_down) > 0);
    assert_equal_frames(&shown, 50);
    let report = leader.server.frame_report().unwrap_or_default();
    assert_eq!(report.counts.mismatches, 0, "{report:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_stops_is_left_behind_and_taken_in_again() {
    let leader = Leader::start(Some(Swap::Immediate), None).await;
    let shown = Shown::default();
    let front = Screen::start(&leader, Role::Render, "front", 2, &shown).await;
    let table = Screen::start(&leader, Role::Render, "table", 2, &shown).await;
    let counts = || leader.server.frame_report().unwrap_or_default().counts;
    let synced = |name: &'static str| {
        let server = &leader.server;
        move || {
            let nodes = server.frame_report().unwrap_or_default().nodes;
            nodes
                .iter()
                .any(|(node, skew)| node == name && skew.count > 0)
        }
    };
    wait_until("step", synced("table")).await;

    let before = counts();
    table.paused.store(true, Ordering::SeqCst);
    front.show(30).await;
    wait_until("it runs free", || counts().freed > before.freed).await;
    let stopped_at = table.frames();
    front.show(10).await;
    assert!(table.frames() <= stopped_at + 1);

    table.paused.store(false, Ordering::SeqCst);
    table.show(20).await;
    show_together(&shown, 20).await;
    drop((front, table));
    assert_equal_frames(&shown, 20);
    assert_eq!(counts().mismatches, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_whose_session_ends_holds_nobody_up() {
    let leader = Leader::start(Some(Swap::Immediate), None).await;
    let shown = Shown::default();
    let front = Screen::start(&leader, Role::Render, "front", 2, &shown).await;
    let table = Screen::start(&leader, Role::Render, "table", 2, &shown).await;
    table.show(20).await;
    drop(table); // the link with it
    front.show(50).await;
    wait_until("parting", || leader.server.clients().len() == 1).await;
    front.show(5).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_leader_a_node_draws_on_its_own() {
    let leader = Leader::start(None, None).await;
    assert!(leader.server.frame_master().is_none() && leader.server.frame_report().is_none());
    let shown = Shown::default();
    let front = Screen::start(&leader, Role::Render, "front", 2, &shown).await;
    wait_until("turns", || front.free_turns.load(Ordering::SeqCst) > 200).await;
    assert_eq!((front.frames(), leader.server.counters().garbage), (0, 0));
    assert!(front.link.is_closed().is_none());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_observer_takes_no_part() {
    let leader = Leader::start(Some(Swap::Immediate), None).await;
    let shown = Shown::default();
    let observer = Screen::start(&leader, Role::Observer, "observer", 2, &shown).await;
    wait_until("refusal", || leader.server.counters().forbidden > 3).await;
    assert_eq!(observer.frames(), 0);
    let report = leader.server.frame_report().unwrap_or_default();
    assert_eq!(report.counts.released, 0);
}
