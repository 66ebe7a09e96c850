//! Who may join, changed in the workbench file while `taut serve` runs.

use std::time::Duration;

use taut_link::{LinkError, Role};
use taut_proto::control::RefusalCode;
use taut_tests::patience::wait_for;
use taut_tests::workbench::{Server, TestWorkbench};
use tokio::runtime::Runtime;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Longest wait for a file that is looked at once a second.
const LIMIT: Duration = Duration::from_secs(30);

/// Writes the workbench file anew, and waits until the server has said this about it.
fn save(workbench: &TestWorkbench, server: &mut Server, text: &str, says: &str) {
    workbench.write("workbench.toml", text);
    server.process.line_with(&[says], 1);
}

#[test]
fn a_name_that_is_revoked_while_the_server_runs_goes_out_and_the_others_stay() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    let mut server = workbench.serve(&[]);
    let runtime = Runtime::new().expect("a runtime");
    let join = |server: &Server, node| workbench.connect(&runtime, server, Role::Observer, node);
    let [lost, stays] = ["lost-laptop", "stays"]
        .map(|node| join(&server, node).unwrap_or_else(|error| panic!("{error}")));

    let before = workbench.file.to_string();
    let revoked = |entry: &str| {
        let mut file = workbench.file.clone();
        let network = file.get_mut("network").and_then(toml::Value::as_table_mut);
        let list = toml::Value::Array(vec![entry.into()]);
        network.expect("a table").insert("revoked".to_owned(), list);
        file.to_string()
    };
    // A fault changes nothing, and is told.
    save(
        &workbench,
        &mut server,
        &revoked("*"),
        "the changed workbench file is not taken",
    );
    assert!(lost.is_closed().is_none() && stays.is_closed().is_none());

    save(
        &workbench,
        &mut server,
        &revoked("lost-laptop"),
        "shut out: 1",
    );
    wait_for("the end of the session", LIMIT, || lost.is_closed());
    assert!(lost.is_closed().is_some_and(|why| why.contains("revoked")));
    match join(&server, "lost-laptop") {
        Err(LinkError::Refused { code, .. }) => assert_eq!(code, RefusalCode::Revoked),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("let in"),
    }
    assert!(stays.is_closed().is_none());

    save(
        &workbench,
        &mut server,
        &before,
        "nobody who is in is shut out",
    );
    let again = join(&server, "lost-laptop");
    drop(again.unwrap_or_else(|error| panic!("{error}")));
    drop(stays);
    server.stop();
}
