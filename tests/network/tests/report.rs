//! The quick subset of the report: every section runs, and every invariant holds. Speed is not asserted: it is the machine's.

use std::path::Path;

use taut_network_tests::report::{Extent, SECTIONS, Verdict, csv, table};

/// Runs a section; its invariants hold.
fn check(name: &str) {
    let mut extent = Extent::quick(Path::new(env!("CARGO_BIN_EXE_taut-network-tests")));
    // Whole processes under load are measured by the report; here it is enough that a missing program is said.
    extent.program = "no-such-program".into();
    let section = SECTIONS.iter().find(|section| section.name == name);
    let section = section.unwrap_or_else(|| panic!("no section {name}"));
    let rows = (section.run)(&extent).unwrap_or_else(|error| panic!("{name}: {error}"));
    print!("{}", table(&rows));
    assert!(!rows.is_empty());
    for row in &rows {
        assert!(!row.invariant || row.verdict == Verdict::Met, "{row:?}");
    }
    assert_eq!(csv(&rows).lines().count(), 1 + rows.len());
}

#[test]
fn latency() {
    check("latency");
}

#[test]
fn loss() {
    check("loss");
}

#[test]
fn isolation_says_what_is_missing() {
    check("isolation");
}

#[test]
fn scale() {
    check("scale");
}

#[test]
fn every_section_has_a_test() {
    for section in SECTIONS.iter().filter(|one| one.name != "hostile") {
        let call = format!("check(\"{}\")", section.name);
        assert!(include_str!("report.rs").contains(&call), "no {call}");
    }
}

#[test]
fn forged() {
    check("forged");
}

#[test]
fn join() {
    check("join");
}

#[test]
fn death() {
    check("death");
}

#[test]
fn soak() {
    check("soak");
}

#[test]
fn the_soak_of_the_program_says_what_is_missing() {
    check("soak-program");
}

#[test]
fn what_is_not_measured_here_is_said() {
    check("elsewhere");
}

#[test]
fn skew() {
    check("skew");
}

#[test]
fn events() {
    check("events");
}

#[test]
fn failover() {
    check("failover");
}

#[test]
fn drawing_nodes_say_what_is_missing() {
    check("screens");
}

#[test]
fn a_server_that_dies_says_what_is_missing() {
    check("server");
}
