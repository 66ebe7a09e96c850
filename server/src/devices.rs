//! From the workbench file's device to one that the haptics loop can read.

use std::path::Path;

use god_object::nalgebra::Point3;
use taut_bridge::{
    AtEnd, DeviceLimits, Grip, Hand, MinJerkPath, RecordedDevice, SimulatedDevice, TraceRow,
    Tremor, ViaPoint,
};
use taut_scene::{BuiltScene, DeviceTrace, HandPreset};

use crate::failure::Failure;
use crate::setup::DeviceSource;

/// A hand without a path sways this far to either side, in a cycle of this time: m, s.
const SWAY: (f64, f64) = (0.02, 8.0);

/// Makes the device that the workbench names. A remote one is found once the network is up.
pub fn device(wanted: &taut_scene::Device, scene: &BuiltScene) -> Result<DeviceSource, Failure> {
    match wanted {
        taut_scene::Device::Simulated {
            hand,
            path,
            tremor,
            seed,
        } => simulated(scene, *hand, path.as_deref(), *tremor, *seed)
            .map(|device| DeviceSource::Local(Box::new(device))),
        taut_scene::Device::Trace { path, repeat } => {
            recorded(path, *repeat, &scene.reference_point())
                .map(|device| DeviceSource::Local(Box::new(device)))
        }
        taut_scene::Device::Remote => Ok(DeviceSource::Remote {
            limits: DeviceLimits::UNLIMITED,
            max_age: taut_bridge::DEFAULT_MAX_AGE,
        }),
    }
}

/// A simulated device in a simulated hand; path and hand are the workbench's, else the scene's.
fn simulated(
    scene: &BuiltScene,
    hand: Option<HandPreset>,
    path: Option<&Path>,
    tremor: f64,
    seed: u64,
) -> Result<SimulatedDevice, Failure> {
    let scene_hand = scene.hand.as_ref();
    let preset = hand
        .or(scene_hand.map(|hand| hand.preset))
        .unwrap_or_default();
    let (trace, repeat, named) = match (path, scene_hand) {
        (Some(path), _) => (
            Some(DeviceTrace::load(path)?),
            true,
            path.display().to_string(),
        ),
        (None, Some(hand)) => (
            Some(hand.path.clone()),
            hand.repeat,
            format!("the hand's path of scene \"{}\"", scene.name),
        ),
        (None, None) => (None, true, String::new()),
    };
    let intention = match trace {
        Some(trace) => MinJerkPath::new(via_points(&trace), repeat)
            .map_err(|error| Failure::BadInput(format!("{named}: {error}")))?,
        None => MinJerkPath::sway(scene.start, SWAY.0, SWAY.1),
    };
    let device = SimulatedDevice::new(
        Grip::workbench(),
        impedance(preset),
        intention,
        scene.reference_point(),
    );
    Ok(if tremor > 0.0 {
        device.with_tremor(Tremor::new(tremor, seed))
    } else {
        device
    })
}

fn recorded(
    path: &Path,
    repeat: bool,
    reference_point: &Point3<f64>,
) -> Result<RecordedDevice, Failure> {
    let trace = DeviceTrace::load(path)?;
    let rows = trace.samples().iter().map(|sample| TraceRow {
        time_s: sample.time,
        pose: sample.pose,
        buttons: sample.buttons,
    });
    let at_end = if repeat { AtEnd::Loop } else { AtEnd::Hold };
    RecordedDevice::new(rows.collect(), at_end, *reference_point)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))
}

fn via_points(trace: &DeviceTrace) -> Vec<ViaPoint> {
    let start = trace.samples().first().map_or(0.0, |first| first.time);
    let point = |sample: &taut_scene::TraceSample| ViaPoint {
        time_s: sample.time - start,
        pose: sample.pose,
    };
    trace.samples().iter().map(point).collect()
}

/// The hand of this name.
pub(crate) fn impedance(preset: HandPreset) -> Hand {
    match preset {
        HandPreset::Released => Hand::RELEASED,
        HandPreset::Light => Hand::LIGHT,
        HandPreset::Firm => Hand::FIRM,
        HandPreset::Arm => Hand::ARM,
    }
}
