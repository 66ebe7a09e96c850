//! `[dynamics]`: what a real device is, as its maker or a measurement says, so that a session can judge what stiffness it bears.

use taut_plant::HandPreset;

use crate::document::{Range, Section};

/// Longest delay or lag that a device may declare, s.
const LONGEST: f64 = 0.1;

/// A device as it is declared, the same along and about every axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceDynamics {
    /// Mass that moves along an axis, kg.
    pub mass: f64,
    /// Viscous damping, N s/m.
    pub damping: f64,
    /// Coulomb friction, N.
    pub friction: f64,
    /// Resolution of the position, m; 0 is exact.
    pub resolution: f64,
    /// Inertia about an axis, kg m^2.
    pub inertia: f64,
    /// Viscous damping about an axis, N m s/rad.
    pub rotational_damping: f64,
    /// Coulomb friction about an axis, N m.
    pub rotational_friction: f64,
    /// Resolution of the rotation, rad; 0 is exact.
    pub angular_resolution: f64,
    /// Delay of the force beyond the loop's own tick, s: the network's, the controller's.
    pub delay: f64,
    /// Time constant of the motors, s.
    pub motor_lag: f64,
    /// The hand that holds it all the time; released is the worst.
    pub hand: HandPreset,
}

pub(super) fn dynamics(section: &Section<'_>) -> Option<DeviceDynamics> {
    let not_negative = |key| section.number_or(key, Range::NotNegative, 0.0);
    let friction = not_negative("friction");
    let resolution = not_negative("resolution");
    let rotational_friction = not_negative("rotational_friction");
    let angular_resolution = not_negative("angular_resolution");
    let delay = section.number_or("delay", Range::UpTo(LONGEST), 0.0);
    let motor_lag = section.number_or("motor_lag", Range::UpTo(LONGEST), 0.0);
    let hand = section
        .choice("hand", &HandPreset::NAMED)
        .unwrap_or(HandPreset::Released);
    let mass = section.required_number("mass", Range::Positive, "mass = 0.2");
    let damping = section.required_number("damping", Range::NotNegative, "damping = 1.0");
    let inertia = section.required_number("inertia", Range::Positive, "inertia = 3e-4");
    let rotational_damping = section.required_number(
        "rotational_damping",
        Range::NotNegative,
        "rotational_damping = 4e-3",
    );
    Some(DeviceDynamics {
        mass: mass?,
        damping: damping?,
        friction,
        resolution,
        inertia: inertia?,
        rotational_damping: rotational_damping?,
        rotational_friction,
        angular_resolution,
        delay,
        motor_lag,
        hand,
    })
}
