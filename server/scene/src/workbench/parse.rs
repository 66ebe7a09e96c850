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
use super::network::{network, places, plain_network};
use super::operator::operator;
use super::parts::Files;
use super::realtime::realtime;
use super::safety::safety;
use super::viewer::{show, viewer};
use super::wrench_in::wrench_in;
use crate::document::{Document, Section, table};
use crate::problem::FileError;
use crate::scene::pose_of;

pub(super) fn parse(document: &Document, directory: &Path) -> Result<Workbench, FileError> {
    let problems = RefCell::new(Vec::new());
    let root = Section::root(&document.root, &problems);
    let workbench = workbench(&root, &Files { directory });
    root.finish();
    let mut found = problems.into_inner();
    // In the order of the file, overrides last.
    found.sort_by_key(|problem| problem.line.unwrap_or(usize::MAX));
    FileError::unless_empty(found)?;
    workbench.ok_or_else(|| {
        let text = "is no workbench; compare it with the shipped workbench.toml";
        document.root.at.problem(text).into()
    })
}

/// Reads all tables, whatever is wrong with some; nothing where one that is needed is missing or of no use.
fn workbench(root: &Section<'_>, files: &Files<'_>) -> Option<Workbench> {
    let name = root.required_text("name", "name = \"workbench\"");
    let scene = root.required_text("scene", "scene = \"peg-in-a-hole\"");
    let scene_at = root.at_key("scene").clone();
    let scene_origin = table(root, "scene_origin", pose_of).flatten();
    let screens = screens(root);
    let nodes = nodes(root, &screens);
    let viewer = viewer(root, files);
    let device = device(root, files);
    let dynamics = table(root, "dynamics", dynamics).flatten();
    let mut network = table(root, "network", |s| network(s, files))
        .or_else(|| (!root.has("network")).then(plain_network));
    let frames = table(root, "frames", frames).unwrap_or_default();
    if let Some(network) = &network {
        places(root, network, nodes.len(), &frames);
    }
    let named = Named {
        nodes: &nodes,
        network: network.as_ref(),
        device: device.as_ref(),
        tracking: viewer.as_ref().map(|viewer| &viewer.tracking),
    };
    let machines = machines(root, &named);
    let monitoring = table(root, "monitoring", |s| monitoring(s, files)).unwrap_or_default();
    let realtime = table(root, "realtime", realtime).unwrap_or_default();
    let safety = table(root, "safety", safety).unwrap_or_default();
    let log = table(root, "log", log).unwrap_or_default();
    let show = table(root, "show", show).unwrap_or_default();
    let vrpn = table(root, "vrpn", vrpn).unwrap_or_default();
    let observers = table(root, "observers", |s| observers(s, files)).unwrap_or_default();
    let operator = table(root, "operator", |s| operator(s, files)).unwrap_or_default();
    let zenoh = table(root, "zenoh", |s| zenoh(s, files)).unwrap_or_default();
    let beside = (device.as_ref(), &safety, &zenoh);
    let wrench_in = wrench_in(root, beside, network.as_mut());
    Some(Workbench {
        name: name?.to_owned(),
        scene: files.scene(scene?),
        scene_origin: scene_origin.unwrap_or_else(Pose::identity),
        screens,
        nodes,
        machines,
        viewer: viewer?,
        device: device?,
        dynamics,
        network: network?,
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
        directory: files.directory.to_path_buf(),
    })
}
