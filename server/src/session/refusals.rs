//! Refusals, counted so that a flood of them is a sum: of each who is refused the first is told at once, further ones once a minute.

use std::time::Duration;

/// Time over which refusals of one are summed.
pub(super) const SUM_PERIOD: Duration = Duration::from_secs(60);
/// How many are counted apart; further ones are summed together.
const MAX_SOURCES: usize = 256;

/// How many were refused, by who it was.
#[derive(Debug)]
pub(super) struct Refusals<K> {
    sources: Vec<Source<K>>,
    /// Beyond [`MAX_SOURCES`].
    others: u64,
    others_summed_at: Duration,
}

#[derive(Debug)]
struct Source<K> {
    who: K,
    since: Duration,
    more: u64,
}

impl<K> Default for Refusals<K> {
    fn default() -> Self {
        Self {
            sources: Vec::new(),
            others: 0,
            others_summed_at: Duration::ZERO,
        }
    }
}

impl<K: Copy + PartialEq> Refusals<K> {
    /// Counts one; whether it is to be logged at once.
    pub(super) fn is_first(&mut self, who: K, now: Duration) -> bool {
        if let Some(source) = self.sources.iter_mut().find(|source| source.who == who) {
            source.more += 1;
            return false;
        }
        if self.sources.len() < MAX_SOURCES {
            self.sources.push(Source {
                who,
                since: now,
                more: 0,
            });
            return true;
        }
        self.others += 1;
        false
    }

    /// The sums whose time is over, `None` those of many. Who was quiet meanwhile is forgotten.
    pub(super) fn due(&mut self, now: Duration) -> Vec<(Option<K>, u64)> {
        let mut sums = Vec::new();
        self.sources.retain_mut(|source| {
            if now < source.since + SUM_PERIOD {
                return true;
            }
            if source.more == 0 {
                return false;
            }
            sums.push((Some(source.who), std::mem::take(&mut source.more)));
            source.since = now;
            true
        });
        if self.others > 0 && now >= self.others_summed_at + SUM_PERIOD {
            sums.push((None, std::mem::take(&mut self.others)));
            self.others_summed_at = now;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use std::net::IpAddr;

    use super::*;

    const S: Duration = Duration::from_secs(1);

    fn address(last: u32) -> IpAddr {
        IpAddr::from((0x0a00_0000 | last).to_be_bytes())
    }

    #[test]
    fn of_an_address_that_keeps_knocking_one_refusal_is_told_and_the_others_are_summed() {
        let mut refusals = Refusals::default();
        assert!(refusals.is_first(address(1), 10 * S));
        for _ in 0..1000 {
            assert!(!refusals.is_first(address(1), 11 * S));
        }
        assert!(refusals.is_first(address(2), 12 * S), "another address");
        assert!(refusals.due(69 * S).is_empty(), "not yet");
        assert_eq!(refusals.due(71 * S), [(Some(address(1)), 1000)]);
        // It goes on: summed still. Then it is quiet, and is forgotten.
        assert!(!refusals.is_first(address(1), 72 * S));
        assert_eq!(refusals.due(140 * S), [(Some(address(1)), 1)]);
        assert!(refusals.due(210 * S).is_empty());
        assert!(refusals.is_first(address(1), 211 * S));
    }

    #[test]
    fn addresses_without_number_take_no_memory_without_bound_and_none_is_lost() {
        let mut refusals = Refusals::default();
        let logged = (0..100_000)
            .filter(|last| refusals.is_first(address(*last), S))
            .count();
        assert_eq!((logged, refusals.sources.len()), (MAX_SOURCES, MAX_SOURCES));
        let summed: u64 = refusals
            .due(Duration::MAX)
            .iter()
            .map(|(_, times)| times)
            .sum();
        assert_eq!(logged as u64 + summed, 100_000);
    }
}
