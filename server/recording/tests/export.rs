//! What `export_mcap` writes.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use god_object::nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use god_object::{Pose, Vector6};
use mcap::Summary;
use taut_recording::{
    ForceRecord, HapticsRecord, MovingObstacle, Recorder, Recording, RecordingError, SceneFrames,
    export_mcap,
};

use crate::reading::{Header, Joy, PoseStamped, SixStamped, TfMessage, Transform, export};
use crate::round_trip::{manifest, pose, update};

fn tick(sequence: u32, buttons: u16, faulty: bool) -> HapticsRecord {
    HapticsRecord {
        sequence: u64::from(sequence),
        time: Duration::from_nanos(1_000_000 * u64::from(sequence)),
        tick: Duration::from_nanos(1_000_250 * u64::from(sequence)),
        pose: pose(sequence),
        velocity: Vector6::repeat(f64::from(sequence) / 7.0),
        buttons,
        faulty,
        wrench: Vector6::repeat(f64::from(sequence) / 3.0),
    }
}

fn force(sequence: u32) -> ForceRecord {
    ForceRecord {
        sequence: u64::from(sequence),
        time: Duration::from_nanos(1_000_500 * u64::from(sequence)),
        device_sequence: u64::from(sequence),
        device_pose: pose(sequence),
        constraint_sequence: 1,
        wrench: Vector6::repeat(f64::from(sequence) / 9.0),
    }
}

/// Five ticks of which the third is faulty and the fourth has another button, six updates, five forces.
fn record(directory: &Path) {
    let (mut taps, recorder) = Recorder::start(directory, manifest(), "").expect("cannot record");
    for sequence in 1..=6 {
        taps.updates.push(update(sequence));
    }
    for sequence in 1..=5 {
        taps.haptics
            .push(tick(sequence, u16::from(sequence >= 4), sequence == 3));
        taps.forces.push(force(sequence));
    }
    assert!(recorder.finish().failure.is_none());
}

/// One obstacle that moves, the second of the scene.
fn scene() -> SceneFrames {
    SceneFrames {
        reference_point: Point3::new(0.0, 0.0, 0.5),
        obstacles: vec![MovingObstacle {
            index: 1,
            name: "upper plate".to_owned(),
            pose_at: Box::new(|elapsed| {
                Pose::from_parts(
                    Translation3::new(elapsed, 0.0, 0.0),
                    UnitQuaternion::identity(),
                )
            }),
        }],
    }
}

fn numbers(pose: &Pose) -> [u64; 7] {
    let (at, turn) = (&pose.translation, &pose.rotation);
    [at.x, at.y, at.z, turn.i, turn.j, turn.k, turn.w].map(f64::to_bits)
}

fn recorded() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("no temporary directory");
    record(directory.path());
    directory
}

fn changed(directory: &Path, file: &str, change: impl FnOnce(String) -> Vec<u8>) {
    let path = directory.join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        panic!("{file} is not there");
    };
    assert!(std::fs::write(path, change(text)).is_ok());
}

#[test]
fn every_record_is_there_bit_by_bit_at_its_session_time() {
    let (directory, scene) = (recorded(), scene());
    let file = export(directory.path(), Ok(&scene));
    let report = &file.report;
    assert_eq!((report.ticks, report.updates, report.forces), (5, 6, 5));
    assert_eq!(file.left_out(), "");
    assert!(file.times.is_sorted(), "{:?}", file.times);

    let poses = file.read::<PoseStamped>("/device/pose");
    let good = [1, 2, 4, 5]; // the third is faulty: where the device was is not known
    assert_eq!(poses.len(), good.len());
    for ((time, PoseStamped(header, read)), sequence) in poses.into_iter().zip(good) {
        assert_eq!(read.map(f64::to_bits), numbers(&pose(sequence)));
        // Logged at the tick, stamped when the device was there.
        assert_eq!(time, 1_000_250 * u64::from(sequence));
        let stamp = 1_000_000 * u64::from(sequence);
        assert_eq!((header.sec, u64::from(header.nanosec)), (0, stamp));
        assert_eq!(header.frame, "world");
    }
    let twists = file.read::<SixStamped>("/device/twist");
    assert_eq!(twists.len(), good.len());
    assert_eq!(twists[3].1.1, [5.0 / 7.0; 6]);
    let wrenches = file.read::<SixStamped>("/hand/wrench");
    assert_eq!(wrenches.len(), 5);
    assert_eq!((wrenches[2].0, wrenches[2].1.1), (3_000_750, [1.0; 6]));
    assert_eq!(wrenches[2].1.0.frame, "reference_point");
    let answers = file.read::<SixStamped>("/coupling/wrench");
    assert_eq!(answers.len(), 5);
    assert_eq!((answers[4].0, answers[4].1.1), (5_002_500, [5.0 / 9.0; 6]));

    for (time, PoseStamped(_, read)) in file.read("/god_object/pose") {
        let sequence = (time / 1_000_001) as u32;
        assert_eq!(read.map(f64::to_bits), numbers(&pose(sequence + 1)));
    }
    assert_eq!(file.topics["/god_object/pose"].len(), 6);
}

#[test]
fn a_sample_that_is_read_again_is_told_once_its_force_at_each_tick() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let (mut taps, recorder) =
        Recorder::start(directory.path(), manifest(), "").expect("cannot record");
    // Behind a network: two ticks for each sample of the device.
    for number in 1..=6_u32 {
        taps.haptics.push(HapticsRecord {
            sequence: u64::from(number),
            tick: Duration::from_nanos(1_000_250 * u64::from(number)),
            ..tick(number.div_ceil(2), u16::from(number >= 4), false)
        });
    }
    assert!(recorder.finish().failure.is_none());
    let scene = scene();
    let file = export(directory.path(), Ok(&scene));
    assert_eq!((file.report.ticks, file.left_out()), (6, String::new()));
    assert_eq!(file.topics["/hand/wrench"].len(), 6);
    let stamps = |headers: Vec<Header>| -> Vec<u32> {
        let stamps = headers.iter().map(|header| header.nanosec / 1_000_000);
        stamps.collect()
    };
    let poses = file.read::<PoseStamped>("/device/pose");
    let headers = poses.into_iter().map(|(_, PoseStamped(header, _))| header);
    assert_eq!(stamps(headers.collect()), [1, 2, 3]);
    let twists = file.read::<SixStamped>("/device/twist");
    let headers = twists.into_iter().map(|(_, SixStamped(header, _))| header);
    assert_eq!(stamps(headers.collect()), [1, 2, 3]);
    let messages = file.read::<TfMessage>("/tf").into_iter();
    let transforms = messages.flat_map(|(_, TfMessage(transforms))| transforms);
    let devices = transforms.filter(|Transform(_, child, _)| child == "device");
    let headers = devices.map(|Transform(header, _, _)| header);
    assert_eq!(stamps(headers.collect()), [1, 2, 3]);
    // A button that goes down in between is told when it does.
    let presses = file.read::<Joy>("/device/buttons");
    let times: Vec<u64> = presses.iter().map(|(time, _)| *time).collect();
    assert_eq!(times, [1_000_250, 4_001_000]);
}

#[test]
fn buttons_are_told_when_they_change() {
    let (directory, scene) = (recorded(), scene());
    let presses = export(directory.path(), Ok(&scene)).read::<Joy>("/device/buttons");
    let seen: Vec<_> = presses
        .iter()
        .map(|(time, Joy(header, axes, buttons))| {
            assert_eq!(header.frame, "device");
            (*time, axes.len(), buttons.len(), buttons[0])
        })
        .collect();
    assert_eq!(seen, [(1_000_250, 0, 16, 0), (4_001_000, 0, 16, 1)]);
}

#[test]
fn transforms_place_the_bodies_and_the_reference_point_in_the_world() {
    let (directory, scene) = (recorded(), scene());
    let file = export(directory.path(), Ok(&scene));
    let mut newest = BTreeMap::new();
    for (_, TfMessage(transforms)) in file.read("/tf") {
        for Transform(header, child, numbers) in transforms {
            assert_eq!(header.frame, "world");
            newest.insert(child, numbers);
        }
    }
    let names: Vec<&str> = newest.keys().map(String::as_str).collect();
    let moving = "obstacle_1_upper_plate";
    assert_eq!(names, ["device", "god_object", moving, "reference_point"]);
    assert_eq!(newest["device"].map(f64::to_bits), numbers(&pose(5)));
    // Seven nanoseconds on its trace.
    assert_eq!(newest[moving], [7e-9, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    let plates = file.read::<PoseStamped>(&format!("/{moving}/pose"));
    assert_eq!((plates.len(), plates[5].1.1[0]), (6, 7e-9));
    let point = newest["reference_point"];
    let expected = (pose(5) * Point3::new(0.0, 0.0, 0.5)).coords;
    assert!((Vector3::new(point[0], point[1], point[2]) - expected).norm() < 1e-15);
    assert_eq!(point[3..], [0.0, 0.0, 0.0, 1.0], "the axes of the world");
}

#[test]
fn the_file_says_what_it_is() {
    let (directory, scene) = (recorded(), scene());
    let file = export(directory.path(), Ok(&scene));
    let Ok(Some(summary)) = Summary::read(&file.bytes) else {
        panic!("no summary");
    };
    assert_eq!(
        summary.stats.map(|stats| stats.message_count),
        Some(file.report.messages)
    );
    for schema in summary.schemas.values() {
        assert_eq!(schema.encoding, "ros2msg");
        assert!(schema.name.contains("/msg/"), "{}", schema.name);
        assert!(!schema.data.is_empty());
    }
    // As the profile of ROS 2 in MCAP's registry has it: required, a list in YAML.
    for channel in summary.channels.values() {
        let qos = channel.metadata.get("offered_qos_profiles");
        assert_eq!(qos.map(String::as_str), Some("[]"), "{}", channel.topic);
    }
    let about = mcap::read::metadata(&file.bytes, &summary.metadata_indexes[0]);
    assert!(about.is_ok_and(|about| about.name == "taut" && about.metadata["scene"] == "none"));
}

#[test]
fn damaged_lines_are_left_out_and_said_and_the_whole_ones_are_there() {
    let (directory, scene) = (recorded(), scene());
    // In the middle: a byte that begins a quotation, a field too few, bytes that are no text, a time that ROS cannot say.
    changed(directory.path(), "haptics.csv", |text| {
        let mut lines: Vec<Vec<u8>> = text.lines().map(|line| line.as_bytes().to_vec()).collect();
        lines[1][0] = b'"';
        lines[2].truncate(10);
        lines[4][5] = 0xff;
        lines[5] = b"5,9000000000000000000".to_vec();
        lines[5].extend(
            text.lines()
                .nth(5)
                .map_or(&b""[..], |line| &line.as_bytes()["5,5000000".len()..]),
        );
        lines.join(&b'\n').into_iter().chain([b'\n']).collect()
    });
    // At the end: half a line, whose last number still is one.
    changed(directory.path(), "updates.csv", |text| {
        text.as_bytes()[..text.len() - 2].to_vec()
    });
    assert!(std::fs::remove_file(directory.path().join("forces.csv")).is_ok());
    let file = export(directory.path(), Ok(&scene));
    let report = &file.report;
    assert_eq!((report.ticks, report.updates, report.forces), (1, 5, 0));
    assert_eq!(file.topics["/hand/wrench"].len(), 1);
    assert_eq!(file.topics["/god_object/pose"].len(), 5);
    let said = file.left_out();
    for part in [
        "4 lines of",
        "haptics.csv, the first is line 2",
        "1 line of",
        "updates.csv, the first is line 7",
        "forces.csv: cannot be read",
    ] {
        assert!(said.contains(part), "{part} is missing: {said}");
    }
}

#[test]
fn a_session_that_was_killed_is_exported_and_said_not_to_be_whole() {
    let (directory, scene) = (recorded(), scene());
    changed(directory.path(), "recording.json", |text| {
        text.replace("\"complete\": true", "\"complete\": false")
            .into()
    });
    let file = export(directory.path(), Ok(&scene));
    assert_eq!(file.report.ticks, 5);
    assert!(file.left_out().contains("did not come to its end"));
}

#[test]
fn without_its_scene_the_rest_is_exported() {
    let directory = recorded();
    let file = export(directory.path(), Err("part.ply is gone".to_owned()));
    assert!(file.left_out().contains("part.ply is gone"));
    assert_eq!(file.topics["/device/pose"].len(), 4);
    assert!(!file.topics.contains_key("/obstacle_1_upper_plate/pose"));
    for (_, TfMessage(transforms)) in file.read("/tf") {
        assert!(
            transforms
                .iter()
                .all(|Transform(_, child, _)| child != "reference_point")
        );
    }
}

#[test]
fn a_file_with_another_header_is_left_out() {
    let (directory, scene) = (recorded(), scene());
    changed(directory.path(), "haptics.csv", |text| {
        text.replacen("sample", "tick", 1).into()
    });
    let file = export(directory.path(), Ok(&scene));
    assert_eq!((file.report.ticks, file.report.updates), (0, 6));
    assert!(
        file.left_out().contains("the header is `tick,"),
        "{}",
        file.left_out()
    );
}

#[test]
fn an_export_can_be_interrupted() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let (mut taps, recorder) =
        Recorder::start(directory.path(), manifest(), "").expect("cannot record");
    (1..=1500).for_each(|sequence| taps.updates.push(update(sequence)));
    assert!(recorder.finish().failure.is_none());
    let recording = Recording::open(directory.path()).expect("cannot open");
    let ended = export_mcap(&recording, Err(String::new()), Vec::new(), || true);
    assert!(
        matches!(ended, Err(RecordingError::Interrupted)),
        "{ended:?}"
    );
}
