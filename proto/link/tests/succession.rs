//! Frames without the server over real sockets: the nodes go on together, led by one of them, until there is a server again.
//!
//! Nothing here measures: the report of `tests/network` does.

use crate::support::*;
use std::{
    collections::{HashMap, HashSet},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use taut_link::{
    ClientLink, ClientOptions, FrameTurn, LinkHealth, RejoinPolicy, Renewal, Role, ServerLink,
    ServerOptions, SupervisedLink,
};
use taut_proto::{
    Payload,
    barrier::{FRAMES_LEFT_OUT, Release, ReleaseHead, Swap},
};
use tokio::runtime::Runtime;

/// Silence after which nodes and server give each other up: a node leads after three tenths of it. Long for a busy machine, short for a test.
const SILENCE: Duration = Duration::from_secs(2);
/// Longest that a frame waits for a node.
const LOOSE_PATIENCE: Duration = Duration::from_millis(250);

/// A server that broadcasts and leads frames until it dies without a word.
struct Leader {
    workers: Vec<Worker>,
    server: Mortal,
    /// Fingerprints of all states that it broadcast.
    sent: Arc<Mutex<HashSet<u64>>>,
}

fn all<T>(shared: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Leader {
    fn start(addresses: Option<Addresses>) -> Leader {
        let options = ServerOptions {
            idle_timeout: FORGIVING,
            node_timeout: SILENCE,
            frames: Some(leading(Swap::Immediate)),
            ..ServerOptions::loopback(key('a'))
        };
        let server = Mortal::start(options, addresses);
        let sent = Arc::<Mutex<HashSet<u64>>>::default();
        let hashes = sent.clone();
        let workers = broadcasting(&server.link, move |state| {
            all(&hashes).extend(state.hash().ok());
        });
        Leader {
            workers,
            server,
            sent,
        }
    }

    fn die(self) -> Addresses {
        drop(self.workers);
        self.server.die()
    }

    /// Waits until so many nodes have told of ten frames that they showed together.
    fn in_step(&self, nodes: usize) {
        until("step", || {
            let report = self.server.link.frame_report().unwrap_or_default();
            report
                .nodes
                .iter()
                .filter(|(_, skew)| skew.count >= 10)
                .count()
                >= nodes
        });
    }
}

/// One frame as a node showed it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shown {
    frame: u64,
    state_hash: u64,
    swapped: Instant,
    /// Sessions that the node had had then.
    sessions: u64,
    lost: bool,
}

/// A node that joins again, and "draws" for some milliseconds per frame.
struct Screen {
    runtime: Option<Runtime>,
    /// Let go of when it can say nothing to anybody any more.
    _supervised: Arc<SupervisedLink<()>>,
    /// Its first link.
    first: Arc<ClientLink>,
    shown: Arc<Mutex<Vec<Shown>>>,
    worker: Option<Worker>,
}

fn joining(server: &ServerLink, node: &str) -> ClientOptions {
    options(server, Role::Render, node)
}

impl Screen {
    fn start(leader: &Leader, name: &str, draws_ms: u64) -> Screen {
        let runtime = runtime();
        let options = joining(&leader.server.link, name);
        let (supervised, first) = supervised(&runtime, options, RejoinPolicy::default());
        let supervised = Arc::new(supervised);
        let shown = Arc::<Mutex<Vec<Shown>>>::default();
        let own = (supervised.clone(), first.clone(), shown.clone());
        let body = move |is_over: &dyn Fn() -> bool| {
            let (supervised, mut link, shown) = own;
            let mut sessions = 1;
            let mut gate = link.frame_gate(Duration::ZERO);
            while !is_over() {
                match supervised.take_renewal() {
                    Some(Renewal::Session { link: next, .. }) => {
                        (link, sessions) = (next, sessions + 1);
                        gate = link.frame_gate(Duration::ZERO);
                    }
                    Some(Renewal::Ended(end)) => panic!("{end:?}"),
                    None => {}
                }
                let FrameTurn::Draw(released) = gate.turn() else {
                    std::thread::sleep(Duration::from_millis(1));
                    continue;
                };
                assert_eq!(released.state.hash(), Ok(released.state_hash));
                std::thread::sleep(Duration::from_millis(draws_ms));
                gate.arrive();
                if gate.wait().is_some() {
                    let swapped = Instant::now();
                    gate.swapped(swapped);
                    all(&shown).push(Shown {
                        frame: released.frame,
                        state_hash: released.state_hash,
                        swapped,
                        sessions,
                        lost: supervised.health() != LinkHealth::Connected,
                    });
                }
            }
            drop(gate);
        };
        Screen {
            runtime: Some(runtime),
            _supervised: supervised,
            first,
            shown,
            worker: Some(Worker::start(name, body)),
        }
    }

    /// Frames shown with numbers above this one.
    fn above(&self, frame: u64) -> Vec<Shown> {
        let shown = all(&self.shown);
        let above = shown.iter().filter(|shown| shown.frame > frame);
        above.copied().collect()
    }

    fn newest(&self) -> u64 {
        let shown = all(&self.shown);
        shown.last().map_or(0, |shown| shown.frame)
    }
}

/// As a crash: nothing is said to anybody.
impl Drop for Screen {
    fn drop(&mut self) {
        drop(self.worker.take());
        self.first.abandon();
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Frames above `frame` are the same at all nodes, of the state that is held, ascend, and at least `at_least` of them were shown by all.
fn assert_together(screens: &[&Screen], frame: u64, at_least: usize) {
    let mut frames: HashMap<u64, Vec<Shown>> = HashMap::new();
    for screen in screens {
        let shown = screen.above(frame);
        for pair in shown.windows(2) {
            assert!(pair[0].frame < pair[1].frame, "{pair:?}");
        }
        for shown in shown {
            frames.entry(shown.frame).or_default().push(shown);
        }
    }
    let hashes: HashSet<_> = frames.values().flatten().map(|s| s.state_hash).collect();
    assert_eq!(
        hashes.len(),
        1,
        "the state that was held last, and no other"
    );
    let whole: Vec<_> = frames
        .values()
        .filter(|shown| shown.len() == screens.len())
        .collect();
    assert!(whole.len() >= at_least, "{} frames by all", whole.len());
    let mut skews: Vec<_> = whole
        .iter()
        .map(|shown| {
            let times = || shown.iter().map(|shown| shown.swapped);
            times()
                .max()
                .zip(times().min())
                .map_or(Duration::MAX, |(last, first)| last - first)
        })
        .collect();
    skews.sort_unstable();
    println!(
        "median skew {:?}, largest {:?}",
        skews[skews.len() / 2],
        skews[skews.len() - 1]
    );
    // Nobody goes on for longer without the others, whatever the machine does now and then.
    assert!(skews[skews.len() / 2] < LOOSE_PATIENCE, "{skews:?}");
}

#[test]
fn nodes_swap_together_when_the_server_dies_and_when_their_leader_dies_until_the_next_server() {
    let leader = Leader::start(None);
    let screens = [("left", 3), ("middle", 7), ("right", 2)];
    let [left, middle, right] =
        screens.map(|(name, draws_ms)| Screen::start(&leader, name, draws_ms));
    leader.in_step(3);
    let (before, sent) = (left.newest(), leader.sent.clone());

    let addresses = leader.die();
    // The first that joined leads; its frames are above all that the server can have released meanwhile.
    let led_from = before + FRAMES_LEFT_OUT / 2;
    let everybody = [&left, &middle, &right];
    let many = |screens: &[&Screen], frame, count| {
        let enough = |screen: &&Screen| screen.above(frame).len() >= count;
        screens.iter().all(enough)
    };
    until("frames without a server", || many(&everybody, led_from, 40));
    // Also after the link has been given up.
    until("being lost", || {
        everybody
            .iter()
            .all(|screen| screen.first.is_closed().is_some())
    });
    let given_up = everybody.map(Screen::newest).into_iter().max().unwrap_or(0);
    until("frames without a link", || many(&everybody, given_up, 20));
    assert_together(&everybody, led_from, 40);
    let held = left.above(led_from)[0].state_hash;
    assert!(all(&sent).contains(&held), "the server sent it");
    assert!(
        left.above(given_up)
            .iter()
            .all(|shown| shown.lost && shown.sessions == 1)
    );

    // The one that leads dies: the next takes over.
    let led_from = given_up + FRAMES_LEFT_OUT / 2;
    drop(left);
    let two = [&middle, &right];
    until("frames without the first leader", || {
        many(&two, led_from, 40)
    });
    assert_together(&two, led_from, 30);
    assert_eq!(middle.above(led_from)[0].state_hash, held);

    // The next server: everybody comes back, and is in step.
    let again = Leader::start(Some(addresses));
    again.in_step(2);
    for screen in two {
        let newest = *all(&screen.shown)
            .last()
            .unwrap_or_else(|| panic!("frames"));
        assert_eq!(newest.sessions, 2);
        assert!(all(&again.sent).contains(&newest.state_hash));
        // Sockets and keys of the group before are of no use any more.
        let sent = screen.first.counters().packets_sent;
        std::thread::sleep(Duration::from_millis(200));
        assert_eq!(screen.first.counters().packets_sent, sent);
    }
    let report = again.server.link.frame_report().unwrap_or_default();
    assert_eq!((report.counts.mismatches, report.counts.reclaimed), (0, 0));
    drop((middle, right));
    again.die();
}

#[test]
fn a_member_that_lies_makes_nobody_draw_what_the_server_did_not_send_and_is_not_heard_while_it_lives()
 {
    let leader = Leader::start(None);
    let left = Screen::start(&leader, "left", 2);
    let right = Screen::start(&leader, "right", 2);
    let runtime = runtime();
    let liar = must(runtime.block_on(taut_link::connect(joining(&leader.server.link, "liar"))));
    leader.in_step(2);
    until("the roster", || {
        liar.roster().is_some_and(|roster| {
            roster.members.len() == 3
                && roster.members.iter().all(|member| member.address.is_some())
        })
    });
    let lie = |frame| {
        let head = ReleaseHead {
            term: 2,
            master: liar.session(),
            frame,
            period_us: 5_000,
            members: [left.first.session(), right.first.session()]
                .into_iter()
                .collect(),
            ..ReleaseHead::default()
        };
        let forged = state(77);
        let release = Payload::Release(Release {
            head,
            state: forged,
        });
        liar.send_to_member(left.first.session(), &release)
            && liar.send_to_member(right.first.session(), &release)
    };
    // While the server is heard, nothing of it counts. The keys of the others may be a moment younger.
    let refused = || left.first.counters().garbage;
    until("refusal", || {
        assert!(lie(left.newest() + 5000));
        refused() > 20
    });
    let before = left.newest();
    assert!(before < 5000, "frame {before}");
    let report = leader.server.link.frame_report().unwrap_or_default();
    assert_eq!((report.counts.mismatches, report.counts.reclaimed), (0, 0));

    // When the server is gone a member may disturb frames; the pictures stay those of the server.
    let sent = leader.sent.clone();
    leader.die();
    let mut frame = before + 100_000;
    until("frames of a liar", || {
        frame += 1;
        assert!(lie(frame));
        std::thread::sleep(Duration::from_millis(5));
        left.newest() > before + 100_000
    });
    for screen in [&left, &right] {
        for shown in screen.above(0) {
            assert!(all(&sent).contains(&shown.state_hash), "{shown:?}");
        }
    }
}
