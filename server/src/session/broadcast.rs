//! The broadcaster: the newest shared data as one state, 1000 times a second, to every client.
//!
//! On a thread of its own: a slow socket costs the loops nothing. Here the method's types end and the wire's begin.

use std::sync::atomic::AtomicU64;
use std::time::Duration;

use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, Vector6, angular, at_reference_point, linear, pose_difference};
use god_object::{ConstraintSet, NonPenetrationConstraint};
use taut_bridge::ArmingState;
use taut_link::Broadcaster;
use taut_proto::state::{
    BodyState, ContactState, HEAD_TRACKED, HeadState, MAX_CONTACTS, RunState, TOOL_DEVICE_SILENT,
    TOOL_FORCE_LIMITED, ToolState,
};
use taut_proto::{HotState, PoseF32};
use taut_scene::{Carried, Carrier, FidelityPlan};

use crate::loops::shell::{Beat, run_at_deadlines};
use crate::loops::wiring::SharedView;
pub use crate::session::bridge_commands::BridgeCommands;
use crate::session::head::Head;
use crate::session::observers::Outlets;
use crate::session::state_events::EventSource;
use crate::shared::clock::{SessionClock, nanoseconds};
use crate::shared::contact_snapshot::{ContactSnapshot, MovingObstacle};
use crate::shared::device_state::DeviceState;
use crate::shared::shutdown::Shutdown;
use crate::shared::wrench_command::WrenchCommand;

/// Sends states, and the wrenches of a remote device, until the end is asked for.
pub fn run(
    mut states: StateWriter,
    mut broadcaster: Broadcaster,
    mut bridge_commands: Option<BridgeCommands>,
    mut outlets: Outlets,
    clock: SessionClock,
    beat: Beat,
    shutdown: &Shutdown,
) {
    // A state that comes late is followed by the next one; nothing is owed to anybody.
    let late = AtomicU64::new(0);
    run_at_deadlines(clock, beat, shutdown, &late, |now| {
        if let Some(commands) = &mut bridge_commands {
            let armed = states.is_armed();
            commands.pass_force(armed, &mut broadcaster);
            let BridgeCommands { wrenches, sets, .. } = commands;
            let fresh = wrenches.update();
            let command = wrenches.output_buffer();
            let at_edge = sets.tick(now, command, armed, states.contacts(), |part| {
                broadcaster.send_constraints(part);
            });
            if fresh && !at_edge {
                broadcaster.send_wrench(command);
            }
        }
        if let Some(state) = states.newest(now) {
            // What could not be sent is counted by the link.
            let _ = broadcaster.send(state);
            outlets.publish(state);
        }
    });
    if let Some(commands) = &mut bridge_commands {
        commands.end(clock.now(), &mut broadcaster);
    }
}

/// Reads the shared data and keeps the state that is sent. No allocation.
#[derive(Debug)]
pub struct StateWriter {
    shared: SharedView,
    head: Head,
    reference_point: Point3<f64>,
    scene_revision: u32,
    /// By their numbers in the description.
    carried: Vec<(u16, Carried)>,
    state: HotState,
    motion: MotionEstimate,
    events: EventSource,
    most_contacts: usize,
    /// Time between two states, and from when on the next one is due.
    period: Duration,
    due: Duration,
}

impl StateWriter {
    /// A writer of states of one scene.
    pub fn new(
        shared: SharedView,
        head: Head,
        reference_point: &Point3<f64>,
        scene_revision: u32,
    ) -> Self {
        Self {
            shared,
            head,
            reference_point: *reference_point,
            scene_revision,
            carried: Vec::new(),
            state: HotState::empty(),
            motion: MotionEstimate::default(),
            events: EventSource::default(),
            most_contacts: MAX_CONTACTS,
            period: Duration::ZERO,
            due: Duration::ZERO,
        }
    }

    /// The same with no more than a state in `period`, however often it is asked: for a loop that has more to send than states.
    #[must_use]
    pub fn with_period(self, period: Duration) -> Self {
        Self { period, ..self }
    }

    /// The same with no more contacts in a state than the scene's choice of its fidelity allows, the nearest.
    #[must_use]
    pub fn with_fidelity(self, plan: Option<&FidelityPlan>) -> Self {
        Self {
            most_contacts: plan.map_or(self.most_contacts, |plan| plan.contacts as usize),
            ..self
        }
    }

    /// The same with scenery that is carried about; the scene has so many obstacles.
    #[must_use]
    pub fn with_carried(self, obstacles: usize, carried: &[Carried]) -> Self {
        let numbered = carried.iter().map(|it| (obstacles + it.place, *it));
        // No client can be told of a body beyond the numbers of the wire, and none has one.
        let carried = numbered.filter_map(|(id, it)| Some((u16::try_from(id).ok()?, it)));
        Self {
            carried: carried.collect(),
            ..self
        }
    }

    /// Whether the haptics loop's port gives force, as of the last state; false as soon as somebody disarms, so that a bridge fades at once.
    pub fn is_armed(&self) -> bool {
        self.shared.device.held().safety.gives
    }

    /// The newest of the god-object loop.
    pub fn contacts(&mut self) -> &ContactSnapshot {
        self.shared.contacts.newest()
    }

    /// The state now; `None` while the device has not been sampled since the last one, or none is due.
    pub fn newest(&mut self, now: Duration) -> Option<&HotState> {
        if !self.shared.device.refresh() || now < self.due {
            return None;
        }
        self.due = (self.due + self.period).max(now);
        let device = self.shared.device.held();
        let contacts = self.shared.contacts.newest();
        let wrench = self.shared.wrench.newest();
        self.motion.follow(contacts, &self.reference_point);
        self.events.follow(device, contacts);

        let state = &mut self.state;
        state.sample_time_ns = nanoseconds(device.time);
        state.tick = device.sequence;
        state.scene_revision = self.scene_revision;
        state.run = run_state(device);
        state.constraint_age_us =
            u32::try_from(wrench.constraint_age.as_micros()).unwrap_or(u32::MAX);
        state.head = head_state(&mut self.head, now, device.time);
        state.tools.clear();
        state
            .tools
            .push(tool_state(device, contacts, wrench, &self.motion.velocity));
        state.bodies.clear();
        state.bodies.extend(contacts.moving.iter().map(body_state));
        for (id, carried) in &self.carried {
            let mut moving = contacts.moving.iter();
            let carrier = match carried.by {
                Carrier::GodObject => Some(&contacts.set.god_object_pose),
                Carrier::Device => Some(&device.pose),
                Carrier::Obstacle(place) => moving
                    .find(|moving| usize::from(moving.obstacle) == place)
                    .map(|moving| &moving.pose),
            };
            let pose = carrier.map(|carrier| carrier * carried.pose);
            // A session with more of them than a state holds is refused.
            let _ = pose.map(|pose| {
                state.bodies.try_push(BodyState {
                    id: *id,
                    flags: 0,
                    pose: PoseF32::from_isometry(&pose),
                })
            });
        }
        nearest_contacts(&contacts.set, &mut state.contacts);
        state.contacts.truncate(self.most_contacts);
        self.events.take(&mut state.events);
        Some(&self.state)
    }
}

fn run_state(device: &DeviceState) -> RunState {
    match device.safety.arming {
        _ if device.faulty => RunState::Fault,
        ArmingState::Faulted => RunState::Fault,
        ArmingState::Disarmed => RunState::Paused,
        // On its way there: nothing comes back unless it is asked for.
        ArmingState::Fading if !device.safety.gives => RunState::Paused,
        _ => RunState::Running,
    }
}

fn head_state(head: &mut Head, now: Duration, sampled: Duration) -> HeadState {
    let pose = PoseF32::from_isometry(&head.pose(now));
    let older = nanoseconds(sampled) as i64 - nanoseconds(head.read_at(now)) as i64;
    HeadState {
        pose,
        age_us: i32::try_from(older / 1000).unwrap_or(i32::MIN),
        eye_separation: head.eye_separation as f32,
        flags: if head.moves() { HEAD_TRACKED } else { 0 },
    }
}

fn tool_state(
    device: &DeviceState,
    contacts: &ContactSnapshot,
    wrench: &WrenchCommand,
    velocity: &Vector6,
) -> ToolState {
    let limited = if wrench.saturated {
        TOOL_FORCE_LIMITED
    } else {
        0
    };
    let silent = if device.faulty { TOOL_DEVICE_SILENT } else { 0 };
    // What a bridge says that it renders is the truth; what was computed here answers a pose that is older.
    let felt = device.felt.map_or(wrench.wrench, |felt| felt.wrench);
    ToolState {
        god_object: PoseF32::from_isometry(&contacts.set.god_object_pose),
        device: PoseF32::from_isometry(&device.pose),
        linear_velocity: single(&linear(velocity)),
        angular_velocity: single(&angular(velocity)),
        force: single(&linear(&felt)),
        torque: single(&angular(&felt)),
        buttons: device.buttons,
        flags: limited | silent,
        id: 0,
    }
}

fn body_state(moving: &MovingObstacle) -> BodyState {
    BodyState {
        id: moving.obstacle,
        flags: 0,
        pose: PoseF32::from_isometry(&moving.pose),
    }
}

/// The contacts with the smallest gaps, nearest first. Forces of single contacts are not unique and not told.
fn nearest_contacts(
    set: &ConstraintSet,
    nearest: &mut taut_proto::ArrayVec<ContactState, MAX_CONTACTS>,
) {
    nearest.clear();
    for constraint in &set.constraints {
        let contact = contact_state(constraint);
        let place = nearest
            .iter()
            .take_while(|other| other.gap <= contact.gap)
            .count();
        if place < MAX_CONTACTS {
            if nearest.is_full() {
                nearest.pop();
            }
            nearest.insert(place, contact);
        }
    }
}

fn contact_state(constraint: &NonPenetrationConstraint) -> ContactState {
    ContactState {
        pair: [0, constraint.features.obstacle],
        point: single(&constraint.point.coords),
        normal: single(&constraint.normal),
        force: 0.0,
        gap: constraint.gap as f32,
    }
}

fn single(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

/// Velocity of the god-object at the reference point, from its last two poses.
#[derive(Debug, Default)]
struct MotionEstimate {
    last: Option<(Duration, Pose)>,
    velocity: Vector6,
}

impl MotionEstimate {
    fn follow(&mut self, contacts: &ContactSnapshot, reference_point: &Point3<f64>) {
        let pose = at_reference_point(&contacts.set.god_object_pose, reference_point);
        match &self.last {
            Some((time, _)) if *time >= contacts.published => return,
            Some((time, last)) => {
                let passed = (contacts.published - *time).as_secs_f64();
                self.velocity = pose_difference(&pose, last, &Vector3::zeros()) / passed;
            }
            None => {}
        }
        self.last = Some((contacts.published, pose));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::head::heads;
    use crate::session::state_events::BUTTON_SHIFT;
    use crate::shared::contact_snapshot::constraint;
    use crate::shared::device_state::SafetyState;
    use crate::shared::fanout::Publisher;
    use crate::shared::{contact_snapshot, device_state, wrench_command};
    use taut_bridge::{EventKind, SafetyEvent};
    use taut_proto::state::event_code;
    use taut_scene::{HeadTracking, Viewer, Workbench};

    /// A port in full force that has just limited one.
    fn armed_after_a_limit() -> SafetyState {
        let mut safety = SafetyState {
            arming: ArmingState::Armed,
            ..SafetyState::default()
        };
        safety.events[1] = Some(SafetyEvent {
            number: 1,
            time: Duration::from_millis(4),
            kind: EventKind::ForceLimited,
            value: 23.5,
        });
        safety
    }

    /// A writer of states, and whose data it reads.
    fn wired(
        start: &Pose,
    ) -> (
        Publisher<DeviceState>,
        Publisher<ContactSnapshot>,
        Publisher<WrenchCommand>,
        StateWriter,
    ) {
        let (states, [device]) = device_state::channel(start);
        let (contacts, [snapshots]) = contact_snapshot::channel(start, 32);
        let (wrenches, [wrench]) = wrench_command::channel();
        let workbench = Workbench::shipped().unwrap_or_else(|error| panic!("{error}"));
        let viewer = Viewer {
            tracking: HeadTracking::Fixed,
            ..workbench.viewer
        };
        let [head] = heads(&viewer, None).expect("nothing to start");
        let shared = SharedView {
            device,
            contacts: snapshots,
            wrench,
        };
        let writer = StateWriter::new(shared, head, &Point3::origin(), 7);
        (states, contacts, wrenches, writer)
    }

    #[test]
    fn states_are_as_rare_as_wanted_and_an_end_of_the_force_is_known_at_once() {
        let start = Pose::identity();
        let (mut states, _contacts, _wrenches, writer) = wired(&start);
        let mut writer = writer.with_period(Duration::from_secs(1) / 50);
        let mut device = DeviceState::at_start(&start);
        let mut count = 0;
        for tick in 1..=1000_u64 {
            device.sequence = tick;
            device.safety.gives = tick.is_multiple_of(2);
            states.publish(&device);
            count += u32::from(writer.newest(Duration::from_millis(tick)).is_some());
            assert_eq!(writer.is_armed(), device.safety.gives);
        }
        assert!((50..=51).contains(&count), "{count} states in a second");
    }

    /// A sample at 5 ms, with a button down.
    fn touching(start: &Pose) -> DeviceState {
        DeviceState {
            sequence: 5,
            time: Duration::from_millis(5),
            pose: Pose::translation(0.0, 0.0, 0.05),
            buttons: 0b10,
            safety: armed_after_a_limit(),
            ..DeviceState::at_start(start)
        }
    }

    /// Contacts at 6 ms, the last of which are the nearest, and a plate that moves.
    fn touched(start: &Pose) -> ContactSnapshot {
        let mut snapshot = ContactSnapshot::at_start(start, 32);
        let constraints = (0..12).map(|k| constraint(k, 0.012 - 1e-3 * f64::from(k)));
        snapshot.set.constraints.extend(constraints);
        snapshot.published = Duration::from_millis(6);
        snapshot.report.active = 1;
        snapshot.moving.push(MovingObstacle {
            obstacle: 3,
            pose: Pose::translation(0.0, 0.25, 0.0),
        });
        snapshot
    }

    fn codes(state: &HotState) -> Vec<u32> {
        state.events.iter().map(|event| event.code).collect()
    }

    fn assert_tells_of_touch(state: &HotState) {
        assert_eq!(
            (state.tick, state.sample_time_ns, state.scene_revision),
            (5, 5_000_000, 7)
        );
        assert_eq!(
            (state.run, state.constraint_age_us),
            (RunState::Running, 250)
        );
        let tool = &state.tools[0];
        assert_eq!(
            (tool.device.position[2], tool.god_object.position[2]),
            (0.05, 0.1)
        );
        assert_eq!(
            (tool.force[2], tool.torque[0], tool.flags),
            (3.0, 0.1, TOOL_FORCE_LIMITED)
        );
        let obstacles = state.contacts.iter().map(|contact| contact.pair[1]);
        let obstacles: Vec<u16> = obstacles.collect();
        assert_eq!(obstacles, [11, 10, 9, 8, 7, 6, 5, 4], "nearest first");
        let bodies: Vec<_> = state.bodies.iter().map(|b| (b.id, b.pose)).collect();
        let plate = PoseF32::from_isometry(&Pose::translation(0.0, 0.25, 0.0));
        assert_eq!(bodies, [(3, plate)], "by the obstacle's number");
        assert_eq!(
            codes(state),
            [
                event_code::CONTACT_ON,
                event_code::BUTTON_DOWN | 1 << BUTTON_SHIFT,
                event_code::safety(EventKind::ForceLimited as u8, 23.5)
            ]
        );
        assert_eq!(state.head.age_us, -2000);
    }

    #[test]
    fn a_state_carries_the_newest_of_everything_and_comes_once_per_sample() {
        let start = Pose::translation(0.0, 0.0, 0.1);
        let (mut states, mut contacts, mut wrenches, mut writer) = wired(&start);
        let at = Duration::from_millis;
        assert!(writer.newest(at(0)).is_none(), "no sample yet");

        let (device, mut snapshot) = (touching(&start), touched(&start));
        states.publish(&device);
        contacts.publish(&snapshot);
        wrenches.publish(&WrenchCommand {
            wrench: Vector6::new(0.0, 0.0, 3.0, 0.1, 0.0, 0.0),
            saturated: true,
            constraint_age: Duration::from_micros(250),
            ..WrenchCommand::at_start()
        });
        assert_tells_of_touch(writer.newest(at(7)).expect("a sample was published"));
        assert!(writer.newest(at(8)).is_none(), "nothing new");

        // The god-object moves 2 mm in 2 ms.
        snapshot.set.god_object_pose = Pose::translation(0.0, 0.0, 0.098);
        snapshot.published = Duration::from_millis(8);
        contacts.publish(&snapshot);
        states.publish(&DeviceState {
            sequence: 6,
            faulty: true,
            ..device
        });
        let state = writer.newest(at(9)).expect("a sample was published");
        assert!((state.tools[0].linear_velocity[2] + 1.0).abs() < 1e-6);
        assert_eq!(state.bodies.len(), 1, "told again, not added");
        assert_eq!(state.run, RunState::Fault);
        assert_eq!(
            state.tools[0].flags & TOOL_DEVICE_SILENT,
            TOOL_DEVICE_SILENT
        );
        assert_eq!(codes(state).last(), Some(&event_code::FAULT));
    }

    #[test]
    fn what_is_carried_is_where_its_carrier_is() {
        let start = Pose::translation(0.0, 0.0, 0.1);
        let (mut states, mut contacts, _wrenches, writer) = wired(&start);
        let up = Pose::translation(0.0, 0.0, 0.01);
        let by = |place, by| Carried {
            place,
            by,
            pose: up,
        };
        let carried = [
            by(0, Carrier::GodObject),
            by(2, Carrier::Device),
            by(3, Carrier::Obstacle(3)),
        ];
        let mut writer = writer.with_carried(5, &carried);
        states.publish(&DeviceState {
            sequence: 1,
            pose: Pose::translation(0.0, 0.0, 0.05),
            ..DeviceState::at_start(&start)
        });
        let mut snapshot = ContactSnapshot::at_start(&start, 32);
        snapshot.moving.push(MovingObstacle {
            obstacle: 3,
            pose: Pose::translation(0.0, 0.25, 0.0),
        });
        contacts.publish(&snapshot);
        let state = writer.newest(Duration::from_millis(1)).expect("a sample");
        let places: Vec<(u16, [f32; 3])> = state
            .bodies
            .iter()
            .map(|body| (body.id, body.pose.position))
            .collect();
        let wanted = [
            (3, [0.0, 0.25, 0.0]),
            (5, [0.0, 0.0, 0.11]),
            (7, [0.0, 0.0, 0.06]),
            (8, [0.0, 0.25, 0.01]),
        ];
        assert_eq!(places, wanted);
    }

    #[test]
    fn a_force_that_fades_until_somebody_asks_is_paused_from_the_first() {
        for (arming, gives, run) in [
            (ArmingState::Armed, true, RunState::Running),
            (ArmingState::Fading, true, RunState::Running),
            (ArmingState::Fading, false, RunState::Paused),
            (ArmingState::Disarmed, false, RunState::Paused),
            (ArmingState::Faulted, false, RunState::Fault),
        ] {
            let mut device = DeviceState::at_start(&Pose::identity());
            (device.safety.arming, device.safety.gives) = (arming, gives);
            assert_eq!(run_state(&device), run, "{arming:?}, gives: {gives}");
        }
    }
}
