//! What an arm says of itself, and what it bears.

use std::time::Duration;

use taut_plant::Grip;

use crate::device::DeviceLimits;
use crate::devices::arm::RATE_HZ;

/// What an arm with this grip bears, in its own metres: no more than `largest_stiffness`, N/m, and no torque. Its force comes a period of the loop and as
/// much on the wire after the reading.
pub(crate) fn arm_limits(grip: &Grip, largest_stiffness: f64) -> DeviceLimits {
    let (stable, _) = grip.critical_stiffness(1.0 / RATE_HZ, 2.0 / RATE_HZ);
    DeviceLimits {
        max_stiffness: stable.min(largest_stiffness),
        max_rotational_stiffness: 0.0,
        max_force: grip.max_force,
        max_torque: 0.0,
    }
}

/// What an arm said last: m, m/s, w x y z, its own axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArmState {
    /// Counts states that may be used.
    pub reports: u64,
    /// Whether the newest may be used now.
    pub is_usable: bool,
    /// How long before it was handed on the newest was measured, as far as the driver knows.
    pub age: Duration,
    /// Of the cursor.
    pub position: [f64; 3],
    /// Of the cursor.
    pub velocity: [f64; 3],
    /// Of the grip; `None` without one.
    pub orientation: Option<[f64; 4]>,
    /// Angular velocity, rad/s; `None` where it is not measured: it is taken from the orientations then.
    pub turning: Option<[f64; 3]>,
    /// One bit per button, bit 0 the first.
    pub buttons: u16,
}

#[cfg(unix)]
impl ArmState {
    /// The state after this one of an arm that says its position alone: it is at `position` at `now`, and moves as it did since `before`, which is that then.
    pub(crate) fn moved(
        &self,
        before: &mut Option<([f64; 3], Duration)>,
        now: Duration,
        position: [f64; 3],
    ) -> Self {
        let before = before.replace((position, now));
        let velocity = before.map_or([0.0; 3], |(before, then)| {
            let passed = now.saturating_sub(then).as_secs_f64().max(1e-4);
            std::array::from_fn(|i| (position[i] - before[i]) / passed)
        });
        Self {
            reports: self.reports + 1,
            is_usable: true,
            position,
            velocity,
            ..Self::default()
        }
    }
}
