//! A WoodenHaptics arm on its HID board, as it is chosen and opened.
//!
//! Its axes as they are read: x towards the user, y to the right, z up. Mass, damping and axes are assumed, kinematics, force and stiffness are those of the
//! published configurations: no arm was at hand.

use std::path::PathBuf;

use nalgebra::Vector3;
use taut_plant::Grip;
use taut_vrpn::SensorMapping;

use crate::choice::ForceDevice;
use crate::devices::arm::ArmSettings;
use crate::devices::{Anchor, PolhemSettings, arm_limits, polhem_grip};
use crate::wooden::{WOODEN_MODELS, WoodenModel};

/// An arm on a HID board.
#[derive(Clone, Debug, PartialEq)]
pub struct WoodenSettings {
    /// Of the hidraw device, or of a socket in its place; without one the first board on USB.
    pub path: Option<PathBuf>,
    /// Its numbers.
    pub model: WoodenModel,
    /// From the arm's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
}

impl Default for WoodenSettings {
    fn default() -> Self {
        Self {
            path: None,
            model: WOODEN_MODELS[0],
            mapping: SensorMapping {
                axes: PolhemSettings::AXES,
                ..SensorMapping::identity()
            },
            anchor: Anchor::default(),
        }
    }
}

impl WoodenSettings {
    fn grip(&self) -> Grip {
        Grip {
            max_force: self.model.max_force,
            ..polhem_grip()
        }
    }

    /// What the arm is assumed to bear.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice::arm(self.grip(), &self.mapping)
    }

    /// The arm as a device.
    #[must_use]
    pub fn arm(&self) -> ArmSettings {
        ArmSettings {
            name: format!("{} on a HID board", self.model.name),
            limits: arm_limits(&self.grip(), self.model.max_stiffness),
            with_orientation: self.model.wrist_counts > 0.0,
            centre: Vector3::zeros(),
            mapping: self.mapping,
            anchor: self.anchor,
        }
    }
}
