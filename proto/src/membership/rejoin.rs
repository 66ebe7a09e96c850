//! When a node tries to come back to a server that is gone: at once, then with pauses that double.

/// How to come back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RejoinSettings {
    /// From the start of the first attempt to that of the second, ns.
    pub first_pause_ns: u64,
    /// Longest such distance, ns.
    pub last_pause_ns: u64,
    /// A session that lasted as long begins the pauses anew, ns: one that is lost at once again and again must not be a flood.
    pub steady_after_ns: u64,
    /// Time without a session after which the node gives up, ns; `None`: never.
    pub give_up_after_ns: Option<u64>,
}

impl Default for RejoinSettings {
    /// 0.1 s to 1 s, steady after 2 s, never given up.
    fn default() -> RejoinSettings {
        RejoinSettings {
            first_pause_ns: 100_000_000,
            last_pause_ns: 1_000_000_000,
            steady_after_ns: 2_000_000_000,
            give_up_after_ns: None,
        }
    }
}

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RejoinStep {
    /// Try to join; then ask again.
    Attempt,
    /// Wait until then, ns; then ask again.
    Wait {
        /// Moment of the next step.
        until_ns: u64,
    },
    /// It has been too long.
    GiveUp,
}

/// The way back. Times are arguments.
#[derive(Clone, Debug)]
pub struct Rejoin {
    settings: RejoinSettings,
    /// Since when there is no session; `None` while there is one.
    away_since_ns: Option<u64>,
    joined_ns: u64,
    pause_ns: u64,
    next_ns: u64,
}

impl Rejoin {
    /// A node that has no session yet and may try at once.
    pub fn new(settings: RejoinSettings, now_ns: u64) -> Rejoin {
        Rejoin {
            settings,
            away_since_ns: Some(now_ns),
            joined_ns: now_ns,
            pause_ns: settings.first_pause_ns,
            next_ns: now_ns,
        }
    }

    /// There is a session.
    pub fn joined(&mut self, now_ns: u64) {
        self.away_since_ns = None;
        self.joined_ns = now_ns;
    }

    /// The session is lost.
    pub fn lost(&mut self, now_ns: u64) {
        if self.away_since_ns.is_some() {
            return;
        }
        self.away_since_ns = Some(now_ns);
        if now_ns.saturating_sub(self.joined_ns) >= self.settings.steady_after_ns {
            self.pause_ns = self.settings.first_pause_ns;
            self.next_ns = now_ns;
        }
    }

    /// What to do at `now_ns`. An attempt that is given out counts as made.
    pub fn step(&mut self, now_ns: u64) -> RejoinStep {
        let give_up_ns = self
            .away_since_ns
            .zip(self.settings.give_up_after_ns)
            .map(|(since, after)| since.saturating_add(after));
        if give_up_ns.is_some_and(|at| now_ns >= at) {
            return RejoinStep::GiveUp;
        }
        if now_ns < self.next_ns {
            let until_ns = self.next_ns.min(give_up_ns.unwrap_or(u64::MAX));
            return RejoinStep::Wait { until_ns };
        }
        self.next_ns = now_ns.saturating_add(self.pause_ns);
        self.pause_ns = self
            .pause_ns
            .saturating_mul(2)
            .min(self.settings.last_pause_ns);
        RejoinStep::Attempt
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    /// Moments of the attempts, ms, if each fails after `each` ms, until `end` ms.
    fn attempts(rejoin: &mut Rejoin, from: u64, each: u64, end: u64) -> Vec<u64> {
        let mut now = from;
        let mut made = Vec::new();
        while now < end {
            match rejoin.step(now * MS) {
                RejoinStep::Attempt => {
                    made.push(now);
                    now += each;
                }
                RejoinStep::Wait { until_ns } => now = until_ns / MS,
                RejoinStep::GiveUp => break,
            }
        }
        made
    }

    #[test]
    fn the_first_attempt_is_at_once_and_the_pauses_double_to_a_second() {
        let mut rejoin = Rejoin::new(RejoinSettings::default(), 0);
        assert_eq!(
            attempts(&mut rejoin, 0, 0, 4000),
            [0, 100, 300, 700, 1500, 2500, 3500]
        );
    }

    #[test]
    fn a_slow_attempt_is_followed_by_the_next_without_a_pause() {
        let mut rejoin = Rejoin::new(RejoinSettings::default(), 0);
        assert_eq!(attempts(&mut rejoin, 0, 1000, 4000), [0, 1000, 2000, 3000]);
    }

    #[test]
    fn after_a_steady_session_the_pauses_begin_anew_after_a_short_one_they_do_not() {
        let mut rejoin = Rejoin::new(RejoinSettings::default(), 0);
        attempts(&mut rejoin, 0, 0, 3000); // the last is at 2500
        rejoin.joined(2500 * MS);
        rejoin.lost(2600 * MS);
        assert_eq!(attempts(&mut rejoin, 2600, 0, 4000), [3500]);
        rejoin.joined(3500 * MS);
        rejoin.lost(5500 * MS);
        assert_eq!(attempts(&mut rejoin, 5500, 0, 6000), [5500, 5600, 5800]);
    }

    #[test]
    fn it_gives_up_when_it_was_away_for_as_long_as_named_and_never_without() {
        let settings = RejoinSettings {
            give_up_after_ns: Some(1_200 * MS),
            ..RejoinSettings::default()
        };
        let mut rejoin = Rejoin::new(settings, 0);
        assert_eq!(attempts(&mut rejoin, 0, 0, 10_000), [0, 100, 300, 700]);
        assert_eq!(rejoin.step(1_200 * MS), RejoinStep::GiveUp);
        let mut patient = Rejoin::new(RejoinSettings::default(), 0);
        assert!(attempts(&mut patient, 0, 0, 1_000_000).len() > 990);
    }

    proptest! {
        #[test]
        fn attempts_are_never_closer_than_the_first_pause_nor_further_than_the_last_whatever_happens(
            lives in proptest::collection::vec((0u64..5_000, 0u64..4_000, 0u64..1_500), 1..20),
        ) {
            let mut rejoin = Rejoin::new(RejoinSettings::default(), 0);
            let mut now = 0;
            let mut made: Vec<u64> = Vec::new();
            for (away, alive, each) in lives {
                let begun = now;
                let in_this = attempts(&mut rejoin, now, each, begun + away);
                now = begun + away;
                for pair in in_this.windows(2) {
                    prop_assert!(pair[1] - pair[0] <= each.max(1_000));
                }
                made.extend(in_this);
                now += each; // the last may still have been under way
                rejoin.joined(now * MS);
                now += alive;
                rejoin.lost(now * MS);
            }
            for pair in made.windows(2) {
                prop_assert!(pair[1] - pair[0] >= 100);
            }
        }
    }
}
