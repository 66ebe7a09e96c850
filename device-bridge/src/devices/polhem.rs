//! A Polhem arm on its text board, as it is chosen and opened.
//!
//! Its axes as they are read: x towards the user, y to the right, z up. Mass, damping and axes are assumed, force and stiffness are those of the published
//! configuration: no arm was at hand.

use nalgebra::{Matrix3, Matrix6, Vector3};
use taut_plant::Grip;
use taut_vrpn::{Axes, SensorMapping};

use crate::choice::ForceDevice;
use crate::device::DeviceLimits;
use crate::devices::Anchor;
use crate::devices::arm::ArmSettings;

/// Of the loop around it, Hz.
const RATE_HZ: f64 = 1000.0;
/// From a reading to the force that answers it: a period in the loop, as much on the wire.
const DELAY_S: f64 = 2.0 / RATE_HZ;
/// Published, N/m.
const LARGEST_STIFFNESS: f64 = 2000.0;

/// The arm's mechanics as they are assumed: to be measured on a real one.
#[must_use]
pub(crate) fn polhem_grip() -> Grip {
    Grip {
        mass: 0.2,                                 // kg
        damping: Vector3::repeat(2.0),             // N s/m
        rotational_inertia: 2e-5,                  // kg m^2
        rotational_damping: Vector3::repeat(1e-4), // N m s/rad
        coulomb_force: Vector3::zeros(),
        coulomb_torque: Vector3::zeros(),
        string_inertia: Matrix6::zeros(),
        max_force: 5.0, // N, published
        max_torque: 0.0,
    }
}

/// An arm on a serial port.
#[derive(Clone, Debug, PartialEq)]
pub struct PolhemSettings {
    /// Of the serial port.
    pub path: String,
    /// From the arm's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
}

impl PolhemSettings {
    /// The arm's axes along the workbench's.
    pub const AXES: Axes = Axes::of(Matrix3::new(0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0));

    /// The arm at `path`.
    #[must_use]
    pub fn at(path: &str) -> Self {
        Self {
            path: path.to_owned(),
            mapping: SensorMapping {
                axes: Self::AXES,
                ..SensorMapping::identity()
            },
            anchor: Anchor::default(),
        }
    }

    /// What the arm is assumed to bear.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice {
            grip: polhem_grip(),
            delay_s: DELAY_S - 1.0 / RATE_HZ,
            scale: Some(self.mapping.scale),
            renders_torque: false,
        }
    }

    /// The arm as a device.
    #[must_use]
    pub fn arm(&self) -> ArmSettings {
        let (stable, _) = polhem_grip().critical_stiffness(1.0 / RATE_HZ, DELAY_S);
        ArmSettings {
            name: format!("Polhem at {}", self.path),
            limits: DeviceLimits {
                max_stiffness: stable.min(LARGEST_STIFFNESS),
                max_rotational_stiffness: 0.0,
                max_force: polhem_grip().max_force,
                max_torque: 0.0,
            },
            with_orientation: true,
            centre: Vector3::zeros(),
            mapping: self.mapping,
            anchor: self.anchor,
        }
    }
}
