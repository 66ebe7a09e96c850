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

#[test]
fn a_broken_scene_or_mesh_is_refused_by_file_and_key() {
    let workbench = TestWorkbench::new(PROGRAM);
    let trace = workbench.write("trace.csv", TRACE).display().to_string();
    workbench.write("open.obj", OPEN_MESH);
    workbench.write("rubbish.ply", "ply\nthis is no mesh\n");
    let broken = |case: &str, text: &str, parts: &[&str]| {
        let scene = workbench.write("scene.toml", text).display().to_string();
        refused(
            &workbench,
            case,
            &[
                "replay",
                "--scene",
                &scene,
                "--trace",
                &trace,
                "--out",
                "answer.csv",
            ],
            parts,
        );
        assert!(
            !workbench.directory().join("answer.csv").exists(),
            "{case}: an answer was left"
        );
    };
    let sphere = "{ sphere = { radius = 0.02, subdivisions = 2 } }";
    broken(
        "nan",
        &replaced(SCENE, "0.0, 0.05]", "nan, 0.05]"),
        &["scene.toml:7", "position"],
    );
    broken(
        "zero mass",
        &replaced(SCENE, "mass = 1.0", "mass = 0.0"),
        &["scene.toml:6", "mass"],
    );
    broken(
        "unknown key",
        &format!("{SCENE}\n[limits]\nforse = 1.0\n"),
        &["scene.toml:14", "`forse`", "`force`"],
    );
    broken("no toml", "name = \"ball", &["scene.toml:1"]);
    broken(
        "no mesh file",
        &replaced(SCENE, sphere, "{ mesh = \"missing.ply\" }"),
        &["scene.toml:5", "missing.ply", "check the path"],
    );
    broken(
        "open mesh",
        &replaced(SCENE, sphere, "{ mesh = \"open.obj\" }"),
        &["scene.toml:5", "open.obj"],
    );
    broken(
        "rubbish mesh",
        &replaced(SCENE, sphere, "{ mesh = \"rubbish.ply\" }"),
        &["rubbish.ply"],
    );
    broken(
        "penetration",
        &replaced(SCENE, "0.0, 0.05]", "0.0, 0.01]"),
        &["scene.toml:", "penetration", "\"plane\"", "god_object.pose"],
    );
    refused(
        &workbench,
        "no scene",
        &[
            "replay",
            "--scene",
            "gone.toml",
            "--trace",
            &trace,
            "--out",
            "answer.csv",
        ],
        &["gone.toml", "check the path"],
    );
    refused(
        &workbench,
        "no such shipped scene",
        &[
            "replay",
            "--scene",
            "three-bunnies",
            "--trace",
            &trace,
            "--out",
            "answer.csv",
        ],
        &["three-bunnies", "two-bunnies"],
    );
    let set = [
        "replay",
        "--scene",
        "sphere-on-plane",
        "--trace",
        &trace,
        "--out",
        "answer.csv",
        "--set",
        "coupling.k_z=1.0",
    ];
    refused(
        &workbench,
        "unknown override",
        &set,
        &["k_z", "did you mean"],
    );
}

#[test]
fn a_broken_trace_is_refused_by_its_line() {
    let workbench = TestWorkbench::new(PROGRAM);
    let broken = |case: &str, text: &str, parts: &[&str]| {
        let trace = workbench.write("trace.csv", text).display().to_string();
        refused(
            &workbench,
            case,
            &[
                "replay",
                "--scene",
                "sphere-on-plane",
                "--trace",
                &trace,
                "--out",
                "answer.csv",
            ],
            parts,
        );
    };
    broken(
        "nan",
        &replaced(TRACE, "0.04", "NaN"),
        &["trace.csv:3", "z"],
    );
    broken(
        "time runs back",
        &replaced(TRACE, "0.1,", "-0.1,"),
        &["trace.csv:3", "increase"],
    );
    broken(
        "no quaternion",
        &replaced(TRACE, "0.04,1,", "0.04,2,"),
        &["trace.csv:3", "norm"],
    );
    broken(
        "no header",
        "0.0,0,0,0.05,1,0,0,0\n",
        &["trace.csv:1", "t,x,y,z"],
    );
    let gone = [
        "replay",
        "--scene",
        "sphere-on-plane",
        "--trace",
        "gone.csv",
        "--out",
        "answer.csv",
    ];
    refused(
        &workbench,
        "no trace",
        &gone,
        &["gone.csv", "check the path"],
    );
    assert!(!workbench.directory().join("answer.csv").exists());
}

#[test]
fn a_broken_workbench_is_refused_and_nothing_of_it_starts() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    let key = workbench.key_path();
    let good = workbench.file.clone();
    let scene = workbench
        .write("inside.toml", replaced(SCENE, "0.0, 0.05]", "0.0, 0.01]"))
        .display()
        .to_string();
    let serve = |workbench: &TestWorkbench, case: &str, arguments: &[&str], parts: &[&str]| {
        let config = workbench
            .write("workbench.toml", workbench.file.to_string())
            .display()
            .to_string();
        refused(
            workbench,
            case,
            &[&["serve", "--config", &config, "--key", &key], arguments].concat(),
            parts,
        );
    };

    let mut twins = good.clone();
    let nodes = twins
        .get_mut("node")
        .and_then(toml::Value::as_array_mut)
        .expect("the workbench has nodes");
    nodes[1]
        .as_table_mut()
        .expect("a table")
        .insert("name".into(), "front".into());
    workbench.file = twins;
    serve(
        &workbench,
        "two nodes of one name",
        &[],
        &["workbench.toml:", "front", "two nodes"],
    );

    workbench.file = good.clone();
    workbench.set("network.broadcast_rte", 1000);
    serve(
        &workbench,
        "unknown key",
        &[],
        &["workbench.toml:", "broadcast_rte", "broadcast_rate"],
    );

    workbench.file = good.clone();
    workbench.set("viewer.eye_separation", f64::NAN);
    serve(
        &workbench,
        "nan",
        &[],
        &["workbench.toml:", "eye_separation"],
    );

    workbench.file = good.clone();
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
    serve(
        &workbench,
        "no such shipped scene",
        &["--scene", "no-such-scene"],
        &["no-such-scene", "peg-in-a-hole"],
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
    let config = workbench
        .write("workbench.toml", workbench.file.to_string())
        .display()
        .to_string();
    let short = workbench.write("short.key", "abc").display().to_string();
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
        refused(
            &workbench,
            role,
            &[&[role, "--server", &address, "--key", &key], &arguments[..]].concat(),
            &[&address, "firewall"],
        );
        let nonsense = [
            &[role, "--server", "haptic pc", "--key", &key],
            &arguments[..],
        ]
        .concat();
        refused(
            &workbench,
            &format!("{role} to nonsense"),
            &nonsense,
            &["haptic pc"],
        );
    }
    assert!(!workbench.directory().join("trace.csv").exists());
}
