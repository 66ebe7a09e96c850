//! From the workbench file's device to one that the haptics loop can read.

use std::path::Path;

use god_object::nalgebra::{Point3, Similarity3, UnitQuaternion};
use god_object::spatial::Pose;
use taut_bridge::{
    AtEnd, Device, DeviceLimits, Grip, Hand, HeldStrings, InputChoice, MinJerkPath, Placement,
    RecordedDevice, SimulatedDevice, SpidarDevice, Tremor, simulated_spidar, string_geometry,
    via_points,
};
use taut_scene::{BuiltScene, DeviceTrace, HandPreset};

use crate::loops::realtime::thread_cpu_time;
use crate::session::setup::{DeviceOrigin, DeviceSource};
use crate::shared::failure::Failure;

/// A hand without a path sways this far to either side, in a cycle of this time: m, s.
const SWAY: (f64, f64) = (0.02, 8.0);

/// Makes the device that the workbench names. A remote one is found once the network is up.
///
/// `workbench_from_scene` says where the scene stands, without its display scale.
pub fn device(
    wanted: &taut_scene::Device,
    scene: &BuiltScene,
    workbench_from_scene: &Pose,
) -> Result<DeviceSource, Failure> {
    match wanted {
        taut_scene::Device::Simulated {
            hand,
            path,
            tremor,
            seed,
            strings,
        } => {
            let (hand, intention) = hand_and_intention(scene, *hand, path.as_deref())?;
            let tremor = (*tremor > 0.0).then(|| Tremor::new(*tremor, *seed));
            let device: Box<dyn Device> = match strings {
                None => Box::new(simulated(scene, hand, intention, tremor)),
                Some(named) => {
                    // Its axes are those of the workbench, around which it stands.
                    let turned = workbench_from_scene.rotation.inverse();
                    Box::new(made_of_strings(
                        named, scene, turned, hand, intention, tremor,
                    )?)
                }
            };
            Ok(DeviceSource::Local(device))
        }
        taut_scene::Device::Trace { path, repeat } => {
            recorded(path, *repeat, &scene.reference_point())
                .map(|device| DeviceSource::Local(Box::new(device)))
        }
        // A driver's is opened by [`input`].
        taut_scene::Device::Driver(_) | taut_scene::Device::Remote => Ok(DeviceSource::Remote {
            limits: DeviceLimits::UNLIMITED,
            max_age: taut_bridge::DEFAULT_MAX_AGE,
        }),
    }
}

/// What moves the god-object, the driver's device where one is chosen and else the workbench's, and what it was opened by.
pub(super) fn chosen_device(
    wanted: &taut_scene::Device,
    choice: Option<&InputChoice>,
    scene: &BuiltScene,
    workbench_from_scene: &Pose,
    priority: u8,
) -> Result<(DeviceSource, DeviceOrigin), Failure> {
    let origin = origin(wanted, choice, scene, workbench_from_scene);
    let device = match choice {
        Some(choice) => input(choice, scene, workbench_from_scene, priority)?,
        None => device(wanted, scene, workbench_from_scene)?,
    };
    Ok((device, origin))
}

/// All that the device depends on when it is opened.
fn origin(
    wanted: &taut_scene::Device,
    input: Option<&InputChoice>,
    scene: &BuiltScene,
    workbench_from_scene: &Pose,
) -> DeviceOrigin {
    let files = match wanted {
        taut_scene::Device::Simulated { path, strings, .. } => {
            let strings = strings.as_ref().map(Path::new);
            path.as_deref().into_iter().chain(strings).collect()
        }
        taut_scene::Device::Trace { path, .. } => vec![path.as_path()],
        taut_scene::Device::Driver(_) | taut_scene::Device::Remote => Vec::new(),
    };
    let held = |file: &Path| std::fs::read(file).unwrap_or_default();
    DeviceOrigin {
        wanted: wanted.clone(),
        input: input.cloned(),
        hand: scene.hand.clone(),
        files: files.into_iter().map(held).collect(),
        placement: placement(scene, workbench_from_scene),
    }
}

fn placement(scene: &BuiltScene, workbench_from_scene: &Pose) -> Placement {
    let scale = scene.view.display_scale;
    Placement {
        start: scene.start,
        reference_point: scene.reference_point(),
        workbench_from_world: Similarity3::from_isometry(*workbench_from_scene, scale),
    }
}

/// Opens a device; `priority` is for a thread of its driver that a force depends on.
pub fn input(
    choice: &InputChoice,
    scene: &BuiltScene,
    workbench_from_scene: &Pose,
    priority: u8,
) -> Result<DeviceSource, Failure> {
    let device = choice
        .open(placement(scene, workbench_from_scene), priority)
        .map_err(Failure::bad_input)?;
    if let Some(sentence) = device.info().renders_no_torque() {
        tracing::warn!("{sentence}");
    }
    Ok(DeviceSource::Local(device))
}

/// The simulated hand and what it intends; path and hand are the workbench's, else the scene's.
fn hand_and_intention(
    scene: &BuiltScene,
    hand: Option<HandPreset>,
    path: Option<&Path>,
) -> Result<(Hand, MinJerkPath), Failure> {
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
        Some(trace) => MinJerkPath::new(via_points(trace.samples()), repeat)
            .map_err(|error| Failure::BadInput(format!("{named}: {error}")))?,
        None => MinJerkPath::sway(scene.start, SWAY.0, SWAY.1),
    };
    Ok((preset.into(), intention))
}

fn simulated(
    scene: &BuiltScene,
    hand: Hand,
    intention: MinJerkPath,
    tremor: Option<Tremor>,
) -> SimulatedDevice {
    let device = SimulatedDevice::new(Grip::workbench(), hand, intention, scene.reference_point());
    match tremor {
        Some(tremor) => device.with_tremor(tremor),
        None => device,
    }
}

fn made_of_strings(
    named: &str,
    scene: &BuiltScene,
    turned: UnitQuaternion<f64>,
    hand: Hand,
    intention: MinJerkPath,
    tremor: Option<Tremor>,
) -> Result<SpidarDevice<HeldStrings>, Failure> {
    let geometry = string_geometry(named).map_err(Failure::bad_input)?;
    let made = simulated_spidar(
        geometry,
        turned,
        scene.reference_point(),
        hand,
        intention,
        tremor,
    )
    .map_err(|error| Failure::BadInput(format!("scene \"{}\": {error}", scene.name)))?;
    if let Some(warning) = made.warning {
        tracing::warn!("scene \"{}\": {warning}", scene.name);
    }
    Ok(made.device.with_clock(thread_cpu_time))
}

fn recorded(
    path: &Path,
    repeat: bool,
    reference_point: &Point3<f64>,
) -> Result<RecordedDevice, Failure> {
    let trace = DeviceTrace::load(path)?;
    let at_end = if repeat { AtEnd::Loop } else { AtEnd::Hold };
    RecordedDevice::new(trace.samples().to_vec(), at_end, *reference_point)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", path.display())))
}
