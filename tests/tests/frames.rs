//! Two render nodes as processes show the frames that the server releases: the same states, and swaps that are compared.

use std::time::Duration;

use taut_tests::workbench::TestWorkbench;

use crate::support::draws;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Frames per second that each node is made for: what software draws beside other tests.
const RATE: &str = "8";
/// Frames per second below which a node is not waited for: the least that there is.
const LEAST_RATE: f64 = 1.0;
/// Frames that each node shows.
const FRAMES: &str = "40";
/// Longest wait for these, on a machine that is busy with other tests.
const FRAMES_LIMIT: Duration = Duration::from_secs(60);

/// The report of a server whose two nodes have shown their frames; `None`, said aloud, without an adapter.
fn frames_of_two_nodes(swap: &str) -> Option<serde_json::Value> {
    let mut workbench = TestWorkbench::new(PROGRAM);
    if !draws(&workbench) {
        return None;
    }
    workbench.set("scene", "sphere-on-plane");
    workbench.set("frames.swap", swap);
    // Slower than this a node would swap on its own, and there would be nothing to compare.
    workbench.set("frames.least_rate", LEAST_RATE);
    let server = workbench.serve(&[]);
    let size = ["--headless", "--width", "120", "--height", "80"];
    let arguments = [&size[..], &["--fps", RATE, "--frames", FRAMES]].concat();
    let nodes = ["front", "table"].map(|node| workbench.join("render", node, &server, &arguments));
    for node in nodes {
        let ended = node.end(FRAMES_LIMIT);
        assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
    }
    Some(server.stop())
}

#[test]
fn two_nodes_show_equal_states_and_their_swaps_are_compared() {
    for swap in ["immediate", "scheduled"] {
        let Some(report) = frames_of_two_nodes(swap) else {
            return;
        };
        let frames = &report["frames"];
        println!("{swap}: {frames}");
        assert!(frames["compared"].as_u64() >= Some(40), "{frames}");
        assert_eq!(frames["mismatches"], 0, "{frames}");
        assert!(
            frames["swap_skew_us"]["count"].as_u64() > Some(0),
            "{frames}"
        );
        for client in report["clients"].as_array().expect("a list") {
            assert_eq!(client["state_hash_mismatches"], 0, "{client}");
            assert!(
                client["swap_skew_us"]["count"].as_u64() > Some(0),
                "{client}"
            );
        }
    }
}

#[test]
fn nodes_that_are_not_locked_have_no_skew() {
    let Some(report) = frames_of_two_nodes("off") else {
        return;
    };
    assert_eq!(report["frames"], serde_json::Value::Null);
    for client in report["clients"].as_array().expect("a list") {
        assert_eq!(client["swap_skew_us"], serde_json::Value::Null);
        assert!(client["frames"].as_u64() >= Some(10), "{client}");
    }
}
