//! Whether a peer is alive, by how long it has been silent on the hot plane.
//!
//! A watcher that was itself stopped (a suspended machine, a debugger, a starved processor) has heard nobody, and none of them is to
//! blame: after a late look silence counts from that look on.

/// Silences that mean something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SilenceLimits {
    /// From here on the peer may be gone, ns.
    pub suspect_after_ns: u64,
    /// From here on it is gone, ns.
    pub dead_after_ns: u64,
}

impl SilenceLimits {
    /// Of a node, as the server sees it: suspect after 300 ms, gone after 500 ms. A node speaks every 50 ms, so gone is ten in a row lost.
    pub const OF_A_NODE: SilenceLimits = SilenceLimits {
        suspect_after_ns: 300_000_000,
        dead_after_ns: 500_000_000,
    };
    /// Of the server, as a node sees it: the picture says so after 250 ms, the link is given up after 500 ms.
    pub const OF_THE_SERVER: SilenceLimits = SilenceLimits {
        suspect_after_ns: 250_000_000,
        dead_after_ns: 500_000_000,
    };

    /// The same proportions with another end: for networks that pause longer.
    #[must_use]
    pub fn with_dead_after(self, dead_after_ns: u64) -> SilenceLimits {
        let stretched = u128::from(self.suspect_after_ns) * u128::from(dead_after_ns)
            / u128::from(self.dead_after_ns.max(1));
        SilenceLimits {
            suspect_after_ns: u64::try_from(stretched).unwrap_or(u64::MAX),
            dead_after_ns,
        }
    }

    /// Distance between two looks from which on the watcher counts as having been stopped, ns: 150 ms of 500.
    fn late_look_ns(self) -> u64 {
        self.dead_after_ns / 10 * 3
    }
}

/// What a silence means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Liveness {
    /// Heard lately.
    Alive,
    /// Silent for longer than any busy machine needs.
    Suspect,
    /// Gone. Final: a peer that comes back does so as a new one.
    Dead,
}

/// Watches one peer.
#[derive(Clone, Debug)]
pub struct PeerWatch {
    limits: SilenceLimits,
    last_look_ns: u64,
    /// Since when the watcher looks without a pause.
    awake_since_ns: u64,
    verdict: Liveness,
}

impl PeerWatch {
    /// A watch that begins at `now_ns`, when the peer counts as heard.
    pub fn new(limits: SilenceLimits, now_ns: u64) -> PeerWatch {
        PeerWatch {
            limits,
            last_look_ns: now_ns,
            awake_since_ns: now_ns,
            verdict: Liveness::Alive,
        }
    }

    /// What the silence since `heard_ns` means at `now_ns`. Look four times or more in the silence that means gone. Once dead it stays dead.
    pub fn look(&mut self, now_ns: u64, heard_ns: u64) -> Liveness {
        if now_ns.saturating_sub(self.last_look_ns) > self.limits.late_look_ns() {
            self.awake_since_ns = now_ns;
        }
        self.last_look_ns = now_ns.max(self.last_look_ns);
        if self.verdict == Liveness::Dead {
            return Liveness::Dead;
        }
        let silence_ns = now_ns.saturating_sub(heard_ns.max(self.awake_since_ns));
        self.verdict = if silence_ns >= self.limits.dead_after_ns {
            Liveness::Dead
        } else if silence_ns >= self.limits.suspect_after_ns {
            Liveness::Suspect
        } else {
            Liveness::Alive
        };
        self.verdict
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    #[test]
    fn a_silent_node_is_suspect_after_300_ms_and_dead_after_500_ms() {
        let mut watch = PeerWatch::new(SilenceLimits::OF_A_NODE, 0);
        let mut verdicts = Vec::new();
        for now in (0..=600).step_by(50) {
            verdicts.push(watch.look(now * MS, 0));
        }
        let alive = [Liveness::Alive; 6];
        let suspect = [Liveness::Suspect; 4];
        let dead = [Liveness::Dead; 3];
        assert_eq!(verdicts, [&alive[..], &suspect, &dead].concat());
        assert_eq!(
            watch.look(610 * MS, 605 * MS),
            Liveness::Dead,
            "death is final"
        );
    }

    #[test]
    fn a_suspect_that_speaks_is_alive_again() {
        let mut watch = PeerWatch::new(SilenceLimits::OF_A_NODE, 0);
        for now in [100, 200, 300, 400] {
            watch.look(now * MS, 0);
        }
        assert_eq!(watch.look(450 * MS, 440 * MS), Liveness::Alive);
    }

    #[test]
    fn a_watcher_that_was_stopped_blames_nobody() {
        let mut watch = PeerWatch::new(SilenceLimits::OF_A_NODE, 0);
        assert_eq!(watch.look(5_000 * MS, 10 * MS), Liveness::Alive);
        assert_eq!(watch.look(5_100 * MS, 10 * MS), Liveness::Alive);
        for now in [5_200, 5_300, 5_400] {
            watch.look(now * MS, 10 * MS);
        }
        assert_eq!(watch.look(5_500 * MS, 10 * MS), Liveness::Dead);
    }

    #[test]
    fn a_watcher_that_was_stopped_blames_nobody_for_a_short_silence_either() {
        let limits = SilenceLimits::OF_A_NODE.with_dead_after(100 * MS);
        let mut watch = PeerWatch::new(limits, 0);
        assert_eq!(watch.look(25 * MS, 20 * MS), Liveness::Alive);
        assert_eq!(watch.look(145 * MS, 20 * MS), Liveness::Alive);
        for now in [170, 195, 220] {
            let _ = watch.look(now * MS, 20 * MS);
        }
        assert_eq!(watch.look(245 * MS, 20 * MS), Liveness::Dead);
    }

    #[test]
    fn stretched_limits_keep_their_proportions() {
        let limits = SilenceLimits::OF_A_NODE.with_dead_after(4_000 * MS);
        assert_eq!(limits.suspect_after_ns, 2_400 * MS);
    }

    proptest! {
        #[test]
        fn whoever_speaks_every_quarter_second_is_never_dead(
            pauses in proptest::collection::vec(1u64..250, 1..200),
            looks in proptest::collection::vec(1u64..140, 1..400),
        ) {
            let mut watch = PeerWatch::new(SilenceLimits::OF_A_NODE, 0);
            let mut spoken = vec![0];
            for pause in pauses {
                spoken.push(spoken[spoken.len() - 1] + pause * MS);
            }
            let end = spoken[spoken.len() - 1];
            let mut now = 0;
            for look in looks {
                now += look * MS;
                if now > end {
                    break;
                }
                let heard = spoken.iter().copied().filter(|at| *at <= now).max().unwrap_or(0);
                prop_assert_eq!(watch.look(now, heard), Liveness::Alive);
            }
        }

        #[test]
        fn whoever_stops_is_dead_one_look_after_the_limit_and_not_before(
            last in 0u64..2_000, look in 1u64..100,
        ) {
            let mut watch = PeerWatch::new(SilenceLimits::OF_A_NODE, 0);
            let mut now = 0;
            loop {
                now += look;
                let heard = now.min(last); // speaks without a pause until `last`
                let verdict = watch.look(now * MS, heard * MS);
                prop_assert_eq!(verdict == Liveness::Dead, now >= last + 500);
                if verdict == Liveness::Dead {
                    prop_assert!(now < last + 500 + look);
                    break;
                }
            }
        }
    }
}
