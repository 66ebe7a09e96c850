//! Input devices and trackers in a workbench file.

use std::path::Path;

use nalgebra::Vector3;
use taut_scene::{Device, HeadTracking, SHIPPED_WORKBENCH, Workbench};

fn with_device(keys: &str) -> Result<Workbench, String> {
    let begin = SHIPPED_WORKBENCH.find("[device]").expect("a device");
    let end = SHIPPED_WORKBENCH.find("[network]").expect("a network");
    let text = format!(
        "{}[device]\n{keys}\n{}",
        &SHIPPED_WORKBENCH[..begin],
        &SHIPPED_WORKBENCH[end..]
    );
    Workbench::parse("w.toml", &text, Path::new("")).map_err(|error| error.to_string())
}

fn with_viewer(from: &str, to: &str) -> Result<Workbench, String> {
    assert!(SHIPPED_WORKBENCH.contains(from), "{from}");
    let text = SHIPPED_WORKBENCH.replacen(from, to, 1);
    Workbench::parse("w.toml", &text, Path::new("")).map_err(|error| error.to_string())
}

#[test]
fn a_vrpn_tracker_is_read_with_its_axes_and_unit() {
    let workbench = with_device(
        "kind = \"vrpn\"\nserver = \"Hand@lab-pc\"\nsensor = 2\nmode = \"udp\"\naxes = \"x -z y\"\nscale = 0.001\nanchor = \"workbench\"\nmax_age = 0.25\norigin = { position = [0.0, -0.5, 0.0] }",
    )
    .expect("valid");
    let Device::Vrpn {
        sensor,
        on_workbench,
    } = &workbench.device
    else {
        panic!("{:?}", workbench.device);
    };
    assert_eq!(sensor.address.to_string(), "Hand@lab-pc:3883");
    assert_eq!((sensor.sensor, sensor.udp, *on_workbench), (2, true, true));
    assert_eq!(sensor.mapping.axes.to_string(), "x -z y");
    assert_eq!((sensor.mapping.scale, sensor.max_age), (0.001, 0.25));
    let origin = sensor.mapping.origin.translation.vector;
    assert_eq!(origin, Vector3::new(0.0, -0.5, 0.0));
}

#[test]
fn the_space_mouse_and_the_mouse_are_read() {
    let workbench =
        with_device("kind = \"space-mouse\"\nmode = \"position\"\nreach = 0.3").expect("valid");
    let Device::SpaceMouse {
        position,
        reach,
        speed,
        ..
    } = workbench.device
    else {
        panic!();
    };
    assert_eq!((position, reach, speed), (true, Some(0.3), None));
    let workbench = with_device("kind = \"mouse\"").expect("valid");
    assert_eq!(workbench.device, Device::Remote);
}

#[test]
fn a_head_tracker_takes_the_place_of_the_sway() {
    let sway = "sway = { amplitude = 0.05, period = 8.0 }";
    let tracker = "tracker = { server = \"Head@host\", axes = \"y x z\" }";
    let workbench = with_viewer(sway, tracker).expect("valid");
    let HeadTracking::Vrpn(sensor) = &workbench.viewer.tracking else {
        panic!("{:?}", workbench.viewer.tracking);
    };
    assert_eq!(sensor.address.device, "Head");
    let error = with_viewer(sway, &format!("{sway}\n{tracker}")).expect_err("both");
    assert!(error.contains("exclude each other"), "{error}");
}

#[test]
fn faults_name_the_key_and_the_way_out() {
    for (keys, part) in [
        ("kind = \"vrpn\"", "`server` is missing in [device]"),
        ("kind = \"vrpn\"\nserver = \"Tracker0\"", "DEVICE@HOST:PORT"),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\naxes = \"x y\"",
            "such as \"x -z y\"",
        ),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\nsensors = 1",
            "did you mean `sensor`?",
        ),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\nscale = 0.0",
            "greater than zero",
        ),
        (
            "kind = \"space-mouse\"\ndead_zone = 1.0",
            "between 0 and 0.9",
        ),
        ("kind = \"spacemouse\"", "did you mean `space-mouse`?"),
        (
            "kind = \"space-mouse\"\nhand = \"firm\"",
            "unknown key `hand`",
        ),
    ] {
        let error = with_device(keys).expect_err(keys);
        assert!(error.contains(part), "{keys}: {error}");
    }
}

#[test]
fn a_simulated_device_may_be_made_of_strings() {
    let strings = |keys: &str| {
        let text = format!("kind = \"simulated\"\n{keys}");
        match with_device(&text).expect("valid").device {
            Device::Simulated { strings, .. } => strings,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(strings(""), None);
    assert_eq!(strings("strings = \"wb\""), Some("wb".to_owned()));
    assert_eq!(
        strings("strings = \"mine.toml\""),
        Some("mine.toml".to_owned())
    );
    let error = with_device("kind = \"trace\"\npath = \"a.csv\"\nstrings = \"wb\"");
    assert!(error.is_err_and(|text| text.contains("strings")));
}

#[test]
fn a_tracker_on_the_network_takes_the_place_of_the_sway() {
    let sway = "sway = { amplitude = 0.05, period = 8.0 }";
    let workbench = with_viewer(sway, "remote_tracker = true").expect("valid");
    assert_eq!(workbench.viewer.tracking, HeadTracking::Remote);
    let workbench = with_viewer(sway, &format!("{sway}\nremote_tracker = false")).expect("valid");
    assert!(matches!(
        workbench.viewer.tracking,
        HeadTracking::Sway { .. }
    ));
    let error = with_viewer(sway, &format!("{sway}\nremote_tracker = true")).expect_err("both");
    assert!(error.contains("excludes"), "{error}");
}

fn with_admission(keys: &str) -> Result<Workbench, String> {
    // The first of the file is that of [network].
    let text = SHIPPED_WORKBENCH.replacen("max_clients = 16", keys, 1);
    assert_ne!(text, SHIPPED_WORKBENCH);
    Workbench::parse("w.toml", &text, Path::new("")).map_err(|error| error.to_string())
}

#[test]
fn roles_and_revoked_credentials_are_read_and_faults_have_their_line() {
    let everybody = &with_admission("").expect("valid").network.admission;
    assert_eq!(everybody.roles.len(), 5);
    assert!(everybody.revoked.is_empty());
    let some = with_admission("roles = [\"render\"]\nrevoked = [\"front#2\", \"observer:*\"]")
        .expect("valid")
        .network
        .admission;
    assert_eq!(some.roles.len(), 1);
    let texts: Vec<String> = some.revoked.iter().map(ToString::to_string).collect();
    assert_eq!(texts, ["front#2", "observer:*"]);
    for (keys, part) in [
        ("roles = []", "lets nobody in"),
        ("roles = [\"admin\"]", "no role \"admin\""),
        ("roles = \"render\"", "an array"),
        ("revoked = [\"*\"]", "shut everybody out"),
        ("revoked = [\"front#0\"]", "names no issue"),
        ("revoke = [\"front\"]", "did you mean `revoked`?"),
    ] {
        let error = with_admission(keys).expect_err(keys);
        assert!(error.contains(part), "{keys}: {error}");
    }
}

#[test]
fn a_second_cluster_key_needs_its_time_and_both_are_read() {
    let with = |keys: &str| with_admission(&format!("max_clients = 16\n{keys}"));
    assert_eq!(with("").expect("valid").network.also_key, None);
    let workbench = with("also_key = \"old.key\"\nalso_key_until = \"2030-01-31T12:00:00Z\"");
    let also = workbench.expect("valid").network.also_key.expect("read");
    assert!(also.file.ends_with("old.key"));
    let since = also
        .until
        .duration_since(std::time::UNIX_EPOCH)
        .expect("after 1970");
    assert_eq!(since.as_secs(), 1_896_091_200);
    for (keys, says) in [
        ("also_key = \"old.key\"", "until when"),
        (
            "also_key_until = \"2030-01-31T12:00:00Z\"",
            "without `also_key`",
        ),
        (
            "also_key = \"old.key\"\nalso_key_until = \"tomorrow\"",
            "no time",
        ),
    ] {
        let error = with(keys).expect_err(keys);
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn a_house_that_is_too_small_for_the_workbench_is_a_fault() {
    let error = with_admission("max_clients = 4").expect_err("two nodes and three others");
    assert!(error.contains("write 5 or more"), "{error}");
    assert!(with_admission("max_clients = 5").is_ok());
}
