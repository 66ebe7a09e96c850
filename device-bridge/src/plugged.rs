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
    /// Whether its USB numbers are those of this device's boards; otherwise any adapter has them, and anything may be plugged in.
    pub is_its_board: bool,
}

/// USB number of PJRC's boards.
#[cfg(unix)]
const TEENSY: u16 = 0x16c0;

/// The serial ports on USB, any of which may be a SPIDAR's or a Polhem's, and WoodenHaptics' HID boards.
///
/// # Errors
/// The system does not say, in words for people.
#[cfg(unix)]
pub fn plugged_ports() -> Result<Vec<PluggedPort>, String> {
    // serialport panics without it, as in a container.
    if cfg!(target_os = "linux") && !std::path::Path::new("/sys/class/tty").exists() {
        return Err("/sys/class/tty is not there; mount /sys, where serial ports are".to_owned());
    }
    let ports = serialport::available_ports().map_err(|error| error.to_string())?;
    let on_usb = ports.into_iter().filter_map(|port| {
        let serialport::SerialPortType::UsbPort(usb) = port.port_type else {
            return None;
        };
        let maker = usb.product.or(usb.manufacturer).unwrap_or_default();
        // Polhem's text board is a Teensy; any adapter may be a SPIDAR's.
        let is_teensy = usb.vid == TEENSY;
        let driver = if is_teensy { "polhem" } else { "spidar" };
        Some(PluggedPort {
            what: format!("{:04x}:{:04x}, {maker}", usb.vid, usb.pid),
            device: Some(format!("{driver}:{}", port.port_name)),
            path: port.port_name,
            is_its_board: is_teensy,
        })
    });
    Ok(on_usb.chain(hid_boards()).collect())
}

/// WoodenHaptics' boards, which are no serial ports.
#[cfg(all(unix, feature = "hid"))]
fn hid_boards() -> Vec<PluggedPort> {
    let Ok(hid) = hidapi::HidApi::new() else {
        return Vec::new(); // no HID on this machine
    };
    let board = |device: &hidapi::DeviceInfo| {
        let ids = (device.vendor_id(), device.product_id());
        let path = device.path().to_string_lossy().into_owned();
        crate::wooden::is_board(ids, device.interface_number()).then(|| PluggedPort {
            what: format!("{:04x}:{:04x}, HID", ids.0, ids.1),
            device: Some(format!("wooden={path}")),
            path,
            is_its_board: true,
        })
    };
    hid.device_list().filter_map(board).collect()
}

#[cfg(all(unix, not(feature = "hid")))]
fn hid_boards() -> Vec<PluggedPort> {
    Vec::new()
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
