//! Replay through the program: deterministic, complete, and gone without a trace when it fails.

use std::path::Path;
use std::process::Output;

use taut_scene::REPLAY_COLUMNS;

use crate::support::{refusal, taut};

fn temporary() -> tempfile::TempDir {
    tempfile::tempdir().expect("no temporary directory")
}

/// `taut replay` of the hand in `hand.csv`, with its answer in `out.csv`.
fn replay(directory: &Path, scene: &str, more: &[&str]) -> Output {
    let text = |name: &str| directory.join(name).display().to_string();
    let (hand, out) = (text("hand.csv"), text("out.csv"));
    let always = ["replay", "--scene", scene, "--trace", &hand, "--out", &out];
    taut(&[&always, more].concat())
}

/// The same of a hand that presses a sphere 5 mm into the plane, slides it, and lifts it, at 500 Hz: the report and the answer.
fn pressed(more: &[&str]) -> (serde_json::Value, String) {
    let directory = temporary();
    let mut text = String::from("t,x,y,z,qw,qx,qy,qz\n");
    for row in 0..1000_u32 {
        let time = f64::from(row) * 0.002;
        let height = 0.015 + (0.02 - 0.02 * time).abs();
        text.push_str(&format!(
            "{time},{},0.0,{height},1,0,0,0\n",
            0.05 - 0.05 * time
        ));
    }
    assert!(std::fs::write(directory.path().join("hand.csv"), text).is_ok());
    let more = [&["--json"], more].concat();
    let output = replay(directory.path(), "sphere-on-plane", &more);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let report = serde_json::from_slice(&output.stdout).unwrap_or_default();
    let answer = std::fs::read_to_string(directory.path().join("out.csv"));
    (report, answer.unwrap_or_default())
}

#[test]
fn the_answer_replaces_no_file_that_the_scene_names() {
    let directory = temporary();
    let path = |name: &str| directory.path().join(name);
    let scene = "name = \"x\"\n[god_object]\nshape = { sphere = { radius = 0.01 } }\nmass = 1.0\n\
        [[obstacle]]\nname = \"plate\"\nshape = { box = { half_extents = [0.01, 0.01, 0.01] } }\n\
        motion = { trace = \"out.csv\" }\n";
    let trace = "t,x,y,z,qw,qx,qy,qz\n0,0,0,-0.1,1,0,0,0\n1,0,0,-0.2,1,0,0,0\n";
    for (name, text) in [
        ("scene.toml", scene),
        ("hand.csv", trace),
        ("out.csv", trace),
    ] {
        assert!(std::fs::write(path(name), text).is_ok());
    }
    let scene = path("scene.toml").display().to_string();
    let said = refusal(&replay(directory.path(), &scene, &[]));
    assert!(said.contains("it is read for this answer"), "{said}");
    assert!(std::fs::read_to_string(path("out.csv")).is_ok_and(|text| text == trace));
}

#[test]
fn the_same_trace_gives_the_same_bytes_and_a_complete_report() {
    let mut answers = Vec::new();
    for rate in ["250", "250", "70"] {
        let (report, answer) = pressed(&["--god-object-rate", rate]);
        assert_eq!(report["steps"], 1000);
        assert_eq!(report["solver_fallbacks"], 0);
        assert!(
            report["max_force_n"]
                .as_f64()
                .is_some_and(|force| (4.0..6.0).contains(&force)),
            "{report}"
        );
        assert!(
            report["gap_min_m"].as_f64().is_some_and(|gap| gap > 0.0),
            "{report}"
        );
        assert!(
            report["kkt_max"].as_f64().is_some_and(|kkt| kkt < 1e-6),
            "{report}"
        );
        assert!(
            report["work"]["projections"]
                .as_u64()
                .is_some_and(|count| count > 0),
            "{report}"
        );
        answers.push(answer);
    }
    assert!(!answers[0].is_empty());
    assert!(answers[0] == answers[1], "the same input gave other bytes");
    assert!(answers[0] != answers[2], "the rate makes no difference");
    assert_eq!(answers[0].lines().count(), 1001);
    assert_eq!(answers[0].lines().next(), Some(REPLAY_COLUMNS));
    assert!(REPLAY_COLUMNS.starts_with("t,hx,hy,hz,hqw,hqx,hqy,hqz,sx,sy,sz,"));
}

#[test]
fn timings_add_two_columns_and_change_no_other() {
    let (_, plain) = pressed(&[]);
    let (_, timed) = pressed(&["--timings"]);
    assert!(
        timed
            .lines()
            .next()
            .is_some_and(|header| header.ends_with(",stale,update_us,force_us"))
    );
    for (plain, timed) in plain.lines().zip(timed.lines()) {
        assert_eq!(timed.rsplitn(3, ',').last(), Some(plain));
    }
}

#[test]
fn overrides_and_solvers_reach_the_method() {
    let force = |more: &[&str]| pressed(more).0["max_force_n"].as_f64().unwrap_or(f64::NAN);
    let plain = force(&[]);
    let soft = force(&["--set", "coupling.k_h=500.0"]);
    assert!((soft / plain - 0.5).abs() < 1e-3, "{soft} N of {plain} N");
    let reference = force(&["--solver", "clarabel"]);
    assert!(
        (reference / plain - 1.0).abs() < 1e-4,
        "{reference} N, not {plain} N"
    );
}

#[test]
fn a_failing_replay_leaves_no_file_and_says_one_sentence() {
    let directory = temporary();
    let broken = "t,x,y,z,qw,qx,qy,qz\n0.0,0.05,0,0.04,1,0,0,0\n0.001,nan,0,0.04,1,0,0,0\n";
    assert!(std::fs::write(directory.path().join("hand.csv"), broken).is_ok());
    let error = refusal(&replay(directory.path(), "sphere-on-plane", &[]));
    assert!(
        error.starts_with("taut: ")
            && error.contains("hand.csv:3")
            && error.trim().lines().count() == 1,
        "{error}"
    );
    let files: Vec<_> = std::fs::read_dir(directory.path())
        .into_iter()
        .flatten()
        .flatten()
        .collect();
    assert_eq!(files.len(), 1, "{files:?}");
}

#[test]
fn an_obstacle_with_a_motion_pushes_the_body_and_the_hand() {
    let directory = temporary();
    let scene = directory.path().join("rising.toml");
    let plate = directory.path().join("plate.csv");
    let hand = directory.path().join("hand.csv");
    std::fs::write(
        &scene,
        r#"
name = "rising-plate"

[god_object]
shape = { box = { half_extents = [0.02, 0.02, 0.01] } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.03] }

[[obstacle]]
name = "plate"
shape = { box = { half_extents = [0.1, 0.1, 0.002] } }
motion = { trace = "plate.csv" }
"#,
    )
    .expect("a file");
    // 0.1 m/s up for 0.2 s, then it stays there; the hand holds still.
    std::fs::write(
        &plate,
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n0.2,0,0,0.02,1,0,0,0\n",
    )
    .expect("a file");
    let mut still = String::from("t,x,y,z,qw,qx,qy,qz\n");
    for row in 0..300 {
        still.push_str(&format!("{},0,0,0.03,1,0,0,0\n", f64::from(row) * 1e-3));
    }
    std::fs::write(&hand, still).expect("a file");
    let scene = scene.display().to_string();
    let run = replay(directory.path(), &scene, &[]);
    assert!(run.status.success(), "{run:?}");
    let rows = std::fs::read_to_string(directory.path().join("out.csv")).expect("an answer");
    let header: Vec<&str> = rows.lines().next().expect("a header").split(',').collect();
    let column = |row: &str, name: &str| -> f64 {
        let index = header.iter().position(|h| *h == name).expect("a column");
        row.split(',')
            .nth(index)
            .and_then(|n| n.parse().ok())
            .expect("a number")
    };
    let first = rows.lines().nth(1).expect("a row");
    let last = rows.lines().last().expect("a row");
    assert_eq!(column(first, "fz"), 0.0);
    // The plate's face ends at 22 mm, the body's middle 10 mm above it: 2 mm over the hand, at 1000 N/m.
    assert!((column(last, "fz") - 2.0).abs() < 0.01, "{last}");
    assert!((column(last, "sz") - 0.032).abs() < 1e-5, "{last}");
}
