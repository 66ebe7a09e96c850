//! Ports at which a force device may be plugged in, found without speaking to any.

use crate::choice::InputChoice;
use crate::device::Pose;

/// A serial or HID port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluggedPort {
    /// Of the system.
    pub path: String,
    /// What USB says of it.
    pub what: String,
    /// What `--device` takes for it, where a driver here may fit.
    pub device: Option<String>,
}

/// The serial ports on USB, any of which may be a SPIDAR's.
///
/// # Errors
/// The system does not say, in words for people.
#[cfg(unix)]
pub fn plugged_ports() -> Result<Vec<PluggedPort>, String> {
    let ports = serialport::available_ports().map_err(|error| error.to_string())?;
    let on_usb = ports.into_iter().filter_map(|port| {
        let serialport::SerialPortType::UsbPort(usb) = port.port_type else {
            return None;
        };
        let maker = usb.product.or(usb.manufacturer).unwrap_or_default();
        Some(PluggedPort {
            what: format!("{:04x}:{:04x}, {maker}", usb.vid, usb.pid),
            device: Some(format!("spidar:{}", port.port_name)),
            path: port.port_name,
        })
    });
    Ok(on_usb.collect())
}

/// None is looked for here.
///
/// # Errors
/// None.
#[cfg(not(unix))]
pub fn plugged_ports() -> Result<Vec<PluggedPort>, String> {
    Ok(Vec::new())
}

impl InputChoice {
    /// The largest pure force and torque of a string-driven device at its centre along the weakest direction, N and N m; `None` for another
    /// device, whose mechanics say it.
    #[must_use]
    pub fn strongest(&self) -> Option<(f64, f64)> {
        let Self::Spidar(settings) = self else {
            return None;
        };
        let centre = taut_spidar::capability(&settings.geometry, &Pose::identity());
        Some((centre.weakest_force.size, centre.weakest_torque.size))
    }
}
