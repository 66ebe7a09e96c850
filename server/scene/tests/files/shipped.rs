//! What is shipped loads, and so do the assembly scenes of the data directory.

use taut_scene::{DeviceTrace, HandPreset, SHIPPED_SCENES, Scene, Workbench, check, data_file};

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
        assert!(
            text.contains(
                "run scripts/get-bunny, or name the directory that holds it in TAUT_DATA"
            ),
            "{text}"
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
