//! How many a workbench can serve: limits that are faults, and costs that are worth a note.
//!
//! Figures: `cargo run --release -p taut-network-tests -- scale`, with what they were in `docs/deployment.md`.

use taut_proto::barrier::MAX_MEMBERS;

use super::frames::{FrameSwap, Frames};
use super::load::Workbench;
use super::spec::{Network, Node, TransportKind};
use crate::document::Section;

/// Time that the broadcasting thread takes for one state to one client by unicast, s, with a margin: 8 to 10 µs were measured on loopback.
const UNICAST_COST: f64 = 10e-6;
/// Share of a core that the broadcasting thread may take before it is worth a note.
const BUSY_SHARE: f64 = 0.5;

/// Complains of nodes for which there is no place.
pub(super) fn places(root: &Section<'_>, nodes: &[Node], network: &Network, frames: &Frames) {
    let count = nodes.len();
    if frames.swap != FrameSwap::Off && count > MAX_MEMBERS {
        root.complain(
            root.at(),
            format!(
                "there are {count} nodes, but {MAX_MEMBERS} at most swap together; write swap = \"off\" in [frames], or drive several screens by one node"
            ),
        );
    }
    if count > network.max_clients {
        root.complain(
            root.at(),
            format!(
                "there are {count} nodes, but `max_clients` in [network] lets {} in; raise it, with some more for the device and whoever looks on",
                network.max_clients
            ),
        );
    }
}

impl Workbench {
    /// What this many clients may cost, where that is worth a look.
    pub fn notes(&self) -> Vec<String> {
        let Network {
            max_clients,
            broadcast_rate,
            transport,
            ..
        } = &self.network;
        let share = *max_clients as f64 * broadcast_rate * UNICAST_COST;
        if *transport == TransportKind::Multicast || share <= BUSY_SHARE {
            return Vec::new();
        }
        vec![format!(
            "{max_clients} clients (max_clients) at {broadcast_rate} states a second take about {:.0} % of a core to send to, one by one; lower broadcast_rate, or write transport = \"multicast\" where they are on one wire (docs/deployment.md, Scale)",
            100.0 * share
        )]
    }
}
