//! Tests: the table of `/metrics` in `docs/observers.md` has what is served, name by name.

use std::collections::BTreeSet;

use super::SessionReport;
use super::external::ExternalWrenchReport;
use super::metrics::{ClientLink, Metrics};

const PAGE: &str = include_str!("../../../docs/observers.md");
/// Counts of the network have a name for each, and stand in the page as one.
const NETWORK: &str = "taut_network_";

/// The names in the first column, without labels.
fn told() -> BTreeSet<&'static str> {
    let rows = PAGE.lines().filter(|line| line.starts_with("| `taut_"));
    let cells = rows.filter_map(|row| row.split('|').nth(1));
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    names
        .filter_map(|name| name.split('{').next())
        .filter(|name| !name.starts_with(NETWORK))
        .collect()
}

#[test]
fn the_page_names_every_metric_and_no_other() {
    let external = ExternalWrenchReport {
        refused: [("old".to_owned(), 1)].into(),
        ..ExternalWrenchReport::default()
    };
    let metrics = Metrics {
        time_s: 0.0,
        session: SessionReport {
            external_wrench: Some(external),
            ..SessionReport::default()
        },
        network: [("forged", 0)].into(),
        clients_present: 1,
        client_links: vec![ClientLink::default()],
        stream_observers: 0,
        stream_observers_dropped: 0,
        log_lines_lost: 0,
        memory_bytes: 0,
        open_files: 0,
    };
    let text = metrics.text().expect("text");
    let samples = text.lines().filter(|line| !line.starts_with('#'));
    let served: BTreeSet<&str> = samples
        .filter_map(|line| line.split(['{', ' ']).next())
        .filter(|name| !name.starts_with(NETWORK))
        .collect();
    assert_eq!(told(), served);
}
