//! Every fault of a workbench names file, line and what to do.

use std::path::Path;

use taut_scene::{Device, HandPreset, SHIPPED_WORKBENCH, Workbench};

use crate::support::assert_says;

fn line_of(text: &str, wanted: &str) -> usize {
    1 + text
        .lines()
        .position(|line| line.contains(wanted))
        .expect("the line is there")
}

/// The fault that one change of the shipped file makes; its line must be that of `at`.
fn fault(from: &str, to: &str, at: &str) -> String {
    assert!(SHIPPED_WORKBENCH.contains(from), "{from}");
    let text = SHIPPED_WORKBENCH.replacen(from, to, 1);
    let found = Workbench::parse("w.toml", &text, Path::new(""))
        .expect_err("a fault")
        .to_string();
    let place = format!("w.toml:{}: ", line_of(&text, at));
    found
        .strip_prefix(&place)
        .unwrap_or_else(|| panic!("{found} is not at {place}"))
        .to_owned()
}

/// One change of the shipped file, from and to; what the line of its fault has; how that begins.
type Case = ([&'static str; 2], &'static str, &'static str);

const SCREENS_AND_NODES: &[Case] = &[
    (
        [
            "upper_left = [-0.9, 0.0, 1.2]",
            "upper_left = [0.9, 0.0, 1.2]",
        ],
        "[[screen]]",
        "the corners of screen \"front\" are no rectangle",
    ),
    (
        ["name = \"table\"\nscreens", "name = \"front\" #\nscreens"],
        "\"front\" #",
        "there are two nodes of the name \"front\"; rename one",
    ),
    (
        ["screens = [\"table\"]", "screens = [\"tabel\"]"],
        "tabel",
        "[[node]] draws the screen \"tabel\", which does not exist; known screens: front, table",
    ),
    (
        ["screens = [\"table\"]", "screens = []"],
        "screens = []",
        "[[node]] draws no screen; name at least one in `screens`",
    ),
    (
        ["stereo = \"side-by-side\"", "stereo = \"sidebyside\""],
        "sidebyside",
        "`stereo` in [[node]] is \"sidebyside\", but must be",
    ),
    (
        [
            "height = 427, fullscreen = false }",
            "height = 427, monitor = [0, true] }",
        ],
        "monitor = [0, true]",
        "`monitor` in [[node]] window is a truth value, but must be a name in quotes, a number from 0, or an array of these",
    ),
];

const NETWORK: &[Case] = &[
    (
        ["quic_port = 4857", "quick_port = 4857"],
        "quick_port",
        "unknown key `quick_port` in [network]; did you mean `quic_port`?",
    ),
    (
        ["udp_port = 4858", "udp_port = 4857"],
        "udp_port",
        "`quic_port` and `udp_port` in [network] are both 4857; choose another for one",
    ),
    (
        ["quic_port = 4857", "quic_port = 70000"],
        "quic_port",
        "`quic_port` in [network] is 70000, but must be between 0 and 65535",
    ),
    (
        [
            "# multicast_group = \"239.255.72.87:4859\"",
            "multicast_group = \"192.168.1.5:4859\"",
        ],
        "multicast_group",
        "`multicast_group` in [network] is \"192.168.1.5:4859\", which is no multicast address with a port; write one such as \"239.255.72.87:4859\"",
    ),
    (
        [
            "# multicast_interface = \"192.168.1.5\"",
            "multicast_interface = \"eth0\"",
        ],
        "multicast_interface",
        "[network] does not say from which interface multicast leaves; write its address, such as multicast_interface = \"192.168.1.5\"",
    ),
    (
        ["node_timeout = 0.5 ", "node_timeout = 0.05 "],
        "node_timeout",
        "`node_timeout` in [network] is 0.05, but must be between 0.1 and 60",
    ),
    (
        ["bind = \"127.0.0.1\"", "bind = \"here\""],
        "\"here\"",
        "`bind` in [network] is \"here\", which is no address; write one such as \"0.0.0.0\"",
    ),
];

const FRAMES: &[Case] = &[
    (
        ["swap = \"scheduled\"", "swap = \"imediate\""],
        "\"imediate\"",
        "`swap` in [frames] is \"imediate\", but must be \"immediate\", \"scheduled\" or \"off\"; did you mean `immediate`?",
    ),
    (
        ["rate = 60 ", "rate = 0 "],
        "rate = 0 ",
        "`rate` in [frames] is 0, but must be between 1 and 1000",
    ),
    (
        ["rate = 60 ", "rat = 60 "],
        "rat = 60 ",
        "unknown key `rat` in [frames]; did you mean `rate`?",
    ),
];

const REALTIME: &[Case] = &[
    (
        ["mode = \"waive\"", "mode = \"wave\""],
        "\"wave\"",
        "`mode` in [realtime] is \"wave\", but must be \"enforce\" or \"waive\"; did you mean `waive`?",
    ),
    (
        ["haptics_priority = 80", "haptics_priority = 100"],
        "haptics_priority",
        "`haptics_priority` in [realtime] is 100, but must be between 1 and 99",
    ),
];

const VIEWER: &[Case] = &[
    (
        ["eye_separation = 0.064", "eye_separation = 64"],
        "eye_separation",
        "`eye_separation` in [viewer] is 64, but must be between 0 and 0.2",
    ),
    (
        ["eye_separation = 0.064", "separation_scale = 2.0"],
        "separation_scale = 2.0",
        "`separation_scale` in [viewer] is 2, but must be between 0 and 1",
    ),
    (
        ["near = 0.05", "near = 50.0"],
        "[viewer]",
        "`near` (50) in [viewer] must be smaller than `far` (20)",
    ),
];

const DEVICE: &[Case] = &[(
    ["kind = \"simulated\"", "kind = \"trace\""],
    "[device]",
    "`path` is missing in [device]; add path = \"trace.csv\"",
)];

const SAFETY: &[Case] = &[
    (
        ["force_slew = 0.5 ", "force_slew = -0.5 "],
        "force_slew",
        "`force_slew` in [safety] is -0.5, but must be greater than zero and at most 100",
    ),
    (
        ["# max_force = 20.0 ", "max_force = 60.0 #"],
        "max_force = 60",
        "`max_force` in [safety] is 60 N, which cannot fade in 95 ms at `force_slew` = 0.5 N/ms; use at most 47.5 N, or a larger `force_slew`",
    ),
    (
        ["# rearm = \"manual\" ", "rearm = \"never\" #"],
        "\"never\"",
        "`rearm` in [safety] is \"never\", but must be \"automatic\" or \"manual\"",
    ),
    (
        ["# dead_man = 0 ", "dead_man = 16 #"],
        "dead_man = 16",
        "`dead_man` in [safety] is 16, but must be between 0 and 15",
    ),
    (
        ["torque_slew = 0.05", "torque_slow = 0.05"],
        "torque_slow",
        "unknown key `torque_slow` in [safety]; did you mean `torque_slew`?",
    ),
    (
        ["passivity = \"observe\"", "passivity = \"obey\""],
        "\"obey\"",
        "`passivity` in [safety] is \"obey\", but must be \"observe\" or \"control\"",
    ),
];

#[test]
fn every_fault_names_file_line_and_key() {
    let tables = [
        SCREENS_AND_NODES,
        NETWORK,
        FRAMES,
        REALTIME,
        VIEWER,
        DEVICE,
        SAFETY,
    ];
    for ([from, to], at, expected) in tables.concat() {
        let found = fault(from, to, at);
        assert!(
            found.starts_with(expected),
            "found    {found}\nexpected {expected}"
        );
    }
}

#[test]
fn a_workbench_needs_screens_nodes_and_a_viewer() {
    let error = Workbench::parse(
        "w.toml",
        "name = \"a\"\nscene = \"peg-in-a-hole\"\n",
        Path::new(""),
    )
    .unwrap_err();
    let texts: Vec<&str> = error.problems().iter().map(|p| p.text.as_str()).collect();
    assert_eq!(texts.len(), 3, "{texts:?}");
    assert!(texts[0].starts_with("`screen` is missing"));
    assert!(texts[1].starts_with("`node` is missing"));
    assert!(texts[2].starts_with("`viewer` is missing"));
}

#[test]
fn paths_are_relative_to_the_file_and_shipped_scenes_are_names() {
    let text = SHIPPED_WORKBENCH
        .replace("# hand = \"firm\"", "hand = \"arm\" #")
        .replace("# path = \"my-hand.csv\"", "path = \"my-hand.csv\" #");
    let workbench = Workbench::parse("w.toml", &text, Path::new("lab")).unwrap();
    let Device::Simulated { hand, path, .. } = &workbench.device else {
        panic!("simulated")
    };
    assert_eq!(*hand, Some(HandPreset::Arm));
    assert_eq!(path.as_deref(), Some(Path::new("lab/my-hand.csv")));
    assert_eq!(workbench.scene, "peg-in-a-hole");
    let text = SHIPPED_WORKBENCH.replace("scene = \"peg-in-a-hole\"", "scene = \"mine.toml\"");
    let workbench = Workbench::parse("w.toml", &text, Path::new("lab")).unwrap();
    let found = workbench.load_scene().unwrap_err().to_string();
    assert!(found.ends_with("the scene \"lab/mine.toml\" is neither shipped nor a file; write a shipped name or a path"), "{found}");
}

#[test]
fn machines_that_cannot_reach_each_other_are_named() {
    let machines = "[[machine]]\nname = \"pc\"\naddress = \"10.0.0.1\"\nserver = true\n[[machine]]\nname = \"walls\"\naddress = \"2001:db8::11\"\nnodes = [\"front\", \"table\"]\n[scene_origin]";
    let text = SHIPPED_WORKBENCH.replacen("[scene_origin]", machines, 1);
    let found = Workbench::parse("w.toml", &text, Path::new("")).unwrap_err();
    let found: Vec<String> = found.problems().iter().map(ToString::to_string).collect();
    let place = format!("w.toml:{}: ", line_of(&text, "2001:db8::11"));
    let expected = place
        + "walls has the address 2001:db8::11 and pc has 10.0.0.1: one of IPv4 and one of IPv6";
    assert!(
        found.iter().any(|said| said.starts_with(&expected)),
        "{found:?}"
    );
}

#[test]
fn overrides_reach_every_key() {
    let directory = Path::new("");
    let workbench = Workbench::parse_with_overrides(
        "w.toml",
        SHIPPED_WORKBENCH,
        directory,
        &["network.quic_port=0", "node.1.stereo=mono"],
    )
    .unwrap();
    assert_eq!(workbench.network.quic_port, 0);
    assert_eq!(workbench.nodes[1].stereo, taut_scene::Stereo::Mono);
}

#[test]
fn multicast_leaves_from_the_interface_that_is_listened_on_or_named() {
    let parse = |overrides: &[&str]| {
        Workbench::parse_with_overrides("w.toml", SHIPPED_WORKBENCH, Path::new(""), overrides)
    };
    let network = parse(&["network.transport=multicast"]).unwrap().network;
    assert_eq!(network.transport, taut_scene::TransportKind::Multicast);
    assert_eq!(network.multicast_group.to_string(), "239.255.72.87:4859");
    assert_eq!(network.multicast_interface.to_string(), "127.0.0.1");

    let everywhere = ["network.transport=multicast", "network.bind=0.0.0.0"];
    let found = parse(&everywhere).unwrap_err().to_string();
    assert_says(&found, "does not say from which interface multicast leaves");
    let named = [
        everywhere[0],
        everywhere[1],
        "network.multicast_interface=192.168.1.5",
    ];
    let network = parse(&named).unwrap().network;
    assert_eq!(network.multicast_interface.to_string(), "192.168.1.5");
}

#[test]
fn monitors_comfort_and_hud_are_read_and_are_off_by_default() {
    let parse = |text: &str| Workbench::parse("w.toml", text, Path::new("")).expect("valid");
    let shipped = parse(SHIPPED_WORKBENCH);
    assert!(shipped.nodes[0].window.monitors.is_empty() && !shipped.show.hud);
    assert_eq!(shipped.viewer.separation_scale, 1.0);
    assert_eq!(shipped.viewer.nearest_disparity, 0.0);
    for (written, read) in [
        ("\"DP-1\"", vec!["DP-1"]),
        ("1", vec!["1"]),
        ("[\"DP-1\", 0]", vec!["DP-1", "0"]),
    ] {
        let text = SHIPPED_WORKBENCH
            .replacen("fullscreen = false", &format!("monitor = {written}"), 1)
            .replacen(
                "near = 0.05",
                "nearest_disparity_deg = 4\nseparation_scale = 0.5\nnear = 0.05",
                1,
            )
            .replacen("hud = false", "hud = true", 1);
        let changed = parse(&text);
        assert_eq!(changed.nodes[0].window.monitors, read);
        assert_eq!(changed.viewer.separation_scale, 0.5);
        assert!((changed.viewer.nearest_disparity - 4f64.to_radians()).abs() < 1e-12);
        assert!(changed.show.hud);
    }
}
