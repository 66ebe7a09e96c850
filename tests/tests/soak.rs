//! The whole program in a short soak: server, bridge with a moving hand, nodes and an observer that come, go and are killed. For hours:
//! `taut-network-tests --taut PROGRAM --soak 28800 --log FILE soak-program`.

use std::path::Path;
use std::time::Duration;

use taut_network_tests::bench::soak_log::SoakLog;
use taut_network_tests::bench::soak_program;
use taut_tests::workbench::TestWorkbench;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
const DURATION: Duration = Duration::from_secs(20);

#[test]
fn no_promise_is_broken_and_nothing_grows_while_everybody_comes_and_goes() {
    let _one_at_a_time = TestWorkbench::new(PROGRAM);
    let mut log = SoakLog::open(None).unwrap_or_else(|error| panic!("{error}"));
    let run = soak_program::run(Path::new(PROGRAM), DURATION, 21, &mut log)
        .unwrap_or_else(|error| panic!("{error}"));
    println!("{run:?}");
    assert_eq!(log.broken(), [""; 0]);
    assert!(run.states > 0);
    assert!(run.nodes + run.observers + run.bridges + run.servers > 2);
    for growth in log.growth() {
        println!("{growth:?}");
        assert!(!growth.is_growth(), "{growth:?}");
    }
}
