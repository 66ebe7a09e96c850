//! Where HID reports come from: the device itself, or whatever a test puts in its place.

use std::time::Duration;

/// Longest report of any model, and room for those to come.
pub(crate) const MAX_REPORT_BYTES: usize = 64;

/// Finds the device again and again, as cables are pulled and put back.
pub trait ReportPort: Send {
    /// Opens it.
    ///
    /// # Errors
    /// A [`SourceError`] in words for people.
    fn open(&mut self) -> Result<Box<dyn ReportSource>, SourceError>;
}

/// An open device.
pub trait ReportSource: Send {
    /// Waits at most `timeout` for one report and puts it at the start of `buffer`; 0 bytes where none came.
    ///
    /// # Errors
    /// A [`SourceError`]: the device is gone, open it anew.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, SourceError>;

    /// What it is, for logs.
    fn name(&self) -> &str;
}

/// Why there are no reports.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SourceError {
    /// None is plugged in.
    #[error(
        "no SpaceMouse is plugged in (looked for 3Dconnexion's known models among the HID devices); plug one in, or choose another device"
    )]
    NotFound,
    /// There is one, but not for this user.
    #[error(
        "{name} cannot be opened ({cause}); let your user read it: echo 'KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"{vendor:04x}\", MODE=\"0660\", TAG+=\"uaccess\"' | sudo tee /etc/udev/rules.d/70-taut-spacemouse.rules, then plug it in anew"
    )]
    NotOpened {
        /// The model.
        name: &'static str,
        /// Its vendor.
        vendor: u16,
        /// What the system says.
        cause: String,
    },
    /// It was read and is no more.
    #[error("the SpaceMouse is gone ({0}); plug it in again")]
    Gone(String),
    /// This program cannot read HID devices.
    #[error("this program was built without HID; build it with the feature `hid`")]
    NotBuiltIn,
}

/// The known models: the numbers by which USB knows vendor (Logitech for the older ones) and product, and the name. Source: the device tables of the free
/// spacenav project and of VRPN.
#[cfg(any(feature = "hid", test))]
const MODELS: [(u16, u16, &str); 21] = [
    (0x046d, 0xc603, "SpaceMouse Plus XT"),
    (0x046d, 0xc605, "CadMan"),
    (0x046d, 0xc606, "SpaceMouse Classic"),
    (0x046d, 0xc621, "SpaceBall 5000"),
    (0x046d, 0xc623, "SpaceTraveler"),
    (0x046d, 0xc625, "SpacePilot"),
    (0x046d, 0xc626, "SpaceNavigator"),
    (0x046d, 0xc627, "SpaceExplorer"),
    (0x046d, 0xc628, "SpaceNavigator for Notebooks"),
    (0x046d, 0xc629, "SpacePilot Pro"),
    (0x046d, 0xc62b, "SpaceMouse Pro"),
    (0x256f, 0xc62e, "SpaceMouse Wireless"),
    (0x256f, 0xc62f, "SpaceMouse Wireless"),
    (0x256f, 0xc631, "SpaceMouse Pro Wireless"),
    (0x256f, 0xc632, "SpaceMouse Pro Wireless"),
    (0x256f, 0xc633, "SpaceMouse Enterprise"),
    (0x256f, 0xc635, "SpaceMouse Compact"),
    (0x256f, 0xc636, "SpaceMouse Module"),
    (0x256f, 0xc638, "SpaceMouse Pro Wireless"),
    (0x256f, 0xc63a, "SpaceMouse Wireless"),
    (0x256f, 0xc652, "3Dconnexion Universal Receiver"),
];

/// The first known model among the machine's HID devices.
#[derive(Clone, Copy, Debug, Default)]
pub struct HidPort;

#[cfg(feature = "hid")]
impl ReportPort for HidPort {
    fn open(&mut self) -> Result<Box<dyn ReportSource>, SourceError> {
        let gone = |error: hidapi::HidError| SourceError::Gone(error.to_string());
        let hid = hidapi::HidApi::new().map_err(gone)?;
        let found = hid.device_list().find_map(|device| {
            let same = |model: &&(u16, u16, _)| {
                (model.0, model.1) == (device.vendor_id(), device.product_id())
            };
            Some((device, MODELS.iter().find(same)?))
        });
        let (device, &(vendor, _, name)) = found.ok_or(SourceError::NotFound)?;
        let device = device
            .open_device(&hid)
            .map_err(|error| SourceError::NotOpened {
                name,
                vendor,
                cause: error.to_string(),
            })?;
        Ok(Box::new(HidSource { device, name }))
    }
}

#[cfg(not(feature = "hid"))]
impl ReportPort for HidPort {
    fn open(&mut self) -> Result<Box<dyn ReportSource>, SourceError> {
        Err(SourceError::NotBuiltIn)
    }
}

#[cfg(feature = "hid")]
struct HidSource {
    device: hidapi::HidDevice,
    name: &'static str,
}

#[cfg(feature = "hid")]
impl ReportSource for HidSource {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, SourceError> {
        let milliseconds = i32::try_from(timeout.as_millis()).unwrap_or(i32::MAX);
        self.device
            .read_timeout(buffer, milliseconds)
            .map_err(|error| SourceError::Gone(error.to_string()))
    }

    fn name(&self) -> &str {
        self.name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_model_is_listed_once() {
        for (vendor, product, name) in MODELS {
            let same = |other: &&(u16, u16, _)| (other.0, other.1) == (vendor, product);
            assert_eq!(MODELS.iter().filter(same).count(), 1, "{name}");
        }
    }

    /// Passes on a machine with a SpaceMouse and on one without; says which it was.
    #[cfg(feature = "hid")]
    #[test]
    fn the_machine_s_devices_are_looked_through() {
        match HidPort.open() {
            Ok(source) => println!("found: {}", source.name()),
            Err(SourceError::NotFound) => {
                println!("no SpaceMouse here: reading a real one is not tested")
            }
            Err(error @ SourceError::NotOpened { .. }) => println!("{error}"),
            Err(error) => panic!("{error}"),
        }
    }
}
