//! Which device: what was chosen of [`taut_kinds::KINDS`], on the command line or in a workbench file, and how each kind is opened.

mod settings;

use std::path::PathBuf;
use std::str::FromStr;

use taut_kinds::{Chosen, KindId, UnknownDevice, read_choice};
use taut_plant::Grip;
use taut_vrpn::{Address, SensorMapping};

pub use settings::vrpn_settings;
#[cfg(unix)]
use settings::wooden_settings;
use settings::{cap_settings, haply_settings, plugin_settings, polhem_settings, spidar_settings};

use crate::device::Device;
#[cfg(unix)]
use crate::devices::WoodenSettings;
use crate::devices::{
    ArmDevice, CapSettings, HaplySettings, HidPort, PluginSettings, PolhemSettings, SourceError,
    SpaceMouse, SpidarUartError, SpidarUartSettings, VrpnDevice, VrpnSettings,
};
use crate::haply::HaplyError;
use crate::placement::Placement;
use crate::plugin::{Language, PluginError};

/// Which device is read.
#[derive(Clone, Debug, PartialEq)]
pub enum DeviceChoice {
    /// [`crate::SimulatedDevice`], or [`crate::SpidarDevice`] with [`crate::HeldStrings`].
    Simulated {
        /// A shipped geometry's name or a geometry file, for [`crate::string_geometry`]; `None` is without strings.
        strings: Option<String>,
    },
    /// [`crate::RecordedDevice`] of a trace file.
    Trace(PathBuf),
    /// A device of this machine or network, found when it is opened.
    Input(InputChoice),
    /// The mouse of a render window, which joins as a bridge of its own.
    Mouse,
}

impl DeviceChoice {
    /// It takes itself to be at a known place when it is opened: not while somebody works with it.
    #[must_use]
    pub fn is_calibrated_when_opened(&self) -> bool {
        match self {
            Self::Input(InputChoice::Spidar(_)) => true,
            #[cfg(unix)]
            Self::Input(InputChoice::Wooden(_)) => true,
            _ => false,
        }
    }
}

/// A device that is opened.
#[derive(Clone, Debug, PartialEq)]
pub enum InputChoice {
    /// [`SpaceMouse`].
    SpaceMouse(CapSettings),
    /// [`VrpnDevice`].
    Vrpn(Box<VrpnSettings>),
    /// [`crate::ArmDevice`] behind a service.
    Haply(Box<HaplySettings>),
    /// [`crate::SpidarDevice`] on motor boards.
    Spidar(Box<SpidarUartSettings>),
    /// [`crate::ArmDevice`] on a serial port.
    Polhem(Box<PolhemSettings>),
    /// [`crate::ArmDevice`] in a shared library.
    Plugin(Box<PluginSettings>),
    /// [`crate::ArmDevice`] on a HID board.
    #[cfg(unix)]
    Wooden(Box<WoodenSettings>),
}

/// Why a device cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// The SpaceMouse.
    #[error(transparent)]
    SpaceMouse(#[from] SourceError),
    /// The tracker.
    #[error("cannot start to listen to the tracker {0}: {1}; end other programs")]
    Vrpn(Address, std::io::Error),
    /// The Inverse service.
    #[error(transparent)]
    Haply(#[from] HaplyError),
    /// The motor boards.
    #[error(transparent)]
    Spidar(#[from] SpidarUartError),
    /// The shared library.
    #[error(transparent)]
    Plugin(#[from] PluginError),
    /// The port of a Polhem board.
    #[cfg(unix)]
    #[error(transparent)]
    Port(#[from] crate::serial_port::PortError),
    /// The WoodenHaptics board.
    #[cfg(unix)]
    #[error(
        "no WoodenHaptics board can be opened ({0}); plug it in, or let your user read it: echo 'KERNEL==\"hidraw*\", ATTRS{{idVendor}}==\"16c0\", MODE=\"0660\", TAG+=\"uaccess\"' | sudo tee /etc/udev/rules.d/70-taut-wooden.rules, then plug it in anew"
    )]
    Wooden(String),
    /// The thread of either.
    #[cfg(unix)]
    #[error(transparent)]
    Thread(#[from] crate::own_thread::ThreadError),
    /// A driver that is not here.
    #[error("devices on serial ports can be used on Unix only")]
    NotHere,
}

/// What a device with motors is declared to be, before it is opened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceDevice {
    /// Its mechanics, in its own metres.
    pub grip: Grip,
    /// From a reading to the force that answers it, beyond the loop's own period, s.
    pub delay_s: f64,
    /// Metres on the workbench of one of its own; `None` where its metres are the scene's, however large that is drawn.
    pub scale: Option<f64>,
    /// Whether it can turn a hand, not only push it.
    pub renders_torque: bool,
}

impl ForceDevice {
    /// An arm that pushes and turns no hand, with a millisecond for its wire.
    pub(crate) fn arm(grip: Grip, mapping: &SensorMapping) -> Self {
        Self {
            grip,
            delay_s: 1e-3,
            scale: Some(mapping.scale),
            renders_torque: false,
        }
    }
}

impl InputChoice {
    /// What its motors are declared to bear; `None` without motors.
    #[must_use]
    pub fn force_device(&self) -> Option<ForceDevice> {
        match self {
            Self::SpaceMouse(_) | Self::Vrpn(_) => None,
            Self::Haply(settings) => Some(settings.force_device()),
            Self::Spidar(settings) => Some(settings.force_device()),
            Self::Polhem(settings) => Some(settings.force_device()),
            Self::Plugin(settings) => Some(settings.force_device()),
            #[cfg(unix)]
            Self::Wooden(settings) => Some(settings.force_device()),
        }
    }

    /// Starts to read it. A driver with a thread that a force depends on asks for real-time priority `priority` for it; 0 asks for none.
    ///
    /// # Errors
    /// [`InputError`]. A tracker that does not answer yet is no error: it is waited for.
    pub fn open(&self, placement: Placement, priority: u8) -> Result<Box<dyn Device>, InputError> {
        Ok(match self {
            Self::SpaceMouse(settings) => {
                Box::new(SpaceMouse::open(Box::new(HidPort), *settings, placement)?)
            }
            Self::Haply(settings) => Box::new(settings.open(placement, priority)?),
            Self::Spidar(settings) => settings.open(&placement, priority)?,
            Self::Plugin(settings) => Box::new(settings.open(placement, priority)?),
            #[cfg(unix)]
            Self::Polhem(settings) => {
                let board = crate::polhem::start(&settings.path, priority)?;
                Box::new(ArmDevice::new(Box::new(board), settings.arm(), placement))
            }
            #[cfg(unix)]
            Self::Wooden(settings) => {
                let path = settings.path.clone();
                let board = crate::wooden::start(path, settings.model, priority)?;
                Box::new(ArmDevice::new(Box::new(board), settings.arm(), placement))
            }
            #[cfg(not(unix))]
            Self::Polhem(_) => return Err(InputError::NotHere),
            Self::Vrpn(settings) => {
                let device = VrpnDevice::start(settings, placement);
                let tracker = &settings.source.address;
                Box::new(device.map_err(|cause| InputError::Vrpn(tracker.clone(), cause))?)
            }
        })
    }
}

impl DeviceChoice {
    /// What was chosen, where it is read by a driver of this process; `None` is a device of the network.
    ///
    /// # Errors
    /// [`UnknownDevice`]: a geometry cannot be read.
    pub fn of(chosen: &Chosen) -> Result<Option<Self>, UnknownDevice> {
        let input = match chosen.kind.id {
            KindId::Remote => return Ok(None),
            KindId::Mouse => return Ok(Some(Self::Mouse)),
            KindId::Simulated => {
                let strings = chosen.text("strings").map(str::to_owned);
                return Ok(Some(Self::Simulated { strings }));
            }
            KindId::Trace => {
                let path = chosen.file("path").unwrap_or("".as_ref());
                return Ok(Some(Self::Trace(path.to_owned())));
            }
            KindId::Haply => InputChoice::Haply(Box::new(haply_settings(chosen))),
            KindId::Spidar => InputChoice::Spidar(Box::new(spidar_settings(chosen)?)),
            KindId::Polhem => InputChoice::Polhem(Box::new(polhem_settings(chosen))),
            #[cfg(unix)]
            KindId::Wooden => InputChoice::Wooden(Box::new(wooden_settings(chosen))),
            #[cfg(not(unix))]
            KindId::Wooden => {
                let form = "it on Unix only".to_owned();
                return Err(UnknownDevice::Incomplete(chosen.kind.name, form));
            }
            KindId::Plugin => {
                InputChoice::Plugin(Box::new(plugin_settings(chosen, "library", Language::C)))
            }
            KindId::Python => {
                let interpreter = chosen.text("interpreter").unwrap_or("python3");
                let language = Language::Python {
                    interpreter: interpreter.into(),
                };
                InputChoice::Plugin(Box::new(plugin_settings(chosen, "file", language)))
            }
            KindId::SpaceMouse => InputChoice::SpaceMouse(cap_settings(chosen)),
            KindId::Vrpn => {
                let settings = vrpn_settings(chosen).ok_or_else(|| {
                    UnknownDevice::Incomplete(chosen.kind.name, chosen.kind.form())
                })?;
                InputChoice::Vrpn(Box::new(settings))
            }
        };
        Ok(Some(Self::Input(input)))
    }
}

impl FromStr for DeviceChoice {
    type Err = UnknownDevice;

    fn from_str(text: &str) -> Result<Self, UnknownDevice> {
        let choice = Self::of(&read_choice(text)?)?;
        choice.ok_or_else(|| UnknownDevice::Name(text.to_owned(), String::new()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::devices::{Anchor, CapMode};
    use crate::vrpn::VrpnMode;
    use std::time::Duration;

    fn choice(text: &str) -> DeviceChoice {
        text.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn every_kind_of_the_command_line_has_a_driver() {
        for kind in taut_kinds::KINDS.iter().filter(|kind| kind.on_command_line) {
            let text = kind.short_form();
            choice(&text.replace("TRACKER@HOST", "Tracker0@host"));
        }
        assert_eq!(
            choice("trace:a,b.csv"),
            DeviceChoice::Trace("a,b.csv".into())
        );
        let error = "spidar:/dev/x,geometry=nothing".parse::<DeviceChoice>();
        let error = error.expect_err("no geometry").to_string();
        assert!(error.contains("g6x4r"), "{error}");
        // The counters of both are set when they are opened.
        let calibrated = |text| choice(text).is_calibrated_when_opened();
        assert!(calibrated("spidar:/dev/x") && calibrated("wooden"));
        assert!(!calibrated("haply") && !calibrated("polhem:/dev/x"));
    }

    #[test]
    fn words_of_a_declaration_are_those_of_its_driver() {
        use taut_kinds::Takes;
        let known: [(KindId, &str, Vec<&str>); 5] = [
            (
                KindId::Wooden,
                "model",
                crate::wooden::WOODEN_MODELS.map(|m| m.name).to_vec(),
            ),
            (
                KindId::SpaceMouse,
                "mode",
                CapMode::NAMED.map(|m| m.0).to_vec(),
            ),
            (KindId::Vrpn, "mode", VrpnMode::NAMED.map(|m| m.0).to_vec()),
            (KindId::Vrpn, "anchor", Anchor::NAMED.map(|m| m.0).to_vec()),
            (KindId::Haply, "anchor", Anchor::NAMED.map(|m| m.0).to_vec()),
        ];
        for (id, name, words) in known {
            let mut kinds = taut_kinds::KINDS.iter();
            let kind = kinds.find(|kind| kind.id == id).expect("declared");
            let mut keys = kind.keys.iter();
            let key = keys.find(|key| key.name == name).expect("declared");
            let Takes::OneOf(declared) = key.takes else {
                panic!("{name}");
            };
            assert_eq!(declared, words, "{}: {name}", kind.name);
        }
    }

    #[test]
    fn options_reach_the_drivers() {
        let DeviceChoice::Input(InputChoice::SpaceMouse(cap)) =
            choice("space-mouse,mode=position,reach=0.3,dead-zone=0.2")
        else {
            panic!();
        };
        let wanted = CapSettings {
            mode: CapMode::Position,
            reach: 0.3,
            dead_zone: 0.2,
            ..CapSettings::default()
        };
        assert_eq!(cap, wanted);
        let DeviceChoice::Input(InputChoice::Vrpn(vrpn)) = choice(
            "vrpn:Tracker0@lab:4000,sensor=2,mode=udp,axes=x -z y,scale=0.001,anchor=workbench,max-age=0.2",
        ) else {
            panic!();
        };
        assert_eq!(vrpn.source.address.to_string(), "Tracker0@lab:4000");
        assert_eq!((vrpn.source.sensor, vrpn.source.mode), (2, VrpnMode::Udp));
        assert_eq!(vrpn.mapping.axes.to_string(), "x -z y");
        assert_eq!(
            (vrpn.mapping.scale, vrpn.anchor),
            (0.001, Anchor::Workbench)
        );
        assert_eq!(vrpn.max_age, Duration::from_millis(200));
        let DeviceChoice::Input(InputChoice::Haply(haply)) =
            choice("haply=lab:10001,arm=04C3,grip=no,axes=x -z y,scale=2,anchor=workbench")
        else {
            panic!();
        };
        assert_eq!(haply.address.to_string(), "lab:10001");
        assert_eq!(haply.exchange.arm.as_deref(), Some("04C3"));
        assert!(!haply.exchange.with_grip);
        assert_eq!(
            (haply.mapping.scale, haply.anchor),
            (2.0, Anchor::Workbench)
        );
        let plain = DeviceChoice::Input(InputChoice::Haply(Box::default()));
        assert_eq!(choice("haply"), plain);
    }
}
