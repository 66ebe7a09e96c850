//! Coupling at the edge against shipping forces: a hand and a device at one end of a network, the god-object at the other.
//!
//! ```text
//!          bridge (1 kHz)                          server (1 kHz)
//!   device ─► coupling ─► force        pose ─►  god-object ─► constraint set      edge
//!   device ─► force                    pose ─►  god-object ─► coupling ─► wrench  shipped
//! ```
//!
//! Everything but sockets and threads is what runs in a session: codec, seals, assembly, look-ahead, coupling. Both ends tick every
//! millisecond of one virtual clock, whose zero differs between them as two machines' do; a run's bytes depend on its seed alone.
//!
//! The ideal is computed beside each run: a god-object and a coupling without any network, at the device's own poses. So an error is what
//! the network does to the force, not what another force then does to the hand.

use std::sync::Arc;
use std::time::Duration;

use god_object::{Coupling, GodObject};
use nalgebra::{Point3, Vector3, Vector6};
use taut_bridge::edge::{
    EdgeCoupler, device_ahead, device_predicted, offer_of, way_around, write_set,
};
use taut_bridge::{Device, EnergyObserver, Grip, Hand, Pose, SimulatedDevice};
use taut_proto::constraints::SetHead;
use taut_proto::input::INPUT_AT_EDGE;
use taut_proto::{
    Assembler, ConstraintSet, CouplingOffer, Division, InputSample, PartTaken, Payload, PoseF64,
    WrenchCommand,
};

use crate::edge_error::{Quantiles, jnd};
use crate::edge_network::{Impairment, Way};
use crate::edge_scenes::Task;

/// Both ends tick this often.
const TICK: Duration = Duration::from_millis(1);
/// Sets per second.
const SET_RATE_HZ: f64 = 1000.0;
/// Zero of the bridge's clock on the session's: any number, as between two machines.
const CLOCK_OFFSET: Duration = Duration::from_secs(12_345);
/// A force at rest may swing by this share of itself, as nobody can feel: the just-noticeable difference; and by this much, N.
const QUIET: (f64, f64) = (0.07, 0.1);

/// Where the force is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Beside the device, from constraint sets.
    Edge,
    /// At the server; forces travel.
    Shipped,
}

impl Mode {
    /// For tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Shipped => "shipped",
        }
    }
}

/// What a run showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// The force at rest swings by no more than can be felt.
    pub stable: bool,
    /// Swing of the force while the hand wants to stand still, peak to peak, N.
    pub ripple: f64,
    /// Force error in just-noticeable differences, over all samples at which the ideal or the felt force is not zero.
    pub error: Quantiles,
    /// Share of those samples with an error above one.
    pub noticed: f64,
    /// Energy that the device's port gave beyond what it had taken, J.
    pub injected: f64,
    /// Largest force felt, N.
    pub largest: f64,
    /// Datagrams that the server sent per second.
    pub datagrams_hz: f64,
    /// Bytes that the server sent per second.
    pub bytes_hz: f64,
}

/// One run of `task`; the same arguments give the same bytes.
pub fn run(task: &Task, mode: Mode, impairment: Impairment, seed: u64) -> Outcome {
    let (mut up, mut down) = (
        Way::new(impairment, 2 * seed + 1),
        Way::new(impairment, 2 * seed + 2),
    );
    let mut server = Server::new(task, mode);
    let mut bridge = Bridge::new(task, mode);
    let mut ideal = Ideal::new(task);
    let mut seen = Seen::default();
    let ticks = (task.duration / TICK.as_secs_f64()) as u32;
    for tick in 0..ticks {
        let now = TICK * tick;
        let (pose, felt) = bridge.tick(now, &mut down, &mut up);
        let right = ideal.wrench(now, &pose);
        seen.note(task, now, &felt, &right);
        server.tick(now, &mut up, &mut down);
    }
    let (datagrams, bytes) = down.sent();
    seen.outcome(
        bridge.energy.injected(),
        [datagrams, bytes].map(|count| count as f64 / task.duration),
    )
}

/// The god-object's end.
struct Server {
    mode: Mode,
    god_object: GodObject,
    coupling: Coupling,
    radius: f64,
    reference_point: Point3<f64>,
    separations: bool,
    newest: Option<InputSample>,
    wire: ConstraintSet,
}

impl Server {
    fn new(task: &Task, mode: Mode) -> Self {
        let scene = &task.scene;
        let world = Arc::new(scene.world.clone());
        Self {
            mode,
            god_object: god_object(task),
            coupling: Coupling::new(&world, &scene.settings),
            radius: world.body.mesh.radius_about(&world.body.reference_point),
            reference_point: scene.reference_point(),
            separations: scene.settings.implicit_rounds > 0,
            newest: None,
            wire: ConstraintSet::new(),
        }
    }

    fn tick(&mut self, now: Duration, up: &mut Way, down: &mut Way) {
        let now_ns = now.as_nanos() as u64;
        up.receive(now_ns, |payload| {
            if let Payload::Input(sample) = payload
                && self.newest.is_none_or(|newest| newest.index < sample.index)
            {
                self.newest = Some(sample);
            }
        });
        let Some(input) = self.newest else {
            return;
        };
        let Some(mut pose) = input.pose.to_isometry() else {
            return;
        };
        if self.mode == Mode::Edge {
            let age = |since_ns: u64| Duration::from_nanos(now_ns.saturating_sub(since_ns));
            let made = (input.set_made_ns > 0).then_some(input.set_made_ns);
            let way = way_around(age(input.sample_time_ns), made.map(age));
            let velocity = Vector6::from(input.velocity);
            let ahead = device_ahead(&velocity, self.radius, way, TICK);
            self.god_object.set_device_ahead(ahead);
            pose = device_predicted(&pose, &velocity, &self.reference_point, way, TICK);
        }
        self.god_object.step(&pose, None);
        let set = self.god_object.constraint_set();
        match self.mode {
            Mode::Shipped => {
                let output = self.coupling.step(now.as_secs_f64(), &pose, set);
                let command = WrenchCommand {
                    time_ns: now_ns,
                    origin_ns: input.sample_time_ns,
                    wrench: output.wrench.into(),
                    obstacle_work: self.coupling.obstacle_work(),
                    flags: 0,
                };
                down.send(now_ns, &Payload::Wrench(command));
            }
            Mode::Edge => {
                write_set(set, self.separations, &mut self.wire);
                self.wire.head = SetHead {
                    made_ns: now_ns,
                    device_ns: input.sample_time_ns,
                    ..self.wire.head
                };
                let division = Division::of(&self.wire);
                for part in 0..division.parts() {
                    let part = division.part(&self.wire, part);
                    down.send(now_ns, &Payload::Constraints(part));
                }
            }
        }
    }
}

/// The device's end.
struct Bridge {
    mode: Mode,
    device: SimulatedDevice,
    energy: EnergyObserver,
    index: u64,
    assembler: Assembler,
    coupler: EdgeCoupler,
    command: Option<WrenchCommand>,
}

impl Bridge {
    fn new(task: &Task, mode: Mode) -> Self {
        let scene = &task.scene;
        let offer = match offer_of(&scene.world, &scene.settings, [], SET_RATE_HZ) {
            Ok(CouplingOffer::AtEdge(offer)) => offer,
            other => panic!("{other:?}"),
        };
        let coupler = EdgeCoupler::new(&offer).unwrap_or_else(|error| panic!("{error}"));
        Self {
            mode,
            device: SimulatedDevice::new(
                Grip::workbench(),
                Hand::LIGHT,
                task.intention.clone(),
                scene.reference_point(),
            ),
            energy: EnergyObserver::new(scene.reference_point()),
            index: 0,
            assembler: Assembler::new(),
            coupler,
            command: None,
        }
    }

    /// One period; the device's pose and what it then renders.
    fn tick(&mut self, now: Duration, down: &mut Way, up: &mut Way) -> (Pose, Vector6<f64>) {
        let (now_ns, here) = (now.as_nanos() as u64, now + CLOCK_OFFSET);
        down.receive(now_ns, |payload| match payload {
            Payload::Constraints(part) => match self.assembler.take(&part) {
                PartTaken::Whole | PartTaken::Repeated => {
                    if let Some(set) = self.assembler.newest() {
                        let origin = CLOCK_OFFSET + Duration::from_nanos(set.head.device_ns);
                        let taken = self.coupler.take(set, origin);
                        assert_eq!(taken, Ok(()), "a whole set is a set");
                    }
                }
                PartTaken::Waiting | PartTaken::Overtaken => {}
                PartTaken::Refused => panic!("a part contradicts another one"),
            },
            Payload::Wrench(command)
                if self
                    .command
                    .is_none_or(|last| last.time_ns < command.time_ns) =>
            {
                self.command = Some(command);
            }
            _ => {}
        });
        let sample = self
            .device
            .read(here)
            .unwrap_or_else(|fault| panic!("{fault}"));
        let felt = self.coupler.step(here, &sample);
        let wrench = match self.mode {
            Mode::Edge => felt.map_or(Vector6::zeros(), |felt| felt.wrench),
            Mode::Shipped => self
                .command
                .map_or(Vector6::zeros(), |command| Vector6::from(command.wrench)),
        };
        self.device.write(here, &wrench);
        let rendered = *self.device.rendered_wrench();
        self.energy.step(&sample.pose, &rendered);
        self.index += 1;
        let input = InputSample {
            sample_time_ns: now_ns,
            clock_uncertainty_ns: 0,
            index: self.index,
            pose: PoseF64::from_isometry(&sample.pose),
            velocity: sample.velocity.into(),
            buttons: 0,
            flags: if self.mode == Mode::Edge {
                INPUT_AT_EDGE
            } else {
                0
            },
            rendered: rendered.into(),
            set_made_ns: self.coupler.set_made_ns(),
        };
        up.send(now_ns, &Payload::Input(input));
        (sample.pose, rendered)
    }
}

/// The force without a network, at the device's own poses.
struct Ideal {
    god_object: GodObject,
    coupling: Coupling,
    grip: Grip,
}

impl Ideal {
    fn new(task: &Task) -> Self {
        Self {
            god_object: god_object(task),
            coupling: Coupling::new(&task.scene.world, &task.scene.settings),
            grip: Grip::workbench(),
        }
    }

    fn wrench(&mut self, now: Duration, pose: &Pose) -> Vector6<f64> {
        self.god_object.step(pose, None);
        let set = self.god_object.constraint_set();
        let output = self.coupling.step(now.as_secs_f64(), pose, set);
        self.grip.saturated(&output.wrench)
    }
}

/// What is measured on the way.
#[derive(Default)]
struct Seen {
    errors: Vec<f64>,
    at_rest: Vec<Vector3<f64>>,
    right_at_rest: f64,
    largest: f64,
}

impl Seen {
    fn note(&mut self, task: &Task, now: Duration, felt: &Vector6<f64>, right: &Vector6<f64>) {
        let nothing = felt.norm() == 0.0 && right.norm() == 0.0;
        if !nothing {
            self.errors.push(jnd(felt, right));
        }
        let force: Vector3<f64> = felt.fixed_rows::<3>(0).into();
        self.largest = self.largest.max(force.norm());
        if task.rest.contains(&now.as_secs_f64()) {
            self.at_rest.push(force);
            self.right_at_rest += right.fixed_rows::<3>(0).norm();
        }
    }

    fn outcome(mut self, injected: f64, [datagrams_hz, bytes_hz]: [f64; 2]) -> Outcome {
        let count = self.at_rest.len().max(1) as f64;
        let mean = self.at_rest.iter().sum::<Vector3<f64>>() / count;
        let off = self.at_rest.iter().map(|force| (force - mean).norm());
        let ripple = 2.0 * off.fold(0.0, f64::max);
        let right = self.right_at_rest / count;
        let noticed = self.errors.iter().filter(|error| **error > 1.0).count();
        Outcome {
            stable: ripple <= (QUIET.0 * right).max(QUIET.1),
            ripple,
            noticed: noticed as f64 / self.errors.len().max(1) as f64,
            error: Quantiles::of(&mut self.errors),
            injected,
            largest: self.largest,
            datagrams_hz,
            bytes_hz,
        }
    }
}

/// The god-object of a task, at its start.
pub fn god_object(task: &Task) -> GodObject {
    let world = Arc::new(task.scene.world.clone());
    GodObject::new(world, task.scene.settings, task.scene.start)
        .unwrap_or_else(|error| panic!("{error}"))
}
