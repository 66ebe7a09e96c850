//! Frames, members of the group, numbers out of range.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::proto::barrier::{Arrive, MAX_MEMBERS, MOST_TERMS_AHEAD, Swap};
use taut_link::proto::events::EventAck;
use taut_link::proto::header::MAX_DATAGRAM_BYTES;
use taut_link::proto::state::RunState;
use taut_link::proto::{Group, Holder, JoinKey, Payload, confirmation};
use taut_link::{
    ClientLink, ClusterKey, FrameReport, FrameTurn, LinkError, LinkEvent, MulticastOptions,
    ReceivedState, Role, ServerLink, ServerOptions, serve,
};
use tokio::runtime::Runtime;

use super::liar::{Liar, multicast_works, to_groups};
use super::{Attack, Finding};
use crate::bench::skew::settings;
use crate::bench::{
    BenchError, enter, free_group, runtime, server_options, small_content, state, wait_until,
};
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "slow_node",
        tried: "a render node that says it draws a frame in two seconds joins two that draw sixty a second",
        promised: "the wall keeps its rate, and the node is named",
        run: slow_node,
    },
    Attack {
        name: "one-too-many",
        tried: "33 render nodes come to a server that keeps frames together, then one leaves and the last comes again",
        promised: "32 are in; the last is told why it is not and what to do, and gets the place that is left",
        run: one_too_many,
    },
    Attack {
        name: "last_term",
        tried: "a render node claims terms at the end of the numbers, and of the window that counts, under its own keys",
        promised: "the numbers are refused, the server leads on, and its term stays where a successor's fits above it",
        run: last_term,
    },
    Attack {
        name: "forged_states",
        tried: "an observer seals states in the server's name under the group's key: no force, a god-object elsewhere, a tick of the far future",
        promised: "within 250 ms of the first the render node takes no state of the group, names it, and draws the server's; none of them counts as the server's word",
        run: forged_states,
    },
];

const FRAME: Duration = Duration::from_nanos(16_666_667);

/// A server that keeps sixty frames a second together.
fn serve_frames(
    runtime: &Runtime,
    key: &ClusterKey,
    max_clients: usize,
) -> Result<ServerLink, BenchError> {
    let options = ServerOptions {
        frames: Some(settings(Swap::Immediate, 60)),
        max_clients,
        ..server_options(key)
    };
    Ok(runtime.block_on(serve(options, small_content()))?)
}

fn report(server: &ServerLink) -> FrameReport {
    server.frame_report().unwrap_or_default()
}

fn credential(key: &ClusterKey, role: Role, node: &str) -> JoinKey {
    key.credential(role, Holder::Node(node.to_owned()), 1)
        .into()
}

/// Sends a state a millisecond, tells frames, and lets `screens` draw, until `done` has run.
fn while_serving<T>(
    server: &ServerLink,
    screens: &[(&ClientLink, Duration)],
    done: impl FnOnce() -> Result<T, BenchError>,
) -> Result<T, BenchError> {
    let over = AtomicBool::new(false);
    let over = &over;
    std::thread::scope(|scope| {
        let (mut broadcaster, clock) = (server.broadcaster(), server.clock());
        thread(scope, "states", move || {
            while !over.load(Ordering::SeqCst) {
                let now_ns = clock.now_ns();
                broadcaster.send(&state(now_ns / 1_000_000 + 1, now_ns, false));
                std::thread::sleep(Duration::from_millis(1));
            }
        })?;
        if let Some(mut master) = server.frame_master() {
            let lead = move || master.run(&|| over.load(Ordering::SeqCst));
            thread(scope, "frames", lead)?;
        }
        for (screen, period) in screens {
            thread(scope, "screen", move || draw(screen, *period, over))?;
        }
        let result = done();
        over.store(true, Ordering::SeqCst);
        result
    })
}

fn thread<'scope>(
    scope: &'scope std::thread::Scope<'scope, '_>,
    name: &str,
    body: impl FnOnce() + Send + 'scope,
) -> Result<(), BenchError> {
    let builder = std::thread::Builder::new().name(name.to_owned());
    builder.spawn_scoped(scope, body)?;
    Ok(())
}

/// A screen that takes `period` for a frame, or says that it does.
fn draw(screen: &ClientLink, period: Duration, over: &AtomicBool) {
    let mut gate = screen.frame_gate(period);
    while !over.load(Ordering::SeqCst) {
        match gate.turn() {
            FrameTurn::Free => std::thread::sleep(Duration::from_millis(2)),
            FrameTurn::Draw(_) => {
                // Most of it in pieces: the attack ends when it ends.
                let drawn = Instant::now() + period.mul_f64(0.2);
                while Instant::now() < drawn && !over.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                gate.arrive();
                gate.wait();
                gate.swapped(Instant::now());
            }
        }
    }
}

fn one_too_many(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(1)?, ClusterKey::generate()?);
    let server = serve_frames(&runtime, &key, 2 * MAX_MEMBERS)?;
    let join = |number: usize| {
        let node = format!("node{number}");
        enter(&runtime, &server, &key, Role::Render, &node)
    };
    let mut inside = Vec::new();
    for number in 0..MAX_MEMBERS {
        inside.push(join(number)?);
    }
    let refusal = match join(MAX_MEMBERS) {
        Err(LinkError::Refused { text, .. }) => text.to_string(),
        Err(error) => return Err(error.into()),
        Ok(_) => String::new(),
    };
    if let Some(first) = inside.pop() {
        runtime.block_on(first.close());
    }
    wait_until("the place that is left", || {
        server.clients().len() < MAX_MEMBERS
    })?;
    let comes_later = join(MAX_MEMBERS).is_ok();
    Ok(Finding {
        happened: format!(
            "{MAX_MEMBERS} are in; the next one: \"{refusal}\"; in the place that was left: {comes_later}"
        ),
        kept: refusal.contains("stop one, or set swap") && comes_later,
    })
}

fn slow_node(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(1)?, ClusterKey::generate()?);
    let server = serve_frames(&runtime, &key, MAX_MEMBERS)?;
    let join = |node| enter(&runtime, &server, &key, Role::Render, node);
    let (left, right, slow) = (join("left")?, join("right")?, join("slow")?);
    let screens = [
        (&left, FRAME / 2),
        (&right, FRAME / 2),
        (&slow, Duration::from_secs(2)),
    ];
    let (mut named, mut rate) = (false, 0.0);
    while_serving(&server, &screens, || {
        wait_until("the slow node is named", || {
            while let Some(event) = server.try_event() {
                named |=
                    matches!(event, LinkEvent::FreeRunning { node, free: true } if node == "slow");
            }
            named
        })?;
        let (before, start) = (report(&server).counts.released, Instant::now());
        std::thread::sleep(Duration::from_secs(1));
        let released = report(&server).counts.released - before;
        rate = released as f64 / start.elapsed().as_secs_f64();
        Ok(())
    })?;
    // A busy machine may lose some of sixty; the attack left one.
    let report = report(&server);
    Ok(Finding {
        happened: format!(
            "{rate:.0} frames a second; {} swaps on its own",
            report.free_running.join(", ")
        ),
        kept: named && rate > 15.0 && report.free_running == ["slow"],
    })
}

fn last_term(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(1)?, ClusterKey::generate()?);
    let server = serve_frames(&runtime, &key, MAX_MEMBERS)?;
    let left = enter(&runtime, &server, &key, Role::Render, "left")?;
    let key = credential(&key, Role::Render, "liar");
    let liar = runtime.block_on(Liar::join(&server, &key, Role::Render, "liar"))?;
    while_serving(&server, &[(&left, FRAME / 2)], || {
        let steady = || report(&server).counts.released > 20;
        wait_until("frames", steady)?;
        let before = report(&server).counts;
        let claim = |term| {
            liar.say(&Payload::Arrive(Arrive {
                term,
                frame: before.released + 1,
                ..Arrive::default()
            }))
        };
        // At the end of 32 bits, and one beyond the window; a number beyond its range does not even seal.
        let claims = [u64::from(u32::MAX), 2 + MOST_TERMS_AHEAD];
        for term in claims {
            claim(term)?;
        }
        let beyond = claim(u64::MAX).is_err();
        // Of an event that there was not: it would end what is repeated for the others.
        let garbage = server.counters().garbage;
        liar.say(&Payload::EventAck(EventAck { newest: 1 << 30 }))?;
        wait_until("the acknowledgement is refused", || {
            server.counters().garbage > garbage
        })?;
        wait_until("the claims arrive", || {
            report(&server).counts.refused >= before.refused + claims.len() as u64
        })?;
        // One at the edge of the window counts: the server leads on above it.
        claim(1 + MOST_TERMS_AHEAD)?;
        wait_until("the server leads on", || {
            let now = report(&server).counts;
            now.reclaimed > before.reclaimed && now.released > before.released + 20
        })?;
        let counts = report(&server).counts;
        let status = left.counters();
        Ok(Finding {
            happened: format!(
                "{} claims refused, {} counted; {} frames released since; the other node refused {} datagrams",
                counts.refused - before.refused,
                counts.reclaimed - before.reclaimed,
                counts.released - before.released,
                status.garbage
            ),
            kept: beyond && counts.reclaimed == before.reclaimed + 1 && status.garbage == 0,
        })
    })
}

/// What came of forged states.
#[derive(Default)]
struct Forging {
    alarms_before: u64,
    sent: u32,
    drawn: usize,
    /// After the first of them.
    found: Option<Duration>,
}

impl Forging {
    /// `liar` sends them to the group at `address` for 5 s, or until `screen` has withdrawn its states.
    fn run(
        server: &ServerLink,
        screen: &ClientLink,
        (liar, group): (&Liar, &Group),
        address: SocketAddrV4,
    ) -> Result<Self, BenchError> {
        let mut states = Vec::new();
        // Genuine ones first, that none of the group's are refused for nothing.
        std::thread::sleep(Duration::from_millis(300));
        screen.drain_states(&mut states);
        let mut forging = Self {
            alarms_before: screen.states_withdrawn(),
            ..Self::default()
        };
        let (mut sealer, socket) = (liar.as_server(group), to_groups()?);
        let begun = Instant::now();
        while forging.found.is_none() && begun.elapsed() < Duration::from_secs(5) {
            let now_ns = server.clock().now_ns();
            let mut forged = state(now_ns / 1_000_000 + 5, now_ns, false);
            forged.run = RunState::Paused;
            forged.tools[0].god_object.position[1] = 0.5;
            if forging.sent % 5 == 4 {
                forged.tick = 1 << 50;
            }
            let mut buffer = [0; MAX_DATAGRAM_BYTES];
            let datagram = sealer.seal(&Payload::Hot(forged), u64::MAX / 4, &mut buffer);
            let datagram = datagram.map_err(BenchError::missing)?;
            socket.send_to(datagram, &address.into())?;
            forging.sent += 1;
            std::thread::sleep(Duration::from_millis(2));
            states.clear();
            screen.drain_states(&mut states);
            let is_forged = |state: &&ReceivedState| state.state.run == RunState::Paused;
            let mut drawn = states.iter().filter(is_forged);
            forging.drawn += drawn.clone().count();
            if drawn.any(|state| state.of_server().is_some()) {
                return Err(BenchError::missing("a forged state counts as the server's"));
            }
            if screen.states_withdrawn() > forging.alarms_before {
                forging.found = Some(begun.elapsed());
            }
        }
        Ok(forging)
    }

    fn finding(self) -> Finding {
        let (sent, alarms_before) = (self.sent, self.alarms_before);
        let Some(found) = self.found else {
            return Finding {
                happened: format!("{sent} forged states, not found"),
                kept: false,
            };
        };
        let patience = Duration::from_nanos(confirmation::PATIENCE_NS);
        Finding {
            happened: format!(
                "found {} ms after the first of {sent} forged states, {} of which could be drawn; named; states by unicast again; {alarms_before} false alarms before",
                found.as_millis(),
                self.drawn
            ),
            // A machine that does not run the receiving thread in time does not draw either.
            kept: found < patience.max(Duration::from_secs(1)) && alarms_before == 0,
        }
    }
}

fn forged_states(_: &Extent) -> Result<Finding, BenchError> {
    let group = free_group(Ipv4Addr::LOCALHOST)?;
    if !multicast_works(group) {
        return Ok(Finding {
            happened: "not measured: this system gives no multicast on loopback".to_owned(),
            kept: true,
        });
    }
    let (runtime, key) = (runtime(1)?, ClusterKey::generate()?);
    let options = ServerOptions {
        multicast: Some(MulticastOptions {
            group,
            announced: None,
            interface: Ipv4Addr::LOCALHOST,
        }),
        ..server_options(&key)
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let screen = enter(&runtime, &server, &key, Role::Render, "screen")?;
    let observer = credential(&key, Role::Observer, "liar");
    let mut liar = runtime.block_on(Liar::join(&server, &observer, Role::Observer, "liar"))?;
    let known = runtime.block_on(liar.group_with("screen"))?;
    while_serving(&server, &[], || {
        let by_multicast = || {
            let clients = server.clients();
            let mut screens = clients.iter().filter(|client| client.node == "screen");
            screens.any(|client| client.by_multicast)
        };
        wait_until("states by multicast", by_multicast)?;
        let forging = Forging::run(&server, &screen, (&liar, &known), group)?;
        wait_until("it is named", || {
            let mut events = std::iter::from_fn(|| server.try_event());
            events
                .any(|event| matches!(event, LinkEvent::StatesForged { node } if node == "screen"))
        })?;
        wait_until("states by unicast", || !by_multicast())?;
        // From now on the server's alone, whatever the liar goes on saying.
        let (mut states, mut genuine) = (Vec::new(), 0);
        wait_until("the server's states", || {
            states.clear();
            screen.drain_states(&mut states);
            genuine += states.iter().filter(|s| s.of_server().is_some()).count();
            genuine >= 100
        })?;
        Ok(forging.finding())
    })
}
