//! What an operator may change, who may, and what the file has of it.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::{SCENE, bench, serve};
use crate::operator::{Served, TOKEN};
use crate::support::{PATIENCE, Workplace, wait_until};

#[test]
fn what_cannot_be_taken_changes_nothing_and_says_why() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let text = "plate.surface.friction";
    for (edit, part) in [
        ("plaet.color=\"#ffffff\"", "did you mean `plate`"),
        ("plate.surface.friction=nan", "NaN"),
        ("plate.surface.friction=-1", text),
        ("plate.pose.position=[0, 0, inf]", "finite"),
        // The ball would start within it; out of what travels; stiffer than the device bears.
        ("plate.pose.position=[0, 0, 0.02]", "start"),
        ("plate.pose.position=[2e6, 0, 0]", "out of its range"),
        ("coupling.k_h=1e9", "stiff"),
        ("plate=2", "write plate.KEY=VALUE"),
        ("limits.force=1000", "no \"limits\""),
        ("plate.surface.friction=0.2", "already"),
        ("plate.shape.mesh=/etc/passwd", "no key that can be changed"),
    ] {
        let (status, said) = served.edit(&json!({ "edits": [edit], "keep": true }));
        assert_eq!(status, 409, "{edit}: {said}");
        assert!(
            said.contains(part) && said.contains("not taken"),
            "{edit}: {said}"
        );
    }
    // One of several: none.
    let two = ["plate.color=\"#ffffff\"", "plate.opacity=7"];
    served.refuses(&json!({ "edits": two }), "");
    for wish in [
        json!({}),
        json!({ "scene": "other.toml" }),
        json!({ "scene": "../../etc/passwd" }),
        json!({ "edits": "x" }),
        json!([]),
    ] {
        served.refuses(&wish, "");
    }
    assert_eq!(served.revision(), 1);
    assert_eq!(served.file(), SCENE);
    assert_eq!(served.plate("color"), "#c03030");
    assert!(!served.says(&["event=\"edit\""]));
    assert!(!served.says(&["another session begins"]));

    // Recorded is one scene.
    drop(served);
    let place = Workplace::new();
    place.write("bench.toml", SCENE);
    let recording = place.text("recording");
    let served = Served::start_in(place, &bench(&[]), &["--recording", &recording]);
    served.refuses(&json!({ "edits": ["plate.color=\"#ffffff\""] }), "recorded");
}

#[test]
fn who_may_not_change_it_costs_nobody_anything() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let host = served.host();
    let shown = format!("{host}Authorization: Bearer {TOKEN}\r\n");
    let body = json!({ "edits": ["plate.color=\"#ffffff\""] }).to_string();
    let sized = |head: &str, length: usize| format!("{head}Content-Length: {length}\r\n");
    for (head, status) in [
        (sized(&host, body.len()), 401),
        (
            sized(
                &format!("{host}Authorization: Bearer 0123456789abcdef0123456789abcdeF\r\n"),
                body.len(),
            ),
            401,
        ),
        (
            sized(
                &format!("{shown}Origin: http://evil.example\r\n"),
                body.len(),
            ),
            403,
        ),
        (
            sized(
                &format!("Host: rebound.example\r\nAuthorization: Bearer {TOKEN}\r\n"),
                body.len(),
            ),
            403,
        ),
        (sized(&shown, 1_000_000_000), 413),
        (shown.clone(), 411),
    ] {
        let (found, said) = served.post(&head, &body);
        assert_eq!(found, status, "{head} {said}");
    }
    assert_eq!(served.ask("GET /edit", &shown).0, 405);
    // One that says more than it sends is let go of, and nobody waits for it.
    let silent: Vec<_> = (0..20)
        .map(|_| served.send("POST /edit", &sized(&shown, 60_000)))
        .collect();
    // As fast as they go, of a holder of the token and of others.
    let begun = Instant::now();
    let mut sent = 0;
    while begun.elapsed() < Duration::from_secs(2) {
        let stale = json!({ "revision": 99, "edits": ["plate.color=\"#ffffff\""] });
        served.refuses(&stale, "revision 99");
        assert_eq!(served.post(&sized(&host, body.len()), &body).0, 401);
        sent += 2;
    }
    let t = served.now("t").as_f64().expect("a number");
    wait_until("the page goes on", || served.now("t").as_f64() > Some(t));
    assert_eq!(served.ask("POST /disarm", &served.with_token()).0, 200);
    assert_eq!(served.revision(), 1, "after {sent} requests");
    let refused = served.lines_with(&["event=\"refused\""]);
    assert!(refused < 20, "{refused} lines: {}", served.text());
    drop(silent);
    a_flood_of_changes_leaves_the_session_some_time(&served);
}

/// Each could be taken: one a second at most is.
fn a_flood_of_changes_leaves_the_session_some_time(served: &Served) {
    let begun = Instant::now();
    let mut taken = 0;
    while begun.elapsed() < Duration::from_secs(4) {
        let (status, _) =
            served.edit(&json!({ "edits": [format!("plate.opacity=0.{}", 1 + taken % 9)] }));
        taken += u64::from(status == 200);
    }
    let most = 1 + begun.elapsed().as_secs();
    assert!(
        (1..=most).contains(&taken),
        "{taken} in {:?}",
        begun.elapsed()
    );
    assert_eq!(served.revision(), 1 + taken);
}

#[test]
fn of_two_editors_the_later_one_builds_upon_the_first_or_hears_that_it_was_faster() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let friction = |value: &str| json!({ "revision": 1, "edits": [format!("plate.surface.friction={value}")] });
    let answers: Vec<(u16, String)> = std::thread::scope(|scope| {
        let editors = ["0.4", "0.6"].map(|value| {
            let served = &served;
            scope.spawn(move || served.edit(&friction(value)))
        });
        editors
            .map(|editor| editor.join().expect("no panic"))
            .into()
    });
    let mut taken = answers
        .iter()
        .zip(["0.4", "0.6"])
        .filter(|((status, _), _)| *status == 200);
    let (_, first) = taken.next().expect("one of them");
    assert!(taken.next().is_none(), "{answers:?}");
    let refused = answers
        .iter()
        .find(|(status, _)| *status == 409)
        .expect("the other");
    assert!(
        refused.1.contains("revision 1") || refused.1.contains("just being taken"),
        "{refused:?}"
    );
    assert_eq!(served.plate("friction").to_string(), first);
    // Of whatever runs: both stand.
    let said = served.edits(
        &["plate.color=#30c030", "coupling.k_h=1500"],
        "revision 3 runs",
    );
    assert!(
        said.contains("\nwarning: ") && said.contains("lets go"),
        "{said}"
    );
    let scene = served.scene();
    assert_eq!(scene["scene"]["objects"][1]["friction"].to_string(), first);
    assert_eq!(scene["scene"]["objects"][1]["color"], "#30c030");
    assert_eq!(scene["scene"]["coupling"]["stiffness"], 1500.0);
    assert_eq!(
        scene["standing"]["not_kept"].as_array().map(Vec::len),
        Some(4)
    );
    served.edits_not(
        &["--revision", "2", "plate.color=#3030c0"],
        "revision 2 of the scene, and 3 runs",
    );
    let said = served.edits(&[], "plate.color=\"#30c030\"");
    assert!(said.contains("  plate.roughness: as usual\n"), "{said}");
    assert!(
        said.contains("not in the file: coupling.k_h: as usual -> 1500"),
        "{said}"
    );
}

#[test]
fn what_is_kept_is_in_the_file_with_its_comments_and_no_other_change_of_the_file_is_lost() {
    let served = serve(&[], &["--follow-scene"]);
    served.wait_for_run("paused");
    served.edits(&["plate.surface.friction=0.5"], "does not have it");
    served.edits(&["--keep", "plate.color=#30c030"], "the file has it");
    let kept = SCENE
        .replace("\"#c03030\" # red", "\"#30c030\" # red")
        .replace("friction = 0.2", "friction = 0.5");
    assert_eq!(served.file(), kept);
    assert_eq!(served.scene()["standing"]["not_kept"], json!([]));
    // Its own writing is no change of the file: a change of somebody's is.
    served.edits(&["plate.opacity=0.5"], "revision 4 runs");
    assert_eq!(served.file(), kept);
    served.place.write(
        "bench.toml",
        &kept.replace("friction = 0.5", "friction = 0.7"),
    );
    let (code, said) = served.taut_edit(&["--keep"]);
    let is_refused = code == Some(2) && said.contains("was changed since it was read");
    // On a busy machine it comes to the session that has read the file.
    let is_of_next = code == Some(2) && said.contains("went with that") && served.revision() == 5;
    assert!(is_refused || is_of_next, "{said}");
    wait_until("the file is followed", || served.revision() == 5);
    served.edits_not(&["--keep"], "went with that (plate.opacity");
    assert!(
        served.says(&["not kept in a file, is gone", "plate.opacity"]),
        "{}",
        served.text()
    );
    assert_eq!(served.plate("friction"), 0.7);
    assert_eq!(served.plate("opacity"), 1.0);
    // Later, by itself: what was changed before.
    served.edits(&["plate.opacity=0.25"], "");
    wait_until("kept", || served.taut_edit(&["--keep"]).0 == Some(0));
    assert!(served.file().contains("opacity = 0.25") && served.file().contains("# The plate"));
    assert_eq!(served.revision(), 6, "no session for that");
    served.edits(&["plate.opacity=1"], "revision 7");
}

#[test]
fn what_runs_already_is_kept_without_another_session() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let edit = "plate.surface.friction=0.5";
    served.edits(&[edit], "does not have it");
    served.edits(&["--keep", edit], "kept: ");
    let kept = SCENE.replace("friction = 0.2", "friction = 0.5");
    assert_eq!(served.file(), kept);
    assert_eq!(served.scene()["standing"]["not_kept"], json!([]));
    assert_eq!(served.revision(), 2, "no session for that");
    // The file has it now.
    served.edits_not(&["--keep", edit], "already");
}

#[test]
fn another_scene_is_chosen_of_those_that_the_workbench_file_names() {
    let changes = [
        ("rearm = \"manual\"", "rearm = \"automatic\""),
        (
            "token_file = \"operator",
            "scenes = [\"other.toml\", \"peg-in-a-hole\"]\ntoken_file = \"operator",
        ),
    ];

    let served = serve(&changes, &["--follow-scene"]);
    let session = |key: &str| {
        served
            .status()
            .map_or(Value::Null, |status| status["session"][key].clone())
    };
    served.wait_for_run("running");
    let instance = session("instance");
    // Somebody has taken the force away: no change of the scene brings it back.
    assert_eq!(served.ask("POST /disarm", &served.with_token()).0, 200);
    served.wait_for_run("paused");
    served.takes(&json!({ "scene": "other.toml", "edits": ["plate.color=\"#30c030\""] }));
    wait_until("the other scene", || session("scene") == "other");
    assert_eq!(session("instance"), instance, "the same page");
    served.wait_for_run("paused");
    assert!(served.now("force_n") == 0.0);
    served.takes(&json!({ "scene": "peg-in-a-hole" }));
    let kept = json!({ "edits": ["god_object.color=\"#ffffff\""], "keep": true });
    served.refuses(&kept, "no file");
    assert_eq!(served.ask("POST /arm", &served.with_token()).0, 200);
    served.wait_for_run("running");
    // The one that the workbench file names stays one of them.
    served.takes(&json!({ "scene": "bench.toml" }));
    wait_until("the bench again", || session("scene") == "bench");
    served.wait_for_run("running");
    served.takes(&json!({ "scene": "other.toml" }));
    wait_until("the other scene", || session("scene") == "other");
    // The workbench file names another: that counts again.
    let text = std::fs::read_to_string(served.place.path("workbench.toml")).expect("a file");
    let begun = Instant::now();
    served.place.write(
        "workbench.toml",
        &text.replacen("scene = \"bench.toml\"", "scene = \"sphere-on-plane\"", 1),
    );
    wait_until("the named one", || session("scene") == "sphere-on-plane");
    assert!(begun.elapsed() < PATIENCE);
    served.wait_for_run("running");
}
