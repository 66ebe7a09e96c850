//! What a session refuses of files that read well: asked when it is set up, and by `taut check` before.

use taut_bridge::InputChoice;
use taut_bridge::edge::offer_of;
use taut_link::proto::{CouplingOffer, EncodeError};
use taut_link::{ClusterKey, read_key_file};
use taut_scene::{BuiltScene, Device, DeviceDynamics, Workbench};

use super::content::content;
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

/// Everything that `session_setup` would refuse of the files, and what it would warn of, without a device of this machine being opened: for
/// `taut check`.
pub fn refusals(workbench: &Workbench) -> (Vec<Refusal>, Vec<String>) {
    let overrides = Overrides::default();
    let mut found = Vec::new();
    let mut warnings = Vec::new();
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
    let key_file = workbench.network.key_file.as_deref();
    if let Some(key) = key_file.and_then(|file| read_key_file(file).ok()) {
        note(
            "operator",
            "token_file",
            no_token_is_the_key(workbench, &key),
        );
    }
    let scene = workbench.load_scene();
    let Ok((scene, built)) = scene.and_then(|scene| scene.build().map(|built| (scene, built)))
    else {
        return (found, warnings); // of which reading the scene tells
    };
    let placed = workbench.workbench_from_scene(&scene);
    note(
        "wrench_in",
        "enabled",
        external(workbench, &overrides, &placed).map(drop),
    );
    note("scene", "", few_motions(&built));
    let sent = content(&built, workbench, &placed).and_then(|content| {
        let checked = content.check();
        checked.map_err(|error| Failure::BadInput(error.to_string()))
    });
    note("scene", "", sent);
    let offered = where_coupled(&built, workbench, &overrides);
    note("scene", "", offered.map(|told| warnings.extend(told)));
    let choice = driver(workbench, &overrides);
    match choice.and_then(|choice| dynamics_of(workbench, &overrides, choice.as_ref(), &built)) {
        Ok(declared) => {
            let judged = borne(declared, &built, false);
            note("scene", "", judged.map(|told| warnings.extend(told)));
            note(
                "device",
                "path",
                device(&workbench.device, &built, &placed).map(drop),
            );
        }
        Err(why) => note("device", "strings", Err(why)),
    }
    (found, warnings)
}

/// Refuses the cluster key as a token: a token goes in a browser's address, over plain HTTP.
pub(super) fn no_token_is_the_key(workbench: &Workbench, key: &ClusterKey) -> Result<(), Failure> {
    for (table, token) in [
        ("operator", operator_token(workbench)),
        ("observers", observers_token(workbench)),
    ] {
        // One that cannot be read is told of by itself.
        let token = token.ok().flatten();
        if token.is_some_and(|token| ClusterKey::parse(&token).is_ok_and(|it| it == *key)) {
            return Err(Failure::BadInput(format!(
                "the token of [{table}] is the cluster key, which would travel in a browser's address; make another with: openssl rand -hex 32"
            )));
        }
    }
    Ok(())
}

/// Refuses a scene in which more moves than clients can be told of.
pub(super) fn few_motions(built: &BuiltScene) -> Result<(), Failure> {
    if built.motions.len() + built.carried.len() <= MAX_MOVING {
        return Ok(());
    }
    let scenery = match built.carried.len() {
        0 => String::new(),
        more => format!(
            " and {more} things that are carried along (`carried_by`, and parts of moving bodies of another opacity)"
        ),
    };
    Err(Failure::BadInput(format!(
        "the scene \"{}\" has {} obstacles with a motion{scenery}, but a session can tell its clients of {MAX_MOVING}; leave some `motion` or `carried_by` out, or give a body one `opacity`, or use `taut replay`",
        built.name,
        built.motions.len()
    )))
}

/// Sets a second that a bridge is offered when a scene is judged.
const SETS_HZ: f64 = 1000.0;

/// Refuses a number that no program of the cluster takes from another; a warning where the force of a device behind a network is computed here.
fn where_coupled(
    built: &BuiltScene,
    workbench: &Workbench,
    overrides: &Overrides,
) -> Result<Option<String>, Failure> {
    let moving = built.motions.iter().map(|motion| motion.obstacle);
    let offer = offer_of(&built.world, &built.settings, moving, SETS_HZ).map_err(unencodable)?;
    let is_remote = overrides.input.is_none() && workbench.device == Device::Remote;
    Ok(match offer {
        CouplingOffer::AtServer { reason } if is_remote => Some(format!(
            "the force is computed here and not beside the device, so the network's delay is in it: {reason}"
        )),
        _ => None,
    })
}

pub(in crate::session) fn unencodable(error: EncodeError) -> Failure {
    Failure::BadInput(format!(
        "the scene has a number that no program takes from another: {error} (docs/numbers.md)"
    ))
}

/// What is to be known of scene and device together, logged; or the refusal.
pub(super) fn warned_of(
    built: &BuiltScene,
    workbench: &Workbench,
    choice: Option<&InputChoice>,
    overrides: &Overrides,
) -> Result<Vec<String>, Failure> {
    let declared = dynamics_of(workbench, overrides, choice, built)?;
    let mut warnings = borne(declared, built, overrides.allow_unstable)?;
    warnings.extend(where_coupled(built, workbench, overrides)?);
    for warning in &warnings {
        tracing::warn!("{warning}");
    }
    Ok(warnings)
}

/// What is known of the device, and whether it renders torque.
fn dynamics_of(
    workbench: &Workbench,
    overrides: &Overrides,
    choice: Option<&InputChoice>,
    built: &BuiltScene,
) -> Result<Option<(DeviceDynamics, bool)>, Failure> {
    let scene_hand = built.hand.as_ref().map(|hand| hand.preset);
    match choice {
        Some(choice) => {
            // What the file declares is of the file's device.
            let in_file = workbench.dynamics.filter(|_| overrides.input.is_none());
            let scale = built.view.display_scale;
            Ok(of_input(choice, in_file, scale, scene_hand))
        }
        None => Ok(
            declared(&workbench.device, workbench.dynamics.as_ref(), scene_hand)?
                .map(|dynamics| (dynamics, true)),
        ),
    }
}

/// Whether the device bears the scene's stiffness: warnings, or the refusal.
fn borne(
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
