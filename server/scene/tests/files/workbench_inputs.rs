//! Input devices and trackers in a workbench file.

use std::path::Path;

use nalgebra::Vector3;
use taut_kinds::{Chosen, KINDS, KindId, Takes};
use taut_scene::{Device, HeadTracking, NeededFile, SHIPPED_WORKBENCH, Workbench};

use crate::support::assert_says;

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

fn driver(workbench: &Workbench) -> &Chosen {
    match &workbench.device {
        Device::Driver(chosen) => chosen,
        other => panic!("{other:?}"),
    }
}

/// A value that a key takes, as a file has it.
fn example(takes: &Takes) -> String {
    match takes {
        Takes::Number(low, high) => format!("{:?}", (low + high) / 2.0),
        Takes::Whole(low, _) => low.to_string(),
        Takes::OneOf(words) => format!("{:?}", words[0]),
        Takes::YesOrNo => "true".to_owned(),
        Takes::Axes | Takes::RightHandedAxes => "\"x -z y\"".to_owned(),
        Takes::Text(_) | Takes::NameOrFile(_) | Takes::File => "\"wb\"".to_owned(),
        Takes::Service => "\"lab\"".to_owned(),
        Takes::Tracker => "\"T@lab\"".to_owned(),
        Takes::Pose => "{ position = [0.0, 0.0, 0.0] }".to_owned(),
    }
}

#[test]
fn every_key_of_every_kind_is_read_and_none_of_another() {
    for kind in &KINDS {
        let mut keys = format!("kind = \"{}\"\n", kind.name);
        for key in kind.every_key() {
            keys += &format!("{} = {}\n", key.name, example(&key.takes));
        }
        let workbench = with_device(&keys).unwrap_or_else(|error| panic!("{keys}: {error}"));
        if let Device::Driver(chosen) = &workbench.device {
            assert_eq!(chosen.kind.id, kind.id);
        }
        for other in KINDS.iter().flat_map(|kind| kind.every_key()) {
            if !kind.has(other.name) {
                let wrong = format!("{keys}{} = {}\n", other.name, example(&other.takes));
                let error = with_device(&wrong).expect_err(&wrong);
                let named = format!("unknown key `{}` in [device]", other.name);
                assert!(error.contains(&named), "{wrong}: {error}");
            }
        }
    }
}

#[test]
fn a_force_device_is_read_and_its_files_are_relative_to_the_workbench() {
    let workbench = with_device("kind = \"haply\"\naddress = \"lab\"\ngrip = false\nscale = 2.0")
        .expect("valid");
    let chosen = driver(&workbench);
    let address = chosen.service("address").expect("given");
    assert_eq!(address.to_string(), "lab:10001");
    assert_eq!(
        (chosen.yes("grip"), chosen.number("scale")),
        (Some(false), Some(2.0))
    );
    let begin = SHIPPED_WORKBENCH.find("[device]").expect("a device");
    let end = SHIPPED_WORKBENCH.find("[network]").expect("a network");
    let text = format!(
        "{}[device]\nkind = \"python\"\nfile = \"mine.py\"\noptions = \"side=left,gain=2\"\n{}",
        &SHIPPED_WORKBENCH[..begin],
        &SHIPPED_WORKBENCH[end..]
    );
    let workbench = Workbench::parse("w.toml", &text, Path::new("/etc/taut")).expect("valid");
    let chosen = driver(&workbench);
    assert_eq!(chosen.text("options"), Some("side=left,gain=2"));
    let files = workbench.needed_files().expect("its scene is shipped");
    assert!(files.contains(&NeededFile::Named("/etc/taut/mine.py".into())));
    let ported = with_device("kind = \"polhem\"\nport = \"/dev/ttyACM0\"").expect("valid");
    assert_eq!(ported.needed_files().map(|files| files.len()), Ok(0));
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
    let chosen = driver(&workbench);
    assert_eq!(chosen.kind.id, KindId::Vrpn);
    let address = chosen.tracker("server").expect("given");
    assert_eq!(address.to_string(), "Hand@lab-pc:3883");
    assert_eq!(chosen.whole("sensor"), Some(2));
    let words = [chosen.text("mode"), chosen.text("anchor")];
    assert_eq!(words, [Some("udp"), Some("workbench")]);
    let axes = chosen.axes("axes").expect("given");
    assert_eq!(axes.to_string(), "x -z y");
    let numbers = [chosen.number("scale"), chosen.number("max_age")];
    assert_eq!(numbers, [Some(0.001), Some(0.25)]);
    let origin = chosen.pose("origin").expect("given");
    assert_eq!(origin.translation.vector, Vector3::new(0.0, -0.5, 0.0));
    assert_eq!(chosen.pose("mount"), None);
}

#[test]
fn the_space_mouse_and_the_mouse_are_read() {
    let workbench =
        with_device("kind = \"space-mouse\"\nmode = \"position\"\nreach = 0.3").expect("valid");
    let chosen = driver(&workbench);
    assert_eq!(chosen.text("mode"), Some("position"));
    assert_eq!(
        (chosen.number("reach"), chosen.number("speed")),
        (Some(0.3), None)
    );
    let workbench = with_device("kind = \"mouse\"").expect("valid");
    assert_eq!(workbench.device, Device::Remote);
}

#[test]
fn a_head_tracker_takes_the_place_of_the_sway() {
    let sway = "sway = { amplitude = 0.05, period = 8.0 }";
    let tracker = "tracker = { server = \"Head@host\", axes = \"y x z\" }";
    let workbench = with_viewer(sway, tracker).expect("valid");
    let HeadTracking::Vrpn(chosen) = &workbench.viewer.tracking else {
        panic!("{:?}", workbench.viewer.tracking);
    };
    let address = chosen.tracker("server").expect("given");
    assert_eq!(address.device, "Head");
    let anchored = with_viewer(sway, &tracker.replace("axes", "anchor = \"start\", axes"));
    let error = anchored.expect_err("a head is where it is");
    assert_says(&error, "unknown key `anchor`");
    let error = with_viewer(sway, &format!("{sway}\n{tracker}")).expect_err("both");
    assert_says(&error, "exclude each other");
}

#[test]
fn faults_name_the_key_and_the_way_out() {
    for (keys, part) in [
        ("kind = \"vrpn\"", "`server` is missing in [device]"),
        ("kind = \"vrpn\"\nserver = \"Tracker0\"", "DEVICE@HOST:PORT"),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\naxes = \"x y\"",
            "such as `x -z y`",
        ),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\nsensors = 1",
            "did you mean `sensor`?",
        ),
        (
            "kind = \"vrpn\"\nserver = \"T@h\"\nscale = 0.0",
            "between 0.000001 and 1000000",
        ),
        (
            "kind = \"space-mouse\"\ndead_zone = 1.0",
            "between 0 and 0.9",
        ),
        (
            "kind = \"haply\"\naddress = \"a b\"",
            "must be HOST or HOST:PORT",
        ),
        ("kind = \"spidar\"", "add port = \"/dev/ttyUSB0\""),
        (
            "kind = \"plugin\"\nscale = 0",
            "`library` is missing in [device]",
        ),
        (
            "kind = \"polhem\"\nport = \"/dev/x\"\nscale = nan",
            "between 0.01 and 100",
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
    assert_says(&error, "excludes");
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
        assert_says(&error, says);
    }
}

#[test]
fn a_house_that_is_too_small_for_the_workbench_is_a_fault() {
    let error = with_admission("max_clients = 4").expect_err("two nodes and three others");
    assert_says(&error, "write 5 or more");
    assert!(with_admission("max_clients = 5").is_ok());
}
