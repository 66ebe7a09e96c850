//! Passivity control: a wall that is too stiff for the device throws it; with the controller it comes to rest.

use god_object::{Pose, Vector6};
use nalgebra::Point3;
use taut_bridge::{
    Command, DevicePort, EventKind, Passivity, PassivitySettings, SafetySettings, SimulatedDevice,
};
use taut_plant::{Hand, MinJerkPath};

use crate::Row;
use crate::closed_loop::{PERIOD, grip};

/// Damping of the device, N s/m: with it the loop is stable below 2 b / T = 2000 N/m.
const DAMPING: f64 = 1.0;

/// What a run showed.
struct Seen {
    /// Largest speed between 1.5 s and 2 s over that between 0.05 s and 0.3 s.
    growth: f64,
    /// Energy given to the hand beyond what it had put in, J.
    injected: f64,
    /// Whether the controller acted.
    acted: bool,
}

/// Kicks a device that nobody holds against a spring to both sides of `stiffness`, N/m.
fn kick(stiffness: f64, mode: Passivity) -> Seen {
    let path = MinJerkPath::hold(Pose::identity());
    let device = SimulatedDevice::new(grip(DAMPING), Hand::RELEASED, path, Point3::origin());
    let settings = SafetySettings {
        ramp_in: std::time::Duration::ZERO,
        passivity: PassivitySettings::of(mode),
        ..SafetySettings::default()
    };
    let start = Pose::identity();
    let mut port = DevicePort::new(Box::new(device), settings, Point3::origin(), &start);
    let (mut early, mut late, mut acted) = (0.0_f64, 0.0_f64, false);
    for tick in 0..2000 {
        let now = PERIOD * tick;
        let push = if tick < 10 { 0.1 } else { 0.0 };
        let mut speed = 0.0;
        let report = port.tick(now, |reading| {
            speed = reading.sample.velocity.x.abs();
            let x = reading.sample.pose.translation.x;
            Some(Command::fresh(now, Vector6::x() * (push - stiffness * x)))
        });
        acted |= report
            .events
            .iter()
            .any(|event| event.kind == EventKind::PassivityActs);
        match tick {
            50..300 => early = early.max(speed),
            1500.. => late = late.max(speed),
            _ => {}
        }
    }
    Seen {
        growth: late / early,
        injected: port.energy().injected(),
        acted,
    }
}

/// Below and above the critical stiffness.
pub(crate) fn run() -> Vec<Row> {
    let mut rows = Vec::new();
    for stiffness in [3000.0, 4000.0] {
        let observed = kick(stiffness, Passivity::Observe);
        let controlled = kick(stiffness, Passivity::Control);
        rows.push(Row::holds(
            format!("{stiffness} N/m, observed: growth"),
            format!("{:.2}", observed.growth),
            "> 2",
            observed.growth > 2.0,
        ));
        rows.push(Row::at_most(
            format!("{stiffness} N/m, controlled: growth"),
            controlled.growth,
            1.0,
            "",
        ));
        rows.push(Row::holds(
            format!("{stiffness} N/m: energy that came out"),
            format!(
                "{:.2e} J instead of {:.2e} J",
                controlled.injected, observed.injected
            ),
            "less",
            controlled.injected < observed.injected && controlled.acted,
        ));
    }
    // A wall that is soft enough is left alone.
    let soft = kick(500.0, Passivity::Control);
    rows.push(Row::holds(
        "500 N/m: controller",
        if soft.acted { "acts" } else { "does not act" },
        "does not act",
        !soft.acted,
    ));
    rows
}
