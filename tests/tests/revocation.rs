//! Who may join, changed in the workbench file while `taut serve` runs.

use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, LinkError, Role, connect};
use taut_proto::control::RefusalCode;
use taut_tests::patience::wait_for;
use taut_tests::workbench::{Server, TestWorkbench};
use tokio::runtime::Runtime;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Longest wait for a file that is looked at once a second.
const LIMIT: Duration = Duration::from_secs(30);

fn join(
    runtime: &Runtime,
    workbench: &TestWorkbench,
    server: &Server,
    node: &str,
) -> Result<ClientLink, LinkError> {
    let options = ClientOptions::new(server.quic.clone(), workbench.key(), Role::Observer, node);
    runtime.block_on(connect(options))
}

/// Writes the workbench file anew, and waits until the server has said a line about it for the `count`-th time.
fn save(workbench: &TestWorkbench, server: &mut Server, text: &str, says: &str, count: usize) {
    workbench.write("workbench.toml", text);
    wait_for(says, LIMIT, || {
        assert!(server.process.is_running(), "the server ended");
        let log = server.process.stderr();
        (log.matches(says).count() >= count).then_some(())
    });
}

#[test]
fn a_name_that_is_revoked_while_the_server_runs_goes_out_and_the_others_stay() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    let mut server = workbench.serve(&[]);
    let runtime = Runtime::new().expect("a runtime");
    let joined = |node| {
        let link = join(&runtime, &workbench, &server, node);
        link.unwrap_or_else(|error| panic!("{error}"))
    };
    let (lost, stays) = (joined("lost-laptop"), joined("stays"));

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
        1,
    );
    assert!(lost.is_closed().is_none() && stays.is_closed().is_none());

    save(
        &workbench,
        &mut server,
        &revoked("lost-laptop"),
        "shut out: 1",
        1,
    );
    wait_for("the end of the session", LIMIT, || lost.is_closed());
    assert!(lost.is_closed().is_some_and(|why| why.contains("revoked")));
    match join(&runtime, &workbench, &server, "lost-laptop") {
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
        1,
    );
    let again = join(&runtime, &workbench, &server, "lost-laptop");
    drop(again.unwrap_or_else(|error| panic!("{error}")));
    drop(stays);
    server.stop();
}
