//! A whole session behind a network whose delay grows slowly, under a virtual clock: what the hand is given, and how old what it feels is.
//!
//! The server is the three loops of a session with a remote device, the bridge is the bridge's own loop with its port, its clock filter
//! and its coupling; sealed datagrams travel between them. Sockets and threads alone are left out. What the bridge thinks of ages is
//! checked against the virtual clock, which it does not know.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use taut::loops::wiring::WiredLoops;
use taut::session::edge_sets::EdgeSets;
use taut_bridge::edge::{EdgeCoupler, offer_of};
use taut_bridge::{
    ArmWish, BridgeLoop, CommandSource, DEFAULT_MAX_AGE, DeviceLimits, DevicePort, EventKind, Grip,
    Hand, MAX_EDGE_DELAY, MinJerkPath, Passivity, PassivitySettings, Pose, RemoteDevice,
    SafetySettings, SimulatedDevice, ValidationSettings,
};
use taut_link::DeviceInput;
use taut_method_tests::hand::Random;
use taut_proto::time::{TimeRequest, TimeResponse};
use taut_proto::{
    Assembler, ClockFilter, ConstraintSet, CouplingOffer, InputSample, PartTaken, Payload,
    WrenchCommand,
};

use crate::edge::{Mode, god_object};
use crate::edge_network::{Impairment, Way};
use crate::edge_scenes::{Task, path};

/// Both ends tick this often.
const TICK: Duration = Duration::from_millis(1);
/// Zero of the bridge's clock on the session's.
const CLOCK_OFFSET: Duration = Duration::from_secs(12_345);
/// Time requests: quick ones at the join, and later.
const TIME_REQUESTS: (u32, u32, u32) = (16, 5, 50);
/// Bound of the promise: nothing is felt that rests on older data.
pub const ZERO_AFTER: Duration = SafetySettings::ZERO_AFTER;

/// How a delay grows with time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// It doubles in this time, from a millisecond on.
    Doubling(Duration),
    /// By as many seconds each second.
    Steady(f64),
    /// At once to the largest, for good.
    Jump,
    /// From anything to anything between none and the largest, by this seed, held for 20 to 400 ms each.
    Jumps(u64),
    /// It stays, but nothing comes through for anything up to the largest, by this seed, again and again, 20 to 400 ms after the last time.
    Pauses(u64),
}

/// How a network's delay grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// From when on.
    pub begin: Duration,
    /// Whether the way up and the way down are delayed.
    pub ways: [bool; 2],
    /// How it grows.
    pub course: Course,
    /// Largest delay.
    pub most: Duration,
}

impl Growth {
    /// A network that stays as it is.
    pub const NONE: Self = Self {
        begin: Duration::ZERO,
        ways: [false; 2],
        course: Course::Steady(0.0),
        most: Duration::ZERO,
    };

    fn delay_ns(&self, now: Duration, way: usize) -> u64 {
        if !self.ways[way] || now < self.begin {
            return 0;
        }
        let elapsed = now.saturating_sub(self.begin).as_secs_f64();
        let grown = match self.course {
            Course::Doubling(time) => 1e-3 * ((elapsed / time.as_secs_f64()).exp2() - 1.0),
            Course::Steady(slope) => slope * elapsed,
            Course::Jump => self.most.as_secs_f64(),
            Course::Jumps(seed) => self.jumped(seed, elapsed),
            Course::Pauses(_) => 0.0,
        };
        (grown.min(self.most.as_secs_f64()) * 1e9) as u64
    }

    fn jumped(&self, seed: u64, elapsed: f64) -> f64 {
        let mut random = Random(seed);
        let mut until = 0.0;
        loop {
            until += 0.02 + 0.38 * random.unit();
            let delay = self.most.as_secs_f64() * random.unit();
            if elapsed < until {
                return delay;
            }
        }
    }

    /// Whether what is sent now is lost.
    fn loses(&self, now: Duration, way: usize) -> bool {
        let Course::Pauses(seed) = self.course else {
            return false;
        };
        let elapsed = now.saturating_sub(self.begin).as_secs_f64();
        let mut random = Random(seed);
        let mut until = 0.0;
        while until <= elapsed {
            let begin = until + 0.02 + 0.38 * random.unit();
            until = begin + self.most.as_secs_f64() * random.unit();
            if (begin..until).contains(&elapsed) {
                return self.ways[way];
            }
        }
        false
    }
}

/// What a run showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Energy given to the hand beyond what it had put in, J.
    pub given: f64,
    /// Largest force felt before the delay began to grow, and after, N.
    pub largest: [f64; 2],
    /// Largest true age of the newest data that was here while a force was felt.
    pub oldest: Duration,
    /// True age of that data at the end.
    pub age_at_end: Duration,
    /// What the bridge's port told.
    pub events: Vec<EventKind>,
}

/// A ball that a light hand taps and rubs against the scene of `task`, again and again: centre of the motion and its reach there and back.
#[derive(Debug)]
pub struct Rubbing {
    task: Task,
    path: MinJerkPath,
}

impl Rubbing {
    /// Taps on a wall and slides along it.
    pub fn on_wall() -> Self {
        Self::along(
            Task::wall(),
            [
                [0.0, 0.0, 0.04],
                [0.0, 0.0, -0.015],
                [0.06, 0.0, -0.01],
                [0.06, 0.0, 0.022],
            ],
        )
    }

    /// Slides over a dome from side to side.
    pub fn over_dome() -> Self {
        Self::along(
            Task::dome(),
            [
                [-0.05, 0.0, 0.08],
                [-0.018, 0.0, 0.018],
                [0.018, 0.0, 0.018],
                [0.0, 0.0, 0.03],
            ],
        )
    }

    /// Holds still while a plate comes up at 0.1 m/s, lifts and tilts what is held and goes down again: the shipped scene, softer by hand.
    pub fn lifted_by_plate() -> Self {
        let start = Pose::translation(0.0, 0.0, 0.030);
        Self {
            task: Task::plate(),
            path: path(&[(0.0, start), (8.0, start)], true),
        }
    }

    /// Goes down on a wall in half a second and stays there, 15 mm deep if nothing held it.
    pub fn pressing_on_wall() -> Self {
        Self::down_on_wall(&[(0.0, 0.04), (0.5, 0.005)])
    }

    /// The same within so many seconds, once readings are good.
    pub fn coming_down_on_wall(seconds: f64) -> Self {
        Self::down_on_wall(&[(0.0, 0.04), (0.6, 0.04), (0.6 + seconds, 0.005)])
    }

    /// Heights (m) over a wall at these times (s).
    fn down_on_wall(heights: &[(f64, f64)]) -> Self {
        let via = |(time, z): &(f64, f64)| (*time, Pose::translation(0.0, 0.0, *z));
        Self {
            task: Task::wall(),
            path: path(&heights.iter().map(via).collect::<Vec<_>>(), false),
        }
    }

    /// Does once what the hand does in the study of coupling at the edge.
    pub fn once(task: Task) -> Self {
        let path = task.intention.clone();
        Self { task, path }
    }

    fn along(task: Task, places: [[f64; 3]; 4]) -> Self {
        let [first, pressed, slid, lifted] = places.map(|[x, y, z]| Pose::translation(x, y, z));
        let points = [
            (0.0, first),
            (0.5, pressed),
            (0.9, slid),
            (1.2, lifted),
            (1.5, slid),
            (2.0, first),
        ];
        let path = path(&points, true);
        Self { task, path }
    }
}

/// One run over `duration`; the same arguments give the same outcome.
pub fn run(rubbing: &Rubbing, mode: Mode, growth: Growth, duration: Duration) -> Outcome {
    // As `taut bridge` has it.
    run_with(Passivity::Control, rubbing, mode, growth, duration)
}

/// The same with this said of energy.
pub fn run_with(
    passivity: Passivity,
    rubbing: &Rubbing,
    mode: Mode,
    growth: Growth,
    duration: Duration,
) -> Outcome {
    let near = Impairment::new(0.3, 0.0);
    let [mut up, mut down] = [11, 12].map(|seed| Way::new(near, seed));
    let mut server = Server::new(&rubbing.task);
    let mut bridge = Bridge::new(rubbing, mode, passivity);
    let mut outcome = Outcome {
        given: 0.0,
        largest: [0.0; 2],
        oldest: Duration::ZERO,
        age_at_end: Duration::ZERO,
        events: Vec::new(),
    };
    let ticks = (duration.as_secs_f64() / TICK.as_secs_f64()) as u32;
    for tick in 1..=ticks {
        let now = TICK * tick;
        for (index, way) in [&mut up, &mut down].into_iter().enumerate() {
            way.set_delay(near.delay_ns + growth.delay_ns(now, index));
            way.loses_all = growth.loses(now, index);
        }
        let felt = bridge.tick(tick, now, &mut down, &mut up, &mut outcome.events);
        outcome.age_at_end = bridge.newest_data.map_or(now, |taken| now - taken);
        if felt > 0.0 {
            let after = usize::from(now >= growth.begin);
            outcome.largest[after] = outcome.largest[after].max(felt);
            outcome.oldest = outcome.oldest.max(outcome.age_at_end);
        }
        server.tick(now, &mut up, &mut down);
    }
    outcome.given = bridge.of.port().energy().injected();
    outcome
}

/// What disturbs a run.
#[derive(Clone, Debug, Default)]
pub struct Disturbance {
    /// How long everything is on its way, ms, beside 0.3 ms.
    pub delay_ms: f64,
    /// What an operator of the server wishes, and in which millisecond.
    pub wishes: Vec<(u32, ArmWish)>,
    /// Milliseconds in which all that leaves the bridge is lost, and all that leaves the server.
    pub lost: [Range<u32>; 2],
}

/// What is felt in each of `ticks` milliseconds, N; without control of energy, whose reserve is less than what a light hand is pushed back by.
pub fn felt_under(
    disturbance: &Disturbance,
    rubbing: &Rubbing,
    mode: Mode,
    ticks: u32,
) -> (Vec<f64>, Vec<EventKind>) {
    let near = Impairment::new(0.3 + disturbance.delay_ms, 0.0);
    let [mut up, mut down] = [11, 12].map(|seed| Way::new(near, seed));
    let mut server = Server::new(&rubbing.task);
    let mut bridge = Bridge::new(rubbing, mode, Passivity::Observe);
    let (mut felt, mut events) = (Vec::new(), Vec::new());
    for tick in 1..=ticks {
        let wished = disturbance.wishes.iter().filter(|(at, _)| *at == tick);
        wished.for_each(|(_, wish)| server.loops.arm_switch.wish(*wish));
        let now = TICK * tick;
        up.loses_all = disturbance.lost[0].contains(&tick);
        down.loses_all = disturbance.lost[1].contains(&tick);
        felt.push(bridge.tick(tick, now, &mut down, &mut up, &mut events));
        server.tick(now, &mut up, &mut down);
    }
    (felt, events)
}

/// The three loops, and what stands between them and the network.
struct Server {
    loops: WiredLoops,
    inputs: triple_buffer::Input<Option<DeviceInput>>,
    newest: u64,
    wrenches: triple_buffer::Output<WrenchCommand>,
    sets: EdgeSets,
}

impl Server {
    fn new(task: &Task) -> Self {
        let scene = &task.scene;
        let world = Arc::new(scene.world.clone());
        let (inputs, output) = triple_buffer::TripleBuffer::new(&None).split();
        let (device, wrenches) =
            RemoteDevice::new(output, DeviceLimits::UNLIMITED, DEFAULT_MAX_AGE);
        let default = ValidationSettings::default();
        let safety = SafetySettings {
            validation: ValidationSettings {
                max_age: default.max_age + MAX_EDGE_DELAY,
                time_slack: MAX_EDGE_DELAY,
                ..default
            },
            ..SafetySettings::default()
        };
        Self {
            loops: WiredLoops::new(
                &world,
                &scene.settings,
                god_object(task),
                Box::new(device),
                safety,
                None,
            )
            .with_motions(scene.motions.clone(), Duration::ZERO),
            inputs,
            newest: 0,
            wrenches,
            sets: EdgeSets::new(&scene.settings),
        }
    }

    fn tick(&mut self, now: Duration, up: &mut Way, down: &mut Way) {
        let now_ns = now.as_nanos() as u64;
        up.receive(now_ns, |payload| match payload {
            Payload::Input(sample) if sample.index > self.newest => {
                self.newest = sample.index;
                self.inputs.write(Some(DeviceInput {
                    sample,
                    received_ns: now_ns,
                    session: 1,
                }));
            }
            Payload::TimeRequest(TimeRequest { client_sent }) => {
                let response = TimeResponse {
                    client_sent,
                    server_received: now_ns,
                    server_sent: now_ns,
                };
                down.send(now_ns, &Payload::TimeResponse(response));
            }
            _ => {}
        });
        let loops = &mut self.loops;
        loops.haptics.tick(now);
        loops.coupling.tick(now);
        loops.god_object.tick(|| now);
        loops.coupling.tick(now);
        let view = &mut loops.readers.broadcast;
        let armed = view.device.newest().safety.gives;
        let fresh = self.wrenches.update();
        let command = self.wrenches.output_buffer();
        let contacts = view.contacts.newest();
        let at_edge = self.sets.tick(now, command, armed, contacts, |part| {
            down.send(now_ns, &Payload::Constraints(part));
        });
        if fresh && !at_edge {
            down.send(now_ns, &Payload::Wrench(*command));
        }
    }
}

/// The bridge's loop, and what stands between it and the network.
struct Bridge {
    of: BridgeLoop,
    clock: ClockFilter,
    assembler: Assembler,
    set: ConstraintSet,
    command: Option<WrenchCommand>,
    /// Stamps of readings and when they were truly taken, oldest first.
    stamps: VecDeque<(u64, Duration)>,
    /// When the reading was truly taken that the newest data here come from.
    newest_data: Option<Duration>,
}

impl Bridge {
    fn new(rubbing: &Rubbing, mode: Mode, passivity: Passivity) -> Self {
        let scene = &rubbing.task.scene;
        let point = scene.reference_point();
        let device =
            SimulatedDevice::new(Grip::workbench(), Hand::LIGHT, rubbing.path.clone(), point);
        let safety = SafetySettings {
            passivity: PassivitySettings::of(passivity),
            ..SafetySettings::default()
        };
        let port = DevicePort::new(Box::new(device), safety, point, &scene.start);
        let mut of = BridgeLoop::new(port);
        let edge = match mode {
            Mode::Shipped => None,
            Mode::Edge => match offer_of(&scene.world, &scene.settings, [], 1000.0) {
                Ok(CouplingOffer::AtEdge(offer)) => EdgeCoupler::new(&offer).ok(),
                other => panic!("{other:?}"),
            },
        };
        of.begin_session(CommandSource::Other, edge);
        Self {
            of,
            clock: ClockFilter::default(),
            assembler: Assembler::new(),
            set: ConstraintSet::new(),
            command: None,
            stamps: VecDeque::new(),
            newest_data: None,
        }
    }

    /// One period; the force that is felt, N.
    fn tick(
        &mut self,
        tick: u32,
        now: Duration,
        down: &mut Way,
        up: &mut Way,
        events: &mut Vec<EventKind>,
    ) -> f64 {
        let (now_ns, here) = (now.as_nanos() as u64, now + CLOCK_OFFSET);
        let here_ns = here.as_nanos() as u64;
        let (mut newest_stamp, mut whole) = (0, false);
        down.receive(now_ns, |payload| match payload {
            Payload::TimeResponse(response) => {
                assert!(self.clock.update(&response, here_ns));
            }
            Payload::Constraints(part) => {
                let taken = self.assembler.take(&part);
                whole |= matches!(taken, PartTaken::Whole | PartTaken::Repeated);
            }
            Payload::Wrench(command) => {
                newest_stamp = newest_stamp.max(command.origin_ns);
                self.command = Some(command);
            }
            _ => {}
        });
        if whole && let Some(set) = self.assembler.newest() {
            self.set.clone_from(set);
            newest_stamp = newest_stamp.max(set.head.device_ns);
        }
        self.note_data(newest_stamp);

        let session = self.clock.session_time(here_ns);
        if self.set.head.device_ns > 0 {
            self.of.take_set(&self.set, here, session);
        }
        let output = self.of.tick(here, session, self.command);
        events.extend(output.events.iter().map(|event| event.kind));
        let InputSample { sample_time_ns, .. } = output.input;
        self.stamps.push_back((sample_time_ns, now));
        up.send(now_ns, &Payload::Input(output.input));
        let (quick, often, seldom) = TIME_REQUESTS;
        let period = if tick <= quick * often { often } else { seldom };
        if tick.is_multiple_of(period) {
            let request = TimeRequest {
                client_sent: here_ns,
            };
            up.send(now_ns, &Payload::TimeRequest(request));
        }
        self.of.port().rendered().fixed_rows::<3>(0).norm()
    }

    /// Looks up when the reading of this stamp was truly taken.
    fn note_data(&mut self, stamp: u64) {
        while let Some((_, taken)) = self
            .stamps
            .pop_front_if(|(of, _)| *of <= stamp && stamp > 0)
        {
            self.newest_data = Some(taken);
        }
    }
}
