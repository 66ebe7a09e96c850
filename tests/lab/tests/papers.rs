//! Each opponent is first shown to reach what its own paper says.

use std::fs;

use taut_lab::method::Method;
use taut_lab::papers::{figures, table};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/laboratory.md");

#[test]
fn every_opponent_reaches_the_figures_of_its_own_paper_and_the_page_has_them() {
    let figures = figures();
    let missed: Vec<_> = figures.iter().filter(|figure| !figure.reached()).collect();
    assert!(missed.is_empty(), "{missed:#?}");
    let opponents = [
        Method::Paper,
        Method::PaperAdapted,
        Method::VirtualCoupling,
        Method::Penalty,
        Method::Point,
        Method::StaticCoupling,
        Method::LinearisedPenalty,
        Method::TwoRateLcp,
    ];
    for opponent in opponents {
        let its = figures.iter().filter(|figure| figure.method == opponent);
        assert!(its.count() > 0, "{opponent:?}");
    }
    // The last columns are what it came to, which a run of the command makes anew.
    let page = fs::read_to_string(PAGE).expect("the page is there");
    for line in table(&figures).lines() {
        let said: Vec<_> = line.split(" | ").take(3).collect();
        assert!(page.contains(&said.join(" | ")), "not in the page: {line}");
    }
}
