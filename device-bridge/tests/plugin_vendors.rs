//! The plug-ins of vendors, on stand-ins of their libraries. All are built here by `cc`.
#![cfg(unix)]

use std::path::Path;
use std::process::Command as Process;
use std::time::Instant;

use nalgebra::{UnitQuaternion, Vector3};
use taut_bridge::Device;

use crate::plugin::{Loaded, built, document, here, stand_in};
use crate::support::stage::{
    GOOD, HANGS, Inside, NOT_A_NUMBER, NOT_CALIBRATED, NOTHING_NEW, TOO_HOT, UNPLUGGED, goes_wrong,
    opened,
};
use crate::support::{PATIENCE, ms};

/// The plug-in of this name, built by the line of the document as a user types it in the repository, and chosen without options; beside it `strict.so`, the
/// same source with every warning an error.
fn documented(name: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    std::os::unix::fs::symlink(here(), folder.path().join("device-bridge")).expect("a link");
    let document = document();
    let source = format!("plugins/{name}.c");
    let line = document
        .lines()
        .find(|line| line.starts_with("cc ") && line.contains(&source))
        .expect("how to build it");
    let mut shell = Process::new("sh");
    let status = shell.args(["-c", line]).current_dir(folder.path()).status();
    assert!(status.expect("a shell").success(), "{line}");
    built(folder.path(), &here().join(source), "strict.so", "STRICT");
    let plugin = folder.path().join(format!("taut_{name}.so"));
    (folder, format!("plugin:{}", plugin.display()))
}

/// How near numbers of a library's are.
#[derive(Clone, Copy)]
struct Near {
    place: f64,
    angle: f64,
}

const DOUBLE: Near = Near {
    place: 1e-12,
    angle: 1e-9,
};
/// Half the last place of 30 mm as a float is 9.4e-10 m; two parts of a quaternion that are each off by a last place (6e-8) turn by 1.7e-7.
const FLOAT: Near = Near {
    place: 1e-9,
    angle: 2e-7,
};

/// The first reading has the place of a vendor's stand-in, its second button, and this rotation.
fn lies_where_the_stand_in_is(mut device: Box<dyn Device>, turn: Vector3<f64>, near: Near) {
    let begun = Instant::now();
    let sample = loop {
        match device.read(ms(1)) {
            Ok(sample) => break sample,
            Err(fault) => assert!(begun.elapsed() < PATIENCE, "{fault}"),
        }
    };
    let (at, rotation) = (sample.pose.translation.vector, sample.pose.rotation);
    assert!(
        (at.x - 0.03).abs() < near.place && (at.y + 0.02).abs() < near.place,
        "{at}"
    );
    let turn = UnitQuaternion::from_scaled_axis(turn);
    assert!(rotation.angle_to(&turn) < near.angle, "{rotation}");
    assert_eq!(sample.buttons, 2);
}

/// A program that calls the plug-in as taut does, and hangs outside of it, leaves no force: see caller.c.
fn lets_go_of_a_caller_that_hangs(folder: &Path, vendor: &Vendor, library: &Path) {
    let caller = folder.join("caller");
    let mut cc = Process::new("cc");
    cc.args(["-Wall", "-Wextra", "-Werror", "-O1", "-I"])
        .arg(here().join("include"))
        .arg(here().join("tests/plugin_c/caller.c"))
        .arg("-o")
        .arg(&caller)
        .arg("-ldl");
    assert!(cc.status().expect("cc").success(), "the caller");
    let options = format!("library={},{}", library.display(), vendor.finding);
    let mut called = Process::new(caller);
    called
        .arg(folder.join(format!("taut_{}.so", vendor.name)))
        .arg(library)
        .arg(options);
    let out = called.output().expect("it was built");
    let said = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{}: {said}", vendor.name);
    println!("{}", String::from_utf8_lossy(&out.stdout));
}

/// A vendor's plug-in, and what is expected of it on the stand-in of its library.
struct Vendor {
    name: &'static str,
    /// Its options, as they are told to who writes another.
    options: &'static str,
    /// The function of the library that another library is said to lack.
    first_function: &'static str,
    /// The options that find the stand-in.
    finding: &'static str,
    /// Options of its own that are refused, and what is named then.
    refused: &'static [(&'static str, &'static str)],
    /// What its device is called.
    device: &'static str,
    actuated: u8,
    /// N m, with `force=8` and `torque=0.3` where it turns.
    max_torque: f64,
    /// How the stand-in is turned, on the workbench.
    turn: Vector3<f64>,
    near: Near,
    /// Ways in which it goes wrong.
    modes: &'static [i64],
}

fn is_called_as_published(vendor: &Vendor) {
    let (folder, bare) = documented(vendor.name);
    let source = format!("stand_in_{}.c", vendor.name);
    let library = stand_in(folder.path(), &source, "VENDOR");
    let inside = Loaded::of(&library);
    let found = format!("{bare},library={}", library.display());
    let lacks = format!("it lacks: {}", vendor.first_function);
    let strict = format!("{bare},library={}/strict.so", folder.path().display());
    let refused = |choice: &str, named: &str| {
        let said = opened(choice).err().expect(choice);
        assert!(said.contains(named), "{choice}: {said}");
    };
    let missing = "library cannot be loaded (install it; option library=PATH)";
    refused(&format!("{bare},library=/no/lib.so"), missing);
    refused(&strict, &lacks);
    refused(&format!("{found},force=1e9"), "out of range: force");
    refused(
        &format!("{found},colour=red"),
        &format!("there are {}: colour", vendor.options),
    );
    for &(options, named) in vendor.refused {
        refused(&format!("{found},{options}"), named);
    }
    lets_go_of_a_caller_that_hangs(folder.path(), vendor, &library);
    let choice = format!("{found},{},force=8", vendor.finding);
    inside.set("mode", UNPLUGGED);
    refused(&choice, "no device found");
    inside.set("mode", GOOD);

    // Where the workbench has it: right, away from the user, up.
    let device = opened(&format!("{choice},anchor=workbench")).expect("it is there");
    let info = device.info();
    assert_eq!(info.name, vendor.device);
    let freedoms = (
        info.sensed_degrees_of_freedom,
        info.actuated_degrees_of_freedom,
    );
    assert_eq!(freedoms, (6, vendor.actuated));
    let most = (info.limits.max_force, info.limits.max_torque);
    assert_eq!(most, (8.0, vendor.max_torque));
    lies_where_the_stand_in_is(device, vendor.turn, vendor.near);
    inside.wait("it is closed", &|| inside.get("closes") > 0);

    let named = |mode| {
        if mode == NOT_A_NUMBER {
            "not finite"
        } else {
            "was lost"
        }
    };
    let modes: Vec<_> = vendor
        .modes
        .iter()
        .map(|&mode| (mode, named(mode)))
        .collect();
    goes_wrong(&choice, &inside, &modes);
}

#[test]
fn openhaptics_functions_are_called_as_published() {
    is_called_as_published(&Vendor {
        name: "hd",
        options: "library, name, force, stiffness",
        first_function: "hdInitDevice",
        finding: "name=Left Device,stiffness=800",
        refused: &[("name=", "no value for this option, or out of range: name")],
        device: "3D Systems stand-in Touch",
        actuated: 3,
        max_torque: 0.0,
        turn: Vector3::x() * 2.5,
        near: DOUBLE,
        modes: &[HANGS, NOT_A_NUMBER, TOO_HOT, UNPLUGGED, NOT_CALIBRATED],
    });
}

#[test]
fn force_dimension_s_functions_are_called_as_published() {
    is_called_as_published(&Vendor {
        name: "dhd",
        options: "library, id, force, torque, stiffness, rotational-stiffness",
        first_function: "dhdOpenID",
        finding: "id=2,torque=0.3",
        refused: &[
            ("id", "write NAME=VALUE instead of: id"),
            ("id=2.5", "out of range: id"),
        ],
        device: "Force Dimension stand-in.6",
        actuated: 6,
        max_torque: 0.3,
        turn: Vector3::y() * -2.5,
        near: DOUBLE,
        // The last: its force button was pressed.
        modes: &[
            HANGS,
            NOT_A_NUMBER,
            TOO_HOT,
            UNPLUGGED,
            NOTHING_NEW,
            NOT_CALIBRATED,
        ],
    });
}

#[test]
fn virtuose_functions_are_called_as_published() {
    is_called_as_published(&Vendor {
        name: "virtuose",
        options: "library, host, force, torque, stiffness, rotational-stiffness",
        first_function: "virtOpen",
        finding: "host=10.0.0.7#53210,torque=0.3",
        refused: &[
            ("host=", "no value for this option, or out of range: host"),
            (
                "host=10.0.0.8",
                "no Virtuose answers there (option host=ADDRESS): no device found",
            ),
        ],
        device: "Haption Virtuose",
        actuated: 6,
        max_torque: 0.3,
        turn: Vector3::y() * -2.5,
        near: FLOAT,
        // The last two: the offset button is pressed, and the power is off.
        modes: &[
            HANGS,
            NOT_A_NUMBER,
            TOO_HOT,
            UNPLUGGED,
            NOTHING_NEW,
            NOT_CALIBRATED,
        ],
    });
}
