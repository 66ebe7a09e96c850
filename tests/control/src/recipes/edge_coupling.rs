//! Coupling beside the device against shipped forces at 20 ms one way and 5 % loss: a network on which shipping goes unstable.

use crate::Row;
use crate::edge::{Mode, run as run_task};
use crate::edge_network::Impairment;
use crate::edge_scenes::Task;

/// One way, ms.
const DELAY: f64 = 20.0;
/// Percent.
const LOSS: f64 = 5.0;
/// Largest force error at the edge, in just-noticeable differences.
const NOTICED: f64 = 1.0;
/// By how much more energy a shipped force gives to the hand.
const MORE_ENERGY: f64 = 10.0;

/// Every task both ways.
#[must_use]
pub fn run() -> Vec<Row> {
    let network = Impairment::new(DELAY, LOSS);
    let stability = |stable| if stable { "stable" } else { "unstable" };
    let mut rows = Vec::new();
    for task in Task::all() {
        let name = task.name;
        let edge = run_task(&task, Mode::Edge, network, 1);
        let shipped = run_task(&task, Mode::Shipped, network, 1);
        rows.push(Row::holds(
            format!("{name}: edge"),
            stability(edge.stable),
            "stable",
            edge.stable,
        ));
        rows.push(Row::at_most(
            format!("{name}: edge, largest force error"),
            edge.error.max,
            NOTICED,
            "JND",
        ));
        rows.push(Row::holds(
            format!("{name}: shipped"),
            stability(shipped.stable),
            "unstable",
            !shipped.stable,
        ));
        rows.push(Row::holds(
            format!("{name}: shipped, median force error"),
            format!("{:.2} JND", shipped.error.p50),
            "> 1 JND",
            shipped.error.p50 > NOTICED,
        ));
        rows.push(Row::holds(
            format!("{name}: energy given, shipped against edge"),
            format!("{:.2e} J against {:.2e} J", shipped.injected, edge.injected),
            "> 10 times",
            shipped.injected > MORE_ENERGY * edge.injected,
        ));
    }
    rows
}
