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
