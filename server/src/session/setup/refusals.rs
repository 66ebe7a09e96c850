//! What a session refuses of files that read well: asked when it is set up, and by `taut check` before.

use taut_bridge::InputChoice;
use taut_scene::{BuiltScene, DeviceDynamics, Workbench};

use super::devices::device;
use super::stability::{declared, judge, of_input};
use super::workbench::{Overrides, driver, external};
use crate::session::observers::observers_token;
use crate::session::operator::operator_token;
use crate::shared::contact_snapshot::MAX_MOVING;
use crate::shared::failure::Failure;

/// What a session refuses of a workbench that reads well.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Table of the workbench file, or a key of its own, from which it comes.
    pub table: &'static str,
    /// Key in it.
    pub key: &'static str,
    /// Why.
    pub why: Failure,
}

/// Everything that `session_setup` would refuse of the files, without a device of this machine being opened: for `taut check`.
pub fn refusals(workbench: &Workbench) -> Vec<Refusal> {
    let overrides = Overrides::default();
    let mut found = Vec::new();
    let mut note =
        |table, key, why| found.extend(Result::err(why).map(|why| Refusal { table, key, why }));
    note(
        "operator",
        "token_file",
        operator_token(workbench).map(drop),
    );
    note(
        "observers",
        "token_file",
        observers_token(workbench).map(drop),
    );
    let scene = workbench.load_scene();
    let Ok((scene, built)) = scene.and_then(|scene| scene.build().map(|built| (scene, built)))
    else {
        return found; // of which reading the scene tells
    };
    let placed = workbench.workbench_from_scene(&scene);
    note(
        "wrench_in",
        "enabled",
        external(workbench, &overrides, &placed).map(drop),
    );
    note("scene", "", few_motions(&built));
    let choice = driver(workbench, &overrides);
    match choice.and_then(|choice| dynamics_of(workbench, &overrides, choice.as_ref(), &built)) {
        Ok(declared) => {
            note("scene", "", borne(declared, &built, false).map(drop));
            note(
                "device",
                "path",
                device(&workbench.device, &built, &placed).map(drop),
            );
        }
        Err(why) => note("device", "strings", Err(why)),
    }
    found
}

/// Refuses a scene in which more moves than clients can be told of.
pub(super) fn few_motions(built: &BuiltScene) -> Result<(), Failure> {
    if built.motions.len() <= MAX_MOVING {
        return Ok(());
    }
    Err(Failure::BadInput(format!(
        "the scene \"{}\" has {} obstacles with a motion, but a session can tell its clients of {MAX_MOVING}; leave some `motion` out, or use `taut replay`",
        built.name,
        built.motions.len()
    )))
}

/// What is known of the device, and whether it renders torque.
pub(super) fn dynamics_of(
    workbench: &Workbench,
    overrides: &Overrides,
    choice: Option<&InputChoice>,
    built: &BuiltScene,
) -> Result<Option<(DeviceDynamics, bool)>, Failure> {
    let scene_hand = built.hand.as_ref().map(|hand| hand.preset);
    match choice {
        Some(choice) => {
            let by_driver = of_input(choice, built.view.display_scale, scene_hand);
            // What the file declares is of the file's device.
            let in_file = workbench.dynamics.filter(|_| overrides.input.is_none());
            Ok(by_driver.map(|(dynamics, torque)| (in_file.unwrap_or(dynamics), torque)))
        }
        None => Ok(
            declared(&workbench.device, workbench.dynamics.as_ref(), scene_hand)?
                .map(|dynamics| (dynamics, true)),
        ),
    }
}

/// Whether the device bears the scene's stiffness: warnings, or the refusal.
pub(super) fn borne(
    declared: Option<(DeviceDynamics, bool)>,
    built: &BuiltScene,
    allow_unstable: bool,
) -> Result<Vec<String>, Failure> {
    let Some((dynamics, torque)) = declared else {
        return Ok(Vec::new());
    };
    let body = &built.world.body;
    judge(&dynamics, torque, &built.settings, body, allow_unstable)
}
