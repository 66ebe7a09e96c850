//! A force device in `[device]` of the workbench file: opened, armed and felt by `taut serve` itself.
#![cfg(unix)]

use taut_bridge::Hand;
use taut_bridge::haply::{HaplyService, SimulatedInverse, SimulatedSettings};

use crate::support::{Workplace, taut, workbench};

/// The shipped workbench with this device, which nobody needs to arm.
fn with_device(keys: &str) -> String {
    let text = workbench();
    let (before, rest) = text.split_once("[device]").expect("a device");
    let (_, after) = rest.split_once("[network]").expect("a network");
    let text = format!("{before}[device]\n{keys}\n[network]{after}");
    text.replace("# rearm = \"manual\"", "rearm = \"automatic\"")
}

fn served(keys: &str, seconds: &str) -> serde_json::Value {
    let place = Workplace::new();
    place.write("workbench.toml", &with_device(keys));
    let output = taut(&place.serve("workbench.toml", seconds, &["--allow-unstable"]));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
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
    let keys = format!("kind = \"python\"\nfile = \"{file}\"\noptions = \"depth=0.1\"");
    let report = served(&keys, "8");
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
    let report = served(&keys, "6");
    let totals = service.totals();
    assert!(totals.messages > 1000, "{totals:?}");
    let force = report["largest_force_n"].as_f64().expect("a number");
    assert!(
        force > 0.3 && totals.largest_force > 0.3,
        "{force}, {totals:?}"
    );
    assert_eq!(totals.force, 0.0, "a force outlived its session");
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let place = Workplace::new();
    place.write("workbench.toml", &with_device("kind = \"haply\""));
    let output = taut(&place.serve("workbench.toml", "1", &["--follow-scene"]));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("--follow-scene") && said.contains("kind = \"remote\""),
        "{said}"
    );

    // Each session would write over the one before.
    let record = with_device("kind = \"remote\"")
        .replace("[monitoring]", "[monitoring]\nrecord = \"all.rrd\"");
    assert!(record.contains("all.rrd"));
    place.write("workbench.toml", &record);
    let output = taut(&place.serve("workbench.toml", "1", &["--follow-scene"]));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
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
    let output = taut(&place.serve("workbench.toml", "1", &[]));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("none.py") && said.contains("write its whole path"),
        "{said}"
    );
}
