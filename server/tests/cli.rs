//! The program from outside: what bad input gives, and that nothing is left running or lying about.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::support::{PATIENCE, Running, Workplace, free_address, refusal, taut, workbench};

/// The command is refused with exit code 2 and one sentence that holds all of `parts`.
fn refused<S: AsRef<std::ffi::OsStr>>(arguments: &[S], parts: &[&str]) {
    let begun = Instant::now();
    let output = taut(arguments);
    let error = refusal(&output);
    assert!(begun.elapsed() < PATIENCE, "took {:?}", begun.elapsed());
    assert!(error.starts_with("taut: "), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    assert!(
        output.stdout.is_empty(),
        "{:?}",
        String::from_utf8_lossy(&output.stdout)
    );
    for part in parts {
        assert!(error.contains(part), "\"{part}\" is missing: {error}");
    }
}

#[test]
fn every_command_has_help_with_an_example() {
    let commands = "demo serve render bridge replay record export check import preview calibrate doctor keys setup
        deploy simulate-device";
    for command in commands.split_whitespace() {
        let output = taut(&[command, "--help"]);
        assert!(output.status.success(), "{command}");
        assert!(
            String::from_utf8_lossy(&output.stdout).contains("Example"),
            "{command}"
        );
    }
}

/// Who reads may stop reading: `taut doctor | head -1`.
#[test]
fn a_reader_that_goes_away_ends_a_command_quietly() {
    let place = Workplace::new();
    let (key, trace, out) = (
        place.text("other.key"),
        place.text("hand.csv"),
        place.text("out.csv"),
    );
    place.write(
        "hand.csv",
        "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.1,1,0,0,0\n1,0,0,0.1,1,0,0,0\n",
    );
    let workbench = place.text("workbench.toml");
    let replay = [
        "replay",
        "--json",
        "--scene",
        "sphere-on-plane",
        "--trace",
        &trace,
        "--out",
        &out,
    ];
    for arguments in [
        [].as_slice(),
        &["--help"],
        &["doctor"],
        &["doctor", "--json"],
        &["check", "--json", &workbench],
        &["check", &workbench],
        &["keys", "--out", &key],
        &replay,
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_taut"))
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{error}"));
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap_or_else(|e| panic!("{e}"));
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
        assert!(!error.contains("panic"), "{arguments:?}: {error}");
    }
}

/// Of three libraries one loads, one is no library, and one needs what is not there.
#[test]
fn doctor_says_which_vendors_libraries_can_be_loaded() {
    let place = Workplace::new();
    place.write(
        "broken.c",
        "extern int xdr_of_nobody(void);\nint virtOpen(void) { return xdr_of_nobody(); }\n",
    );
    place.write("whole.c", "int dhdOpen(void) { return 0; }\n");
    place.write("libHD.so", "no library\n");
    for (source, library) in [("whole.c", "libdhd.so"), ("broken.c", "libVirtuoseAPI.so")] {
        let built = Command::new("cc")
            .args(["-shared", "-fPIC", "-o"])
            .args([place.path(library), place.path(source)])
            .status();
        assert!(built.expect("no cc").success(), "{library}");
    }
    let says = |found: Option<&Path>| {
        let mut doctor = Command::new(env!("CARGO_BIN_EXE_taut"));
        match found {
            Some(folder) => doctor.env("LD_LIBRARY_PATH", folder),
            None => doctor.env_remove("LD_LIBRARY_PATH"),
        };
        let output = doctor.arg("doctor").output().expect("no doctor");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let with = says(Some(&place.path("")));
    let lines: Vec<&str> = with
        .lines()
        .filter(|line| line.contains("vendor"))
        .collect();
    let [dhd, hd, virtuose] = lines.as_slice() else {
        panic!("{with}");
    };
    assert!(
        dhd.starts_with("ok  vendor's library: libdhd.so") && dhd.contains("plugin:./taut_dhd.so"),
        "{dhd}"
    );
    assert!(hd.starts_with("--") && hd.contains("libHD.so"), "{hd}");
    assert!(
        virtuose.starts_with("--") && virtuose.contains("xdr_of_nobody"),
        "{virtuose}"
    );
    assert!(with.contains("mend: LD_PRELOAD=libtirpc.so.3"), "{with}");
    let without = says(None);
    assert!(
        without.contains("ok  vendors' libraries: none of libdhd.so"),
        "{without}"
    );
}

#[test]
fn the_version_names_the_build() {
    let output = taut(&["--version"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for part in ["commit ", "features ", "target "] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn without_a_command_it_says_how_to_begin_and_starts_nothing() {
    let output = taut::<&str>(&[]);
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        text.contains("taut demo") && text.contains("taut --help"),
        "{text}"
    );
}

#[test]
fn completions_and_manual_pages_name_every_command() {
    let place = Workplace::new();
    let commands = [
        "demo", "serve", "bridge", "replay", "record", "check", "import", "preview", "doctor",
        "keys",
    ];
    for shell in ["bash", "zsh", "fish"] {
        let output = taut(&["completions", shell]);
        let script = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            commands.iter().all(|command| script.contains(command)),
            "{shell}"
        );
    }
    let directory = place.text("man1");
    assert!(taut(&["man", "--out", &directory]).status.success());
    for command in commands {
        let page = place.path("man1").join(format!("taut-{command}.1"));
        let text = std::fs::read_to_string(&page).unwrap_or_default();
        assert!(text.contains("Example"), "{}", page.display());
    }
    assert!(place.path("man1").join("taut.1").exists());
}

#[test]
fn bad_usage_is_exit_code_2() {
    for arguments in [
        ["demo", "--no-such-option"].as_slice(),
        &["no-such-command"],
        &["replay"],
        &["demo", "--duration", "-1"],
    ] {
        assert_eq!(taut(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn check_names_what_serve_would_not_bear() {
    let place = Workplace::new();
    for (from, to, part) in [
        (
            "broadcast_rate = 1000 ",
            "broadcast_rate = 0.01 ",
            "broadcast_rate",
        ),
        (
            "# god_object_rate = 1000",
            "god_object_rate = 5",
            "god_object_rate",
        ),
        ("far = 20.0", "far = 1e9", "cannot be sent"),
    ] {
        let changed = workbench().replace(from, to);
        assert_ne!(changed, workbench(), "{from}");
        place.write("changed.toml", &changed);
        let output = taut(&["check", &place.text("changed.toml")]);
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(2), "{to}: {said}");
        assert!(said.contains(part), "{to}: {said}");
        assert_eq!(
            taut(&place.serve("changed.toml", "1", &[])).status.code(),
            Some(2)
        );
    }
}

/// The loop kept its rate, nothing was penetrated, and somebody was told of it.
fn assert_whole(report: &serde_json::Value) {
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
    // Periods that the loop was late for and skipped are counted: together they are its rate on any machine.
    let periods =
        number(&report["haptics_period_us"]["count"]) + number(&report["deadline_misses"]);
    assert!(periods > 900.0 * number(&report["duration_s"]), "{report}");
    assert_eq!(report["penetrations"], 0, "{report}");
    // Observers: one for each time that it was tried.
    for (key, least) in [
        ("penetration_checks", 1),
        ("packets_sent", 21),
        ("observers", 1),
    ] {
        assert!(report[key].as_u64() >= Some(least), "{key}: {report}");
    }
}

#[test]
fn a_session_is_served_recorded_and_ended_by_a_signal() {
    let place = Workplace::new();
    let address = free_address();
    let server = Running::start(&place.serve("workbench.toml", "60", &["--quic", &address]));

    // A client with another key is refused, and disturbs nobody.
    let other_key = place.text("other.key");
    assert!(taut(&["keys", "--out", &other_key]).status.success());
    let record = |key: &str, out: &str| {
        [
            "record",
            "--server",
            &address,
            "--key",
            &place.text(key),
            "--out",
            &place.text(out),
            "--duration",
            "1",
        ]
        .map(str::to_owned)
    };
    let begun = Instant::now();
    let recorded = loop {
        let output = taut(&record("cluster.key", "trace.csv"));
        if output.status.success() || begun.elapsed() > PATIENCE {
            break output;
        }
    };
    assert!(recorded.status.success(), "{recorded:?}");
    refused(&record("other.key", "refused.csv"), &["key"]);

    let checked = taut(&["check", &place.text("trace.csv")]);
    assert!(checked.status.success(), "{checked:?}");
    let rows =
        std::fs::read_to_string(place.path("trace.csv")).map_or(0, |text| text.lines().count());
    assert!(rows > 20, "{rows} rows in a second");

    let output = server.end("-TERM");
    assert!(output.status.success(), "{output:?}");
    assert_whole(&serde_json::from_slice(&output.stdout).unwrap_or_default());
}

#[test]
fn import_makes_a_scene_or_says_what_to_write() {
    let place = Workplace::new();
    // A tetrahedron of 30 mm, one of its faces turned.
    place.write(
        "part.obj",
        "v 0 0 0\nv 30 0 0\nv 0 30 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 1 3 4\nf 2 3 4\n",
    );
    let (part, out) = (place.text("part.obj"), place.text("out"));
    refused(
        &["import", &part, "--out", &out],
        &["part.obj", "--unit mm (0.0300 m)"],
    );
    assert!(!place.path("out").exists());
    let error = refusal(&taut(&["import", &part, "--out", &out, "--unit", "feet"]));
    assert!(
        error.contains("write one of m, dm, cm, mm, um, inch"),
        "{error}"
    );
    for option in ["--thicken", "--simplify"] {
        let error = refusal(&taut(&["import", &part, "--out", &out, option, "-1"]));
        assert!(
            error.contains(option) && error.contains("metres"),
            "{error}"
        );
    }
    let metres = taut(&["check", &part]);
    let millimetres = taut(&["check", &part, "--unit", "mm"]);
    for (output, size) in [
        (metres, "30.0000 x 30.0000"),
        (millimetres, "0.0300 x 0.0300"),
    ] {
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains(size), "{text}");
    }
    refused(
        &[
            "import", &part, "--out", &out, "--unit", "mm", "--only", "pin",
        ],
        &["no part has a node, object or group \"pin\""],
    );
    let output = taut(&["import", &part, "--out", &out, "--unit", "mm", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
    assert_eq!(
        report["parts"][0]["sources"][0]["findings"][0]["kind"],
        "triangles-turned"
    );
    assert_eq!(report["parts"][0]["sources"][0]["moved_m"], 0.0);
    let scene = report["scene"].as_str().unwrap_or_default();
    assert!(taut(&["check", scene]).status.success());
    // A picture, or a line that says why there is none.
    let notes = report["notes"].to_string();
    let drawn = report["picture"].is_string();
    assert_eq!(drawn, !notes.contains("no picture was drawn: "), "{report}");
    assert_eq!(drawn, place.path("out/picture.png").exists());
    refused(
        &["import", &part, "--out", &out, "--unit", "mm"],
        &["exists already"],
    );
}

#[test]
fn import_joins_files_of_their_own_units_and_splits_pieces() {
    let place = Workplace::new();
    let tetrahedron = |x: f64| {
        format!(
            "v {x} 0 0\nv {} 0 0\nv {x} 30 0\nv {x} 0 30\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
            x + 30.0
        )
    };
    place.write("a.obj", &tetrahedron(0.0));
    place.write("b.obj", &format!("g pin\n{}", tetrahedron(-40.0)));
    let (a, b, out) = (place.text("a.obj"), place.text("b.obj"), place.text("out"));
    let [in_a, in_b] = [&a, &b].map(|file| format!("both={file}"));
    let words = [
        "import", &in_a, &in_b, "--out", &out, "--json", "--unit", "mm",
    ];
    let parts = |words: &[&str]| {
        let output = taut(words);
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
        report["parts"].as_array().cloned().unwrap_or_default()
    };
    refused(
        &[&words[..], &["--unit", "c.obj=inch"]].concat(),
        &["--unit: names c.obj, but no part is called so"],
    );
    refused(
        &[&words[..], &["--unit", "cm"]].concat(),
        &["--unit: is written with two values for all parts"],
    );
    let joined = parts(&[&words[..], &["--unit", "b.obj=cm"]].concat());
    assert_eq!(joined.len(), 1);
    let units = [0, 1].map(|k| joined[0]["sources"][k]["unit"].clone());
    assert_eq!(units, ["mm", "cm"]);
    let volume = joined[0]["mesh"]["volume_m3"].as_f64().unwrap_or_default();
    let expected = 0.03_f64.powi(3) / 6.0 * 1001.0;
    assert!((volume / expected - 1.0).abs() < 1e-9, "{volume}");
    let out = place.text("split");
    let split = parts(&[
        "import",
        &a,
        &b,
        "--out",
        &out,
        "--json",
        "--unit",
        "mm",
        "--split",
        "--obstacle",
    ]);
    let bodies: Vec<&str> = split
        .iter()
        .filter_map(|part| part["body"].as_str())
        .collect();
    assert_eq!(bodies, ["a", "pin"]);
}

#[cfg(feature = "render")]
#[test]
fn a_preview_that_cannot_be_is_refused_before_anything_is_written() {
    let place = Workplace::new();
    place.write(
        "bad.toml",
        "name = \"x\"\n[god_object]\nmass = 1.0\nshape = { sphere = { radius = 0.01 } }\ncolor = \"redd\"\n",
    );
    let (bad, out) = (place.text("bad.toml"), place.text("out.png"));
    let nowhere = place.text("nowhere/out.png");
    refused(
        &["preview", &bad, "--out", &out],
        &[
            "bad.toml:5",
            "`color` in [god_object] is \"redd\"",
            "#rrggbb",
        ],
    );
    refused(
        &["preview", "peg-in-a-hole", "--out", &nowhere],
        &["there is no folder", "--out"],
    );
    let usage = |arguments: &[&str], expected: &str| {
        let words = [&["preview", "peg-in-a-hole", "--out"], arguments].concat();
        let error = refusal(&taut(&words));
        assert!(error.contains(expected), "{error}");
    };
    usage(&["picture.jpg"], "ends in .png");
    usage(&[&out, "--size", "640"], "such as 1280x960");
    usage(&[&out, "--size", "0x640"], "from 1 to 8192");
    usage(&[&out, "--orbit", "0"], "1..=3600");
    usage(&[&out, "--film", "0"], "from 0.1 to 60");
    usage(&[&out, "--gpu", "no-such-card"], "no");
    assert!(!place.path("out.png").exists());
}

#[test]
fn check_lists_every_fault_and_tells_good_from_bad() {
    let place = Workplace::new();
    place.write(
        "bad.toml",
        "name = \"x\"\nspeed = 3\n[god_object]\nmass = -1.0\n",
    );
    let good = taut(&[
        "check",
        &place.text("workbench.toml"),
        "peg-in-a-hole",
        "--json",
    ]);
    assert!(
        good.status.success(),
        "{}",
        String::from_utf8_lossy(&good.stdout)
    );
    let bad = taut(&[
        "check",
        &place.text("workbench.toml"),
        &place.text("bad.toml"),
        "--json",
    ]);
    assert_eq!(bad.status.code(), Some(2));
    let reports: serde_json::Value = serde_json::from_slice(&bad.stdout).unwrap_or_default();
    assert_eq!(reports[0]["problems"].as_array().map(Vec::len), Some(0));
    assert!(
        reports[1]["problems"]
            .as_array()
            .is_some_and(|problems| problems.len() >= 2),
        "{reports}"
    );
}

#[test]
fn an_answer_is_written_beside_its_name_until_it_is_whole() {
    let place = Workplace::new();
    let out = place.path("no-such-directory").join("out.csv");
    place.write("trace.csv", "t,x,y,z,qw,qx,qy,qz\n0,0.05,0,0.04,1,0,0,0\n");
    let (trace, out_text) = (place.text("trace.csv"), out.display().to_string());
    refused(
        &[
            "replay",
            "--scene",
            "moving-plate",
            "--trace",
            &trace,
            "--out",
            &out_text,
        ],
        &["out.csv"],
    );
    assert!(!Path::new(&out).exists());
}
