//! What is shipped loads, and so do the assembly scenes of the data directory.

use std::path::Path;

use taut_scene::{
    DeviceTrace, HandPreset, SHIPPED_SCENES, SHIPPED_WORKBENCH, Scene, Workbench, check, data_file,
};

use crate::support::assert_says;

/// Tables of a workbench file, with a key that none of them knows. Those of `[device]` hang on its kind: docs/devices.md.
const UNKNOWN: [&str; 21] = [
    "qqqqqq=1",
    "scene_origin.qqqqqq=1",
    "screen.0.qqqqqq=1",
    "node.0.qqqqqq=1",
    "node.0.window.qqqqqq=1",
    "machine.0.qqqqqq=1",
    "viewer.qqqqqq=1",
    "viewer.sway.qqqqqq=1",
    "dynamics.qqqqqq=1",
    "network.qqqqqq=1",
    "frames.qqqqqq=1",
    "monitoring.qqqqqq=1",
    "vrpn.qqqqqq=1",
    "observers.qqqqqq=1",
    "operator.qqqqqq=1",
    "zenoh.qqqqqq=1",
    "wrench_in.qqqqqq=1",
    "log.qqqqqq=1",
    "realtime.qqqqqq=1",
    "safety.qqqqqq=1",
    "show.qqqqqq=1",
];

#[test]
fn the_peg_scene_is_the_papers() {
    let built = Scene::named_or_file("peg-in-a-hole")
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(built.world.body.mesh.triangles().len(), 288);
    assert_eq!(built.world.obstacles[0].mesh.triangles().len(), 280);
    assert_eq!(built.stiffness(), 1000.0);
    let hand = built.hand.unwrap();
    assert!(hand.repeat);
    assert_eq!(hand.preset, HandPreset::Firm);
    assert!((25.0..=30.0).contains(&hand.path.duration()));
    assert_start_and_loop(&hand.path, &built.start);
    // 50 mm deep: the face is at y = 30 mm, the peg 60 mm long.
    let deepest = hand
        .path
        .samples()
        .iter()
        .map(|s| s.pose.translation.y)
        .filter(|y| *y > 0.0)
        .fold(f64::INFINITY, f64::min);
    assert!((0.030 - (deepest - 0.030) - 0.050).abs() < 1e-12);
}

#[test]
fn the_sphere_scene_is_ready_to_run() {
    let built = Scene::named_or_file("sphere-on-plane")
        .unwrap()
        .build()
        .unwrap();
    assert_eq!(built.world.body.mesh.triangles().len(), 1280);
    assert_start_and_loop(&built.hand.as_ref().unwrap().path, &built.start);
}

#[test]
fn the_plate_of_the_moving_scene_comes_up_at_a_tenth_of_a_metre_per_second() {
    let built = Scene::named_or_file("moving-plate")
        .unwrap()
        .build()
        .unwrap();
    assert_start_and_loop(&built.hand.as_ref().unwrap().path, &built.start);
    let [motion] = built.motions.as_slice() else {
        panic!("one obstacle moves")
    };
    assert!(motion.repeat);
    let plate = &built.world.obstacles[motion.obstacle];
    assert_eq!(plate.name, "plate");
    assert_eq!(plate.pose, motion.pose_at(0.0), "it starts on its trace");
    assert_eq!(built.bodies[1 + motion.obstacle].pose, plate.pose);
    assert_eq!(motion.path.samples()[0].pose, plate.pose);
    let height = |t: f64| motion.pose_at(t).translation.z;
    assert!((height(1.3) - height(1.1) - 0.1 * 0.2).abs() < 1e-12);
    // It lifts the body, whose lower face is at 20 mm, by 15 mm.
    assert!((height(2.0) + 0.005 - 0.035).abs() < 1e-12);
    let (end, begin) = (motion.pose_at(8.0 - 1e-9), motion.pose_at(8.0));
    assert!((end.translation.vector - begin.translation.vector).norm() < 1e-12);
}

#[test]
fn the_bunnies_load_or_say_how_to_get_them() {
    let scene = Scene::named_or_file("two-bunnies").unwrap();
    assert_start_and_loop(
        &scene.hand_path().unwrap().unwrap(),
        &scene.god_object().pose,
    );
    if data_file("bunny_27k.ply").is_none() {
        let text = scene.build().unwrap_err().to_string();
        assert_says(
            &text,
            "run scripts/get-bunny, or name the directory that holds it in TAUT_DATA",
        );
        taut_test_kit::left_out("bunny_27k.ply is not in the data directory");
        return;
    }
    let built = scene.build().unwrap();
    assert_eq!(built.world.body.mesh.triangles().len(), 27_000);
    assert!((built.size - 0.15).abs() < 1e-4);
}

fn assert_start_and_loop(path: &DeviceTrace, start: &god_object::Pose) {
    let (first, last) = (path.samples()[0], path.samples()[path.samples().len() - 1]);
    assert_eq!(
        first.pose, last.pose,
        "a path that repeats ends where it begins"
    );
    assert!((first.pose.translation.vector - start.translation.vector).norm() < 1e-12);
    assert!(first.pose.rotation.angle_to(&start.rotation) < 1e-7);
}

#[test]
fn every_shipped_scene_has_its_own_name() {
    for shipped in SHIPPED_SCENES {
        assert_eq!(
            Scene::named_or_file(shipped.name).unwrap().name(),
            shipped.name
        );
    }
}

#[test]
fn the_shipped_workbench_is_l_shaped() {
    let workbench = Workbench::shipped().unwrap();
    let [front, table] = workbench.screens.as_slice() else {
        panic!("two screens")
    };
    assert_eq!(
        front.lower_left, table.upper_left,
        "they meet at the common edge"
    );
    assert_eq!(workbench.nodes.len(), 2);
    assert_eq!(workbench.load_scene().unwrap().name(), "peg-in-a-hole");
}

/// What stands under each heading of the shipped workbench, behind the sign of a comment too.
fn tables() -> Vec<(String, String)> {
    let mut tables = vec![(String::new(), String::new())];
    for line in SHIPPED_WORKBENCH.lines() {
        let line = line.trim_start_matches(['#', ' ']);
        if let Some(heading) = line.strip_prefix('[') {
            let name = heading.trim_start_matches('[').split(']').next();
            tables.push((name.unwrap_or_default().to_owned(), String::new()));
        } else if let Some((_, text)) = tables.last_mut() {
            text.push_str(line);
            text.push('\n');
        }
    }
    tables
}

/// The keys that the parser knows beside an unknown one.
fn known_beside(unknown: &str) -> Vec<String> {
    let text = format!("{SHIPPED_WORKBENCH}\n[dynamics]\n[[machine]]\n");
    let error = Workbench::parse_with_overrides("w.toml", &text, Path::new(""), &[unknown])
        .expect_err("an unknown key");
    let mut texts = error.problems().iter().map(|p| p.text.as_str());
    let listed = texts.find_map(|text| text.split_once("; known keys: "));
    let (_, keys) = listed.unwrap_or_else(|| panic!("{unknown}: {error}"));
    keys.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_shipped_workbench_has_every_key() {
    let tables = tables();
    for unknown in UNKNOWN {
        let heading = unknown.split_once('.').map_or("", |(heading, _)| heading);
        for key in known_beside(unknown) {
            let written = format!("{key} = ");
            let is_there = tables.iter().any(|(name, text)| {
                let is_table = heading.is_empty() && *name == key;
                is_table || name == heading && text.contains(&written)
            });
            assert!(is_there, "nobody reads of `{key}` of {unknown}");
        }
    }
}

#[test]
fn the_assembly_scenes_and_traces_of_the_data_directory_load() {
    let Some(first) = data_file("assembly/gear_on_pin.toml") else {
        taut_test_kit::left_out("the data directory has no assembly scenes");
        return;
    };
    let mut scenes = 0;
    for entry in std::fs::read_dir(first.parent().unwrap()).unwrap() {
        let path = entry.unwrap().path();
        match path.extension().and_then(|e| e.to_str()) {
            Some("toml") => {
                let built = Scene::load(&path).and_then(|scene| scene.build()).unwrap();
                assert_eq!(built.settings.k_h, 2000.0);
                scenes += 1;
            }
            Some("csv") => assert!(DeviceTrace::load(&path).unwrap().samples().len() > 1000),
            Some("ply") => {
                let report = check(&[&path]).remove(0);
                assert!(report.is_good(), "{report}");
            }
            _ => {}
        }
    }
    assert_eq!(scenes, 5);
}
