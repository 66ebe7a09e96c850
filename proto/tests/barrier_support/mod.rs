//! A virtual cluster: master and nodes as state machines, a network that loses, doubles and delays, nodes that die and stop.
#![allow(unreachable_pub, reason = "a test's own module")]

use proptest::prelude::*;
use std::collections::{BTreeMap, HashMap};
use taut_proto::barrier::{
    Answer, Arrive, Drawn, LEAD_NS, Master, MasterSettings, Newest, Node, REPEAT_NS, ReleaseHead,
    Succession, Successor, Swap, Turn,
};

use crate::{clock::Random, samples::varied};

const MS: u64 = 1_000_000;
/// Step of the virtual clock, ns.
const STEP: u64 = 100_000;
/// How long a world runs, ns.
const END: u64 = 2_500 * MS;
const SERVER: u16 = 0;

#[derive(Clone, Debug)]
pub struct World {
    nodes: Vec<NodePlan>,
    swap: Swap,
    period_ns: u64,
    /// Thousandths.
    lost: u64,
    doubled: u64,
    /// Longest way, in steps.
    delay: u64,
    server_dies: Option<u64>,
    /// Silent and deaf for a while from here on: start and length, ns.
    server_pauses: Option<(u64, u64)>,
    seed: u64,
}

#[derive(Clone, Debug)]
struct NodePlan {
    starts: u64,
    /// Shortest and longest drawing time, steps.
    draw: (u64, u64),
    /// Gone for good from here on.
    dies: Option<u64>,
    /// Stopped for a while from here on: start and length, ns.
    stops: Option<(u64, u64)>,
}

fn ms(range: std::ops::Range<u64>) -> impl Strategy<Value = u64> {
    range.prop_map(|ms| ms * MS)
}

fn any_plan() -> impl Strategy<Value = NodePlan> {
    varied!(NodePlan {
        starts: ms(0..400),
        draw: (1_u64..60, 1_u64..200).prop_map(|(low, more)| (low, low + more)),
        dies: prop::option::weighted(0.2, ms(500..2000)),
        stops: prop::option::weighted(0.3, (ms(500..1200), ms(10..900))),
    })
}

pub fn any_world() -> impl Strategy<Value = World> {
    varied!(World {
        nodes: prop::collection::vec(any_plan(), 1..5),
        swap: prop_oneof![Just(Swap::Immediate), Just(Swap::Scheduled)],
        period_ns: prop_oneof![Just(8_333_333_u64), Just(16_666_667), Just(100 * MS)],
        lost: 0_u64..300,
        doubled: 0_u64..300,
        delay: 0_u64..30,
        server_dies: Just(None),
        server_pauses: Just(None),
        seed: any::<u64>(),
    })
}

pub fn any_world_without_server() -> impl Strategy<Value = World> {
    (any_world(), 600_u64..1000).prop_map(|(mut world, at)| {
        for node in &mut world.nodes {
            // Early and alive long enough to have been in step; nobody stops for a while, because a node cannot tell that from death.
            node.starts /= 8;
            node.draw = (node.draw.0, node.draw.0 + 20);
            node.stops = None;
            node.dies = node.dies.map(|at| at.clamp(700 * MS, 1300 * MS));
        }
        // As good as a switch: who may rule is told by silence, so loss must not make silence.
        world.lost = world.lost.min(50);
        world.delay = world.delay.min(10);
        world.period_ns = world.period_ns.min(20 * MS);
        world.server_dies = Some(at * MS);
        world
    })
}

/// The same with a server that comes back: of the same epoch, with the numbers that it had.
pub fn any_world_whose_server_pauses() -> impl Strategy<Value = World> {
    (any_world_without_server(), 50_u64..900).prop_map(|(mut world, long)| {
        let at = world.server_dies.take().unwrap_or_default();
        world.server_pauses = Some((at, long * MS));
        world
    })
}

/// When, of which term, which frame.
type Moment = (u64, (u64, u16), u64);

/// What was seen of the outside.
#[derive(Debug, Default)]
pub struct Seen {
    /// RELEASEs as sent: when, rank, frame.
    releases: Vec<Moment>,
    /// What a frame of a term shows, by all nodes that showed it.
    states: HashMap<((u64, u16), u64), Vec<u64>>,
    /// When each node showed which frame of which term.
    shown: BTreeMap<u16, Vec<Moment>>,
    mismatches: u64,
    /// Longest that a frame stayed open beyond what the master allows, ns.
    overdue: u64,
}

#[derive(Clone, Debug)]
enum Packet {
    Arrive(u16, u16, Arrive),
    Release(u16, ReleaseHead, Newest),
}

struct Network {
    random: Random,
    lost: u64,
    doubled: u64,
    delay: u64,
    /// When, what.
    under_way: Vec<(u64, Packet)>,
}

impl Network {
    fn roll(&mut self, below: u64) -> u64 {
        self.random.below(below.max(1))
    }

    fn send(&mut self, now: u64, packet: &Packet) {
        let copies = 1 + u64::from(self.roll(1000) < self.doubled);
        for _ in 0..copies {
            if self.roll(1000) >= self.lost {
                let way = STEP * (1 + self.roll(self.delay + 1));
                self.under_way.push((now + way, packet.clone()));
            }
        }
    }

    fn arrived(&mut self, now: u64) -> Vec<Packet> {
        let mut here = Vec::new();
        self.under_way.retain(|(at, packet)| {
            let due = *at <= now;
            if due {
                here.push(packet.clone());
            }
            !due
        });
        here
    }
}

/// A master with what it sends.
struct Leading {
    master: Master,
    state: Newest,
    /// What the newest RELEASE carried.
    sent: Newest,
    allowed: u64,
    /// When that was.
    last: Option<u64>,
    /// When the second copy of the newest RELEASE.
    again: Option<u64>,
}

struct Screen {
    id: u16,
    plan: NodePlan,
    node: Node,
    succession: Succession,
    leading: Option<Leading>,
    /// State of the newest RELEASE.
    tuple: Newest,
    /// What is being drawn: until when, frame, term, state.
    drawing: Option<(u64, u64, (u64, u16), Newest)>,
    drawn: Option<(u64, (u64, u16), Newest)>,
    heard_server: u64,
}

impl Screen {
    fn is_up(&self, now: u64) -> bool {
        let stopped = |(at, long): (u64, u64)| (at..at + long).contains(&now);
        now >= self.plan.starts
            && self.plan.dies.is_none_or(|dies| now < dies)
            && !self.plan.stops.is_some_and(stopped)
    }

    /// Whether it still draws; what it has drawn by now is told.
    fn is_drawing(&mut self, now: u64) -> bool {
        if let Some((until, frame, rank, state)) = self.drawing {
            if now < until {
                return true;
            }
            self.drawing = None;
            self.drawn = Some((frame, rank, state));
            self.node.drawn(
                now,
                Drawn {
                    state_hash: state.hash,
                    state_time_ns: state.time_ns,
                    ready_ns: now,
                    draw_us: 0,
                },
            );
        }
        false
    }

    fn take_turn(&mut self, now: u64, network: &mut Network, seen: &mut Seen) {
        match self.node.turn(now) {
            Turn::Free | Turn::Wait { .. } => {}
            Turn::Draw { frame } => {
                let (low, high) = self.plan.draw;
                let takes = STEP * (low + network.roll(high - low));
                let rank = self.node.newest().map_or((0, 0), ReleaseHead::rank);
                self.drawing = Some((now + takes, frame, rank, self.tuple));
            }
            Turn::Swap { frame, swap_ns } if swap_ns <= now => {
                if let Some((drawn, rank, state)) = self.drawn.take() {
                    assert_eq!(drawn, frame);
                    seen.states
                        .entry((rank, frame))
                        .or_default()
                        .push(state.hash);
                    seen.shown
                        .entry(self.id)
                        .or_default()
                        .push((now, rank, frame));
                }
                self.node.swapped(now);
            }
            Turn::Swap { .. } => {}
        }
    }
}

impl World {
    fn settings(&self) -> MasterSettings {
        MasterSettings {
            swap: self.swap,
            period_ns: self.period_ns,
            slowest_ns: 100 * MS,
        }
    }

    fn server_is_up(&self, now: u64) -> bool {
        let paused = |(at, long): (u64, u64)| (at..at + long).contains(&now);
        self.server_dies.is_none_or(|dies| now < dies) && !self.server_pauses.is_some_and(paused)
    }

    pub fn run(&self) -> Seen {
        let mut seen = Seen::default();
        let mut network = Network {
            random: Random(self.seed),
            lost: self.lost,
            doubled: self.doubled,
            delay: self.delay,
            under_way: Vec::new(),
        };
        let master = Master::new(self.settings(), SERVER, 1, 1);
        let mut server = Leading::new(master, Newest::default());
        let mut screens: Vec<_> = (1_u16..)
            .zip(&self.nodes)
            .map(|(id, plan)| Screen {
                id,
                plan: plan.clone(),
                node: Node::new(id, 0),
                succession: Succession::new(id, plan.starts),
                leading: None,
                tuple: Newest::default(),
                drawing: None,
                drawn: None,
                heard_server: 0,
            })
            .collect();
        for now in (0..END).step_by(STEP as usize) {
            for packet in network.arrived(now) {
                self.deliver(now, packet, &mut server, &mut screens, &mut network);
            }
            if self.server_is_up(now) {
                server.state = Newest {
                    hash: now / MS + 1,
                    time_ns: now / MS * MS,
                };
                server.lead(now, &mut network, &mut seen);
                // The state stream, which every node hears but for losses.
                for screen in screens.iter_mut().filter(|screen| screen.is_up(now)) {
                    if now % MS == 0 && network.roll(1000) >= self.lost {
                        screen.heard_server = now;
                    }
                }
            }
            for screen in &mut screens {
                if screen.is_up(now) {
                    self.step(now, screen, &mut network, &mut seen);
                }
            }
        }
        seen.mismatches = server.master.counts().mismatches;
        seen
    }

    fn deliver(
        &self,
        now: u64,
        packet: Packet,
        server: &mut Leading,
        screens: &mut [Screen],
        network: &mut Network,
    ) {
        match packet {
            Packet::Arrive(from, to, arrive) if to == SERVER => {
                if self.server_is_up(now) {
                    server.answer(now, from, &arrive, network);
                }
            }
            Packet::Arrive(from, to, arrive) => {
                let screen = &mut screens[usize::from(to) - 1];
                if screen.is_up(now)
                    && let Some(term) = &mut screen.leading
                {
                    term.answer(now, from, &arrive, network);
                }
            }
            Packet::Release(to, head, state) => {
                let screen = &mut screens[usize::from(to) - 1];
                if screen.is_up(now) {
                    screen.succession.release(now, &head);
                    if screen.node.release(now, &head) {
                        screen.tuple = state;
                    }
                }
            }
        }
    }

    fn step(&self, now: u64, screen: &mut Screen, network: &mut Network, seen: &mut Seen) {
        let newest = screen.node.newest();
        if newest.is_none_or(|newest| newest.master == SERVER) {
            screen.succession.hear(screen.heard_server);
        }
        if self.server_dies.is_some() || self.server_pauses.is_some() {
            self.succeed(now, screen, network, seen);
        }
        if screen.is_drawing(now) {
            return;
        }
        screen.take_turn(now, network, seen);
        if let Some(appeal) = screen.node.appeal(now) {
            network.send(now, &Packet::Arrive(screen.id, SERVER, appeal));
        }
        if let Some(message) = screen.node.message(now) {
            let master = screen.node.master();
            network.send(now, &Packet::Arrive(screen.id, master, message));
        }
    }

    /// Stands in for the server, or resigns.
    fn succeed(&self, now: u64, screen: &mut Screen, network: &mut Network, seen: &mut Seen) {
        match screen.succession.poll(now) {
            Successor::No => {}
            Successor::Resign => screen.leading = None,
            Successor::Stand { term, first } => {
                let mut master = Master::new(self.settings(), screen.id, term, first);
                let members = screen.node.newest().map(|newest| newest.members.clone());
                master.expect(now, &members.unwrap_or_default());
                screen.leading = Some(Leading::new(master, screen.tuple));
            }
        }
        if let Some(term) = &mut screen.leading {
            term.lead(now, network, seen);
        }
    }
}

impl Leading {
    fn new(master: Master, state: Newest) -> Leading {
        Leading {
            master,
            state,
            sent: state,
            allowed: 0,
            last: None,
            again: None,
        }
    }

    fn answer(&mut self, now: u64, from: u16, arrive: &Arrive, network: &mut Network) {
        let (answer, _) = self.master.arrive(now, from, arrive);
        if answer == Answer::Repeat
            && let Some(newest) = self.master.newest()
        {
            network.send(now, &Packet::Release(from, newest.clone(), self.sent));
        }
    }

    fn lead(&mut self, now: u64, network: &mut Network, seen: &mut Seen) {
        // The longest patience since the last release.
        self.allowed = self.allowed.max(self.master.patience_ns());
        if self.master.wake_ns().is_none() {
            self.last = None; // nobody is there: nobody waits
        }
        let fresh = self
            .master
            .poll(now, self.state)
            .map(|(head, _)| head.clone());
        if let Some(head) = &fresh {
            self.sent = self.state;
            let allowed = std::mem::replace(&mut self.allowed, 0) + LEAD_NS + STEP;
            if let Some(last) = self.last.replace(now) {
                seen.overdue = seen.overdue.max((now - last).saturating_sub(allowed));
            }
            self.again = Some(now + REPEAT_NS);
            seen.releases.push((now, head.rank(), head.frame));
        }
        let copy = self.again.is_some_and(|at| now >= at);
        if copy {
            self.again = None;
        }
        if (fresh.is_some() || copy)
            && let Some(head) = self.master.newest().cloned()
        {
            for &member in &head.members {
                network.send(now, &Packet::Release(member, head.clone(), self.sent));
            }
        }
    }
}

impl Seen {
    /// Frames ascend everywhere, and equal frames show equal states.
    pub fn assert_truth(&self) -> Result<(), TestCaseError> {
        for ((rank, frame), states) in &self.states {
            prop_assert!(
                states.windows(2).all(|pair| pair[0] == pair[1]),
                "{rank:?} {frame}: {states:?}"
            );
        }
        for (node, shown) in &self.shown {
            for pair in shown.windows(2) {
                prop_assert!(
                    (pair[0].1, pair[0].2) < (pair[1].1, pair[1].2),
                    "node {node}: {pair:?}"
                );
            }
        }
        let mut last = HashMap::new();
        for (_, rank, frame) in &self.releases {
            let before = last.insert(*rank, *frame);
            prop_assert!(before.is_none_or(|before| before < *frame));
        }
        prop_assert_eq!(self.mismatches, 0);
        Ok(())
    }

    /// No frame waited longer than the deadline, and whoever was up to the end showed frames to the end.
    pub fn assert_progress(&self, world: &World) -> Result<(), TestCaseError> {
        prop_assert!(self.overdue == 0, "{} ns overdue", self.overdue);
        for (id, plan) in (1_u16..).zip(&world.nodes) {
            let back = plan.stops.map_or(plan.starts, |(at, long)| at + long);
            if plan.dies.is_some() || back + 800 * MS > END {
                continue;
            }
            let last = self.shown.get(&id).and_then(|shown| shown.last());
            prop_assert!(
                last.is_some_and(|(at, ..)| at + 400 * MS > END),
                "node {}: {:?}",
                id,
                last
            );
        }
        Ok(())
    }

    /// At the end all the living that were in step when the server paused show frames of the server again.
    pub fn assert_server_leads(&self, world: &World) -> Result<(), TestCaseError> {
        let Some((paused, _)) = world.server_pauses else {
            return Ok(());
        };
        for (id, plan) in (1_u16..).zip(&world.nodes) {
            let shown = self.shown.get(&id).map_or(&[][..], Vec::as_slice);
            let was_in = shown.iter().any(|(at, ..)| at + 100 * MS < paused);
            if plan.dies.is_none() && was_in {
                let last = shown.last().filter(|(at, ..)| at + 200 * MS > END);
                let master = last.map(|(_, rank, _)| u16::MAX - rank.1);
                prop_assert_eq!(master, Some(SERVER), "node {}: {:?}", id, shown.last());
            }
        }
        Ok(())
    }

    /// At the end all the living that were in step when the server died show frames of one and the same master.
    pub fn assert_one_master(&self, world: &World) -> Result<(), TestCaseError> {
        let Some(died) = world.server_dies else {
            return Ok(());
        };
        let mut ranks = Vec::new();
        for (id, plan) in (1_u16..).zip(&world.nodes) {
            let shown = self.shown.get(&id).map_or(&[][..], Vec::as_slice);
            let was_in = shown.iter().any(|(at, ..)| at + 100 * MS < died);
            if plan.dies.is_none() && was_in {
                let last = shown.last().filter(|(at, ..)| at + 200 * MS > END);
                prop_assert!(
                    last.is_some(),
                    "node {} stands still: {:?}",
                    id,
                    shown.last()
                );
                ranks.extend(last.map(|(_, rank, _)| *rank));
            }
        }
        prop_assert!(ranks.windows(2).all(|pair| pair[0] == pair[1]), "{ranks:?}");
        prop_assert!(ranks.iter().all(|rank| rank.0 > 1), "{ranks:?}");
        Ok(())
    }
}
