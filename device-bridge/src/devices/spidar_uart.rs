//! A SPIDAR-G on its UART motor boards, as it is chosen and opened.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use taut_spidar::{Geometry, StringFault};
use taut_vrpn::Axes;

use crate::choice::ForceDevice;
use crate::device::Device;
use crate::devices::{SpidarPlacement, string_grip};
use crate::placement::Placement;

/// A line of motor boards, and the strings on it.
#[derive(Clone, Debug, PartialEq)]
pub struct SpidarUartSettings {
    /// Of the serial port.
    pub path: String,
    /// Of the strings.
    pub geometry: Geometry,
    /// Which of the frame's axes point along the workbench's: a turn, no mirror image.
    pub axes: Axes,
}

/// Why a SPIDAR cannot be opened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpidarUartError {
    /// The boards.
    #[cfg(unix)]
    #[error(transparent)]
    Boards(#[from] crate::spidar_uart::BoardsError),
    /// The first counts.
    #[error("{0}")]
    Strings(StringFault),
    /// The system.
    #[error("motor boards on a serial port can be used on Unix only")]
    NotHere,
}

impl SpidarUartSettings {
    /// The published frames have y up, and z towards the user.
    pub const AXES: Axes = Axes::of(Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0));

    /// What the strings are assumed to bear.
    #[must_use]
    pub fn force_device(&self) -> ForceDevice {
        ForceDevice {
            grip: string_grip(&self.geometry, &SpidarPlacement::default()),
            delay_s: 1e-3,
            scale: None,
            renders_torque: true,
        }
    }

    /// Opens the boards; the grip is taken to be at the centre of the frame, not turned, and there the body starts. Lengths are the world's.
    #[cfg(unix)]
    pub fn open(
        &self,
        placement: &Placement,
        priority: u8,
    ) -> Result<Box<dyn Device>, SpidarUartError> {
        use crate::devices::SpidarDevice;
        use crate::realtime::monotonic_now;
        use crate::spidar_uart::{SpidarBoards, within_range};

        let geometry = within_range(&self.geometry)?;
        let boards = SpidarBoards::open(&self.path, &geometry, priority)?;
        let turn = Rotation3::from_matrix_unchecked(*self.axes.matrix());
        let workbench = placement.workbench_from_world.isometry.rotation;
        let around = SpidarPlacement::around(
            placement.start * placement.reference_point,
            workbench.inverse() * UnitQuaternion::from_rotation_matrix(&turn),
            placement.start.rotation,
            placement.reference_point,
        );
        let device = SpidarDevice::calibrated_at_centre(geometry, boards, around, monotonic_now());
        let device = device.map_err(SpidarUartError::Strings)?;
        tracing::info!(
            "calibrated: the grip was taken to be at the centre of the frame, not turned"
        );
        Ok(Box::new(device))
    }

    /// Nothing can be opened here.
    #[cfg(not(unix))]
    pub fn open(
        &self,
        _placement: &Placement,
        _priority: u8,
    ) -> Result<Box<dyn Device>, SpidarUartError> {
        Err(SpidarUartError::NotHere)
    }
}
