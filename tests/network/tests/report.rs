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

macro_rules! checked {
    ($($test:ident $section:literal,)*) => {
        const CHECKED: &[&str] = &[$($section),*];
        $(#[test]
        fn $test() {
            check($section);
        })*
    };
}

checked! {
    latency "latency",
    loss "loss",
    isolation_says_what_is_missing "isolation",
    scale "scale",
    forged "forged",
    join "join",
    death "death",
    soak "soak",
    the_soak_of_the_program_says_what_is_missing "soak-program",
    what_is_not_measured_here_is_said "elsewhere",
    skew "skew",
    events "events",
    failover "failover",
    drawing_nodes_say_what_is_missing "screens",
    a_server_that_dies_says_what_is_missing "server",
}

#[test]
fn every_section_has_a_test() {
    for section in SECTIONS.iter().filter(|one| one.name != "hostile") {
        assert!(
            CHECKED.contains(&section.name),
            "no test of {}",
            section.name
        );
    }
}
