//! How the frames of the render nodes went, as the end report says it.

use std::fmt;

use serde::{Deserialize, Serialize};
use taut_link::{Distribution, FrameReport};

use crate::report::client::ClientReport;

const MILLISECONDS_PER_MICROSECOND: f64 = 1e-3;

/// How the frames of the render nodes went. Times of swaps are as true as the nodes' clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FramesReport {
    /// Frames released.
    pub released: u64,
    /// Frames released at the deadline, without a node that was waited for.
    pub lapses: u64,
    /// Drawn frames whose state was compared with the released one.
    pub compared: u64,
    /// Of these, other than the released one.
    pub mismatches: u64,
    /// Nodes that were let go for silence.
    pub evicted: u64,
    /// Times that a node was left to swap on its own: it draws fewer frames than the least rate, or than it says.
    #[serde(default)]
    pub freed: u64,
    /// Last swap call of a frame less the first, over the nodes that had drawn it in time; `null` until two swapped one together.
    pub swap_skew_us: Option<Distribution>,
    /// Last light of a frame less the first, by each node's last picture and as their window systems tell it; `null` until two nodes told of one frame.
    #[serde(default)]
    pub light_skew_us: Option<Distribution>,
    /// From the moment at which a frame could be shown to its last swap call.
    pub overhead_us: Option<Distribution>,
    /// Age of the shown state at the last swap call.
    pub pose_age_ms: Option<Distribution>,
}

impl FramesReport {
    /// What the network measured, with each node's part put among the clients.
    pub fn new(measured: &FrameReport, clients: &mut [ClientReport]) -> Self {
        for client in clients {
            let own = |nodes: &[(String, Distribution)]| {
                let own = nodes.iter().find(|(node, _)| *node == client.node);
                own.and_then(|(_, skew)| known(*skew, 1.0))
            };
            let (call, light) = (own(&measured.nodes), own(&measured.lit_nodes));
            (client.swap_skew_us, client.light_skew_us) = (call, light);
            client.free_running = measured.free_running.contains(&client.node);
        }
        let counts = &measured.counts;
        Self {
            released: counts.released,
            lapses: counts.lapses,
            compared: counts.compared,
            mismatches: counts.mismatches,
            evicted: counts.evicted,
            freed: counts.freed,
            swap_skew_us: known(measured.skew, 1.0),
            light_skew_us: known(measured.light, 1.0),
            overhead_us: known(measured.overhead, 1.0),
            pose_age_ms: known(measured.age, MILLISECONDS_PER_MICROSECOND),
        }
    }
}

impl fmt::Display for FramesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} released, {} without a node that was waited for; {} pictures of another state in {} compared",
            self.released, self.lapses, self.mismatches, self.compared
        )?;
        if self.freed > 0 {
            write!(
                f,
                "; {} times a node was left to swap on its own",
                self.freed
            )?;
        }
        for (what, skew) in [("swap", &self.swap_skew_us), ("light", &self.light_skew_us)] {
            if let Some(skew) = skew {
                write!(
                    f,
                    "; {what} skew p50 {:.0} us, p99 {:.0} us, max {:.0} us",
                    skew.p50, skew.p99, skew.max
                )?;
            }
        }
        match (&self.swap_skew_us, &self.light_skew_us) {
            (Some(_), None) => write!(f, " (of calls; when they lit up is not known)"),
            _ => Ok(()),
        }
    }
}

fn known(us: Distribution, scale: f64) -> Option<Distribution> {
    (us.count > 0).then(|| us.scaled(scale))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_client_gets_its_own_skew_and_the_session_the_frames() {
        let spread = |p50| Distribution {
            p50,
            p99: 2.0 * p50,
            p999: 3.0 * p50,
            max: 4.0 * p50,
            count: 7,
        };
        let measured = FrameReport {
            skew: spread(10.0),
            overhead: spread(100.0),
            age: spread(18_000.0),
            light: spread(3000.0),
            nodes: vec![("table".into(), spread(5.0))],
            lit_nodes: vec![("front".into(), spread(40.0))],
            free_running: vec!["front".into()],
            ..FrameReport::default()
        };
        let client = |node: &str| ClientReport {
            node: node.into(),
            ..ClientReport::default()
        };
        let mut clients = [client("front"), client("table")];
        let report = FramesReport::new(&measured, &mut clients);
        assert_eq!(clients[0].swap_skew_us, None);
        assert_eq!(clients[0].light_skew_us.map(|skew| skew.p50), Some(40.0));
        assert_eq!(clients[1].light_skew_us, None);
        let said = report.to_string();
        assert!(
            said.contains("; swap skew p50 10 us") && said.contains("; light skew p50 3000 us"),
            "{said}"
        );
        let calls_alone = FramesReport {
            light_skew_us: None,
            ..report
        };
        let said = calls_alone.to_string();
        assert!(
            said.contains("max 40 us (of calls; when they lit up is not known)"),
            "{said}"
        );
        assert!(clients[0].free_running && !clients[1].free_running);
        assert_eq!(clients[1].swap_skew_us.map(|skew| skew.max), Some(20.0));
        assert_eq!(report.swap_skew_us.map(|skew| skew.p50), Some(10.0));
        assert_eq!(report.pose_age_ms.map(|age| age.p99), Some(36.0));
    }
}
