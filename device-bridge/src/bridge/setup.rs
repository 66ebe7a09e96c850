//! What the command line asks for, checked before anything is started: motion, credential, and the device behind its port.

use std::path::PathBuf;

use nalgebra::Point3;
use taut_link::proto::SceneDescription;
use taut_link::{ClientOptions, Role, read_join_key};
use taut_spidar::Geometry;

use super::BridgeError;
use crate::bridge_loop::BridgeLoop;
use crate::choice::{DeviceChoice, InputChoice};
use crate::cli::BridgeArgs;
use crate::device::{Device, DeviceInfo, Pose};
use crate::devices::{AtEnd, Grip, MinJerkPath, RecordedDevice, SimulatedDevice, Trace, Tremor};
use crate::placement::Placement;
use crate::port::{DevicePort, Passivity, SafetySettings};
use crate::simulated_strings::{simulated_spidar, string_geometry};
use crate::trace_file::{TraceFileError, read_path, read_trace};

/// States per second for a client that draws nothing: the fewest.
const STATE_RATE_HZ: u32 = 1;

/// Sway of a hand that was given no path: 20 mm to either side, a cycle in 8 s.
const SWAY: (f64, f64) = (0.02, 8.0);

/// Rates that a device loop can hold, in Hz. One that is slower cannot take a force away within what is promised: its last write holds too long.
const RATES_HZ: std::ops::RangeInclusive<f64> = 100.0..=10_000.0;

/// Stiffer than any wall that a loop of 1 kHz renders, N/m.
const MAX_CONTACT_STIFFNESS: f64 = 20_000.0;

/// What moves the device: read and checked before anything is started.
pub(super) enum Motion {
    /// A simulated hand; without a path it sways.
    Held {
        path: Option<MinJerkPath>,
        strings: Option<Box<Geometry>>,
    },
    Trace(PathBuf, Trace),
    Input(InputChoice),
}

pub(super) fn prepare(args: &BridgeArgs) -> Result<(ClientOptions, Motion), BridgeError> {
    check_ranges(args)?;
    let motion = match (&args.device, &args.path) {
        (DeviceChoice::Mouse, _) => return Err(BridgeError::Mouse),
        (DeviceChoice::Input(input), _) => Motion::Input(input.clone()),
        (DeviceChoice::Trace(file), _) => Motion::Trace(file.clone(), read_trace(file)?),
        (DeviceChoice::Simulated { strings }, file) => {
            let path = file.as_ref().map(|file| read_path(file, args.looping));
            Motion::Held {
                path: path.transpose()?,
                strings: strings
                    .as_deref()
                    .map(string_geometry)
                    .transpose()?
                    .map(Box::new),
            }
        }
    };

    Ok((client_options(args)?, motion))
}

fn check_ranges(args: &BridgeArgs) -> Result<(), BridgeError> {
    let safety = &args.safety;
    let rate = (RATES_HZ, "100 to 10000 Hz");
    let limit = (f64::MIN_POSITIVE..=1e3, "a number above 0, at most 1000");
    let contact = (0.0..=MAX_CONTACT_STIFFNESS, "0 to 20000 N/m");
    let seconds = (0.0..=1e9, "0 to 1e9 s");
    for (option, value, &(ref valid, range)) in [
        ("--rate", Some(args.rate), &rate),
        ("--max-force", Some(safety.max_force), &limit),
        ("--max-torque", Some(safety.max_torque), &limit),
        ("--force-slew", Some(safety.force_slew), &limit),
        ("--torque-slew", Some(safety.torque_slew), &limit),
        (
            "--contact-stiffness",
            Some(safety.contact_stiffness),
            &contact,
        ),
        ("--duration", args.duration, &seconds),
        ("--give-up", args.give_up, &seconds),
    ] {
        if let Some(value) = value.filter(|value| !valid.contains(value)) {
            return Err(BridgeError::OutOfRange {
                option,
                value,
                range,
            });
        }
    }
    Ok(())
}

pub(super) fn client_options(args: &BridgeArgs) -> Result<ClientOptions, BridgeError> {
    let key_file = args
        .key
        .clone()
        .or_else(|| std::env::var_os("TAUT_KEY_FILE").map(PathBuf::from))
        .ok_or(BridgeError::NoKey)?;
    let key = read_join_key(&key_file)?;
    let mut options = ClientOptions::new(&args.server, key, Role::Device, &args.node);
    options.transport = args.transport;
    options.rate_hz = STATE_RATE_HZ;
    Ok(options)
}

pub(super) fn build_loop(
    args: &BridgeArgs,
    motion: &Motion,
    scene: &SceneDescription,
) -> Result<BridgeLoop, BridgeError> {
    let start = scene
        .god_object
        .pose
        .to_isometry()
        .ok_or(BridgeError::NoStartPose)?;
    let reference_point = Point3::from(scene.reference_point);
    let tremor = Tremor::new(Tremor::TYPICAL_RMS, args.seed);
    let device: Box<dyn Device> = match motion {
        Motion::Held { path, strings } => {
            let path = match path {
                Some(path) => path.clone(),
                None => MinJerkPath::sway(start, SWAY.0, SWAY.1),
            };
            let hand = args.hand.into();
            match strings {
                None => Box::new(
                    SimulatedDevice::new(Grip::workbench(), hand, path, reference_point)
                        .with_tremor(tremor),
                ),
                Some(geometry) => {
                    let origin = scene.scene_origin.to_isometry();
                    let turned = origin.ok_or(BridgeError::NoStartPose)?.rotation.inverse();
                    let made = simulated_spidar(
                        Geometry::clone(geometry),
                        turned,
                        reference_point,
                        hand,
                        path,
                        Some(tremor),
                    )?;
                    if let Some(warning) = made.warning {
                        tracing::warn!("{warning}");
                    }
                    Box::new(made.device)
                }
            }
        }
        Motion::Input(input) => input.open(
            Placement::of_scene(scene).ok_or(BridgeError::NoStartPose)?,
            args.priority,
        )?,
        Motion::Trace(path, trace) => {
            let at_end = if args.looping {
                AtEnd::Loop
            } else {
                AtEnd::Fault
            };
            let device = RecordedDevice::new(trace.clone(), at_end, reference_point);
            Box::new(device.map_err(|cause| TraceFileError::Trace(path.clone(), cause))?)
        }
    };
    Ok(behind_port(args, device, reference_point, &start))
}

/// The device behind the port that makes every force safe. What has no motors, or no hand at them, arms by itself.
pub(super) fn behind_port(
    args: &BridgeArgs,
    device: Box<dyn Device>,
    reference_point: Point3<f64>,
    start: &Pose,
) -> BridgeLoop {
    let has_motors = device.info().actuated_degrees_of_freedom > 0;
    if let Some(sentence) = device.info().renders_no_torque() {
        tracing::warn!("{sentence}");
    }
    let nobody_is_hurt = matches!(args.device, DeviceChoice::Simulated { .. }) || !has_motors;
    let mut safety = args.safety.settings(args.rate, nobody_is_hurt);
    if !has_motors {
        safety.passivity.mode = Passivity::Observe; // nobody is given any energy
    } else {
        for sentence in lowered(&safety, device.info()) {
            tracing::warn!("{sentence}");
        }
    }
    BridgeLoop::new(DevicePort::new(device, safety, reference_point, start))
}

/// What to tell a user of limits that are held to what fades in time.
fn lowered(safety: &SafetySettings, info: &DeviceInfo) -> Vec<String> {
    let asked = safety.within(info);
    let held = asked.that_can_fade();
    let rate_hz = safety.period.as_secs_f64().recip();
    [
        (
            ("--max-force", asked.max_force, held.max_force, "N"),
            ("--force-slew", safety.force_rate),
        ),
        (
            ("--max-torque", asked.max_torque, held.max_torque, "N m"),
            ("--torque-slew", safety.torque_rate),
        ),
    ]
    .into_iter()
    .filter(|((_, asked, held, _), _)| held < asked)
    .map(|((limit, asked, held, unit), (slew, rate))| {
        format!(
            "{limit} is lowered from {asked} to {held:.2} {unit}: at {slew} {} and --rate {rate_hz:.0} no more fades in time",
            rate * 1e-3
        )
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::device::DeviceLimits;

    #[test]
    fn a_limit_that_is_lowered_to_what_fades_in_time_is_told() {
        let told = |safety: SafetySettings, rate_hz: f64, limits, actuated_degrees_of_freedom| {
            let safety = SafetySettings {
                period: Duration::from_secs_f64(rate_hz.recip()),
                ..safety
            };
            let info = DeviceInfo {
                actuated_degrees_of_freedom,
                limits,
                ..DeviceInfo::without_force("arm")
            };
            lowered(&safety, &info).join("; ")
        };
        let said = |max_force, rate_hz, limits| {
            let safety = SafetySettings {
                max_force,
                ..SafetySettings::default()
            };
            told(safety, rate_hz, limits, 6)
        };
        let unlimited = DeviceLimits::UNLIMITED;
        assert_eq!(said(47.5, 1000.0, unlimited), "");
        assert_eq!(
            said(60.0, 1000.0, unlimited),
            "--max-force is lowered from 60 to 47.50 N: at --force-slew 0.5 and --rate 1000 no more fades in time"
        );
        assert!(said(20.0, 100.0, unlimited).contains("from 20 to 8.00 N"));
        for (motors, told_of_torque) in [(6, true), (3, false)] {
            let safety = SafetySettings {
                max_torque: 50.0,
                ..SafetySettings::default()
            };
            let told = told(safety, 1000.0, unlimited, motors);
            assert_eq!(
                told.contains("--max-torque is lowered"),
                told_of_torque,
                "{told}"
            );
        }
        let weak = DeviceLimits {
            max_force: 5.0,
            ..unlimited
        };
        assert_eq!(said(60.0, 1000.0, weak), "", "the device's own limit");
    }
}
