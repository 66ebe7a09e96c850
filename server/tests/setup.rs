//! `taut setup`: the file that it writes is good, and is what was answered.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};

use taut_scene::{Device, Workbench};

use crate::support::{Workplace, command, refusal, taut};

/// Runs it with these answers, one a line.
fn answered(place: &Workplace, answers: &str) -> Output {
    let mut child = command(&["setup", "--out", &place.text("mine.toml")])
        .stdin(Stdio::piped())
        .spawn()
        .expect("taut starts");
    let mut input = child.stdin.take().expect("piped");
    // It may have ended before it read all.
    let _ = input.write_all(answers.as_bytes());
    drop(input);
    child.wait_with_output().expect("taut ends")
}

fn loaded(place: &Workplace) -> Workbench {
    let path = place.text("mine.toml");
    let checked = taut(&["check", &path]);
    assert!(checked.status.success(), "{checked:?}");
    Workbench::load(Path::new(&path)).expect("checked")
}

#[test]
fn the_defaults_are_a_workbench_that_can_be_deployed() {
    let place = Workplace::new();
    let (file, key, out) = (
        place.text("mine.toml"),
        place.text("cluster.key"),
        place.text("out"),
    );
    let output = taut(&["setup", "--yes", "--out", &file]);
    assert!(output.status.success(), "{output:?}");
    let workbench = loaded(&place);
    assert_eq!((workbench.screens.len(), workbench.machines.len()), (2, 3));
    let deployed = taut(&["deploy", &file, "--master", &key, "--out", &out]);
    assert!(deployed.status.success(), "{deployed:?}");
    // What is there is not written over.
    let before = fs::read(&file).expect("written");
    let again = refusal(&taut(&["setup", "--yes", "--out", &file]));
    assert!(again.contains("not written over"));
    assert_eq!(fs::read(&file).expect("there"), before);
}

#[test]
fn answers_through_a_pipe_are_what_is_written() {
    let place = Workplace::new();
    let answers = "the \"cave\"\n3\nhaptics\n10.1.2.3\n\
        2.5\n1.5\nwall-pc\n10.1.2.4\n\
        2.5\n2\nwall-pc\n\
        1\nnine\n1.5\nhaptics\n\
        mono\nspidar:/dev/ttyUSB0\n";
    let output = answered(&place, answers);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    assert!(
        said.contains("\"nine\" does not do: write a number"),
        "{said}"
    );
    let workbench = loaded(&place);
    assert_eq!(workbench.name, "the \"cave\"");
    assert_eq!(workbench.device, Device::Remote);
    let machines: Vec<(&str, String, &[String], Option<&str>)> = workbench
        .machines
        .iter()
        .map(|m| {
            (
                m.name.as_str(),
                m.address.to_string(),
                m.nodes.as_slice(),
                m.device.as_deref(),
            )
        })
        .collect();
    let (one, two) = (
        ["left".to_owned()],
        ["front".to_owned(), "table".to_owned()],
    );
    assert_eq!(
        machines,
        [
            (
                "haptics",
                "10.1.2.3".to_owned(),
                &one[..],
                Some("spidar:/dev/ttyUSB0")
            ),
            ("wall-pc", "10.1.2.4".to_owned(), &two[..], None),
        ]
    );
    let front = &workbench.screens[0];
    assert!(((front.lower_right - front.lower_left).norm() - 2.5).abs() < 1e-12);
    // The wall at the left meets the front screen.
    let left = &workbench.screens[2];
    assert!((left.lower_right - front.lower_left).norm() < 1e-12);
}

#[test]
fn answers_that_end_early_leave_no_file() {
    let place = Workplace::new();
    let error = refusal(&answered(&place, "mine\n2\n"));
    assert!(
        error.contains("name of the haptic PC") && error.contains("--yes"),
        "{error}"
    );
    assert!(!place.path("mine.toml").exists());
}

/// The answers up to the number of screens; what follows is the test's.
const BEGUN: &str = "mine\n";

#[test]
fn an_answer_that_would_make_another_workbench_is_asked_for_again() {
    let place = Workplace::new();
    let rest = "haptics\n10.1.2.3\n\n\n\n\nmono\nmouse\ntrace:hand.csv\nsimulated\n";
    let output = answered(&place, &format!("{BEGUN}2.5\n0\n1\n{rest}"));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{output:?}");
    for part in [
        "\"2.5\" does not do: write a whole number from 1 to 4",
        "\"0\" does not do",
        "\"mouse\" does not do: that is a render window's",
        "\"trace:hand.csv\" does not do: a service finds a file by its whole path",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert_eq!(loaded(&place).screens.len(), 1);
}

#[test]
fn wrong_answers_without_end_long_ones_and_a_place_that_cannot_be_written_leave_no_file() {
    let place = Workplace::new();
    let endless = format!("{BEGUN}{}", "many\n".repeat(100));
    let long = format!("{BEGUN}{}\n", "1".repeat(5000));
    for (answers, part) in [(endless, "5 answers did not do"), (long, "4096 bytes")] {
        let error = refusal(&answered(&place, &answers));
        assert!(
            error.contains(part) && error.contains("number of screens"),
            "{error}"
        );
        assert!(!place.path("mine.toml").exists());
    }
    place.write("file", "");
    let below = place.text("file/mine.toml");
    let error = refusal(&taut(&["setup", "--yes", "--out", &below]));
    assert!(
        error.contains(&below) && error.contains("another --out"),
        "{error}"
    );
}

#[test]
fn a_folder_that_is_missing_is_told_before_a_question_is_asked() {
    let place = Workplace::new();
    let out = place.text("nowhere/mine.toml");
    let output = taut(&["setup", "--out", &out]);
    let said = refusal(&output);
    assert!(said.contains("nowhere is no folder"), "{said}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert!(!said.contains("name of the workbench"), "{said}");
}
