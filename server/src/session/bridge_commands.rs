//! What goes to the bridge of a remote device: forces or constraint sets, and a force from outside. On the broadcaster's thread.

use std::time::Duration;

use taut_bridge::edge::pass_on;
use taut_link::Broadcaster;
use taut_proto::WrenchCommand;
use taut_proto::wrench::WRENCH_PAUSED;

use crate::session::edge_sets::EdgeSets;
use crate::shared::clock::nanoseconds;
use crate::shared::passed_wrench::PassedReader;

/// Ticks in which a bridge is told that there is no force from outside any more.
const TOLD_NONE: u32 = 100;

/// What goes to the bridge of a remote device: wrenches, newest wins, or constraint sets.
#[derive(Debug)]
pub struct BridgeCommands {
    /// From the haptics loop.
    pub wrenches: triple_buffer::Output<WrenchCommand>,
    /// For a bridge that couples by itself.
    pub sets: EdgeSets,
    /// A force from outside, where the workbench takes one.
    pub passed: Option<PassedReader>,
    /// Ticks in which there was none since the last, as far as they count.
    pub told_none: u32,
}

impl BridgeCommands {
    /// Sends the force from outside that is due; none while the port gives no force. That there is none any more is said some times over: a datagram may be lost.
    pub(super) fn pass_force(&mut self, armed: bool, broadcaster: &mut Broadcaster) {
        let Some(passed) = &mut self.passed else {
            return;
        };
        let judged = passed.read().as_ref().filter(|_| armed);
        self.told_none = match judged {
            Some(_) => 0,
            None => self.told_none + 1,
        };
        if self.told_none <= TOLD_NONE {
            broadcaster.send_force(&pass_on(judged));
        }
        self.told_none = self.told_none.min(TOLD_NONE);
    }

    /// Says that no force comes any more.
    pub(super) fn end(&mut self, now: Duration, broadcaster: &mut Broadcaster) {
        self.pass_force(false, broadcaster);
        self.sets.pause(broadcaster);
        broadcaster.send_wrench(&WrenchCommand {
            time_ns: nanoseconds(now),
            origin_ns: 0,
            wrench: [0.0; 6],
            obstacle_work: 0.0,
            flags: WRENCH_PAUSED,
        });
    }
}
