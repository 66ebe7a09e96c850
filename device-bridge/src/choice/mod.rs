//! Which device: one word on the command line, with options after commas.
//!
//! `simulated,strings=wb`, `trace:FILE`, `haply=HOST:PORT`, `space-mouse,speed=0.2`, `vrpn:Tracker0@host,axes=x -z y`, `mouse`.

mod option_text;
mod settings;

use std::path::PathBuf;
use std::str::FromStr;

use taut_plant::Grip;
use taut_vrpn::{Address, AddressError};

use option_text::nearest;
#[cfg(unix)]
use settings::wooden_settings;
use settings::{
    cap_settings, haply_settings, plugin_settings, polhem_settings, spidar_settings,
    strings_option, vrpn_settings,
};

use crate::device::Device;
#[cfg(unix)]
use crate::devices::WoodenSettings;
use crate::devices::{
    ArmDevice, CapSettings, HaplySettings, HidPort, PluginSettings, PolhemSettings, SourceError,
    SpaceMouse, SpidarUartError, SpidarUartSettings, VrpnDevice, VrpnSettings,
};
use crate::haply::{HaplyAddressError, HaplyError};
use crate::placement::Placement;
use crate::plugin::PluginError;

/// A driver, for lists that people read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Driver {
    /// Its name in choices and in workbench files.
    pub name: &'static str,
    /// How it is chosen.
    pub form: &'static str,
    /// What it is.
    pub what: &'static str,
}

/// All drivers.
pub const DRIVERS: [Driver; 10] = [
    Driver {
        name: "simulated",
        form: "simulated[,strings=g6x3r|g6x5r|wb|FILE]",
        what: "a simulated device in a simulated hand, made of strings on request: pose and force",
    },
    Driver {
        name: "trace",
        form: "trace:FILE",
        what: "a recorded trace of poses: no force",
    },
    Driver {
        name: "haply",
        form: "haply[=HOST:PORT][,arm=ID,grip=yes|no,axes=x y z,scale=S,anchor=start|workbench]",
        what: "a Haply Inverse arm behind its service, with or without a VerseGrip: force without torque",
    },
    Driver {
        name: "spidar",
        form: "spidar:PORT[,geometry=g6x4r|NAME|FILE,axes=x -z y]",
        what: "a SPIDAR-G on its UART motor boards: six degrees of freedom, force and torque",
    },
    Driver {
        name: "polhem",
        form: "polhem:PORT[,axes=y -x z,scale=S,anchor=start|workbench]",
        what: "a Polhem arm on its text board: six degrees of freedom, force without torque",
    },
    Driver {
        name: "wooden",
        form: "wooden[=PATH][,model=NAME,axes=y -x z,scale=S,anchor=start|workbench]",
        what: "a WoodenHaptics arm, or a kin of it, on its HID board: force without torque",
    },
    Driver {
        name: "plugin",
        form: "plugin:LIBRARY[,axes=x y z,scale=S,anchor=start|workbench,...]",
        what: "a force device in a shared library of your own (taut_device.h); other options go to the library",
    },
    Driver {
        name: "space-mouse",
        form: "space-mouse[,mode=rate|position,speed=M/S,turn-rate=RAD/S,dead-zone=D,...]",
        what: "a 3Dconnexion SpaceMouse: six degrees of freedom in, no force",
    },
    Driver {
        name: "vrpn",
        form: "vrpn:TRACKER@HOST[:PORT][,sensor=N,mode=tcp|udp,axes=x -z y,scale=M,...]",
        what: "a sensor of a VRPN tracker: six degrees of freedom in, no force",
    },
    Driver {
        name: "mouse",
        form: "mouse",
        what: "mouse and keyboard of a render window (`taut demo`, `taut render --hold`): no force",
    },
];

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
    #[error("cannot start to listen to the tracker {address}: {cause}; end other programs")]
    Vrpn {
        /// Of the tracker.
        address: Address,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The Inverse service.
    #[error(transparent)]
    Haply(#[from] HaplyError),
    /// The motor boards.
    #[error(transparent)]
    Spidar(#[from] SpidarUartError),
    /// The shared library.
    #[error(transparent)]
    Plugin(#[from] PluginError),
    /// The Polhem board.
    #[cfg(unix)]
    #[error(transparent)]
    Polhem(#[from] crate::polhem::PolhemError),
    /// The WoodenHaptics board.
    #[cfg(unix)]
    #[error(transparent)]
    Wooden(#[from] crate::wooden::WoodenError),
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
    /// Metres on the workbench of one of its own.
    pub scale: f64,
    /// Whether it can turn a hand, not only push it.
    pub renders_torque: bool,
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
                let board = crate::polhem::PolhemBoard::open(&settings.path, priority)?;
                Box::new(ArmDevice::new(Box::new(board), settings.arm(), placement))
            }
            #[cfg(unix)]
            Self::Wooden(settings) => {
                let path = settings.path.clone();
                let board = crate::wooden::WoodenBoard::open(path, settings.model, priority)?;
                Box::new(ArmDevice::new(Box::new(board), settings.arm(), placement))
            }
            #[cfg(not(unix))]
            Self::Polhem(_) => return Err(InputError::NotHere),
            Self::Vrpn(settings) => {
                let device = VrpnDevice::start(settings, placement);
                Box::new(device.map_err(|cause| InputError::Vrpn {
                    address: settings.source.address.clone(),
                    cause,
                })?)
            }
        })
    }
}

/// A text that chooses no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnknownDevice {
    /// No driver of that name.
    #[error("there is no device `{name}`{hint}; use {}", names_and_forms())]
    Name {
        /// What was written.
        name: String,
        /// The nearest name, in a sentence's end, or nothing.
        hint: String,
    },
    /// The driver needs more than its name.
    #[error("the device `{name}` is incomplete; write {form}")]
    Incomplete {
        /// The driver.
        name: &'static str,
        /// What to write.
        form: &'static str,
    },
    /// The tracker's address.
    #[error(transparent)]
    Address(#[from] AddressError),
    /// The Inverse service's address.
    #[error(transparent)]
    Service(#[from] HaplyAddressError),
    /// The geometry of a string-driven device.
    #[error("{0}")]
    Geometry(String),
    /// No such option.
    #[error("the device `{device}` has no option `{option}`{hint}; it has {known}")]
    Option {
        /// The driver.
        device: &'static str,
        /// What was written.
        option: String,
        /// The nearest option.
        hint: String,
        /// All of them.
        known: String,
    },
    /// A value that the option does not take.
    #[error("`{option}` of the device `{device}` is `{value}`, but must be {wanted}")]
    Value {
        /// The driver.
        device: &'static str,
        /// The option.
        option: &'static str,
        /// What was written.
        value: String,
        /// What it takes.
        wanted: String,
    },
}

impl FromStr for DeviceChoice {
    type Err = UnknownDevice;

    fn from_str(text: &str) -> Result<Self, UnknownDevice> {
        let end = text.find([':', ',', '=']).unwrap_or(text.len());
        let (name, rest) = text.split_at(end);
        let Some(driver) = DRIVERS.iter().find(|driver| driver.name == name) else {
            return Err(UnknownDevice::Name {
                name: text.to_owned(),
                hint: nearest(name, DRIVERS.iter().map(|driver| driver.name)),
            });
        };
        let incomplete = UnknownDevice::Incomplete {
            name: driver.name,
            form: driver.form,
        };
        match (driver.name, rest.strip_prefix(':')) {
            ("simulated", None) => Ok(Self::Simulated {
                strings: strings_option(rest.trim_start_matches(','))?,
            }),
            ("mouse", None) if rest.is_empty() => Ok(Self::Mouse),
            ("trace", Some(file)) if !file.is_empty() => Ok(Self::Trace(file.into())),
            ("spidar", Some(rest)) if !rest.is_empty() => Ok(Self::Input(InputChoice::Spidar(
                Box::new(spidar_settings(rest)?),
            ))),
            ("polhem", Some(rest)) if !rest.is_empty() => Ok(Self::Input(InputChoice::Polhem(
                Box::new(polhem_settings(rest)?),
            ))),
            ("plugin", Some(rest)) if !rest.is_empty() && !rest.starts_with(',') => Ok(
                Self::Input(InputChoice::Plugin(Box::new(plugin_settings(rest)?))),
            ),
            #[cfg(unix)]
            ("wooden", None) => Ok(Self::Input(InputChoice::Wooden(Box::new(wooden_settings(
                rest,
            )?)))),
            ("haply", None) => Ok(Self::Input(InputChoice::Haply(Box::new(haply_settings(
                rest,
            )?)))),
            ("space-mouse", None) => {
                let settings = cap_settings(rest.trim_start_matches(','))?;
                Ok(Self::Input(InputChoice::SpaceMouse(settings)))
            }
            ("vrpn", Some(rest)) => Ok(Self::Input(InputChoice::Vrpn(Box::new(vrpn_settings(
                rest,
            )?)))),
            _ => Err(incomplete),
        }
    }
}

/// The forms of all drivers, in a sentence.
fn names_and_forms() -> String {
    let forms: Vec<&str> = DRIVERS.iter().map(|driver| short(driver.form)).collect();
    let (last, others) = forms.split_last().unwrap_or((&"", &[]));
    format!("{} or {last}", others.join(", "))
}

/// A form without its options.
fn short(form: &'static str) -> &'static str {
    form.split('[').next().unwrap_or(form)
}

/// What follows the arguments in `--help`: every driver with its options.
#[must_use]
pub fn drivers_help() -> String {
    let mut help = "Devices:\n".to_owned();
    for Driver { form, what, .. } in DRIVERS {
        help += &format!("  {form}\n      {what}\n");
    }
    help
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

    fn error(text: &str) -> String {
        text.parse::<DeviceChoice>().expect_err(text).to_string()
    }

    #[test]
    fn every_driver_is_chosen_by_its_form() {
        for driver in DRIVERS {
            let text = short(driver.form)
                .replace("TRACKER@HOST", "Tracker0@host")
                .replace("PORT", "/dev/ttyUSB0")
                .replace("FILE", "a,b.csv");
            choice(&text);
        }
        assert_eq!(
            choice("trace:a,b.csv"),
            DeviceChoice::Trace("a,b.csv".into())
        );
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

    #[test]
    fn wrong_words_are_answered_with_the_right_ones() {
        for (text, part) in [
            ("spacemouse", "did you mean `space-mouse`?"),
            ("simulatd", "did you mean `simulated`?"),
            (
                "phantom",
                "use simulated, trace:FILE, haply, spidar:PORT, polhem:PORT, wooden, plugin:LIBRARY, space-mouse",
            ),
            ("spidar", "write spidar:PORT"),
            ("spidar:", "write spidar:PORT"),
            ("wooden,model=phantom", "must be woodenhaptics-2019 or"),
            ("polhem", "write polhem:PORT"),
            ("plugin", "write plugin:LIBRARY"),
            ("plugin:", "write plugin:LIBRARY"),
            ("plugin:/l.so,scale=0", "a number from 0.01 to 100"),
            ("polhem:/dev/x,scal=1", "did you mean `scale`?"),
            ("spidar:/dev/x,geometry=nothing", "g6x4r"),
            ("spidar:/dev/x,axes=y x z", "right-handed"),
            ("haply=", "write HOST or HOST:PORT"),
            ("haply:10001", "write haply[=HOST:PORT]"),
            ("haply=pc:1,grip=maybe", "must be yes or no"),
            ("haply,scale=0", "a number from 0.01 to 100"),
            ("haply,arms=1", "did you mean `arm`?"),
            ("trace:", "write trace:FILE"),
            ("trace", "write trace:FILE"),
            ("simulated,hand=firm", "it has strings"),
            ("simulated,strings", "must be g6x3r, g6x4r, g6x5r, wb or"),
            ("simulated:wb", "write simulated"),
            ("vrpn", "write vrpn:TRACKER@HOST"),
            ("vrpn:Tracker0", "DEVICE@HOST:PORT"),
            ("vrpn:T@h,sensors=1", "did you mean `sensor`?"),
            ("vrpn:T@h,axes=x y", "such as `x -z y`"),
            ("vrpn:T@h,mode=tpc", "must be tcp or udp"),
            ("space-mouse,speed=fast", "a number from 0.001 to 10"),
            ("space-mouse,speed=NaN", "a number from 0.001 to 10"),
            ("space-mouse,sped=1", "did you mean `speed`?"),
        ] {
            let error = error(text);
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn the_help_names_every_driver() {
        let help = drivers_help();
        for driver in DRIVERS {
            assert!(help.contains(driver.form) && help.contains(driver.what));
        }
    }
}
