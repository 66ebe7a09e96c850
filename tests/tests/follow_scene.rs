//! A scene that is edited while it is served: nodes and bridge follow, a scene that cannot be served changes nothing, and force comes from a person again.

use std::path::Path;
use std::time::Duration;

use taut_tests::patience::wait_for;
use taut_tests::workbench::TestWorkbench;
use toml::{Table, Value};

use crate::support::{SMALL, draws};

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Longest wait for what takes a second: a debug build on a busy machine.
const LIMIT: Duration = Duration::from_secs(60);

/// A ball over a block of this colour and friction.
fn scene(color: &str, friction: f64) -> String {
    format!(
        "name = \"edited\"\n[god_object]\nshape = {{ sphere = {{ radius = 0.02 }} }}\nmass = 1.0\npose = {{ position = [0.0, 0.0, 0.05] }}\n\
         [[obstacle]]\nname = \"block\"\nshape = {{ box = {{ half_extents = [0.05, 0.05, 0.02] }} }}\ncolor = \"{color}\"\n\
         surface = {{ friction = {friction} }}\n"
    )
}

fn pictures(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

#[test]
fn nodes_follow_a_scene_that_is_edited_and_one_that_is_wrong_changes_nothing() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    if !draws(&workbench) {
        return;
    }
    workbench.log = Some("warn,taut=info");
    let file = workbench.write("edited.toml", scene("#c03030", 0.2));
    workbench.set("scene", file);
    let mut server = workbench.serve(&["--follow-scene"]);
    let drawn = workbench.directory().join("pictures");
    let out = drawn.display().to_string();
    // Without --stay: it is no end of the server.
    let small = [&SMALL[..], &["--out", &out]].concat();
    let node = workbench.join("render", "front", &server, &small);
    server.process.line_with(&["front joined"], 1);
    wait_for("a picture", LIMIT, || (pictures(&drawn) > 0).then_some(()));

    // A fault of the file, and one that only shows when a session is to begin: the ball starts within the block.
    workbench.write(
        "edited.toml",
        "name = \"edited\"\n[god_object]\nmass = -1\n",
    );
    server
        .process
        .line_with(&["the changed scene is not taken"], 1);
    let within = scene("#c03030", 0.2).replace("0.0, 0.0, 0.05", "0.0, 0.0, 0.03");
    workbench.write("edited.toml", within);
    server
        .process
        .line_with(&["the changed scene is not taken"], 2);
    let before = pictures(&drawn);
    wait_for("it goes on", LIMIT, || {
        (pictures(&drawn) > before + 2).then_some(())
    });

    workbench.write("edited.toml", scene("#30c030", 0.5));
    server.process.line_with(&["is taken: the force fades"], 1);
    server.process.line_with(&["front joined"], 2);
    let before = pictures(&drawn);
    wait_for("pictures of the new scene", LIMIT, || {
        (pictures(&drawn) > before + 2).then_some(())
    });
    // Another scene by its name in the workbench file.
    workbench.set("scene", "peg-in-a-hole");
    workbench.save();
    server.process.line_with(&["is taken: the force fades"], 2);
    server.process.line_with(&["front joined"], 3);
    let report = node.leave();
    assert!(report.contains("sessions: 3"), "{report}");
    let report = server.stop();
    assert_eq!(report["penetrations"].as_u64(), Some(0), "{report}");
}

#[test]
fn a_bridge_follows_to_a_scene_in_which_its_body_starts_elsewhere() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.log = Some("warn,taut=info");
    let file = workbench.write("edited.toml", scene("#c03030", 0.2));
    workbench.set("scene", file);
    let remote = Table::from_iter([("kind".to_owned(), Value::from("remote"))]);
    workbench.set("device", remote);
    let mut server = workbench.serve(&["--follow-scene"]);
    let bridge = workbench.join("bridge", "bridge", &server, &["--json"]);
    server.process.line_with(&["bridge joined as"], 1);
    let elsewhere = scene("#c03030", 0.2).replace("0.0, 0.0, 0.05", "0.02, 0.0, 0.06");
    workbench.write("edited.toml", elsewhere);
    server.process.line_with(&["is taken: the force fades"], 1);
    server.process.line_with(&["bridge joined as"], 2);
    wait_for("the bridge says so", LIMIT, || {
        let said = bridge.stderr();
        said.contains("joined another scene (edited)").then_some(())
    });
    bridge.leave();
    let report = server.stop();
    assert_eq!(report["penetrations"].as_u64(), Some(0), "{report}");
}
