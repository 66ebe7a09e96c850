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

/// A model with the numbers by which USB knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// Of the vendor: Logitech for the older ones.
    pub vendor: u16,
    /// Of the product.
    pub product: u16,
    /// For people.
    pub name: &'static str,
}

const fn model(vendor: u16, product: u16, name: &'static str) -> Model {
    Model {
        vendor,
        product,
        name,
    }
}

/// The known models. Source: the device tables of the free spacenav project and of VRPN.
pub const MODELS: [Model; 21] = [
    model(0x046d, 0xc603, "SpaceMouse Plus XT"),
    model(0x046d, 0xc605, "CadMan"),
    model(0x046d, 0xc606, "SpaceMouse Classic"),
    model(0x046d, 0xc621, "SpaceBall 5000"),
    model(0x046d, 0xc623, "SpaceTraveler"),
    model(0x046d, 0xc625, "SpacePilot"),
    model(0x046d, 0xc626, "SpaceNavigator"),
    model(0x046d, 0xc627, "SpaceExplorer"),
    model(0x046d, 0xc628, "SpaceNavigator for Notebooks"),
    model(0x046d, 0xc629, "SpacePilot Pro"),
    model(0x046d, 0xc62b, "SpaceMouse Pro"),
    model(0x256f, 0xc62e, "SpaceMouse Wireless"),
    model(0x256f, 0xc62f, "SpaceMouse Wireless"),
    model(0x256f, 0xc631, "SpaceMouse Pro Wireless"),
    model(0x256f, 0xc632, "SpaceMouse Pro Wireless"),
    model(0x256f, 0xc633, "SpaceMouse Enterprise"),
    model(0x256f, 0xc635, "SpaceMouse Compact"),
    model(0x256f, 0xc636, "SpaceMouse Module"),
    model(0x256f, 0xc638, "SpaceMouse Pro Wireless"),
    model(0x256f, 0xc63a, "SpaceMouse Wireless"),
    model(0x256f, 0xc652, "3Dconnexion Universal Receiver"),
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
            let known = MODELS
                .iter()
                .find(|m| (m.vendor, m.product) == (device.vendor_id(), device.product_id()))?;
            Some((device, known))
        });
        let (device, model) = found.ok_or(SourceError::NotFound)?;
        let device = device
            .open_device(&hid)
            .map_err(|error| SourceError::NotOpened {
                name: model.name,
                vendor: model.vendor,
                cause: error.to_string(),
            })?;
        Ok(Box::new(HidSource {
            device,
            name: model.name,
        }))
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
        for (place, one) in MODELS.iter().enumerate() {
            let same = |other: &&Model| (other.vendor, other.product) == (one.vendor, one.product);
            assert_eq!(
                MODELS.iter().filter(same).count(),
                1,
                "{place}: {}",
                one.name
            );
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
