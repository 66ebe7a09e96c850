//! Whether the server of a link is still there, by what arrives on the hot plane.
//!
//! The server answers a time request every 50 ms, whatever it has to tell; QUIC itself would take a second to notice that nobody is there.

use super::ClientLink;
use std::time::{Duration, Instant};
use taut_proto::membership::{Liveness, PeerWatch, SilenceLimits};

/// A hot plane on which nothing ever came (a firewall, perhaps) is told after this; the link is not given up for it.
const NEVER_HEARD: Duration = Duration::from_secs(1);

/// A link as people see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkHealth {
    /// States or signs of life come.
    #[default]
    Connected,
    /// The server is silent, or gone. The last state is held, and screens say so.
    Lost {
        /// For how long it has been.
        since: Duration,
    },
    /// A new session is there; its scene is being fetched.
    Rejoining,
}

/// Watches the server of one link. Look four times or more in the silence after which it is gone.
#[derive(Debug)]
pub struct LinkWatch {
    limits: SilenceLimits,
    start: Instant,
    packets: u64,
    heard: Instant,
    /// From the first datagram on.
    watch: Option<PeerWatch>,
}

impl LinkWatch {
    /// A watch of a link that was joined at `now`; the server is gone after `dead_after` of silence.
    pub fn new(now: Instant, dead_after: Duration) -> LinkWatch {
        let dead_after_ns = u64::try_from(dead_after.as_nanos()).unwrap_or(u64::MAX);
        LinkWatch {
            limits: SilenceLimits::OF_THE_SERVER.with_dead_after(dead_after_ns),
            start: now,
            packets: 0,
            heard: now,
            watch: None,
        }
    }

    /// What the silence means at `now`.
    pub fn look(&mut self, link: &ClientLink, now: Instant) -> Liveness {
        self.follow(link.counters().packets_received, now)
    }

    /// When the last datagram came, as of the last look; before the first, when the link was joined.
    pub fn heard(&self) -> Instant {
        self.heard
    }

    fn follow(&mut self, packets: u64, now: Instant) -> Liveness {
        let ns = |moment: Instant| {
            let since = moment.saturating_duration_since(self.start);
            u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
        };
        if packets != self.packets {
            self.packets = packets;
            self.heard = now;
        }
        if packets == 0 {
            let silence = now.saturating_duration_since(self.start);
            return if silence < NEVER_HEARD {
                Liveness::Alive
            } else {
                Liveness::Suspect
            };
        }
        let (now_ns, heard_ns) = (ns(now), ns(self.heard));
        let limits = self.limits;
        let watch = self
            .watch
            .get_or_insert_with(|| PeerWatch::new(limits, now_ns));
        watch.look(now_ns, heard_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_server_that_stops_speaking_is_suspect_then_dead_and_one_never_heard_is_only_suspect() {
        let start = Instant::now();
        let after = |ms: u64| start + Duration::from_millis(ms);
        let mut watch = LinkWatch::new(start, Duration::from_millis(500));
        let mut never = LinkWatch::new(start, Duration::from_millis(500));
        assert_eq!(watch.follow(3, after(20)), Liveness::Alive);
        for now in (40..=240).step_by(20) {
            assert_eq!(watch.follow(3, after(now)), Liveness::Alive);
        }
        assert_eq!(watch.heard(), after(20));
        for now in (280..=500).step_by(20) {
            assert_eq!(watch.follow(3, after(now)), Liveness::Suspect);
        }
        assert_eq!(watch.follow(3, after(520)), Liveness::Dead);
        assert_eq!(never.follow(0, after(900)), Liveness::Alive);
        assert_eq!(never.follow(0, after(5_000)), Liveness::Suspect);
        assert_eq!(never.follow(1, after(5_020)), Liveness::Alive);
    }
}
