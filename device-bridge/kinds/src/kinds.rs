//! The declarations.

use crate::key::{Key, Takes};
use crate::kind::{Kind, KindId};

const fn key(name: &'static str, takes: Takes, what: &'static str) -> Key {
    Key {
        name,
        takes,
        what,
        in_file_only: false,
    }
}

const fn in_file(name: &'static str, takes: Takes, what: &'static str) -> Key {
    Key {
        name,
        takes,
        what,
        in_file_only: true,
    }
}

const AXES: Key = key(
    "axes",
    Takes::Axes,
    "which of its axes points along x, y, z of the workbench; default `x y z`",
);
/// Of arms that have x towards the user.
const AXES_OF_ARM: Key = key(
    "axes",
    Takes::Axes,
    "which of its axes points along x, y, z of the workbench; default `y -x z`",
);
const SCALE: Key = key(
    "scale",
    Takes::Number(1e-2, 1e2),
    "metres on the workbench of a metre of the device; forces are not scaled; default 1",
);
const ANCHOR: Key = key(
    "anchor",
    Takes::OneOf(&["start", "workbench"]),
    "`start`: the body moves from its start as the hand does; `workbench`: it is where the hand is; default `start`",
);
const OPTIONS: Key = in_file(
    "options",
    Takes::Text("the options, with commas between"),
    "what is handed on as it is written; on the command line every other option is",
);
const GEOMETRY: Takes = Takes::NameOrFile("g6x3r, g6x4r, g6x5r, wb or a geometry file");

const PLAIN: Kind = Kind {
    id: KindId::Remote,
    name: "",
    what: "",
    place: None,
    place_word: "",
    place_example: "",
    needs_place: false,
    keys: &[],
    hands_on: false,
    has_motors: false,
    on_command_line: true,
};

const ON_PORT: Kind = Kind {
    place: Some(key(
        "port",
        Takes::File,
        "its serial port, such as `/dev/ttyUSB0`",
    )),
    place_word: "PORT",
    place_example: "/dev/ttyUSB0",
    needs_place: true,
    ..PLAIN
};

/// Every kind there is.
pub const KINDS: [Kind; 12] = [
    Kind {
        id: KindId::Simulated,
        name: "simulated",
        what: "a simulated device in a simulated hand, made of strings on request: pose and force",
        keys: &[
            key(
                "strings",
                GEOMETRY,
                "made of strings: a shipped geometry or a file; default: without any",
            ),
            in_file(
                "hand",
                Takes::OneOf(&["released", "light", "firm", "arm"]),
                "the hand; default: the scene's, else light",
            ),
            in_file(
                "path",
                Takes::File,
                "via points of the hand; default: the scene's",
            ),
            in_file(
                "tremor",
                Takes::Number(0.0, 1e-3),
                "m rms, 8 to 12 Hz; default 0",
            ),
            in_file(
                "seed",
                Takes::Whole(0, i64::MAX),
                "of the tremor; default 0",
            ),
        ],
        ..PLAIN
    },
    Kind {
        id: KindId::Trace,
        name: "trace",
        what: "a recorded trace of poses: no force",
        place: Some(key("path", Takes::File, "the trace, CSV")),
        place_word: "FILE",
        place_example: "trace.csv",
        needs_place: true,
        keys: &[in_file(
            "loop",
            Takes::YesOrNo,
            "again and again; default no",
        )],
        ..PLAIN
    },
    Kind {
        id: KindId::Haply,
        name: "haply",
        what: "a Haply Inverse arm behind its service, with or without a VerseGrip: force without torque",
        place: Some(key(
            "address",
            Takes::Service,
            "the service; default `127.0.0.1:10001`",
        )),
        place_word: "HOST:PORT",
        keys: &[
            key(
                "arm",
                Takes::Text("the service's name of the arm, such as 04C3"),
                "the arm by the service's name of it; default: the first",
            ),
            key(
                "grip",
                Takes::YesOrNo,
                "no: the grip is left out, 3 degrees of freedom; default yes",
            ),
            key(
                "events",
                Takes::Whole(0, 65_535),
                "port of the service's events, which are told in the log; 0: none; default 10020",
            ),
            AXES,
            SCALE,
            ANCHOR,
        ],
        has_motors: true,
        ..PLAIN
    },
    Kind {
        id: KindId::Spidar,
        name: "spidar",
        what: "a SPIDAR-G on its UART motor boards: six degrees of freedom, force and torque",
        keys: &[
            key(
                "geometry",
                GEOMETRY,
                "where its strings are: a shipped geometry or a file; default `g6x4r`",
            ),
            key(
                "axes",
                Takes::RightHandedAxes,
                "which of the frame's axes points along x, y, z of the workbench; default `x -z y`",
            ),
        ],
        has_motors: true,
        ..ON_PORT
    },
    Kind {
        id: KindId::Polhem,
        name: "polhem",
        what: "a Polhem arm on its text board: six degrees of freedom, force without torque",
        keys: &[AXES_OF_ARM, SCALE, ANCHOR],
        has_motors: true,
        ..ON_PORT
    },
    Kind {
        id: KindId::Wooden,
        name: "wooden",
        what: "a WoodenHaptics arm, or a kin of it, on its HID board: force without torque",
        place: Some(key(
            "port",
            Takes::File,
            "its HID port, such as `/dev/hidraw3`; default: the first that is found",
        )),
        place_word: "PORT",
        keys: &[
            key(
                "model",
                Takes::OneOf(&[
                    "woodenhaptics-2019",
                    "woodenhaptics-2015",
                    "polhem-1",
                    "aluhaptics-2",
                    "vintage",
                ]),
                "which arm; default `woodenhaptics-2019`",
            ),
            AXES_OF_ARM,
            SCALE,
            ANCHOR,
        ],
        has_motors: true,
        ..PLAIN
    },
    Kind {
        id: KindId::Plugin,
        name: "plugin",
        what: "a force device in a shared library of your own (taut_device.h); other options go to the library",
        place: Some(key("library", Takes::File, "the library")),
        place_word: "LIBRARY",
        place_example: "/path/lib.so",
        needs_place: true,
        keys: &[AXES, SCALE, ANCHOR, OPTIONS],
        hands_on: true,
        has_motors: true,
        ..PLAIN
    },
    Kind {
        id: KindId::Python,
        name: "python",
        what: "a device of your own in Python, in a process of its own; other options go to its `open`",
        place: Some(key("file", Takes::File, "the file with `class Device`")),
        place_word: "FILE",
        place_example: "/path/device.py",
        needs_place: true,
        keys: &[
            key(
                "interpreter",
                Takes::Text("the interpreter's path"),
                "the Python, 3.9 or later; default `python3` of the `PATH`",
            ),
            AXES,
            SCALE,
            ANCHOR,
            OPTIONS,
        ],
        hands_on: true,
        has_motors: true,
        ..PLAIN
    },
    Kind {
        id: KindId::SpaceMouse,
        name: "space-mouse",
        what: "a 3Dconnexion SpaceMouse: six degrees of freedom in, no force",
        keys: &[
            key(
                "mode",
                Takes::OneOf(&["rate", "position"]),
                "`rate`: the cap's displacement is a velocity; `position`: a displacement from the start; default `rate`",
            ),
            key(
                "dead_zone",
                Takes::Number(0.0, 0.9),
                "share of the largest deflection that counts as none; default 0.08",
            ),
            key(
                "speed",
                Takes::Number(1e-3, 10.0),
                "m/s at full deflection; default 0.1",
            ),
            key(
                "turn_rate",
                Takes::Number(1e-2, 100.0),
                "rad/s at full deflection; default 1",
            ),
            key(
                "reach",
                Takes::Number(1e-3, 10.0),
                "m at full deflection, position mode; default 0.1",
            ),
            key(
                "tilt",
                Takes::Number(1e-2, 3.0),
                "rad at full deflection, position mode; default 0.6",
            ),
            key(
                "yield_force",
                Takes::Number(1e-2, 1e3),
                "N: a coupling force of this size stops the body against full deflection; default 5",
            ),
            key(
                "yield_torque",
                Takes::Number(1e-3, 1e3),
                "N m, likewise; default 0.25",
            ),
        ],
        ..PLAIN
    },
    Kind {
        id: KindId::Vrpn,
        name: "vrpn",
        what: "a sensor of a VRPN tracker: six degrees of freedom in, no force",
        place: Some(key("server", Takes::Tracker, "the tracker")),
        place_word: "TRACKER@HOST",
        place_example: "Tracker0@host:3883",
        needs_place: true,
        keys: &[
            key(
                "sensor",
                Takes::Whole(0, 1 << 20),
                "which of its sensors; default 0",
            ),
            key(
                "mode",
                Takes::OneOf(&["tcp", "udp"]),
                "`tcp`: this side dials; `udp`: the server calls back and reports come as datagrams; default `tcp`",
            ),
            AXES,
            key(
                "scale",
                Takes::Number(1e-6, 1e6),
                "m per unit of the tracker; default 1",
            ),
            ANCHOR,
            key(
                "max_age",
                Takes::Number(1e-3, 10.0),
                "s of silence after which it counts as lost; default 0.1",
            ),
            in_file(
                "origin",
                Takes::Pose,
                "of the tracker's origin on the workbench, after `axes`",
            ),
            in_file(
                "mount",
                Takes::Pose,
                "of the held thing in the sensor's frame",
            ),
        ],
        ..PLAIN
    },
    Kind {
        id: KindId::Mouse,
        name: "mouse",
        what: "mouse and keyboard of a render window (`taut demo`, `taut render --hold`): no force",
        ..PLAIN
    },
    Kind {
        id: KindId::Remote,
        name: "remote",
        what: "what `taut bridge` on this or another machine has",
        on_command_line: false,
        ..PLAIN
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_is_declared_once_and_so_are_its_keys() {
        for (place, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..place].iter().all(|other| other.name != kind.name));
            assert!(KINDS[..place].iter().all(|other| other.id != kind.id));
            let names: Vec<_> = kind.every_key().map(|key| key.name).collect();
            for (place, name) in names.iter().enumerate() {
                assert!(!names[..place].contains(name), "{}: {name}", kind.name);
            }
            assert_eq!(kind.hands_on, kind.has("options"), "{}", kind.name);
            let written = kind.every_key().filter(|key| key.takes == Takes::Pose);
            assert!(written.count() == 0 || kind.id == KindId::Vrpn);
        }
    }

    #[test]
    fn forms_say_what_may_be_left_out() {
        let form = |name: &str| {
            let kind = KINDS.iter().find(|kind| kind.name == name).expect("there");
            kind.form()
        };
        assert_eq!(form("mouse"), "mouse");
        assert_eq!(form("trace"), "trace:FILE");
        assert_eq!(form("simulated"), "simulated[,strings=NAME]");
        assert_eq!(
            form("haply"),
            "haply[=HOST:PORT][,arm=NAME,grip=yes|no,events=N,axes=x y z,scale=X,anchor=start|workbench]"
        );
        assert!(form("plugin").ends_with(",...]"));
    }
}
