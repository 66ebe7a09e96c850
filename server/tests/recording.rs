//! A live session that is recorded, and computed again from its files: the same bits.

use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use taut::commands::replay::recorded;
use taut::report::RecordedReport;
use taut::session::Session;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut::shared::failure::Failure;
use taut::shared::shutdown::Shutdown;
use taut_link::ClusterKey;

use crate::support::{PATIENCE, Workplace, no_monitor, refusal, shipped_workbench, taut};

/// How long a session runs at least: the simulated hand touches before.
const RUN: Duration = Duration::from_millis(2500);
/// Recordings of a scene until one is whole: what a starved recorder could not write in time is missing, and said to be.
const ATTEMPTS: u32 = 5;
/// Updates that a recording must hold to be worth something.
const UPDATES: u64 = 200;

/// A session of this scene that is recorded here.
fn started(scene: &str, directory: &Path) -> Result<Session, Failure> {
    let key = ClusterKey::generate().expect("no random numbers");
    let overrides = Overrides {
        scene: Some(scene.to_owned()),
        recording: Some(directory.to_path_buf()),
        ..no_monitor()
    };
    session_setup(&shipped_workbench(&[]), key, &overrides).and_then(Session::start)
}

fn record(scene: &str, directory: &Path) {
    let session = started(scene, directory).unwrap_or_else(|error| panic!("{error}"));
    let begun = Instant::now();
    // The recorder writes to the files while it records: a busy machine may take longer for as many rows.
    let rows = |name: &str| {
        let text = std::fs::read_to_string(directory.join(name)).unwrap_or_default();
        text.lines().count() as u64
    };
    let enough = || rows("updates.csv") > 2 * UPDATES && rows("forces.csv") > 2 * UPDATES;
    while (begun.elapsed() < RUN || !enough()) && !session.is_ending() {
        assert!(begun.elapsed() < PATIENCE, "too few rows");
        std::thread::sleep(Duration::from_millis(20));
    }
    let (_, failure) = session.stop();
    assert_eq!(failure, None);
}

fn again(directory: &Path) -> Result<RecordedReport, Failure> {
    recorded::run(directory, None, false, &Shutdown::default())
}

/// What is left of a recording of which record 50 is missing.
fn assert_a_gap(directory: &Path, compared: impl Fn(&RecordedReport) -> u64) {
    let report = again(directory).unwrap_or_else(|error| panic!("{error}"));
    assert!(compared(&report) <= 49, "{report}");
    assert_eq!(report.first_difference, None);
    assert!(report.gap.is_some_and(|gap| gap.contains("not whole")));
}

/// Why it is not computed at all.
fn refused(directory: &Path) -> String {
    let refused = again(directory).map(|report| report.to_string());
    refused.expect_err("computed").to_string()
}

/// The report of `taut export` into this file.
fn exported(recording: &Path, out: &Path) -> serde_json::Value {
    let arguments = [Path::new("export"), recording, Path::new("--out"), out];
    let arguments = arguments.map(Path::as_os_str);
    let output = taut(&[&arguments[..], &["--json".as_ref()]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && out.is_file(), "{said}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}"))
}

fn replaced(path: &Path, change: impl FnOnce(String) -> String) {
    let Ok(text) = std::fs::read_to_string(path) else {
        panic!("{} is not there", path.display());
    };
    assert!(std::fs::write(path, change(text)).is_ok());
}

/// The text of a file without one of its records, counted from 1.
fn without_record(text: &str, record: usize) -> String {
    let others = text
        .lines()
        .enumerate()
        .filter(|(number, _)| *number != record); // the header is line 0
    others.map(|(_, line)| format!("{line}\n")).collect()
}

#[test]
fn a_recorded_session_is_computed_again_bit_by_bit() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    for scene in ["sphere-on-plane", "peg-in-a-hole", "moving-plate"] {
        let out = directory.path().join(format!("{scene}.csv"));
        let mut attempts = (0..ATTEMPTS).map(|attempt| {
            let recording = directory.path().join(format!("{scene}-{attempt}"));
            record(scene, &recording);
            let report = recorded::run(&recording, Some(&out), false, &Shutdown::default());
            (report.unwrap_or_else(|error| panic!("{error}")), recording)
        });
        let Some((report, recording)) = attempts.find(|(report, _)| report.complete) else {
            panic!("{scene}: no recording is whole");
        };
        assert!(
            report.updates > UPDATES && report.forces > UPDATES,
            "{report}"
        );
        assert_eq!(report.first_difference, None);
        assert_eq!((report.different_updates, report.different_forces), (0, 0));
        let rows = std::fs::read_to_string(&out).map_or(0, |text| text.lines().count());
        assert_eq!(rows as u64, report.forces + 1);
        let mcap = directory.path().join(format!("{scene}.mcap"));
        let export = exported(&recording, &mcap);
        assert_eq!(export["updates"], report.updates);
        assert_eq!(export["forces"], report.forces);
        assert_eq!(export["left_out"], serde_json::json!([]));
        // What moves in this scene has a topic.
        let (plate, moves) = ("obstacle_1_plate", scene == "moving-plate");
        let bytes = std::fs::read(&mcap).unwrap_or_default();
        let found = bytes
            .windows(plate.len())
            .any(|part| part == plate.as_bytes());
        assert_eq!(found, moves, "{scene}");
    }
}

#[test]
fn a_recording_that_was_changed_is_found_out() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let path = directory.path().join("session");
    record("sphere-on-plane", &path);

    // Another answer in the last update.
    let updates = path.join("updates.csv");
    let last = std::fs::read_to_string(&updates)
        .ok()
        .and_then(|text| Some(text.lines().last()?.split(',').next()?.to_owned()))
        .unwrap_or_default();
    replaced(&updates, |text| {
        let trimmed = text.trim_end();
        let cut = trimmed.rfind(',').unwrap_or(0);
        format!("{},0.125\n", &trimmed[..cut])
    });
    let report = again(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(report.different_updates, 1);
    let difference = report.first_difference.unwrap_or_default();
    assert!(
        difference.contains(&format!("update {last}:")) && difference.contains("gap 1.25e-1"),
        "{difference}"
    );

    // An update that is missing, of a recording that says that it is whole, and of one that does not: the last was killed, and its last line is cut.
    let manifest = path.join("recording.json");
    let say_complete = |is_complete: bool| {
        replaced(&manifest, |text| {
            let [from, to] = [!is_complete, is_complete].map(|c| format!("\"complete\": {c}"));
            text.replace(&from, &to)
        });
    };
    say_complete(true);
    replaced(&updates, |text| without_record(&text, 50));
    assert!(refused(&path).contains("not whole"));
    say_complete(false);
    replaced(&path.join("forces.csv"), |text| {
        text[..text.len() - 30].to_owned()
    });
    assert_a_gap(&path, |report| report.updates);

    // Another stiffness.
    replaced(&path.join("scene.toml"), |text| {
        text.replace("k_h = 1000.0", "k_h = 2000.0")
    });
    assert!(refused(&path).contains("other bodies or settings"));

    // What does not rest on the scene is exported all the same.
    let export = exported(&path, &directory.path().join("changed.mcap"));
    assert!(export["updates"].as_u64() > Some(UPDATES));
    let left_out = export["left_out"].to_string();
    assert!(left_out.contains("other bodies or settings"), "{left_out}");
}

#[test]
fn a_lost_force_is_a_gap_and_what_is_behind_it_is_not_compared() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let path = directory.path().join("session");
    record("sphere-on-plane", &path);
    // As a queue that was full leaves it.
    replaced(&path.join("recording.json"), |text| {
        text.replace("\"complete\": true", "\"complete\": false")
    });
    replaced(&path.join("forces.csv"), |text| without_record(&text, 50));
    assert_a_gap(&path, |report| report.forces);
}

/// What its manifest is written to first has a longer path than the system takes, its scene has not: begun, and no more.
#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_cannot_be_begun_leaves_nothing() {
    let place = tempfile::tempdir().expect("no temporary directory");
    let mut path = place.path().to_path_buf();
    while path.as_os_str().len() < 4080 {
        let missing = 4079 - path.as_os_str().len();
        path.push("a".repeat(missing.min(100)));
    }
    for was_there in [false, true] {
        if was_there {
            assert!(std::fs::create_dir(&path).is_ok());
        }
        let why = started("sphere-on-plane", &path)
            .err()
            .map(|why| why.to_string());
        assert!(why.is_some_and(|why| why.contains("recording.json.partial")));
        let left = std::fs::read_dir(&path).map(Iterator::count).ok();
        assert_eq!(left, was_there.then_some(0));
    }
}

#[test]
fn an_export_needs_a_recording_and_leaves_nothing_without_one() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    let out = directory.path().join("out.mcap");
    let arguments = [
        "export".as_ref(),
        directory.path().as_os_str(),
        "--out".as_ref(),
    ];
    let said = refusal(&taut(&[&arguments[..], &[out.as_os_str()]].concat()));
    assert!(said.contains("name the directory of a recording"), "{said}");
    assert!(std::fs::read_dir(directory.path()).is_ok_and(|mut left| left.next().is_none()));
}

#[test]
fn a_recording_is_never_written_over_another() {
    let directory = tempfile::tempdir().expect("no temporary directory");
    record("sphere-on-plane", directory.path());
    let second = std::panic::catch_unwind(|| record("sphere-on-plane", directory.path()));
    assert!(second.is_err());
    assert!(again(directory.path()).is_ok_and(|report| report.first_difference.is_none()));
}

/// A scene of two files in the folder where it is used.
const HERE: &str = r#"name = "here"
[god_object]
shape = { sphere = { radius = 0.01 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.1], rotation = [1.0, 0.0, 0.0, 0.0] }
[[obstacle]]
name = "box"
shape = { box = { half_extents = [0.1, 0.1, 0.01] } }
motion = { trace = "way.csv", loop = true }
"#;
const WAY: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,0.01,1,0,0,0\n2,0,0,0,1,0,0,0\n";

#[test]
fn a_recording_of_a_scene_in_the_current_folder_is_replayed_from_any_other() {
    let place = tempfile::tempdir().expect("a folder");
    for (file, text) in [("here.toml", HERE), ("way.csv", WAY)] {
        std::fs::write(place.path().join(file), text).expect("written");
    }
    let output = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args("demo --scene here.toml --headless --duration 1 --recording made".split(' '))
        .current_dir(place.path())
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let made = place.path().join("made");
    let made = made.to_string_lossy();
    let output = taut(&["replay", "--recording", &made]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    // What it is computed from is not written over.
    let way = place.path().join("way.csv");
    for command in [vec!["replay", "--recording", &made], vec!["export", &made]] {
        let out = way.to_string_lossy();
        let output = taut(&[&command[..], &["--out", &out]].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("it is read for this answer"), "{said}");
        assert!(std::fs::read_to_string(&way).is_ok_and(|text| text == WAY));
    }
}

#[cfg(unix)]
#[test]
fn a_recording_that_cannot_grow_says_so_at_once_and_ends_nothing() {
    let place = Workplace::new();
    let recording = place.text("recording");
    let arguments = place.serve("workbench.toml", "4", &["--recording", &recording]);
    // 512-byte blocks: 64 KiB a file.
    let output = Command::new("sh")
        .args([
            "-c",
            "ulimit -f 128; exec \"$0\" \"$@\"",
            env!("CARGO_BIN_EXE_taut"),
        ])
        .args(arguments)
        .output()
        .expect("a shell");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let at_once = said.find("nothing is recorded any more");
    let at_the_end = said.rfind("the recording is not whole");
    assert!(at_once.is_some() && at_once < at_the_end, "{said}");
}
