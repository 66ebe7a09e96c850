//! Devices in shared libraries: the interface on a stand-in hand in C, built here by `cc`.
#![cfg(unix)]
#![allow(
    unsafe_code,
    reason = "the tests look into the libraries that they built"
)]

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::atomic::{AtomicI64, Ordering};

use libloading::Library;
use taut_bridge::Rearm;
use tempfile::TempDir;

use crate::support::stage::{
    BAD_SAMPLES, FAULTS, GOOD, HANGS, Inside, Stage, UNPLUGGED, a_person_arms, goes_wrong,
    is_a_whole_hand, no_write_jumps, opened,
};

pub fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub fn document() -> String {
    std::fs::read_to_string(here().join("../docs/devices.md")).expect("the document")
}

/// Builds `source` in `folder`, with everything that a compiler can find a fault.
pub fn built(folder: &Path, source: &Path, name: &str, define: &str) -> PathBuf {
    let library = folder.join(name);
    let mut cc = Process::new("cc");
    cc.args(["-Wall", "-Wextra", "-Werror", "-O1", "-shared", "-fPIC"])
        .arg(format!("-D{define}"))
        .arg("-I")
        .arg(here().join("include"))
        .arg(source)
        .arg("-o")
        .arg(&library)
        .args(["-ldl", "-lm", "-lpthread"]);
    let out = cc.output().expect("cc, as of the package build-essential");
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    library
}

pub fn stand_in(folder: &Path, source: &str, define: &str) -> PathBuf {
    let source = here().join("tests/plugin_c").join(source);
    built(folder, &source, &format!("lib{define}.so"), define)
}

/// What the test sees of a library, loaded a second time: the same one.
pub struct Loaded(Library);

impl Loaded {
    pub fn of(path: &Path) -> Self {
        // SAFETY: it was built from a source of this folder.
        Self(unsafe { Library::new(path) }.expect("it was built"))
    }

    fn number(&self, name: &str) -> &AtomicI64 {
        let name = format!("taut_test_{name}");
        // SAFETY: tests/plugin_c/plant.h defines it as an atomic of 64 bits, and the library stays loaded for as long as `self`.
        unsafe {
            let symbol = self
                .0
                .get::<*const AtomicI64>(name.as_bytes())
                .expect("defined");
            &**symbol
        }
    }
}

impl Inside for Loaded {
    fn get(&self, name: &str) -> i64 {
        self.number(name).load(Ordering::SeqCst)
    }

    fn set(&self, name: &str, value: i64) {
        self.number(name).store(value, Ordering::SeqCst);
    }
}

/// The stand-in as a whole hand: the folder in which it is, what the test sees of it, and what opens it.
fn hand() -> (TempDir, Loaded, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let library = stand_in(folder.path(), "hand.c", "HAND");
    let inside = Loaded::of(&library);
    let choice = format!("plugin:{}", library.display());
    (folder, inside, choice)
}

#[test]
fn a_hand_in_c_is_felt_lost_and_felt_again() {
    let (_folder, inside, choice) = hand();
    let choice = format!("{choice},side=left,scale=1,firm");
    is_a_whole_hand(&choice, "stand-in hand");
    goes_wrong(&choice, &inside, &FAULTS);
}

#[test]
fn a_device_that_hangs_is_left_and_closed_when_it_comes_back() {
    let (_folder, inside, choice) = hand();
    let mut stage = Stage::new(&choice, Rearm::Automatic);
    stage.until_felt(&inside);
    inside.set("after", -1);
    inside.set("mode", HANGS);
    inside.wait("it hangs", &|| inside.get("served") > 0);
    drop(stage); // comes back, though the library does not
    assert!(inside.get("force") > 0, "nobody can take it away");
    inside.set("mode", GOOD);
    inside.wait("it is closed", &|| inside.get("closes") == 1);
    assert_eq!((inside.get("after"), inside.get("force")), (0, 0));
}

#[test]
fn a_force_does_not_outlive_the_loop_that_wrote_it() {
    let (_folder, inside, choice) = hand();
    let mut stage = Stage::new(&choice, Rearm::Automatic);
    stage.until_felt(&inside);
    // Nobody ticks any more; the library is read and written on.
    inside.wait("zero without a write", &|| inside.get("force") == 0);
    stage.until_felt(&inside);
}

#[test]
fn no_write_of_a_plug_in_jumps() {
    let (_folder, inside, choice) = hand();
    let choice = format!("{choice},anchor=workbench");
    no_write_jumps(&choice, &inside, &BAD_SAMPLES);
}

#[test]
fn a_hand_that_rests_before_the_first_tick_is_felt_all_the_same() {
    let (_folder, inside, choice) = hand();
    let mut stage = Stage::new(&choice, Rearm::Automatic);
    // A millisecond of its own in each; it rests after some 250.
    inside.wait("it is read and written", &|| inside.get("writes") > 500);
    stage.until_felt(&inside);
}

#[test]
fn a_device_without_motors_is_read_and_never_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let library = stand_in(folder.path(), "hand.c", "NO_MOTORS");
    let mut stage = Stage::new(&format!("plugin:{}", library.display()), Rearm::Automatic);
    assert_eq!(stage.port.info().actuated_degrees_of_freedom, 0);
    let inside = |stage: &Stage| stage.time > 1100;
    stage.until("it is read", |stage, fault, _| {
        fault.is_none() && inside(stage)
    });
}

#[test]
fn a_person_arms_a_plug_in_again() {
    let (_folder, inside, choice) = hand();
    a_person_arms(&choice, &inside);
}

#[test]
fn what_does_not_fit_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = |library: &Path| {
        let choice = format!("plugin:{}", library.display());
        opened(&choice).err().expect("it does not fit")
    };
    for (define, named) in [
        (
            "OTHER_VERSION",
            "its table is of version 9, and 1 is understood; compile it with",
        ),
        ("OTHER_SIZE", "bytes, and version 1 has"),
        ("HOLE", "no function `write`"),
        ("NO_TABLE", "no table of functions"),
        ("NO_ENTRY", "exports no function `taut_device_entry`"),
        (
            "INFINITE",
            "max_force is inf, but must be from 0.001 to 1000",
        ),
    ] {
        let said = error(&stand_in(folder.path(), "hand.c", define));
        assert!(said.contains(named), "{define}: {said}");
    }
    let missing = error(Path::new("/no/such/lib.so"));
    assert!(missing.contains("write its whole path"), "{missing}");
    let text = folder.path().join("text.so");
    std::fs::write(&text, "no library").expect("written");
    let said = error(&text);
    assert!(said.contains("cannot be loaded"), "{said}");
    let hand = stand_in(folder.path(), "hand.c", "HAND");
    let choice = format!("plugin:{},colour=red", hand.display());
    let said = opened(&choice).err().expect("no such option");
    assert!(said.contains("what options are these?"), "{said}");
    Loaded::of(&hand).set("mode", UNPLUGGED);
    assert!(error(&hand).contains("no hand is plugged in"));
}

#[test]
fn the_example_of_the_document_is_a_device() {
    let document = document();
    let (_, section) = document
        .split_once("## Write a device in C")
        .expect("the section");
    let (_, code) = section.split_once("```c\n").expect("the example");
    let (code, _) = code.split_once("```").expect("its end");
    assert!(code.lines().count() <= 45, "{} lines", code.lines().count());
    let folder = tempfile::tempdir().expect("a folder");
    let source = folder.path().join("mine.c");
    std::fs::write(&source, code).expect("written");
    let library = built(folder.path(), &source, "libmine.so", "MINE");
    let mut stage = Stage::new(&format!("plugin:{}", library.display()), Rearm::Automatic);
    assert_eq!(stage.port.info().actuated_degrees_of_freedom, 3);
    stage.until("the floor", |_, fault, force| {
        fault.is_none() && force > 0.3
    });
}
