//! A force device in `[device]` of the workbench file: opened, armed and felt by `taut serve` itself.
#![cfg(unix)]

use std::time::{Duration, Instant};

use taut_bridge::Hand;
use taut_bridge::haply::{HaplyService, SimulatedInverse, SimulatedSettings};
use taut_link::{ClientOptions, Role, connect, read_key_file};

use crate::support::{PATIENCE, Running, Workplace, refusal, taut, workbench};

/// Where the scene stands, so that its ball begins at the workbench's origin: three times as large as it is, at (0.05, 0, 0.04) m of its own.
const STANDS: &str = "position = [-0.15, 0.0, -0.12]";

/// The shipped workbench with this device, which nobody needs to arm.
fn with_device(keys: &str) -> String {
    let text = workbench().replacen("position = [0.0, -0.45, 0.25]", STANDS, 1);
    assert!(text.contains(STANDS));
    let (before, rest) = text.split_once("[device]").expect("a device");
    let (_, after) = rest.split_once("[network]").expect("a network");
    let text = format!("{before}[device]\n{keys}\n[network]{after}");
    text.replace("# rearm = \"manual\"", "rearm = \"automatic\"")
}

/// The report of a server of this device that was served until `enough` of the force that its states tell.
fn served_until(keys: &str, enough: impl Fn(f32) -> bool) -> serde_json::Value {
    let place = Workplace::new();
    place.write("workbench.toml", &with_device(keys));
    // Ended by a signal: how long a busy machine takes to bring a force about is nobody's promise.
    let server = Running::start(&place.serve("workbench.toml", "300", &["--allow-unstable"]));
    let address = server.word_after("serving on ");
    let key = read_key_file(&place.path("cluster.key")).expect("a key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let options = ClientOptions::new(address, key, Role::Operator, "witness");
    let witness = runtime.block_on(connect(options)).expect("joins");
    let (begun, mut states) = (Instant::now(), Vec::new());
    let mut is_enough = false;
    while !is_enough && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(5));
        witness.drain_states(&mut states);
        is_enough = states.drain(..).any(|received| {
            let tool = received.state.tools.first();
            let force = tool.map_or([0.0; 3], |tool| tool.force);
            enough(force.iter().map(|part| part * part).sum::<f32>().sqrt())
        });
    }
    let output = server.end("-INT");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(is_enough, "no force that is enough within a minute: {said}");
    assert!(output.status.success(), "{said}");
    assert!(said.contains("type arm and Enter"), "{said}");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{error}: {printed}"))
}

#[test]
fn a_device_in_python_is_felt_by_the_server_itself() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/python/examples/spring_hand.py"
    );
    // It goes down from when it is opened on, and is seen where it is, however late the first tick comes.
    let keys = format!(
        "kind = \"python\"\nfile = \"{file}\"\noptions = \"depth=0.1\"\nanchor = \"workbench\""
    );
    let report = served_until(&keys, |force| force > 0.5);
    let force = report["largest_force_n"].as_f64().expect("a number");
    assert!(force > 0.5 && force <= 5.0, "{report}");
}

#[test]
fn a_haply_arm_is_opened_by_the_server_itself() {
    let inverse = SimulatedInverse::new(&SimulatedSettings::held(Hand::LIGHT));
    let any = "127.0.0.1:0".parse().expect("an address");
    let service = HaplyService::start(any, inverse).expect("a free port");
    let keys = format!(
        "kind = \"haply\"\naddress = \"{}\"\nscale = 2.0",
        service.address()
    );
    // What the arm itself got counts, too.
    let report = served_until(&keys, |force| {
        force > 0.3 && service.totals().largest_force > 0.3
    });
    let force = report["largest_force_n"].as_f64().expect("a number");
    assert!(force > 0.3, "{report}");
    let totals = service.totals();
    assert_eq!(totals.force, 0.0, "a force outlived its session");
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let place = Workplace::new();
    place.write("workbench.toml", &with_device("kind = \"haply\""));
    let following = place.serve("workbench.toml", "1", &["--follow-scene"]);
    let said = refusal(&taut(&following));
    assert!(
        said.contains("--follow-scene") && said.contains("kind = \"remote\""),
        "{said}"
    );

    // A recording is of one session.
    let record = with_device("kind = \"remote\"")
        .replace("[monitoring]", "[monitoring]\nrecord = \"all.rrd\"");
    assert!(record.contains("all.rrd"));
    place.write("workbench.toml", &record);
    let said = refusal(&taut(&following));
    assert!(said.contains("[monitoring] record"), "{said}");

    // With its line, before anything is opened.
    place.write(
        "workbench.toml",
        &with_device("kind = \"haply\"\naxis = \"x y z\""),
    );
    let output = taut(&["check", &place.text("workbench.toml")]);
    let said = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("did you mean `axes`?"), "{said}");

    place.write(
        "workbench.toml",
        &with_device("kind = \"python\"\nfile = \"none.py\""),
    );
    let said = refusal(&taut(&place.serve("workbench.toml", "1", &[])));
    assert!(
        said.contains("none.py") && said.contains("write its whole path"),
        "{said}"
    );
}
