//! Coupling beside the device against shipped forces at 20 ms one way and 5 % loss: a network on which shipping goes unstable.

use crate::edge::{Mode, run as run_task};
use crate::edge_network::Impairment;
use crate::edge_scenes::Task;
use crate::row::{Row, Rows};

/// One way, ms.
const DELAY: f64 = 20.0;
/// Percent.
const LOSS: f64 = 5.0;
/// Largest force error at the edge, in just-noticeable differences.
const NOTICED: f64 = 1.0;
/// By how much more energy a shipped force gives to the hand.
const MORE_ENERGY: f64 = 10.0;

/// Every task both ways.
pub(crate) fn run() -> Vec<Row> {
    let network = Impairment::new(DELAY, LOSS);
    let stability = |stable| if stable { "stable" } else { "unstable" };
    let mut all = Vec::new();
    for task in Task::all() {
        let mut rows = Rows::of(task.name);
        let edge = run_task(&task, Mode::Edge, network, 1);
        let shipped = run_task(&task, Mode::Shipped, network, 1);
        rows.holds("edge", stability(edge.stable), "stable", edge.stable);
        rows.at_most("edge, largest force error", edge.error.max, NOTICED, "JND");
        let unstable = !shipped.stable;
        rows.holds("shipped", stability(shipped.stable), "unstable", unstable);
        let median = shipped.error.p50;
        rows.holds(
            "shipped, median force error",
            format!("{median:.2} JND"),
            "> 1 JND",
            median > NOTICED,
        );
        rows.holds(
            "energy given, shipped against edge",
            format!("{:.2e} J against {:.2e} J", shipped.injected, edge.injected),
            "> 10 times",
            shipped.injected > MORE_ENERGY * edge.injected,
        );
        all.extend(rows.all);
    }
    all
}
