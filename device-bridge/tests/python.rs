//! Devices in Python: the hostile tests of the plug-ins in C, on a hand in Python, and what Python alone can do wrong. Needs `python3`.
#![cfg(unix)]

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use taut_bridge::{DeviceFault, Rearm};
use tempfile::TempDir;

use crate::support::PATIENCE;
use crate::support::stage::{
    BAD_SAMPLES, FAULTS, GOOD, HANGS, Inside, Stage, a_person_arms, goes_wrong, is_a_whole_hand,
    no_write_jumps, opened,
};

// Of tests/python/hand.py.
const STUBBORN: i64 = 8;
const EXITS: i64 = 9;
const CRASHES: i64 = 10;
const WRONG_SHAPE: i64 = 11;
const UNKNOWN_KEY: i64 = 12;
const PRINTS: i64 = 13;
const WRITES_TO_THE_LINK: i64 = 14;
const WRITE_RAISES: i64 = 15;
const PLACES: [&str; 11] = [
    "mode", "served", "force", "torque", "after", "closes", "opens", "process", "writes", "jump",
    "fall",
];

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The numbers that a hand shares with its test.
struct Shared {
    file: File,
    choice: String,
    _folder: TempDir,
}

impl Shared {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state");
        std::fs::write(&path, [0; 8 * PLACES.len()]).expect("written");
        let hand = here().join("tests/python/hand.py");
        Self {
            choice: format!("python:{},state={}", hand.display(), path.display()),
            file: File::options()
                .read(true)
                .write(true)
                .open(&path)
                .expect("it is there"),
            _folder: folder,
        }
    }

    fn place(name: &str) -> u64 {
        let place = PLACES.iter().position(|place| *place == name);
        8 * place.expect("a number of the hand") as u64
    }
}

impl Inside for Shared {
    fn get(&self, name: &str) -> i64 {
        let mut bytes = [0; 8];
        self.file
            .read_exact_at(&mut bytes, Self::place(name))
            .expect("it has 64 bytes");
        i64::from_le_bytes(bytes)
    }

    fn set(&self, name: &str, value: i64) {
        self.file
            .write_all_at(&value.to_le_bytes(), Self::place(name))
            .expect("it is writable");
    }
}

/// Whether the process is there and no zombie.
fn is_alive(process: i64) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/stat"));
    status.is_ok_and(|text| !text.contains(") Z "))
}

/// A file of this text, and what opens it.
fn written(folder: &Path, text: &str) -> (PathBuf, String) {
    let path = folder.join("mine.py");
    std::fs::write(&path, text).expect("written");
    let choice = format!("python:{}", path.display());
    (path, choice)
}

#[test]
fn a_hand_in_python_is_felt_lost_and_felt_again() {
    let inside = Shared::new();
    is_a_whole_hand(&inside.choice, "hand in Python");
    assert_eq!(inside.get("closes"), 1);
    let own = [
        (EXITS, "was lost"),
        (WRONG_SHAPE, "was lost"),
        (UNKNOWN_KEY, "was lost"),
        (WRITES_TO_THE_LINK, "was lost"),
        (WRITE_RAISES, "was lost"),
    ];
    goes_wrong(&inside.choice, &inside, &[&FAULTS[..], &own].concat());
}

#[test]
fn a_hand_that_hangs_is_interrupted_and_lets_go_by_itself() {
    let inside = Shared::new();
    let mut stage = Stage::new(&inside.choice, Rearm::Automatic);
    stage.until_felt(&inside);
    let closes = inside.get("closes");
    inside.set("mode", HANGS);
    inside.wait("it hangs", &|| inside.get("served") > 0);
    // Nobody takes the mode away: the interruption alone ends it, with zero at the motors.
    inside.wait("closed with zero", &|| inside.get("closes") > closes);
    assert_eq!(inside.get("force"), 0);
}

#[test]
fn a_hand_that_cannot_be_interrupted_is_killed_and_one_that_crashes_is_found_again() {
    let inside = Shared::new();
    let mut stage = Stage::new(&inside.choice, Rearm::Automatic);
    for mode in [STUBBORN, CRASHES] {
        stage.until_felt(&inside);
        let (process, opens) = (inside.get("process"), inside.get("opens"));
        inside.set("mode", mode);
        stage.until("it is lost", |_, fault, force| {
            matches!(fault, Some(DeviceFault::Lost { .. })) && force == 0.0
        });
        inside.wait("its process ends", &|| !is_alive(process));
        inside.set("mode", GOOD);
        inside.wait("another is started", &|| inside.get("opens") > opens);
    }
    stage.until_felt(&inside);
    let process = inside.get("process");
    drop(stage);
    assert!(!is_alive(process) && inside.get("force") == 0);
}

#[test]
fn what_is_printed_stops_nothing() {
    let inside = Shared::new();
    let mut stage = Stage::new(&inside.choice, Rearm::Automatic);
    stage.until_felt(&inside);
    inside.set("mode", PRINTS);
    // 100 kB in every read: more than a pipe holds.
    stage.until("it prints on", |_, _, _| inside.get("served") > 20);
    inside.set("mode", GOOD);
    stage.until_felt(&inside);
    assert_eq!(inside.get("opens"), 1, "it was stopped by its own words");
}

#[test]
fn a_force_does_not_outlive_the_loop_that_wrote_it_nor_the_bridge() {
    let inside = Shared::new();
    let mut stage = Stage::new(&inside.choice, Rearm::Automatic);
    stage.until_felt(&inside);
    // Nobody ticks any more; the file is read and written on.
    inside.wait("zero without a write", &|| inside.get("force") == 0);
    stage.until_felt(&inside);
    drop(stage);
    assert_eq!(inside.get("force"), 0);
    assert!(!is_alive(inside.get("process")));
}

#[test]
fn no_write_of_a_device_in_python_jumps() {
    let inside = Shared::new();
    let choice = format!("{},anchor=workbench", inside.choice);
    no_write_jumps(&choice, &inside, &BAD_SAMPLES);
}

#[test]
fn a_person_arms_a_device_in_python_again() {
    let inside = Shared::new();
    a_person_arms(&inside.choice, &inside);
}

#[test]
fn what_does_not_fit_is_named_with_the_line_of_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = "class Device:\n    def open(self, options): pass\n    def info(self): return INFO\n    def read(self): return None\n    def write(self, wrench): pass\n    def close(self): pass\n";
    let good = "{'sensed_degrees_of_freedom': 3, 'actuated_degrees_of_freedom': 3, 'max_force': 5, 'max_stiffness': 500}";
    for (text, named) in [
        (
            "x = 1\n".to_owned(),
            "needs a class Device with open, info, read, write, close",
        ),
        (
            "class Device:\n    def open(self): pass\n".to_owned(),
            "it lacks info, read, write, close",
        ),
        ("import no_such_module\n".to_owned(), "mine.py\", line 1"),
        ("class Device\n".to_owned(), "SyntaxError"),
        (
            whole.replace("INFO", "{'max_force': 1}"),
            "KeyError: 'sensed_degrees_of_freedom'",
        ),
        (
            whole.replace("INFO", &good.replace("'max_stiffness'", "'max_stifness'")),
            "info gives ['max_stifness']",
        ),
        (
            whole.replace("INFO", &good.replace("5,", "float('inf'),")),
            "max_force is inf, but must be from 0.001 to 1000",
        ),
        (
            whole.replace("INFO", &good.replace(", 'max_force': 5", "")),
            "max_force is NaN",
        ),
        (
            whole.replace(
                "): pass\n    def info",
                "): raise OSError('no arm')\n    def info",
            ),
            ", line 2, in open",
        ),
        (
            "import os\nprint('last words')\nos._exit(3)\n".to_owned(),
            "exit status: 3); its last lines:\nlast words",
        ),
        ("import sys\nsys.exit(2)\n".to_owned(), "SystemExit: 2"),
    ] {
        let (_, choice) = written(folder.path(), &text);
        let said = opened(&choice).err().unwrap_or_else(|| panic!("{text}"));
        assert!(said.contains(named), "{text}: {said}");
        assert!(
            !said.contains("<string>") && !said.contains("<frozen"),
            "{said}"
        );
    }
    let (path, choice) = written(folder.path(), &whole.replace("INFO", good));
    drop(opened(&choice).unwrap_or_else(|error| panic!("{error}")));
    for (choice, named) in [
        (format!("{choice},firm"), "NAME=VALUE, and `firm` is none"),
        (
            format!("{choice},interpreter=/no/python"),
            "give the option interpreter=PATH",
        ),
        (
            "python:/no/such/file.py".to_owned(),
            "write its whole path, python:/path/device.py",
        ),
    ] {
        let said = opened(&choice).err().expect("it does not fit");
        assert!(said.contains(named), "{choice}: {said}");
    }
    drop(path);
}

#[test]
fn a_file_that_does_not_open_is_interrupted_and_says_where() {
    let folder = tempfile::tempdir().expect("a folder");
    let opens = folder.path().join("opens");
    let text = format!(
        "import time\nopen({opens:?}, 'w').close()\nclass Device:\n    def open(self, options):\n        time.sleep(1000)\n    info = read = write = close = open\n"
    );
    let (_, choice) = written(folder.path(), &text);
    let begun = Instant::now();
    let said = opened(&choice).err().expect("it hangs");
    assert!(opens.exists() && begun.elapsed() < PATIENCE);
    assert!(said.contains("time.sleep(1000)"), "{said}");
}

#[test]
fn the_example_is_felt_and_is_that_of_the_document() {
    let example = here().join("../server/python/examples/spring_hand.py");
    let text = std::fs::read_to_string(&example).expect("the example");
    assert!(text.lines().count() <= 50, "{} lines", text.lines().count());
    let document =
        std::fs::read_to_string(here().join("../docs/devices.md")).expect("the document");
    let (_, section) = document
        .split_once("## Write a device in Python")
        .expect("the section");
    assert!(
        section.contains(&format!("```python\n{text}```")),
        "docs/devices.md shows another example"
    );
    let mut stage = Stage::new(
        &format!("python:{},depth=0.04", example.display()),
        Rearm::Automatic,
    );
    assert_eq!(stage.port.info().actuated_degrees_of_freedom, 3);
    stage.until("the floor", |_, fault, force| {
        fault.is_none() && force > 0.3
    });
}

#[test]
fn the_types_name_every_key_that_is_taken() {
    let read = |path: &str| std::fs::read_to_string(here().join(path)).expect(path);
    let host = read("src/plugin/taut_host.py");
    let types = read("../server/python/taut/device.py");
    for set in ["SAMPLE_KEYS = {", "INFO_KEYS = {"] {
        let (_, keys) = host.split_once(set).expect("a set of keys");
        let (keys, _) = keys.split_once('}').expect("its end");
        let names: Vec<&str> = keys.split('"').skip(1).step_by(2).collect();
        assert!(names.len() >= 7, "{keys}");
        for name in names {
            let is_typed = types.contains(&format!("\n    {name}: "));
            assert!(is_typed, "taut/device.py lacks {name}");
        }
    }
}
