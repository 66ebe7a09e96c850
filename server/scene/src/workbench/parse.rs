//! A workbench out of its document. Every fault is reported, each with its line.

use std::cell::RefCell;
use std::net::{IpAddr, Ipv4Addr};
use std::path::{Path, PathBuf};

use god_object::Pose;
use nalgebra::Point3;
use taut_proto::JoinPolicy;

use super::admission::admission;
use super::dynamics::dynamics;
use super::load::Workbench;
use super::looking_on::{observers, vrpn, zenoh};
use super::safety::safety;
use super::spec::{
    Device, HeadTracking, Monitoring, Network, Node, RealTime, RealTimeMode, Screen, Show, Stereo,
    TransportKind, Viewer, Window,
};
use super::tracker::vrpn_sensor;
use crate::document::{Document, Range, Section};
use crate::problem::FileError;
use crate::scene::{HandPreset, pose_of, shipped_scene_text};

/// Shortest edge of a screen, m. Shorter is a slip of the unit.
const MIN_SCREEN_EDGE: f64 = 0.01;
/// Largest cosine between the edges of a screen: half a degree from square, more than a careful tape measure errs by.
const SQUARENESS: f64 = 8.7e-3;
/// Largest window side, pixels.
const MAX_PIXELS: i64 = 16_384;
/// Fastest stream or loop, 1/s.
const MAX_RATE: f64 = 10_000.0;
/// Most clients.
const MAX_CLIENTS: i64 = 256;

pub(super) fn parse(document: &Document, directory: &Path) -> Result<Workbench, FileError> {
    let problems = RefCell::new(Vec::new());
    let root = Section::root(&document.root, &problems);
    let name = root
        .required_text("name", "name = \"workbench\"")
        .map(str::to_owned);
    let scene = root
        .required_text("scene", "scene = \"peg-in-a-hole\"")
        .map(|scene| {
            if shipped_scene_text(scene).is_some() {
                scene.to_owned()
            } else {
                directory.join(scene).display().to_string()
            }
        });
    let scene_at = root.get("scene").map_or(root.at(), |node| &node.at).clone();
    let scene_origin = table(&root, "scene_origin", pose_of)
        .flatten()
        .unwrap_or_else(Pose::identity);
    let screens = screens(&root);
    let nodes = nodes(&root, &screens);
    let viewer = match table(&root, "viewer", viewer) {
        Some(viewer) => viewer,
        None => {
            if !root.has("viewer") {
                root.complain_missing("viewer", "the table [viewer] with head");
            }
            None
        }
    };
    let files = Files { directory };
    let simulated = Device::Simulated {
        hand: None,
        path: None,
        tremor: 0.0,
        seed: 0,
        strings: None,
    };
    let device = table(&root, "device", |s| device(s, &files)).unwrap_or(Some(simulated));
    let dynamics = table(&root, "dynamics", dynamics).flatten();
    let network = network(root.section("network"), &root, &files);
    let monitoring = monitoring(root.section("monitoring"), &root, &files);
    let realtime = realtime(root.section("realtime"));
    let safety = table(&root, "safety", safety).unwrap_or_default();
    let show = table(&root, "show", show).unwrap_or_default();
    let vrpn = table(&root, "vrpn", vrpn).unwrap_or_default();
    let observers = table(&root, "observers", |s| observers(s, &files)).unwrap_or_default();
    let zenoh = table(&root, "zenoh", |s| zenoh(s, &files)).unwrap_or_default();
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
        viewer,
        device,
        dynamics,
        network,
        monitoring,
        realtime,
        safety,
        show,
        vrpn,
        observers,
        zenoh,
        scene_at,
    })
}

/// Paths in the file are relative to it.
pub(super) struct Files<'d> {
    directory: &'d Path,
}

impl Files<'_> {
    pub(super) fn path(&self, section: &Section<'_>, key: &'static str) -> Option<PathBuf> {
        section.text(key).map(|text| self.directory.join(text))
    }

    /// A name of something shipped as it is, a file relative to the workbench's: one that has an ending or a folder.
    fn named(&self, text: &str) -> String {
        if text.contains(['.', '/', '\\']) {
            self.directory.join(text).display().to_string()
        } else {
            text.to_owned()
        }
    }
}

/// Reads a table and complains of the keys that were not asked for.
fn table<T>(
    parent: &Section<'_>,
    key: &'static str,
    read: impl FnOnce(&Section<'_>) -> T,
) -> Option<T> {
    let section = parent.section(key)?;
    let value = read(&section);
    section.finish();
    Some(value)
}

fn screens(root: &Section<'_>) -> Vec<Screen> {
    let mut screens: Vec<Screen> = Vec::new();
    for section in root.sections("screen") {
        let name = unique_name(&section, "screen", screens.iter().map(|s| s.name.as_str()));
        let corner = |key: &'static str| {
            if !section.has(key) {
                section.complain_missing(key, &format!("{key} = [x, y, z] (m)"));
            }
            section.numbers::<3>(key, Range::Finite).map(Point3::from)
        };
        let corners = (
            corner("lower_left"),
            corner("lower_right"),
            corner("upper_left"),
        );
        if let (Some(name), (Some(lower_left), Some(lower_right), Some(upper_left))) =
            (name, corners)
        {
            let (right, up) = (lower_right - lower_left, upper_left - lower_left);
            let square = right.dot(&up).abs() <= SQUARENESS * right.norm() * up.norm();
            if right.norm() < MIN_SCREEN_EDGE || up.norm() < MIN_SCREEN_EDGE || !square {
                let text = format!(
                    "the corners of screen \"{name}\" are no rectangle; give lower left, lower right and upper left in metres"
                );
                section.complain(section.at(), text);
            }
            screens.push(Screen {
                name,
                lower_left,
                lower_right,
                upper_left,
            });
        }
        section.finish();
    }
    if screens.is_empty() && !root.has("screen") {
        root.complain_missing("screen", "at least one [[screen]] with three corners");
    }
    screens
}

fn nodes(root: &Section<'_>, screens: &[Screen]) -> Vec<Node> {
    let mut nodes: Vec<Node> = Vec::new();
    for section in root.sections("node") {
        let name = unique_name(&section, "node", nodes.iter().map(|n| n.name.as_str()));
        if !section.has("screens") {
            section.complain_missing("screens", "screens = [\"front\"]");
        }
        let mut drawn = Vec::new();
        for (screen, at) in section.texts("screens").unwrap_or_default() {
            if !screens.iter().any(|known| known.name == screen) {
                let known: Vec<&str> = screens.iter().map(|s| s.name.as_str()).collect();
                let text = format!(
                    "{} draws the screen \"{screen}\", which does not exist; known screens: {}",
                    section.name(),
                    known.join(", ")
                );
                section.complain(at, text);
            } else if drawn.iter().any(|other| other == screen) {
                section.complain(
                    at,
                    format!(
                        "{} draws the screen \"{screen}\" twice; remove one",
                        section.name()
                    ),
                );
            }
            drawn.push(screen.to_owned());
        }
        if let Some(list) = section.get("screens").filter(|_| drawn.is_empty()) {
            section.complain(
                &list.at,
                format!(
                    "{} draws no screen; name at least one in `screens`",
                    section.name()
                ),
            );
        }
        let stereo = section.choice("stereo", &Stereo::NAMED).unwrap_or_default();
        let window = table(&section, "window", |window| {
            let pixels = |key, default| {
                window
                    .integer(key, 16, MAX_PIXELS)
                    .map_or(default, |n| n as u32)
            };
            Window {
                width: pixels("width", 1280),
                height: pixels("height", 800),
                fullscreen: window.boolean("fullscreen").unwrap_or(false),
            }
        });
        let window = window.unwrap_or(Window {
            width: 1280,
            height: 800,
            fullscreen: false,
        });
        section.finish();
        if let Some(name) = name {
            nodes.push(Node {
                name,
                screens: drawn,
                stereo,
                window,
            });
        }
    }
    if nodes.is_empty() && !root.has("node") {
        root.complain_missing("node", "at least one [[node]] with name and screens");
    }
    nodes
}

fn unique_name<'n>(
    section: &Section<'_>,
    kind: &str,
    mut others: impl Iterator<Item = &'n str>,
) -> Option<String> {
    let name = section.required_text("name", &format!("name = \"{kind}-1\""))?;
    if others.any(|other| other == name) {
        let at = section.get("name").map_or(section.at(), |node| &node.at);
        section.complain(
            at,
            format!("there are two {kind}s of the name \"{name}\"; rename one"),
        );
    }
    Some(name.to_owned())
}

fn viewer(section: &Section<'_>) -> Option<Viewer> {
    let eye_separation = section.number_or("eye_separation", Range::UpTo(0.2), 0.064);
    let head = table(section, "head", pose_of);
    if head.is_none() && !section.has("head") {
        section.complain_missing(
            "head",
            "head = { position = [0.0, -1.3, 0.9], rotation = [0.7071, 0.7071, 0.0, 0.0] }",
        );
    }
    let sway = table(section, "sway", |sway| HeadTracking::Sway {
        amplitude: sway.number_or("amplitude", Range::UpTo(1.0), 0.05),
        period: sway.number_or("period", Range::Positive, 6.0),
    });
    let near = section.number_or("near", Range::Positive, 0.05);
    let far = section.number_or("far", Range::Positive, 20.0);
    if near >= far {
        section.complain(
            section.at(),
            format!(
                "`near` ({near}) in {} must be smaller than `far` ({far})",
                section.name()
            ),
        );
    }
    let tracker = table(section, "tracker", vrpn_sensor);
    if let (Some(_), Some(_), Some(node)) = (&sway, &tracker, section.get("tracker")) {
        let text = "`tracker` and `sway` in [viewer] exclude each other; leave one out";
        section.complain(&node.at, text);
    }
    let remote = section.boolean("remote_tracker").unwrap_or(false);
    if let (true, Some(node)) = (remote, section.get("remote_tracker"))
        && (tracker.is_some() || sway.is_some())
    {
        let text = "`remote_tracker` in [viewer] excludes `tracker` and `sway`; leave one out";
        section.complain(&node.at, text);
    }
    let tracking = match tracker {
        None if remote => HeadTracking::Remote,
        Some(sensor) => HeadTracking::Vrpn(Box::new(sensor?)),
        None => sway.unwrap_or(HeadTracking::Fixed),
    };
    Some(Viewer {
        eye_separation,
        head: head.flatten()?,
        tracking,
        near,
        far,
    })
}

fn device(section: &Section<'_>, files: &Files<'_>) -> Option<Device> {
    #[derive(Clone, Copy)]
    enum Kind {
        Simulated,
        Trace,
        Vrpn,
        SpaceMouse,
        Remote,
    }
    if !section.has("kind") {
        section.complain_missing("kind", "kind = \"simulated\"");
    }
    let kinds = [
        ("simulated", Kind::Simulated),
        ("trace", Kind::Trace),
        ("vrpn", Kind::Vrpn),
        ("space-mouse", Kind::SpaceMouse),
        ("mouse", Kind::Remote),
        ("remote", Kind::Remote),
    ];
    let Some(kind) = section.choice("kind", &kinds) else {
        // Which keys belong here depends on the kind: complain of nothing else.
        for key in ["hand", "path", "tremor", "seed", "strings", "loop"]
            .iter()
            .chain(&["server", "sensor", "mode", "axes", "scale", "max_age"])
            .chain(&[
                "origin",
                "mount",
                "anchor",
                "dead_zone",
                "speed",
                "turn_rate",
            ])
            .chain(&["reach", "tilt", "yield_force", "yield_torque"])
        {
            section.has(key);
        }
        return None;
    };
    match kind {
        Kind::Simulated => Some(Device::Simulated {
            hand: section.choice("hand", &HandPreset::NAMED),
            path: files.path(section, "path"),
            tremor: section.number_or("tremor", Range::UpTo(1e-3), 0.0),
            seed: section
                .integer("seed", 0, i64::MAX)
                .unwrap_or(0)
                .unsigned_abs(),
            strings: section.text("strings").map(|named| files.named(named)),
        }),
        Kind::Trace => {
            section.required_text("path", "path = \"trace.csv\"")?;
            Some(Device::Trace {
                path: files.path(section, "path")?,
                repeat: section.boolean("loop").unwrap_or(false),
            })
        }
        Kind::Vrpn => {
            let anchors = [("start", false), ("workbench", true)];
            let on_workbench = section.choice("anchor", &anchors).unwrap_or(false);
            Some(Device::Vrpn {
                sensor: Box::new(vrpn_sensor(section)?),
                on_workbench,
            })
        }
        Kind::SpaceMouse => {
            let number = |key, most| section.number(key, Range::PositiveUpTo(most));
            Some(Device::SpaceMouse {
                position: section
                    .choice("mode", &[("rate", false), ("position", true)])
                    .unwrap_or(false),
                dead_zone: section.number("dead_zone", Range::UpTo(0.9)),
                speed: number("speed", 10.0),
                turn_rate: number("turn_rate", 100.0),
                reach: number("reach", 10.0),
                tilt: number("tilt", 3.0),
                yield_force: number("yield_force", 1e3),
                yield_torque: number("yield_torque", 1e3),
            })
        }
        Kind::Remote => Some(Device::Remote),
    }
}

/// An address to listen on.
pub(super) fn bind(section: &Section<'_>, default: IpAddr) -> Option<IpAddr> {
    let Some(text) = section.text("bind") else {
        return (!section.has("bind")).then_some(default);
    };
    let address = text.parse();
    if address.is_err() {
        let at = section.get("bind").map_or(section.at(), |node| &node.at);
        section.complain(
            at,
            format!(
                "`bind` in {} is \"{text}\", which is no address; write one such as \"0.0.0.0\"",
                section.name()
            ),
        );
    }
    address.ok()
}

pub(super) fn port(section: &Section<'_>, key: &'static str, default: u16) -> u16 {
    section
        .integer(key, 0, i64::from(u16::MAX))
        .and_then(|n| u16::try_from(n).ok())
        .unwrap_or(default)
}

/// Silence after which a node counts as gone, s: ten of its signs of life.
const NODE_TIMEOUT: f64 = 0.5;
/// Longest that may be asked for, s.
const MAX_NODE_TIMEOUT: f64 = 60.0;

fn network(section: Option<Section<'_>>, root: &Section<'_>, files: &Files<'_>) -> Option<Network> {
    let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let Some(section) = section else {
        return (!root.has("network")).then_some(Network {
            bind: loopback,
            quic_port: 4857,
            udp_port: 4858,
            transport: TransportKind::Udp,
            key_file: None,
            broadcast_rate: 1000.0,
            max_clients: 16,
            admission: JoinPolicy::default(),
            node_timeout: NODE_TIMEOUT,
        });
    };
    let transports = [
        ("udp", TransportKind::Udp),
        ("quic", TransportKind::QuicDatagram),
    ];
    let address = bind(&section, loopback);
    let (quic_port, udp_port) = (
        port(&section, "quic_port", 4857),
        port(&section, "udp_port", 4858),
    );
    if quic_port == udp_port && quic_port != 0 {
        let at = section
            .get("udp_port")
            .map_or(section.at(), |node| &node.at);
        section.complain(
            at,
            format!(
                "`quic_port` and `udp_port` in {} are both {udp_port}; choose another for one",
                section.name()
            ),
        );
    }
    let network = Network {
        bind: address.unwrap_or(loopback),
        quic_port,
        udp_port,
        transport: section.choice("transport", &transports).unwrap_or_default(),
        key_file: files.path(&section, "key_file"),
        broadcast_rate: section.number_or("broadcast_rate", Range::PositiveUpTo(MAX_RATE), 1000.0),
        max_clients: section
            .integer("max_clients", 1, MAX_CLIENTS)
            .map_or(16, |n| n as usize),
        admission: admission(&section),
        node_timeout: section.number_or(
            "node_timeout",
            Range::PositiveUpTo(MAX_NODE_TIMEOUT),
            NODE_TIMEOUT,
        ),
    };
    section.finish();
    Some(network)
}

fn monitoring(
    section: Option<Section<'_>>,
    root: &Section<'_>,
    files: &Files<'_>,
) -> Option<Monitoring> {
    let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let mut monitoring = Monitoring {
        enabled: true,
        bind: loopback,
        grpc_port: 9876,
        web_port: 9090,
        record: None,
        memory_limit: 256 << 20,
    };
    let Some(section) = section else {
        return (!root.has("monitoring")).then_some(monitoring);
    };
    monitoring.enabled = section.boolean("enabled").unwrap_or(true);
    monitoring.bind = bind(&section, loopback).unwrap_or(loopback);
    monitoring.grpc_port = port(&section, "grpc_port", monitoring.grpc_port);
    monitoring.web_port = port(&section, "web_port", monitoring.web_port);
    monitoring.record = files.path(&section, "record");
    if let Some(mebibytes) = section.integer("memory_limit_mib", 16, 1 << 20) {
        monitoring.memory_limit = mebibytes.unsigned_abs() << 20;
    }
    if monitoring.grpc_port == monitoring.web_port && monitoring.web_port != 0 {
        let at = section
            .get("web_port")
            .map_or(section.at(), |node| &node.at);
        section.complain(
            at,
            format!(
                "`grpc_port` and `web_port` in {} are both {}; choose another for one",
                section.name(),
                monitoring.web_port
            ),
        );
    }
    section.finish();
    Some(monitoring)
}

fn realtime(section: Option<Section<'_>>) -> Option<RealTime> {
    let mut realtime = RealTime {
        mode: RealTimeMode::Waive,
        haptics_priority: 80,
        coupling_priority: 70,
        god_object_priority: None,
        haptics_core: None,
        coupling_core: None,
        god_object_core: None,
        god_object_rate: None,
    };
    let Some(section) = section else {
        return Some(realtime);
    };
    let priority = |key| {
        section
            .integer(key, 1, 99)
            .and_then(|n| u8::try_from(n).ok())
    };
    let core = |key| {
        section
            .integer(key, 0, 1023)
            .and_then(|n| usize::try_from(n).ok())
    };
    realtime.mode = section
        .choice(
            "mode",
            &[
                ("enforce", RealTimeMode::Enforce),
                ("waive", RealTimeMode::Waive),
            ],
        )
        .unwrap_or_default();
    realtime.haptics_priority = priority("haptics_priority").unwrap_or(realtime.haptics_priority);
    realtime.coupling_priority =
        priority("coupling_priority").unwrap_or(realtime.coupling_priority);
    realtime.god_object_priority = priority("god_object_priority");
    realtime.haptics_core = core("haptics_core");
    realtime.coupling_core = core("coupling_core");
    realtime.god_object_core = core("god_object_core");
    realtime.god_object_rate = section.number("god_object_rate", Range::PositiveUpTo(MAX_RATE));
    section.finish();
    Some(realtime)
}

fn show(section: &Section<'_>) -> Show {
    let wanted = |key| section.boolean(key).unwrap_or(false);
    Show {
        ghost: wanted("ghost"),
        contacts: wanted("contacts"),
        force: wanted("force"),
    }
}
