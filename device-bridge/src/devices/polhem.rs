//! A Polhem arm on its text board, as it is chosen and opened.
//!
//! Its axes as they are read: x towards the user, y to the right, z up. Mass, damping and axes are assumed, force and stiffness are those of the published
//! configuration: no arm was at hand.

use nalgebra::{Matrix3, Vector3};
use taut_plant::Grip;
use taut_vrpn::{Axes, SensorMapping};

use crate::choice::ForceDevice;
use crate::devices::arm::ArmSettings;
use crate::devices::{Anchor, arm_limits, haply_grip};

/// Published, N/m.
const LARGEST_STIFFNESS: f64 = 2000.0;

/// The arm's mechanics as they are assumed: to be measured on a real one. The grip turns as lightly as a Haply's.
pub(crate) fn polhem_grip() -> Grip {
    Grip {
        mass: 0.2,                     // kg
        damping: Vector3::repeat(2.0), // N s/m
        max_force: 5.0,                // N, published
        ..haply_grip()
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
        ForceDevice::arm(polhem_grip(), &self.mapping)
    }

    /// The arm as a device.
    #[must_use]
    pub fn arm(&self) -> ArmSettings {
        ArmSettings {
            name: format!("Polhem at {}", self.path),
            limits: arm_limits(&polhem_grip(), LARGEST_STIFFNESS),
            with_orientation: true,
            centre: Vector3::zeros(),
            mapping: self.mapping,
            anchor: self.anchor,
        }
    }
}
