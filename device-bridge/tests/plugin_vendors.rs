//! The plug-ins of vendors, on stand-ins of their libraries. All are built here by `cc`.
#![cfg(unix)]

use std::process::Command as Process;
use std::time::Instant;

use nalgebra::{UnitQuaternion, Vector3};
use taut_bridge::Device;

use crate::plugin::{Loaded, built, document, here, stand_in};
use crate::support::stage::{
    GOOD, HANGS, Inside, NOT_A_NUMBER, NOT_CALIBRATED, NOTHING_NEW, PATIENCE, TOO_HOT, UNPLUGGED,
    goes_wrong, ms, opened,
};

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

/// Each of these options is refused, and what is wrong is named.
fn refused(bare: &str, options: &[(&str, &str)]) {
    for (options, named) in options {
        let said = opened(&format!("{bare},{options}")).err().expect(options);
        assert!(said.contains(named), "{options}: {said}");
    }
}

fn not_there_while_unplugged(choice: &str, inside: &Loaded) {
    inside.set("mode", UNPLUGGED);
    let said = opened(choice).err().expect("none is plugged in");
    assert!(said.contains("no device found"), "{said}");
    inside.set("mode", GOOD);
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

#[test]
fn openhaptics_functions_are_called_as_published() {
    let (folder, bare) = documented("hd");
    let vendor = stand_in(folder.path(), "stand_in_hd.c", "HD");
    let inside = Loaded::of(&vendor);
    refused(
        &bare,
        &[
            (
                "library=/no/libHD.so",
                "cannot be loaded (install it; option library=PATH)",
            ),
            ("force=1e9", "out of range: force"),
            ("colour=red", "there are library, name, force, stiffness"),
            (
                &format!("library={}/strict.so", folder.path().display()),
                "it lacks: hdInitDevice",
            ),
        ],
    );
    let choice = format!(
        "{bare},library={},name=Left Device,force=8,stiffness=800",
        vendor.display()
    );
    not_there_while_unplugged(&choice, &inside);

    // Where the workbench has it: right, away from the user, up; and turned about the axis to the right.
    let device = opened(&format!("{choice},anchor=workbench")).expect("it is there");
    assert_eq!(device.info().name, "3D Systems stand-in Touch");
    let freedoms = (
        device.info().sensed_degrees_of_freedom,
        device.info().actuated_degrees_of_freedom,
    );
    assert_eq!(freedoms, (6, 3));
    assert_eq!(device.info().limits.max_force, 8.0);
    lies_where_the_stand_in_is(device, Vector3::x() * 2.5, DOUBLE);
    inside.wait("it is closed", &|| inside.get("closes") > 0);

    let modes = [
        (HANGS, "was lost"),
        (NOT_A_NUMBER, "not finite"),
        (TOO_HOT, "was lost"),
        (UNPLUGGED, "was lost"),
        (NOT_CALIBRATED, "was lost"),
    ];
    goes_wrong(&choice, &inside, &modes);
}

#[test]
fn force_dimension_s_functions_are_called_as_published() {
    let (folder, bare) = documented("dhd");
    let vendor = stand_in(folder.path(), "stand_in_dhd.c", "DHD");
    let inside = Loaded::of(&vendor);
    refused(
        &bare,
        &[
            (
                "library=/no/libdhd.so",
                "cannot be loaded (option library=PATH)",
            ),
            ("force=1e9", "out of range: force"),
            ("colour=red", "there are library, id, force"),
            ("id", "write NAME=VALUE instead of: id"),
            (
                &format!("library={}/strict.so", folder.path().display()),
                "it lacks: dhdOpenID",
            ),
        ],
    );
    let choice = format!(
        "{bare},library={},id=2,force=8,torque=0.3",
        vendor.display()
    );
    not_there_while_unplugged(&choice, &inside);

    // Where the workbench has it: right, away from the user, up; and turned about the axis away from the user.
    let device = opened(&format!("{choice},anchor=workbench")).expect("it is there");
    assert_eq!(device.info().name, "Force Dimension stand-in.6");
    assert_eq!(
        (
            device.info().limits.max_force,
            device.info().limits.max_torque
        ),
        (8.0, 0.3)
    );
    lies_where_the_stand_in_is(device, Vector3::y() * -2.5, DOUBLE);

    let modes = [
        (HANGS, "was lost"),
        (NOT_A_NUMBER, "not finite"),
        (TOO_HOT, "was lost"),
        (UNPLUGGED, "was lost"),
        (NOTHING_NEW, "was lost"),
    ];
    goes_wrong(&choice, &inside, &modes);
    assert!(inside.get("closes") > 0);
}

#[test]
fn virtuose_functions_are_called_as_published() {
    let (folder, bare) = documented("virtuose");
    let vendor = stand_in(folder.path(), "stand_in_virtuose.c", "VIRT");
    let inside = Loaded::of(&vendor);
    refused(
        &bare,
        &[
            (
                "library=/no/libVirtuoseAPI.so",
                "cannot be loaded (option library=PATH)",
            ),
            ("force=1e9", "out of range: force"),
            ("colour=red", "there are library, host, force"),
            ("host=", "no value for this option, or out of range: host"),
            (
                &format!("library={}/strict.so", folder.path().display()),
                "it lacks: virtOpen",
            ),
            (
                &format!("library={},host=10.0.0.8", vendor.display()),
                "no Virtuose answers there (option host=ADDRESS): no device found",
            ),
        ],
    );
    let choice = format!(
        "{bare},library={},host=10.0.0.7#53210,force=8,torque=0.3",
        vendor.display()
    );
    not_there_while_unplugged(&choice, &inside);

    // Where the workbench has it: right, away from the user, up; and turned about the axis away from the user.
    let device = opened(&format!("{choice},anchor=workbench")).expect("it is there");
    let info = device.info();
    assert_eq!(info.name, "Haption Virtuose");
    assert_eq!((info.limits.max_force, info.limits.max_torque), (8.0, 0.3));
    lies_where_the_stand_in_is(device, Vector3::y() * -2.5, FLOAT);
    inside.wait("it is closed", &|| inside.get("closes") > 0);

    // The last two: the offset button is pressed, and the power is off.
    let modes = [
        (HANGS, "was lost"),
        (NOT_A_NUMBER, "not finite"),
        (TOO_HOT, "was lost"),
        (UNPLUGGED, "was lost"),
        (NOTHING_NEW, "was lost"),
        (NOT_CALIBRATED, "was lost"),
    ];
    goes_wrong(&choice, &inside, &modes);
}
