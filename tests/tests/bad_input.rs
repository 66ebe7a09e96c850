//! Bad input: exit code 2, one sentence that says what, where and what to do, and nothing left running.

use std::net::UdpSocket;

use taut_link::create_key_file;
use taut_tests::workbench::TestWorkbench;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");

/// A scene that is good, to be broken.
const SCENE: &str = r#"
name = "ball"

[god_object]
shape = { sphere = { radius = 0.02, subdivisions = 2 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.05] }

[[obstacle]]
name = "plane"
shape = { plane = { size = 0.4, thickness = 0.05 } }
"#;
const TRACE: &str = "t,x,y,z,qw,qx,qy,qz\n0.0,0,0,0.05,1,0,0,0\n0.1,0,0,0.04,1,0,0,0\n";
/// A tetrahedron without its last face.
const OPEN_MESH: &str = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";

/// Runs to a refusal whose one sentence has all `parts`.
fn refused(workbench: &TestWorkbench, case: &str, arguments: &[&str], parts: &[&str]) {
    // `run` also fails when a process is left behind.
    let ended = workbench.run(case, arguments);
    assert_eq!(
        ended.status.code(),
        Some(2),
        "{case}: {}\n{}",
        ended.status,
        ended.stderr
    );
    assert_eq!(ended.stdout, "", "{case}");
    let sentence = ended.one_sentence();
    println!("{case}: {sentence}");
    assert!(sentence.starts_with("taut: "), "{case}: {sentence}");
    for part in parts {
        assert!(
            sentence.contains(part),
            "{case}: \"{part}\" is not in: {sentence}"
        );
    }
}

fn replaced(text: &str, what: &str, by: &str) -> String {
    assert!(text.contains(what), "{what}");
    text.replace(what, by)
}

/// A replay that is refused, and leaves no answer.
fn replay_refused(
    workbench: &TestWorkbench,
    case: &str,
    (scene, trace): (&str, &str),
    more: &[&str],
    parts: &[&str],
) {
    let files = ["--scene", scene, "--trace", trace, "--out", "answer.csv"];
    let arguments = [&["replay"][..], &files, more].concat();
    refused(workbench, case, &arguments, parts);
    let answer = workbench.directory().join("answer.csv");
    assert!(!answer.exists(), "{case}: an answer was left");
}

/// One fault of each kind of file; all others of each are told by the same readers (`server/scene/tests/files`).
#[test]
fn a_broken_scene_mesh_or_trace_is_refused_by_file_and_place() {
    let workbench = TestWorkbench::new(PROGRAM);
    let trace = workbench.write("trace.csv", TRACE);
    workbench.write("open.obj", OPEN_MESH);
    let broken = |case: &str, text: &str, parts: &[&str]| {
        let scene = workbench.write("scene.toml", text);
        replay_refused(&workbench, case, (&scene, &trace), &[], parts);
    };
    broken(
        "unknown key",
        &format!("{SCENE}\n[limits]\nforse = 1.0\n"),
        &["scene.toml:14", "`forse`", "`force`"],
    );
    let sphere = "{ sphere = { radius = 0.02, subdivisions = 2 } }";
    broken(
        "open mesh",
        &replaced(SCENE, sphere, "{ mesh = \"open.obj\" }"),
        &["scene.toml:5", "open.obj"],
    );
    broken(
        "penetration",
        &replaced(SCENE, "0.0, 0.05]", "0.0, 0.01]"),
        &["scene.toml:", "penetration", "\"plane\"", "god_object.pose"],
    );
    let replay = |case: &str, scene: &str, trace: &str, more: &[&str], parts: &[&str]| {
        replay_refused(&workbench, case, (scene, trace), more, parts);
    };
    let gone = ["gone.toml", "check the path"];
    replay("no scene", "gone.toml", &trace, &[], &gone);
    let known = ["three-bunnies", "two-bunnies"];
    replay("unknown name", "three-bunnies", &trace, &[], &known);
    let shipped = "sphere-on-plane";
    let set = ["--set", "coupling.k_z=1.0"];
    let meant = ["k_z", "did you mean"];
    replay("unknown override", shipped, &trace, &set, &meant);
    let gone = ["gone.csv", "check the path"];
    replay("no trace", shipped, "gone.csv", &[], &gone);
    let turned = workbench.write("turned.csv", replaced(TRACE, "0.04,1,", "0.04,2,"));
    let norm = ["turned.csv:3", "norm"];
    replay("no quaternion", shipped, &turned, &[], &norm);
}

#[test]
fn a_broken_workbench_is_refused_and_nothing_of_it_starts() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    let key = workbench.key_path();
    let good = workbench.file.clone();
    let scene = workbench.write("inside.toml", replaced(SCENE, "0.0, 0.05]", "0.0, 0.01]"));
    let serve = |workbench: &TestWorkbench, case: &str, arguments: &[&str], parts: &[&str]| {
        let config = workbench.save();
        let always = ["serve", "--config", &config, "--key", &key];
        refused(workbench, case, &[&always, arguments].concat(), parts);
    };

    workbench.set("network.broadcast_rte", 1000);
    serve(
        &workbench,
        "unknown key",
        &[],
        &["workbench.toml:", "broadcast_rte", "broadcast_rate"],
    );

    workbench.file = good;
    serve(
        &workbench,
        "start in penetration",
        &["--scene", &scene],
        &[
            "inside.toml:",
            "starts in penetration of obstacle \"plane\"",
        ],
    );
    serve(
        &workbench,
        "no scene",
        &["--scene", "absent.toml"],
        &["absent.toml"],
    );

    // Whichever of the two ports is taken, the other one is given back.
    let taken = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    let address = taken.local_addr().expect("an address").to_string();
    serve(
        &workbench,
        "control port in use",
        &["--quic", &address],
        &[&address, "in use", "another port"],
    );
    serve(
        &workbench,
        "state port in use",
        &["--udp", &address],
        &[&address, "in use", "another port"],
    );

    refused(
        &workbench,
        "no workbench file",
        &["serve", "--config", "gone.toml", "--key", &key],
        &["gone.toml", "check the path"],
    );
}

#[test]
fn a_key_that_cannot_be_used_is_refused_by_its_file() {
    let workbench = TestWorkbench::new(PROGRAM);
    let config = workbench.save();
    let short = workbench.write("short.key", "abc");
    let serve = ["serve", "--config", &config];
    refused(
        &workbench,
        "no key",
        &serve,
        &["cluster key", "taut keys", "--key"],
    );
    refused(
        &workbench,
        "key file is gone",
        &[&serve[..], &["--key", "gone.key"]].concat(),
        &["gone.key"],
    );
    refused(
        &workbench,
        "short key",
        &[&serve[..], &["--key", &short]].concat(),
        &["short.key"],
    );
    let existing = workbench.directory().join("existing.key");
    create_key_file(&existing).unwrap_or_else(|error| panic!("{error}"));
    let before = std::fs::read(&existing).expect("a key file");
    refused(
        &workbench,
        "key file exists",
        &["keys", "--out", &existing.display().to_string()],
        &["existing.key"],
    );
    assert_eq!(std::fs::read(&existing).expect("a key file"), before);
}

#[test]
fn a_server_that_is_not_there_is_named() {
    let workbench = TestWorkbench::new(PROGRAM);
    let key = workbench.key_path();
    // A port that was free a moment ago.
    let address = UdpSocket::bind("127.0.0.1:0")
        .and_then(|socket| socket.local_addr())
        .expect("a socket")
        .to_string();
    let mut roles = vec![("bridge", vec![]), ("record", vec!["--out", "trace.csv"])];
    match workbench.adapter() {
        Ok(()) => roles.push(("render", vec!["--headless", "--node", "front"])),
        Err(reason) => taut_test_kit::left_out(format_args!("render without a server: {reason}")),
    }
    for (role, arguments) in roles {
        let join = |server| {
            let always = [role, "--server", server, "--key", &key];
            [&always, &arguments[..]].concat()
        };
        refused(&workbench, role, &join(&address), &[&address, "firewall"]);
        let case = format!("{role} to nonsense");
        refused(&workbench, &case, &join("haptic pc"), &["haptic pc"]);
    }
    assert!(!workbench.directory().join("trace.csv").exists());
}
