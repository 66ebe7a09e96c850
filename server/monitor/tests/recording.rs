//! A recording, read back with rerun's own reader, holds what was shown.

use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use taut_monitor::{
    BodyRole, InspectError, LogLevel, Monitor, MonitorBody, MonitorError, MonitorOptions,
    MonitorSample, MonitorScene, MonitorScreen, MonitorSender, MonitorStats, Pose, RrdSummary,
    ShownContact, inspect,
};

/// Samples are one picture period and a bit apart, so that several pictures are drawn.
const SAMPLES: u64 = 60;
const SAMPLE_PERIOD_NS: u64 = 20_000_000;

fn tetrahedron(name: &str, role: BodyRole) -> MonitorBody {
    MonitorBody {
        name: name.into(),
        vertices: vec![
            [0.0, 0.0, 0.0],
            [0.1, 0.0, 0.0],
            [0.0, 0.1, 0.0],
            [0.0, 0.0, 0.1],
        ],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        colour: None,
        role,
        pose: Pose::identity(),
    }
}

fn scene() -> MonitorScene {
    let corners = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
    ];
    MonitorScene {
        bodies: vec![
            tetrahedron("tool", BodyRole::GodObject),
            tetrahedron("left/hand wall, 100%", BodyRole::Obstacle),
        ],
        screens: vec![MonitorScreen {
            name: "front".into(),
            corners: corners.map(Point3::from),
        }],
        head: Some(Isometry3::translation(0.0, -0.5, 0.5)),
        ..MonitorScene::new("two tetrahedra")
    }
}

fn sample(index: u64) -> MonitorSample {
    let mut sample = MonitorSample::at((index + 1) * SAMPLE_PERIOD_NS);
    sample.god_object_pose = Isometry3::translation(0.001 * index as f64, 0.0, 0.2);
    sample.device_pose = Isometry3::translation(0.001 * index as f64, 0.0, 0.19);
    sample.wrench = Vector6::new(0.0, 0.0, 3.0, 0.0, 0.1, 0.0);
    sample.contacts.push(ShownContact {
        point: Point3::new(0.0, 0.0, 0.1),
        normal: Vector3::z(),
    });
    sample.packets_sent = 10 * index;
    sample
}

fn recording_only(path: &std::path::Path) -> MonitorOptions {
    MonitorOptions {
        record: Some(path.to_owned()),
        serve: false,
        ..MonitorOptions::default()
    }
}

/// What is in a recording of this scene of what `show` tells the monitor, and what the monitor says of it.
fn recorded(
    scene: MonitorScene,
    show: impl FnOnce(&Monitor, &mut MonitorSender),
) -> (RrdSummary, MonitorStats) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.rrd");
    let (monitor, mut sender) = Monitor::start(&recording_only(&path), scene).unwrap();
    show(&monitor, &mut sender);
    let stats = monitor.stop().unwrap();
    (inspect(&path).unwrap(), stats)
}

/// Offers these one after the other, so that several pictures are drawn.
fn offer(sender: &mut MonitorSender, samples: impl Iterator<Item = MonitorSample>) {
    for sample in samples {
        assert!(sender.offer(sample));
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn a_recorded_stream_is_read_back_with_its_entities_and_times() {
    let (summary, stats) = recorded(scene(), |monitor, sender| {
        assert_eq!(monitor.address(), None);
        offer(sender, (0..SAMPLES).map(sample));
        sender.log(SAMPLE_PERIOD_NS, LogLevel::Warn, "said by a loop");
        monitor.log(LogLevel::Info, "said by the server");
    });
    assert_eq!(stats.samples_shown, SAMPLES);
    assert_eq!(stats.samples_dropped, 0);

    let entities = "/log /plots/constraint_age /plots/contacts /plots/force /plots/gap /plots/loops /plots/network
        /plots/torque /world /world/contacts /world/device /world/device/tool /world/force
        /world/god_object /world/god_object/tool /world/head /world/screens/front";
    for entity in entities.split_whitespace() {
        assert!(
            summary.rows.contains_key(entity),
            "no {entity} in {:?}",
            summary.rows
        );
    }
    let obstacles = summary
        .rows
        .keys()
        .filter(|path| path.starts_with("/world/obstacles/"));
    assert_eq!(obstacles.count(), 1, "{:?}", summary.rows);

    // Every window of five samples is a point in the plots, plus one row for the lines' names and colours; the first window has four.
    assert_eq!(summary.rows["/plots/force"], SAMPLES / 5 + 1 + 1);
    // The scene's two lines, the loop's, the server's.
    assert_eq!(summary.rows["/log"], 4);
    assert!(summary.rows["/world/god_object"] > 1);
    assert!(summary.timelines.iter().eq(["session_time"]));
    let last = (SAMPLES * SAMPLE_PERIOD_NS) as i64;
    assert_eq!(summary.time_ns, Some((0, last)));
    assert_eq!(summary.blueprints, 1);
}

#[test]
fn a_peak_of_a_millisecond_between_two_samples_is_in_the_recording() {
    let with_peak = |index| {
        let mut sample = sample(index);
        for tick in 0..20 {
            let is_peak = (index, tick) == (31, 13);
            let force = if is_peak { 17.5 } else { 3.0 };
            let wrench = Vector6::new(0.0, 0.0, force, 0.0, if is_peak { -0.4 } else { 0.1 }, 0.0);
            sample.between.add(&wrench, 900.0);
        }
        sample
    };
    let show = |_: &Monitor, sender: &mut MonitorSender| {
        offer(sender, (0..SAMPLES).map(with_peak));
    };
    let (summary, stats) = recorded(scene(), show);
    assert_eq!(stats.samples_dropped, 0);
    assert_eq!(summary.numbers["/plots/force"], (0.0, 17.5));
    assert_eq!(summary.numbers["/plots/torque"], (-0.4, 0.4));
    assert_eq!(summary.numbers["/plots/constraint_age"], (0.0, 900.0));
}

#[test]
fn an_obstacle_that_moves_is_recorded_with_every_picture_and_one_at_rest_once() {
    let mut scene = scene();
    scene.bodies[1].name = "wall".into();
    scene
        .bodies
        .push(tetrahedron("plate", BodyRole::MovingObstacle));
    let moved = |index| {
        let mut sample = sample(index);
        let up = Isometry3::translation(0.0, 0.0, 1e-3 * index as f64);
        // The wall is at rest, and 7 is none of the scene's.
        for obstacle in [1, 0, 7] {
            assert!(sample.moving.push(obstacle, up));
        }
        sample
    };
    let show = |_: &Monitor, sender: &mut MonitorSender| {
        offer(sender, (0..SAMPLES).map(moved));
    };
    let rows = recorded(scene, show).0.rows;
    let pictures = rows["/world/god_object"];
    assert!(pictures > 2, "{rows:?}");
    // The mesh is one row more.
    assert_eq!(rows["/world/obstacles/plate"], pictures + 1);
    assert_eq!(rows["/world/obstacles/wall"], 2);
}

#[test]
fn dropping_the_monitor_completes_the_recording_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.rrd");
    let (monitor, mut sender) = Monitor::start(&recording_only(&path), scene()).unwrap();
    sender.offer(sample(0));
    drop(monitor);
    assert_eq!(inspect(&path).unwrap().rows["/plots/force"], 2);
    assert!(
        sender.offer(sample(1)),
        "offering after the end does no harm"
    );
}

#[test]
fn a_sample_that_is_not_finite_leaves_the_picture_and_is_counted() {
    let (summary, stats) = recorded(scene(), |_, sender| {
        let mut broken = sample(0);
        broken.god_object_pose.translation.vector.x = f64::NAN;
        sender.offer(broken);
    });
    assert_eq!(stats.samples_not_finite, 1);
    assert_eq!(summary.rows["/world/god_object"], 1, "only the first pose");
    assert_eq!(
        summary.rows["/log"], 3,
        "the scene's two lines and one about the sample"
    );
}

#[test]
fn a_recording_that_cannot_be_written_is_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing").join("session.rrd");
    let error = Monitor::start(&recording_only(&path), scene()).unwrap_err();
    assert!(matches!(error, MonitorError::Record { .. }));
    assert!(error.to_string().contains("session.rrd"), "{error}");
}

#[test]
fn a_recording_that_is_there_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.rrd");
    std::fs::write(&path, "precious").unwrap();
    let error = Monitor::start(&recording_only(&path), scene()).unwrap_err();
    assert!(matches!(error, MonitorError::Record { .. }));
    assert!(error.to_string().contains("session.rrd"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), b"precious");
}

#[test]
fn a_full_disk_is_an_error_that_names_the_file() {
    let full = std::path::Path::new("/dev/full"); // Linux: every write fails as on a full disk.
    if !full.exists() {
        taut_test_kit::left_out("no /dev/full here");
        return;
    }
    let outcome =
        Monitor::start(&recording_only(full), scene()).and_then(|(monitor, mut sender)| {
            sender.offer(sample(0));
            monitor.stop()
        });
    let error = outcome.unwrap_err();
    assert!(matches!(error, MonitorError::Record { .. }), "{error}");
    assert!(error.to_string().contains("/dev/full"), "{error}");
}

#[test]
fn a_broken_mesh_is_an_error_that_names_the_body() {
    let mut scene = scene();
    scene.bodies[1].triangles[0][2] = 99;
    let options = MonitorOptions {
        serve: false,
        ..MonitorOptions::default()
    };
    let error = Monitor::start(&options, scene).unwrap_err();
    assert!(error.to_string().contains("left/hand wall"), "{error}");
}

#[test]
fn a_file_that_is_no_recording_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("text.rrd");
    std::fs::write(
        &path,
        "this is not a recording, but it is long enough to hold a header",
    )
    .unwrap();
    let error = inspect(&path).unwrap_err();
    assert!(matches!(error, InspectError::Decode { .. }), "{error}");
    assert!(error.to_string().contains("text.rrd"), "{error}");
    let missing = inspect(&folder.path().join("none.rrd")).unwrap_err();
    assert!(matches!(missing, InspectError::Open { .. }), "{missing}");
}
