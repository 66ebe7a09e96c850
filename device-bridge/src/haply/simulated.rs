//! The service's side of the wire, without sockets: an arm in a simulated hand, a grip, and one answer to each message.
//!
//! The arm's mechanics are those that the driver assumes ([`crate::HaplySettings`]). Forces of all sessions add up; each holds for its message, and
//! ends after [`IDLE_AFTER`] without another.

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use nalgebra::Vector3;
use serde_json::{Value, json};
use taut_plant::{Hand, MinJerkPath, Tremor};

use crate::device::Pose;
use crate::devices::haply_grip;
use crate::devices::held_arm::{HeldArm, down_and_up};

/// Middle of the arm's workspace in its own axes, m. Assumed.
pub(crate) const WORKSPACE_CENTRE: [f64; 3] = [0.0, -0.1, 0.16];
/// Silence after which a session's force is none. Assumed: the documentation says that it ends, not when.
const IDLE_AFTER: Duration = Duration::from_millis(50);
/// Longer without a connection than an outage, and no longer than a person takes for the next command.
const PAUSE: Duration = Duration::from_secs(1);
/// Largest force along an axis that is taken, N; more is limited to the arm's largest.
const LARGEST_COMMAND: f64 = 1e3;
/// Largest message that is read, bytes.
const MAX_MESSAGE: usize = 1 << 20;

/// What is simulated.
#[derive(Clone, Debug)]
pub struct SimulatedSettings {
    /// Who holds it.
    pub hand: Hand,
    /// Where the hand leads it; poses of the cursor in the arm's axes. `None`: down by 60 mm and up again, for ever.
    pub path: Option<MinJerkPath>,
    /// Of the hand.
    pub tremor: Option<Tremor>,
    /// Whether there is a grip that measures the orientation.
    pub with_grip: bool,
}

impl SimulatedSettings {
    /// An arm with a grip, in a hand that goes down and up.
    #[must_use]
    pub fn held(hand: Hand) -> Self {
        Self {
            hand,
            path: None,
            tremor: None,
            with_grip: true,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Push {
    force: Vector3<f64>,
    said: Duration,
}

/// A service with one arm.
pub struct SimulatedInverse {
    arm: HeldArm,
    with_grip: bool,
    plugged: bool,
    pushes: HashMap<u64, Push>,
    connected: HashSet<u64>,
    /// Since when nobody is connected.
    alone_since: Option<Duration>,
    /// The hand rests where its path begins, until the arm is commanded.
    rests: bool,
    messages: u64,
}

impl SimulatedInverse {
    /// At rest where the hand's path begins.
    #[must_use]
    pub fn new(settings: &SimulatedSettings) -> Self {
        let path = settings.path.clone();
        let path = path.unwrap_or_else(|| down_and_up(WORKSPACE_CENTRE.into()));
        let tremor = settings.tremor.clone();
        Self {
            arm: HeldArm::new(haply_grip(), settings.hand, path, tremor),
            with_grip: settings.with_grip,
            plugged: true,
            pushes: HashMap::new(),
            connected: HashSet::new(),
            alone_since: None,
            rests: true,
            messages: 0,
        }
    }

    /// Pulls the arm's cable, or puts it back.
    pub fn set_plugged(&mut self, plugged: bool) {
        self.plugged = plugged;
    }

    /// The arm in the hand.
    #[must_use]
    pub fn held(&self) -> &HeldArm {
        &self.arm
    }

    /// Where the cursor truly is, the arm's axes.
    #[must_use]
    pub fn true_pose(&self) -> Pose {
        *self.arm.plant.pose()
    }

    /// Messages answered so far.
    #[must_use]
    pub fn messages(&self) -> u64 {
        self.messages
    }

    /// The inventory that greets a connection. Who comes first after a pause finds the hand where its path begins, and the hand waits there for the
    /// first command: a body that starts where the hand is reaches what lies below it, however long its program takes to begin.
    pub fn inventory(&mut self, now: Duration, session: u64) -> String {
        self.advance(now);
        let alone = self.alone_since.take();
        if alone.is_some_and(|since| now.saturating_sub(since) > PAUSE) {
            self.arm.begin_again();
            self.rests = true;
        }
        self.connected.insert(session);
        self.state(session, true)
    }

    /// The one answer to a message of a session; one that is not understood moves nothing.
    pub fn answer(&mut self, now: Duration, session: u64, message: &str) -> String {
        self.messages += 1;
        self.advance(now);
        let message: Value = if message.len() <= MAX_MESSAGE {
            serde_json::from_str(message).unwrap_or(Value::Null)
        } else {
            Value::Null
        };
        let command = commanded(&message);
        self.rests &= command.is_none();
        match command {
            Some(force) => drop(self.pushes.insert(session, Push { force, said: now })),
            None => drop(self.pushes.remove(&session)),
        }
        self.command(now);
        let full = !message["session"]["force_render_full_state"].is_null();
        self.state(session, full)
    }

    /// A connection has ended.
    pub fn leave(&mut self, now: Duration, session: u64) {
        self.advance(now);
        self.pushes.remove(&session);
        self.command(now);
        if self.connected.remove(&session) && self.connected.is_empty() {
            self.alone_since = Some(now);
        }
    }

    /// Goes on to `now`.
    pub fn advance(&mut self, now: Duration) {
        let due = self.arm.due(now);
        if self.rests {
            return;
        }
        let ends = self.pushes.values().map(|push| push.said + IDLE_AFTER);
        // A force that has grown too old ended where it did.
        let without = ends
            .min()
            .map_or(Duration::ZERO, |end| now.saturating_sub(end).min(due));
        self.arm.go_on(due - without);
        self.command(now);
        self.arm.go_on(without);
    }

    fn command(&mut self, now: Duration) {
        self.pushes.retain(|_, push| now < push.said + IDLE_AFTER);
        let sum: Vector3<f64> = self.pushes.values().map(|push| push.force).sum();
        let sum = if self.plugged { sum } else { Vector3::zeros() };
        self.arm.push(now, &sum);
    }

    fn state(&self, session: u64, full: bool) -> String {
        let mut arms = Vec::new();
        let mut grips = Vec::new();
        let pose = self.arm.plant.measured_pose();
        if self.plugged {
            let mut arm = json!({
                "device_id": "51A3",
                "state": self.arm_state(&pose),
                "status": { "calibrated": true, "in_use": !self.pushes.is_empty(), "power_supply": true, "ready": true, "started": true },
            });
            if full {
                arm["config"] = arm_config();
            }
            arms.push(arm);
        }
        if self.with_grip {
            let q = pose.rotation;
            let mut grip = json!({
                "device_id": "61A3",
                "state": {
                    "battery_level": 0.9,
                    "battery_voltage": 4.1,
                    "buttons": { "a": false, "b": false, "c": false },
                    "hall": 0,
                    "orientation": { "x": q.i as f32, "y": q.j as f32, "z": q.k as f32, "w": q.w as f32 },
                },
                "status": { "connected": true, "awake": true, "ready": true },
            });
            if full {
                grip["config"] = json!({
                    "port": "simulated", "type": "wireless_verse_grip", "major_version": 1, "minor_version": 0, "hardware_version": 1,
                    "basis": { "permutation": "XYZ" }, "preset": "defaults",
                });
            }
            grips.push(grip);
        }
        json!({
            "session_id": session,
            "inverse3": arms,
            "verse_grip": [],
            "wireless_verse_grip": grips,
            "custom_verse_grip": [],
        })
        .to_string()
    }

    fn arm_state(&self, pose: &Pose) -> Value {
        let velocity: Vector3<f64> = self.arm.plant.velocity().fixed_rows::<3>(0).into();
        let commanded = !self.pushes.is_empty();
        json!({
            "cursor_position": xyz(&pose.translation.vector),
            "cursor_velocity": xyz(&velocity),
            "current_cursor_force": xyz(&self.arm.rendered()),
            // The arm's joints are not simulated.
            "angular_position": { "a0": 0.0, "a1": 0.0, "a2": 0.0 },
            "angular_velocity": { "a0": 0.0, "a1": 0.0, "a2": 0.0 },
            "body_orientation": { "x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0 },
            "mode": "idle",
            "control_domain": if commanded { "cartesian" } else { "undefined" },
            "control_mode": if commanded { "force" } else { "idle" },
            "transform": {
                "position": { "x": 0.0, "y": 0.0, "z": 0.0 },
                "rotation": { "x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0 },
                "scale": { "x": 1.0, "y": 1.0, "z": 1.0 },
            },
        })
    }
}

/// The force of the arm in a message; `None` where it commands none.
fn commanded(message: &Value) -> Option<Vector3<f64>> {
    let arms = message["inverse3"].as_array()?;
    let arm = arms.iter().find(|arm| arm["device_id"] == "51A3")?;
    let command = &arm["commands"]["set_cursor_force"];
    // `execute: false` only checks the command.
    if command["execute"] == Value::Bool(false) {
        return None;
    }
    let vector = &command["vector"];
    let part = |name: &str| {
        vector[name]
            .as_f64()
            .filter(|part| part.abs() <= LARGEST_COMMAND)
    };
    Some(Vector3::new(part("x")?, part("y")?, part("z")?))
}

/// Single precision, as the service's.
fn xyz(vector: &Vector3<f64>) -> Value {
    json!({ "x": vector.x as f32, "y": vector.y as f32, "z": vector.z as f32 })
}

fn arm_config() -> Value {
    json!({
        "type": "inverse3",
        "device_info": { "major_version": 7, "minor_version": 1, "id": "51A3", "device_type": 4, "uuid": "00000000000000000000000000000000" },
        "port": "simulated",
        "extended_device_id": "simulated",
        "extended_firmware_version": "simulated",
        "gravity_compensation": { "enabled": true, "scaling_factor": 1.0 },
        "handedness": "right",
        "torque_scaling": { "enabled": true },
        "basis": { "permutation": "XYZ" },
        "preset": "defaults",
        "mount": {},
        "filters": { "force_gate": { "gain": 0.0 }, "damping": { "scalar": 0.0 } },
    })
}
