//! `taut replay`: the same scene and trace give the same bytes, and the columns that scripts rely on.

use std::path::PathBuf;

use taut_method_tests::motion::shipped;
use taut_scene::{DeviceTrace, REPLAY_COLUMNS, TraceSample};
use taut_tests::motion::{intention, sampled};
use taut_tests::process::Ended;
use taut_tests::workbench::TestWorkbench;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");

/// The shipped peg's path from the left face into the hole and out, 200 samples a second.
fn trace_of_the_peg(workbench: &TestWorkbench) -> (PathBuf, usize) {
    let path = intention(&shipped("peg-in-a-hole"));
    let samples = sampled(&path, 200.0, 0.0, 29.0).map(|(time, pose)| TraceSample {
        time,
        pose,
        buttons: 0,
    });
    let trace =
        DeviceTrace::new("peg", samples.collect(), false).unwrap_or_else(|error| panic!("{error}"));
    (
        workbench.write("peg.csv", trace.to_csv()),
        trace.samples().len(),
    )
}

fn replay(workbench: &TestWorkbench, trace: &str, out: &str, more: &[&str]) -> (Ended, Vec<u8>) {
    let always = [
        "replay",
        "--scene",
        "peg-in-a-hole",
        "--trace",
        trace,
        "--out",
        out,
        "--json",
    ];
    let ended = workbench.run("replay", &[&always, more].concat());
    assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
    let bytes = std::fs::read(workbench.directory().join(out))
        .unwrap_or_else(|error| panic!("{out}: {error}"));
    (ended, bytes)
}

#[test]
fn a_trace_replayed_twice_gives_the_same_bytes_row_for_row() {
    let workbench = TestWorkbench::new(PROGRAM);
    let (trace, rows) = trace_of_the_peg(&workbench);
    let trace = trace.display().to_string();
    let (ended, first) = replay(&workbench, &trace, "first.csv", &[]);
    let (_, second) = replay(&workbench, &trace, "second.csv", &[]);
    assert!(first == second, "the same trace gave other bytes");

    let report = ended.json();
    assert_eq!(report["steps"], rows);
    assert_eq!(report["solver_fallbacks"], 0);
    let text = String::from_utf8(first).expect("text");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(REPLAY_COLUMNS));
    assert_eq!(lines.count(), rows);

    // The god-object is the same one that the loops run: it ends up 50 mm in the hole on the way.
    let column = |name: &str| {
        REPLAY_COLUMNS
            .split(',')
            .position(|column| column == name)
            .expect("a column")
    };
    let sy = column("sy");
    let least = text
        .lines()
        .skip(1)
        .filter(|line| {
            line.split(',')
                .next()
                .is_some_and(|t| t.parse::<f64>().is_ok_and(|t| t > 25.0))
        })
        .map(|line| {
            line.split(',')
                .nth(sy)
                .and_then(|y| y.parse::<f64>().ok())
                .expect("a number")
        });
    assert!((least.fold(f64::INFINITY, f64::min) - 0.010).abs() < 1e-4);
}

#[test]
fn an_option_of_the_scene_changes_the_answer_and_timings_only_add_columns() {
    let workbench = TestWorkbench::new(PROGRAM);
    let (trace, _) = trace_of_the_peg(&workbench);
    let trace = trace.display().to_string();
    let (_, plain) = replay(&workbench, &trace, "plain.csv", &[]);
    let (_, timed) = replay(&workbench, &trace, "timed.csv", &["--timings"]);
    let (_, soft) = replay(
        &workbench,
        &trace,
        "soft.csv",
        &["--set", "coupling.k_h=1000.0"],
    );
    assert_ne!(plain, soft);
    let (plain, timed) = (
        String::from_utf8(plain).expect("text"),
        String::from_utf8(timed).expect("text"),
    );
    for (without, with) in plain.lines().zip(timed.lines()) {
        assert_eq!(with.rsplitn(3, ',').last(), Some(without));
    }
}
