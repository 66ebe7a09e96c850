//! Those who look on, and the operator's page, in a workbench file: off unless wanted, and never open to everybody by a slip.

use std::net::Ipv4Addr;
use std::path::Path;

use taut_scene::{NeededFile, SHIPPED_WORKBENCH, Workbench};

use crate::support::assert_says;

fn with(assignments: &[&str]) -> Result<Workbench, String> {
    Workbench::parse_with_overrides("w.toml", SHIPPED_WORKBENCH, Path::new(""), assignments)
        .map_err(|error| error.to_string())
}

#[test]
fn nobody_looks_on_unless_the_file_says_so() {
    let shipped = Workbench::shipped().expect("valid");
    assert!(!shipped.vrpn.enabled && !shipped.observers.enabled && !shipped.zenoh.enabled);
    assert!(!shipped.operator.enabled);
    let begin = SHIPPED_WORKBENCH.find("[vrpn]").expect("there");
    let end = SHIPPED_WORKBENCH.find("[realtime]").expect("there");
    let without = format!(
        "{}{}",
        &SHIPPED_WORKBENCH[..begin],
        &SHIPPED_WORKBENCH[end..]
    );
    let without = Workbench::parse("w.toml", &without, Path::new("")).expect("valid");
    assert_eq!(
        (
            without.vrpn,
            without.observers,
            without.operator,
            without.zenoh
        ),
        (
            shipped.vrpn,
            shipped.observers,
            shipped.operator,
            shipped.zenoh
        ),
        "the shipped file shows the defaults"
    );
}

#[test]
fn the_keys_are_read() {
    let workbench = with(&[
        "vrpn.enabled=true",
        "vrpn.bind=\"192.168.1.5\"",
        "vrpn.tracker=\"Haptic0\"",
        "observers.enabled=true",
        "observers.rate=30",
        "zenoh.enabled=true",
        "zenoh.connect=[\"tcp/a:7447\", \"tls/b:7447\"]",
    ])
    .expect("valid");
    assert_eq!(workbench.vrpn.bind, Ipv4Addr::new(192, 168, 1, 5));
    assert_eq!((workbench.vrpn.port, workbench.vrpn.rate), (3883, 120.0));
    assert_eq!(workbench.vrpn.tracker, "Haptic0");
    assert_eq!(
        (workbench.observers.port, workbench.observers.rate),
        (4860, 30.0)
    );
    assert_eq!(workbench.observers.token(), Ok(None));
    assert_eq!(workbench.zenoh.connect, ["tcp/a:7447", "tls/b:7447"]);
}

#[test]
fn slips_are_refused_with_what_to_do() {
    for (assignments, wanted) in [
        (&["vrpn.bind=\"::1\""][..], "write an IPv4 one"),
        (&["vrpn.tracker=\"a b\""], "letters, digits"),
        (&["vrpn.rate=0"], "`rate`"),
        (
            &["observers.enabled=true", "observers.bind=\"0.0.0.0\""],
            "token_file =",
        ),
        (&["observers.rate=100"], "`rate`"),
        (&["zenoh.enabled=true"], "connect ="),
        (&["zenoh.name=\"a/b\""], "letters, digits"),
        (&["observers.tokn=1"], "tokn"),
        (&["operator.bind=\"0.0.0.0\""], "bind"),
        (&["operator.port=70000"], "`port`"),
    ] {
        let found = with(assignments).expect_err(wanted);
        assert_says(&found, wanted);
    }
}

#[test]
fn no_rate_is_so_slow_that_its_period_is_no_time() {
    for table in ["vrpn", "observers", "zenoh"] {
        for rate in ["1e-300", "5e-20", "0.99"] {
            let found = with(&[&format!("{table}.rate={rate}")]).expect_err(rate);
            for wanted in ["`rate`", table, "between 1 and"] {
                assert_says(&found, wanted);
            }
        }
        with(&[&format!("{table}.rate=1")]).expect("the slowest");
    }
}

#[test]
fn a_token_is_read_from_its_file_and_a_poor_one_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("observers.token");
    let set = format!("observers.token_file=\"{}\"", path.display());
    let open = ["observers.enabled=true", "observers.bind=\"0.0.0.0\"", &set];
    let stream = with(&open).expect("valid").observers;
    assert!(
        stream
            .token()
            .expect_err("no file")
            .contains("openssl rand")
    );
    std::fs::write(&path, "short\n").expect("written");
    assert!(stream.token().expect_err("short").contains("at least 16"));
    std::fs::write(&path, "0123456789abcdef_-\n").expect("written");
    assert_eq!(stream.token(), Ok(Some("0123456789abcdef_-".to_owned())));
    let set = format!("operator.token_file=\"{}\"", path.display());
    let operator = with(&["operator.enabled=true", &set])
        .expect("valid")
        .operator;
    assert_eq!(operator.token(), Ok(Some("0123456789abcdef_-".to_owned())));
    std::fs::write(&path, "short\n").expect("written");
    let refused = operator.token().expect_err("short");
    assert_says(&refused, "[operator]");
}

#[test]
fn scenes_to_choose_from_are_needed_with_their_own_files_where_there_is_a_page() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = "name = \"a\"\ngod_object = { shape = { sphere = { radius = 0.01 } }, mass = 1 }\nhand = { path = \"hand.csv\" }\n";
    for (file, text) in [
        ("a.toml", scene),
        ("b.toml", scene),
        ("hand.csv", "t,x,y,z,qw,qx,qy,qz\n"),
    ] {
        std::fs::write(directory.path().join(file), text).expect("written");
    }
    let parse = |assignments: &[&str]| {
        let parsed = Workbench::parse_with_overrides(
            "workbench.toml",
            SHIPPED_WORKBENCH,
            directory.path(),
            assignments,
        );
        parsed.map_err(|error| error.to_string())
    };
    let named = "operator.scenes=[\"b.toml\", \"two-bunnies\", \"a.toml\"]";
    let workbench = parse(&["scene=a.toml", named]).expect("valid");
    assert_eq!(workbench.scenes().len(), 1, "there is no page");
    let on = "operator.enabled=true";
    let workbench = parse(&[
        "scene=a.toml",
        on,
        "operator.scenes=[\"b.toml\", \"a.toml\"]",
    ]);
    let workbench = workbench.expect("valid");
    let [a, b] = ["a.toml", "b.toml"].map(|file| directory.path().join(file).display().to_string());
    assert_eq!(
        workbench.scenes(),
        [&a, &b],
        "each once, the served one first"
    );
    let needed = workbench.needed_files().expect("all there");
    for scene in [a, b] {
        assert!(needed.contains(&NeededFile::Named(scene.clone().into())));
        let hand = NeededFile::OfScene {
            scene,
            name: "hand.csv".to_owned(),
            found: directory.path().join("hand.csv"),
            by_mesh: false,
        };
        assert!(needed.contains(&hand), "{needed:?}");
    }
    let many = format!("operator.scenes=[{}]", "\"b.toml\", ".repeat(101));
    assert!(
        parse(&[&many])
            .expect_err("too many")
            .contains("more than 100")
    );
    assert!(
        parse(&["operator.scenes=[\"\"]"])
            .expect_err("no name")
            .contains("no name")
    );
}
