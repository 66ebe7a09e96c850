//! A device in a shared library or in Python, as it is chosen and opened.
//!
//! What the library says bounds force and stiffness. Mass and damping it does not say: they are assumed light, which is the cautious side.

use std::path::PathBuf;

use nalgebra::Vector3;
use taut_vrpn::SensorMapping;

use crate::choice::ForceDevice;
use crate::devices::arm::{ArmDevice, ArmSettings};
use crate::devices::{Anchor, haply_grip};
use crate::placement::Placement;
use crate::plugin::{Language, Plugin, PluginError};

/// A library, and where its device stands.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginSettings {
    /// Of the library or the file.
    pub path: PathBuf,
    /// What it is written in.
    pub language: Language,
    /// For the library: what is not one of ours, with commas between.
    pub options: String,
    /// From the device's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
}

impl PluginSettings {
    /// What a device is assumed to bear before its library has said it.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice {
            renders_torque: true,
            ..ForceDevice::arm(haply_grip(), &self.mapping)
        }
    }

    /// Loads the library and opens its device.
    pub fn open(&self, placement: Placement, priority: u8) -> Result<ArmDevice, PluginError> {
        let (plugin, info) = Plugin::open(&self.path, &self.language, &self.options, priority)?;
        let arm = ArmSettings {
            name: info.name,
            limits: info.limits,
            with_orientation: info.with_orientation,
            centre: Vector3::zeros(),
            mapping: self.mapping,
            anchor: self.anchor,
        };
        Ok(ArmDevice::new(Box::new(plugin), arm, placement))
    }
}
