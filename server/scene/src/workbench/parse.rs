//! A workbench out of its document. Every fault is reported, each with its line.

use std::cell::RefCell;
use std::path::Path;

use god_object::Pose;

use super::device::device;
use super::displays::{nodes, screens};
use super::dynamics::dynamics;
use super::frames::frames;
use super::load::Workbench;
use super::log::log;
use super::looking_on::{observers, vrpn, zenoh};
use super::machines::{Named, machines};
use super::monitoring::monitoring;
use super::network::{network, places};
use super::operator::operator;
use super::parts::{Files, table};
use super::realtime::realtime;
use super::safety::safety;
use super::spec::Device;
use super::viewer::{show, viewer};
use super::wrench_in::{WrenchIn, beside, wrench_in};
use crate::document::{Document, Section};
use crate::problem::FileError;
use crate::scene::pose_of;

pub(super) fn parse(document: &Document, directory: &Path) -> Result<Workbench, FileError> {
    let problems = RefCell::new(Vec::new());
    let root = Section::root(&document.root, &problems);
    let files = Files { directory };
    let name = root
        .required_text("name", "name = \"workbench\"")
        .map(str::to_owned);
    let scene = root
        .required_text("scene", "scene = \"peg-in-a-hole\"")
        .map(|scene| files.scene(scene));
    let scene_at = root.get("scene").map_or(root.at(), |node| &node.at).clone();
    let scene_origin = table(&root, "scene_origin", pose_of)
        .flatten()
        .unwrap_or_else(Pose::identity);
    let screens = screens(&root);
    let nodes = nodes(&root, &screens);
    let files = Files { directory };
    let viewer = match table(&root, "viewer", |s| viewer(s, &files)) {
        Some(viewer) => viewer,
        None => {
            if !root.has("viewer") {
                root.complain_missing("viewer", "the table [viewer] with head");
            }
            None
        }
    };
    let simulated = Device::Simulated {
        hand: None,
        path: None,
        tremor: 0.0,
        seed: 0,
        strings: None,
    };
    let device = table(&root, "device", |s| device(s, &files)).unwrap_or(Some(simulated));
    let dynamics = table(&root, "dynamics", dynamics).flatten();
    let mut network = network(root.section("network"), &root, &files);
    let frames = table(&root, "frames", frames).unwrap_or_default();
    if let Some(network) = &network {
        places(&root, network, nodes.len(), &frames);
    }
    let machines = machines(
        &root,
        &Named {
            nodes: &nodes,
            network: network.as_ref(),
            device: device.as_ref(),
            tracking: viewer.as_ref().map(|viewer| &viewer.tracking),
        },
    );
    let monitoring = monitoring(root.section("monitoring"), &root, &files);
    let realtime = realtime(root.section("realtime"));
    let safety = table(&root, "safety", safety).unwrap_or_default();
    let log = table(&root, "log", log).unwrap_or_default();
    let show = table(&root, "show", show).unwrap_or_default();
    let vrpn = table(&root, "vrpn", vrpn).unwrap_or_default();
    let observers = table(&root, "observers", |s| observers(s, &files)).unwrap_or_default();
    let operator = table(&root, "operator", |s| operator(s, &files)).unwrap_or_default();
    let zenoh = table(&root, "zenoh", |s| zenoh(s, &files)).unwrap_or_default();
    let outside = root.section("wrench_in");
    let wrench_in = outside.as_ref().map_or_else(WrenchIn::default, wrench_in);
    let beside_it = (device.as_ref(), &safety, &zenoh);
    beside(outside.as_ref(), &wrench_in, beside_it, network.as_mut());
    if let Some(outside) = outside {
        outside.finish();
    }
    root.finish();
    let mut found = problems.into_inner();
    // In the order of the file, overrides last.
    found.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
    FileError::unless_empty(found)?;
    let (
        Some(name),
        Some(scene),
        Some(viewer),
        Some(device),
        Some(network),
        Some(monitoring),
        Some(realtime),
    ) = (name, scene, viewer, device, network, monitoring, realtime)
    else {
        return Err(document
            .root
            .at
            .problem("is no workbench; compare it with the shipped workbench.toml")
            .into());
    };
    Ok(Workbench {
        name,
        scene,
        scene_origin,
        screens,
        nodes,
        machines,
        viewer,
        device,
        dynamics,
        network,
        frames,
        monitoring,
        realtime,
        safety,
        log,
        show,
        vrpn,
        observers,
        operator,
        zenoh,
        wrench_in,
        scene_at,
        directory: directory.to_path_buf(),
    })
}
