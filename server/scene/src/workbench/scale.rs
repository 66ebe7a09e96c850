//! What many clients cost, where that is worth a note.
//!
//! Figures: `cargo run --release -p taut-network-tests -- scale`, with what they were in `docs/deployment.md`.

use super::load::Workbench;
use super::spec::{Network, TransportKind};

/// Time that the broadcasting thread takes for one state to one client by unicast, s, with a margin: 8 to 10 µs were measured on loopback.
const UNICAST_COST: f64 = 10e-6;
/// Share of a core that the broadcasting thread may take before it is worth a note.
const BUSY_SHARE: f64 = 0.5;

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
