//! What is pushed by the loops is read back bit by bit, and what is lost is said.

use std::path::Path;
use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use god_object::constraint::{Feature, FeaturePair, NonPenetrationConstraint, Separation};
use god_object::nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use god_object::{ConstraintSet, Pose, ShadedAcceleration, Vector6};
use taut_recording::{
    EventRecord, FORMAT, ForceRecord, HapticsRecord, Lost, Manifest, Recorder, Recording,
    RecordingError, SceneOrigin, UpdateRecord,
};

pub(crate) fn manifest() -> Manifest {
    Manifest {
        format: FORMAT,
        program: "taut test".to_owned(),
        scene: "none".to_owned(),
        origin: SceneOrigin::Shipped,
        overrides: Vec::new(),
        identity: "0".to_owned(),
        complete: false,
        reason: None,
        lost: Lost::default(),
        records: None,
    }
}

/// Poses whose numbers have no short decimal form, and are not quite unit.
pub(crate) fn pose(seed: u32) -> Pose {
    let x = f64::from(seed) * std::f64::consts::PI;
    Pose::from_parts(
        Translation3::new(x.sin() * 1e-7, x.cos() / 3.0, -0.0),
        UnitQuaternion::new_unchecked(Quaternion::new(
            x.cos(),
            x.sin() * (1.0 + 3e-16),
            1e-300,
            0.0,
        )),
    )
}

pub(crate) fn update(sequence: u32) -> UpdateRecord {
    UpdateRecord {
        sequence: u64::from(sequence),
        published: Duration::from_nanos(1_000_001 * u64::from(sequence)),
        device_sequence: u64::from(sequence),
        device_pose: pose(sequence),
        obstacle_time: Duration::from_nanos(7),
        device_ahead: 0.125,
        shaded: (sequence % 2 == 1).then(|| ShadedAcceleration {
            sequence: 5,
            acceleration: Vector6::repeat(1.0 / 3.0),
        }),
        pose: pose(sequence + 1),
        contacts: 3,
        gap_min: if sequence == 4 { f64::INFINITY } else { 0.1 },
    }
}

fn bits(pose: &Pose) -> [u64; 7] {
    let (at, turn) = (&pose.translation, &pose.rotation);
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k].map(f64::to_bits)
}

fn row() -> NonPenetrationConstraint {
    NonPenetrationConstraint {
        features: FeaturePair {
            obstacle: 0,
            on_body: Feature::Vertex(3),
            on_obstacle: Feature::Face(12),
        },
        point: Point3::new(0.1, 0.2, 0.3),
        normal: Vector3::z(),
        gap: 1e-6,
        separation: Separation::OfObstacle,
        obstacle_displacement: Vector3::zeros(),
        shading_normal: None,
    }
}

fn lines(directory: &Path, file: &str) -> Vec<String> {
    match std::fs::read_to_string(directory.join(file)) {
        Ok(text) => text.lines().map(str::to_owned).collect(),
        Err(error) => panic!("{file}: {error}"),
    }
}

fn force() -> ForceRecord {
    ForceRecord {
        sequence: 1,
        time: Duration::from_nanos(123_456_789),
        device_sequence: 9,
        device_pose: pose(17),
        constraint_sequence: 8,
        wrench: Vector6::new(1e-9, 2.0, -0.0, 1.0 / 7.0, 5.0, 6.0),
    }
}

fn tick(time: u64, faulty: bool) -> HapticsRecord {
    HapticsRecord {
        sequence: 1,
        time: Duration::from_millis(time),
        tick: Duration::from_millis(time),
        pose: pose(2),
        velocity: Vector6::zeros(),
        buttons: 1,
        faulty,
        wrench: Vector6::zeros(),
    }
}

/// Six updates, a force, two constraints, three ticks of which two are good and at one time, and an event.
fn record(path: &Path) {
    let (mut taps, recorder) = Recorder::start(path, manifest(), "name = \"none\"\n")
        .unwrap_or_else(|error| panic!("{error}"));
    let mut set = ConstraintSet::with_capacity(2);
    set.sequence = 4;
    set.constraints = vec![row(), row()];
    assert_no_alloc(|| {
        for sequence in 1..=6 {
            taps.updates.push(update(sequence));
        }
        taps.forces.push(force());
        taps.constraints.push_set(&set);
        taps.haptics.push(tick(5, false));
        taps.haptics.push(tick(5, false));
        taps.haptics.push(tick(6, true));
    });
    recorder.tell(EventRecord {
        time: Duration::from_millis(3),
        kind: "client".to_owned(),
        text: "front joined, \"udp\"\nas third".to_owned(),
    });
    let summary = recorder.finish();
    assert!(summary.failure.is_none());
    assert_eq!((summary.records.updates, summary.records.haptics), (6, 3));
}

#[test]
fn records_come_back_bit_by_bit_and_what_is_cut_off_is_missed() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let path = directory.path().join("new");
    record(&path);
    let recording = Recording::open(&path).unwrap_or_else(|error| panic!("{error}"));
    assert!(recording.manifest().complete);
    assert_eq!(recording.scene(), "name = \"none\"\n");
    let (Ok(mut updates), Ok(mut forces)) = (recording.updates(), recording.forces()) else {
        panic!("no files");
    };
    for sequence in 1..=6 {
        let Ok(Some(read)) = updates.next_record() else {
            panic!("update {sequence} is not there");
        };
        assert_eq!(read, update(sequence));
        assert_eq!(bits(&read.device_pose), bits(&pose(sequence)));
        assert_eq!(bits(&read.pose), bits(&pose(sequence + 1)));
    }
    assert!(matches!(updates.next_record(), Ok(None)));
    assert!(matches!(forces.next_record(), Ok(Some(read)) if read == force()));
    // All is there, and says so; what somebody cut off afterwards is missed, at whichever end of a line.
    assert!(matches!(forces.next_record(), Ok(None)));
    let text = std::fs::read_to_string(path.join("forces.csv")).unwrap_or_default();
    let header = text.lines().next().unwrap_or_default().to_owned() + "\n";
    assert!(std::fs::write(path.join("forces.csv"), header).is_ok());
    let mut cut = recording.forces().unwrap_or_else(|error| panic!("{error}"));
    let missed = cut.next_record().map_err(|error| error.to_string());
    assert!(
        matches!(&missed, Err(said) if said.contains("ends after 0 records, but the session wrote 1")),
        "{missed:?}"
    );
    // A device trace has good samples only, and strictly increasing times.
    assert_eq!(lines(&path, "device.csv").len(), 1 + 1);
    assert_eq!(lines(&path, "haptics.csv").len(), 1 + 3);
    assert_eq!(
        lines(&path, "constraints.csv")[1],
        "4,0,vertex 3,face 12,0.1,0.2,0.3,0,0,1,0.000001"
    );
    assert_eq!(
        lines(&path, "events.csv")[1],
        "3000000,client,\"front joined, \"\"udp\"\" as third\""
    );
}

#[test]
fn a_writer_that_falls_behind_makes_the_recording_incomplete() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let (mut taps, recorder) = Recorder::start(directory.path(), manifest(), "")
        .expect("an empty directory is good enough");
    // Far more than the queue holds, faster than lines can be written.
    let pushed = 1_000_000;
    for _ in 0..pushed {
        taps.updates.push(update(1));
    }
    let summary = recorder.finish();
    assert!(summary.lost.updates > 0);
    assert_eq!(summary.records.updates + summary.lost.updates, pushed);
    let recording = Recording::open(directory.path()).expect("an incomplete recording can be read");
    assert!(!recording.manifest().complete);
    assert_eq!(recording.manifest().lost, summary.lost);
}

#[test]
fn a_directory_with_something_in_it_is_left_alone() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let kept = directory.path().join("mine.txt");
    assert!(std::fs::write(&kept, "mine").is_ok());
    let started = Recorder::start(directory.path(), manifest(), "");
    assert!(matches!(started, Err(RecordingError::NotEmpty(_))));
    assert_eq!(lines(directory.path(), "mine.txt"), ["mine"]);
}

#[test]
fn a_line_that_was_cut_off_is_named() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let (mut taps, recorder) =
        Recorder::start(directory.path(), manifest(), "").expect("cannot record");
    taps.updates.push(update(1));
    taps.updates.push(update(2));
    assert!(recorder.finish().failure.is_none());
    let path = directory.path().join("updates.csv");
    let text = std::fs::read_to_string(&path).expect("no updates");
    assert!(std::fs::write(&path, &text[..text.len() - 40]).is_ok());
    let recording = Recording::open(directory.path()).expect("cannot open");
    let mut updates = recording.updates().expect("no updates");
    assert!(matches!(updates.next_record(), Ok(Some(_))));
    match updates.next_record() {
        Err(error) => assert!(error.to_string().contains("updates.csv, line 3"), "{error}"),
        other => panic!("{other:?}"),
    }
}

/// What is left of the last number is a number, too: another one.
#[test]
fn a_line_that_was_cut_off_in_its_last_number_is_no_line() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let (mut taps, recorder) =
        Recorder::start(directory.path(), manifest(), "").expect("cannot record");
    taps.updates.push(update(1));
    assert!(recorder.finish().failure.is_none());
    let path = directory.path().join("updates.csv");
    let text = std::fs::read_to_string(&path).expect("no updates");
    assert!(text.ends_with(",0.1\n"));
    assert!(std::fs::write(&path, &text[..text.len() - 2]).is_ok()); // ",0."
    let mut updates = Recording::open(directory.path())
        .and_then(|opened| opened.updates())
        .expect("no updates");
    match updates.next_record() {
        Err(error) => assert!(error.to_string().contains("no end"), "{error}"),
        other => panic!("{other:?}"),
    }
    assert!(matches!(updates.next_record(), Ok(None)));
}
