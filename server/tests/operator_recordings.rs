//! A recording that is begun and ended at the operator's page of a real `taut serve`, and computed again; and where none can be.
#![cfg(unix)]

use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use taut::commands::replay::recorded;
use taut::shared::shutdown::Shutdown;

use crate::operator::{Served, with_token_file};
use crate::support::{Workplace, wait_until};

/// Recordings until one is whole: what a starved recorder could not write in time is missing, and said to be.
const ATTEMPTS: usize = 5;
/// Updates that a recording must hold to be worth something.
const UPDATES: usize = 200;

/// The workbench with a page, a scene that arms itself, and this in `[operator]`.
fn workbench_with(operator: &str) -> String {
    with_token_file()
        .replacen("rearm = \"manual\"", "rearm = \"automatic\"", 1)
        .replacen(
            "token_file = \"operator",
            &format!("{operator}token_file = \"operator"),
            1,
        )
}

fn serve(operator: &str, more: &[&str]) -> Served {
    let served = Served::start_in(Workplace::new(), &workbench_with(operator), more);
    wait_until("a session", || served.status().is_some());
    served
}

impl Served {
    fn standing(&self, key: &str) -> Value {
        self.scene()["standing"][key].clone()
    }

    /// Begins or ends a recording of the session that runs; the answer.
    fn record(&self, on: bool) -> String {
        self.takes(&json!({ "recording": on }))
    }

    fn folders(&self) -> Vec<PathBuf> {
        let folder = std::fs::read_dir(self.place.path("recordings"));
        let mut found: Vec<PathBuf> = folder
            .map(|files| files.map(|file| file.expect("a file").path()).collect())
            .unwrap_or_default();
        found.sort();
        found
    }
}

fn rows(directory: &Path, name: &str) -> usize {
    let text = std::fs::read_to_string(directory.join(name)).unwrap_or_default();
    text.lines().count()
}

/// Begins a recording, the `count`-th of this page, and waits until it holds enough; its folder.
fn begin(served: &Served, count: usize) -> PathBuf {
    let said = served.record(true);
    assert!(
        said.contains("GB an hour") && said.contains("are free there"),
        "{said}"
    );
    let recording = PathBuf::from(served.standing("recording").as_str().expect("a folder"));
    assert!(said.contains(&recording.display().to_string()), "{said}");
    assert_eq!(served.folders().len(), count, "each its own");
    assert!(
        recording.starts_with(served.place.path("recordings")),
        "{recording:?}"
    );
    served.wait_for_run("running");
    wait_until("it is written", || {
        served.now("recorded") == true
            && rows(&recording, "updates.csv") > UPDATES
            && rows(&recording, "forces.csv") > UPDATES
    });
    recording
}

/// Whether the recording is complete; then it is computed again bit by bit.
fn is_whole(recording: &Path) -> bool {
    let report = recorded::run(recording, None, false, &Shutdown::default());
    let report = report.unwrap_or_else(|error| panic!("{error}"));
    if report.complete {
        assert!(report.updates as usize > UPDATES / 2, "{report}");
        assert_eq!(report.first_difference, None);
        assert_eq!((report.different_updates, report.different_forces), (0, 0));
    }
    report.complete
}

#[test]
fn a_recording_from_the_page_replays_bit_by_bit_and_the_session_goes_on() {
    let served = serve("recordings = \"recordings\"\n", &["--follow-scene"]);
    served.wait_for_run("running");
    assert_eq!(served.standing("recording"), Value::Null);
    assert_eq!(served.standing("why_not_recorded"), Value::Null);
    assert!(
        !served.place.path("recordings").exists(),
        "nothing before it is asked for"
    );
    served.refuses(&json!({ "recording": false }), "not recorded");
    // What was changed and is not in the file is recorded as it runs, and stays so.
    served.takes(&json!({ "edits": ["coupling.k_h=1500"] }));
    let not_kept = served.standing("not_kept");
    let before = served.standing("revision").as_u64().expect("a number");
    let whole = (1..=ATTEMPTS).any(|attempt| {
        let revision = before + 2 * (attempt as u64 - 1);
        let recording = begin(&served, attempt);
        assert_eq!(served.standing("revision"), revision + 1);
        assert_eq!(served.standing("not_kept"), not_kept);
        // A recording is of one scene, and there is one.
        served.refuses(&json!({ "recording": true }), "already");
        let edit = json!({ "edits": ["coupling.k_h=1000"] });
        served.refuses(&edit, "end the recording first");

        served.record(false);
        assert_eq!(served.standing("revision"), revision + 2);
        assert_eq!(served.standing("recording"), Value::Null);
        served.wait_for_run("running");
        wait_until("no recording", || served.now("recorded") == false);
        is_whole(&recording)
    });
    assert!(whole, "no recording is whole");
    wait_until("it is audited", || {
        served.says(&[
            "taut::audit",
            "event=\"edit\"",
            "operator-page",
            "recording to",
        ])
    });
    assert_another_scene_ends_a_recording(&served);
}

/// An edited file ends the recording of the scene that it was, and says so.
fn assert_another_scene_ends_a_recording(served: &Served) {
    served.record(true);
    let recording = served.standing("recording");
    served.wait_for_run("running");
    let file = served.place.path("workbench.toml");
    let text = std::fs::read_to_string(&file).expect("a file");
    let other = text.replacen(
        "scene = \"sphere-on-plane\"",
        "scene = \"peg-in-a-hole\"",
        1,
    );
    assert_ne!(text, other);
    std::fs::write(&file, other).expect("written");
    wait_until("the other scene", || {
        served.standing("name") == "peg-in-a-hole"
    });
    assert_eq!(served.standing("recording"), Value::Null);
    assert!(served.says(&["ends with the scene", recording.as_str().expect("a folder")]));
}

#[test]
fn where_no_recording_can_begin_the_page_says_why_and_nothing_is_made() {
    let refusal = |operator: &str, more: &[&str], why: &str| {
        let served = serve(operator, more);
        let reason = served.standing("why_not_recorded");
        assert!(
            reason.as_str().is_some_and(|text| text.contains(why)),
            "{why}: {reason}"
        );
        for on in [true, false] {
            served.refuses(&json!({ "recording": on }), why);
        }
        assert_eq!(served.standing("revision"), 1);
        assert!(served.folders().is_empty());
    };
    refusal("", &[], "recordings = \"DIR\"");
    let place = tempfile::tempdir().expect("a folder");
    let named = place.path().join("from-start").display().to_string();
    let recordings = "recordings = \"recordings\"\n";
    refusal(recordings, &["--recording", &named], "--recording");

    // A folder that cannot be had is found before the session that runs is touched.
    let served = serve("recordings = \"workbench.toml/recordings\"\n", &[]);
    served.refuses(&json!({ "recording": true }), "`recordings` in [operator]");
    for wish in [
        json!({ "recording": true, "edits": ["coupling.k_h=1000"] }),
        json!({ "recording": true, "keep": true }),
        json!({ "recording": true, "scene": "sphere-on-plane" }),
        json!({ "recording": "yes" }),
        json!({ "recording": 1 }),
    ] {
        served.refuses(&wish, "");
    }
    let stale = json!({ "revision": 9, "recording": true });
    served.refuses(&stale, "revision 9");
    assert_eq!(served.standing("revision"), 1);
}
