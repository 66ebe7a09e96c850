//! Wrenches of a node of ROS 2 in the order of their numbers, with the age that the network gave them.
//!
//! Nobody knows the clock of that node, so the stamp beside a message (when it was sent) is compared with those before it: a message that took longer than
//! the quickest one so far is older by that. A network that grows slower makes values old, and a flow of old ones stops; the delay of the quickest is not
//! known and does not count. Between two clocks this holds as far as they drift by at most [`DRIFT`].
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `quickest`   | ns   | least difference between session time at arrival and the sender's stamp |

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use taut_zenoh::{Attachment, RosWrench};
use triple_buffer::Input;

use taut_bridge::{ExternalWrenchStatistics, NewestWrench, SentWrench};

/// Most that two clocks go apart, as a share of the time.
const DRIFT: f64 = 1e-4;
/// Silence of a publisher after which another one is heard.
const SILENCE: Duration = Duration::from_secs(1);

/// A publisher that is heard.
#[derive(Clone, Copy, Debug)]
struct Source {
    gid: [u8; 16],
    /// Number and arrival of its newest message.
    sequence: i64,
    heard: Duration,
    quickest: f64,
    /// Its stamp, ns of the sender's clock.
    sent_ns: i64,
    /// Whether a stamp was ever before that of an earlier message, which was told.
    went_back: bool,
    /// Counts the publishers: that of a session, for the loop.
    number: u64,
}

/// Puts what comes in order, for the haptics loop.
#[derive(Debug)]
pub(super) struct RosOrder {
    output: Input<NewestWrench>,
    newest: NewestWrench,
    source: Option<Source>,
    statistics: Arc<ExternalWrenchStatistics>,
}

impl RosOrder {
    pub(super) fn new(
        output: Input<NewestWrench>,
        statistics: Arc<ExternalWrenchStatistics>,
    ) -> Self {
        Self {
            output,
            newest: NewestWrench::default(),
            source: None,
            statistics,
        }
    }

    /// Takes what came at session time `now`.
    pub(super) fn take(&mut self, came: &RosWrench, now: Duration) {
        let (wrench, attachment) = match came {
            RosWrench::Wrench { wrench, attachment } => (*wrench, attachment),
            RosWrench::NoWrench => {
                self.newest.spoiled = now;
                return self.output.write(self.newest);
            }
            RosWrench::NoAttachment => return self.drop_one(),
        };
        let Some(source) = self.follow(attachment, now) else {
            return self.drop_one();
        };
        // What it took longer than the quickest; never negative, as that is a minimum.
        let late = (difference(attachment, now) - source.quickest).max(0.0);
        let late = Duration::try_from_secs_f64(late * 1e-9).unwrap_or(Duration::MAX);
        self.newest.sent = Some(SentWrench {
            wrench,
            made: Some(now.saturating_sub(late)),
            uncertainty: Duration::ZERO,
            received: now,
            sender: source.number,
            index: attachment.sequence.unsigned_abs(),
        });
        self.output.write(self.newest);
    }

    /// The source of the message, if it is its newest and nobody else has the word.
    fn follow(&mut self, attachment: &Attachment, now: Duration) -> Option<Source> {
        let gap = difference(attachment, now);
        let followed = match self.source {
            Some(source) if source.gid == attachment.gid => {
                let step = attachment.sequence.checked_sub(source.sequence)?;
                if step <= 0 {
                    return None;
                }
                let missing = step.unsigned_abs() - 1;
                self.statistics.lost.fetch_add(missing, Ordering::Relaxed);
                let went_back = attachment.sent_ns < source.sent_ns;
                if went_back && !source.went_back {
                    let by = source.sent_ns.abs_diff(attachment.sent_ns) as f64 * 1e-9;
                    tracing::warn!(
                        "the clock of the node of ROS 2 that sends forces went back by {by:.3} s: its values count as that much older; start the node anew"
                    );
                }
                let passed = now.saturating_sub(source.heard).as_nanos() as f64;
                Source {
                    sequence: attachment.sequence,
                    heard: now,
                    quickest: (source.quickest + DRIFT * passed).min(gap),
                    sent_ns: attachment.sent_ns,
                    went_back: source.went_back || went_back,
                    ..source
                }
            }
            Some(source) if now.saturating_sub(source.heard) <= SILENCE => return None,
            before => Source {
                gid: attachment.gid,
                sequence: attachment.sequence,
                heard: now,
                quickest: gap,
                sent_ns: attachment.sent_ns,
                went_back: false,
                number: before.map_or(0, |before| before.number) + 1,
            },
        };
        self.source = Some(followed);
        self.source
    }

    fn drop_one(&self) {
        self.statistics.dropped.fetch_add(1, Ordering::Relaxed);
    }
}

/// Session time at arrival less the sender's stamp, ns.
fn difference(attachment: &Attachment, now: Duration) -> f64 {
    // Some 60 bits: the difference is exact before it is rounded.
    (now.as_nanos() as i128 - i128::from(attachment.sent_ns)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::spatial::Vector6;
    use triple_buffer::Output;

    const EPOCH_MS: i64 = 1_790_000_000_000;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn order() -> (RosOrder, Output<NewestWrench>) {
        let (input, output) = triple_buffer::triple_buffer(&NewestWrench::default());
        (RosOrder::new(input, Arc::default()), output)
    }

    fn came(gid: u8, sequence: i64, sent_ms: i64) -> RosWrench {
        RosWrench::Wrench {
            wrench: Vector6::x() * sequence as f64,
            attachment: Attachment {
                sequence,
                sent_ns: sent_ms * 1_000_000,
                gid: [gid; 16],
            },
        }
    }

    fn newest(output: &mut Output<NewestWrench>) -> (u64, Duration) {
        let sent = output.read().sent.unwrap_or_else(|| panic!("nothing"));
        (sent.index, sent.received - sent.made.unwrap_or_default())
    }

    #[test]
    fn one_that_took_longer_than_the_quickest_is_older_by_that() {
        let (mut order, mut output) = order();
        for (sequence, sent, arrived, late) in [
            (1, 0, 10, 0),
            (2, 1, 11, 0),
            (3, 2, 62, 50),
            (4, 60, 65, 0),
            (5, 61, 71, 5),
        ] {
            order.take(&came(1, sequence, EPOCH_MS + sent), ms(arrived));
            let (index, age) = newest(&mut output);
            assert_eq!(index, sequence.unsigned_abs());
            let off = age.abs_diff(ms(late));
            assert!(off < Duration::from_micros(20), "{sequence}: {age:?}");
        }
    }

    #[test]
    fn repeated_overtaken_and_strange_ones_are_dropped_and_gaps_are_counted() {
        let (mut order, mut output) = order();
        order.take(&came(1, 5, EPOCH_MS), ms(10));
        for (gid, sequence) in [(1, 5), (1, 4), (1, i64::MIN), (2, 9)] {
            order.take(&came(gid, sequence, EPOCH_MS + 1), ms(11));
            assert_eq!(newest(&mut output).0, 5);
        }
        order.take(&RosWrench::NoAttachment, ms(12));
        assert_eq!(order.statistics.dropped.load(Ordering::Relaxed), 5);
        order.take(&came(1, 8, EPOCH_MS + 3), ms(13));
        assert_eq!(
            (
                newest(&mut output).0,
                order.statistics.lost.load(Ordering::Relaxed)
            ),
            (8, 2)
        );
        // After a second of silence another publisher is heard, from its own beginning.
        order.take(&came(2, 1, EPOCH_MS - 9_000_000), ms(2000));
        assert_eq!(newest(&mut output), (1, Duration::ZERO));
        assert_eq!(output.read().sent.map(|sent| sent.sender), Some(2));
    }

    #[test]
    fn a_stamp_of_any_size_ends_nothing() {
        let (mut order, mut output) = order();
        for (sequence, sent) in [
            (1, EPOCH_MS),
            (2, i64::MAX / 1_000_000),
            (3, i64::MIN / 1_000_000),
            (4, 0),
            (5, EPOCH_MS + 4),
        ] {
            order.take(
                &came(1, sequence, sent),
                ms(10_000 + sequence.unsigned_abs()),
            );
            assert_eq!(newest(&mut output).0, sequence.unsigned_abs());
        }
        // One from the far future made all after it old: nothing of them is felt until the publisher is another.
        assert!(newest(&mut output).1 > ms(1000));
    }

    #[test]
    fn a_clock_that_goes_back_is_noticed_until_another_publisher_is_heard() {
        let (mut order, mut output) = order();
        let went_back = |order: &RosOrder| order.source.is_some_and(|source| source.went_back);
        // One that is late has a late arrival, not an early stamp.
        order.take(&came(1, 1, EPOCH_MS), ms(10));
        order.take(&came(1, 2, EPOCH_MS + 1), ms(70));
        assert!(!went_back(&order));
        let hour_ago = EPOCH_MS - 3_600_000;
        for sequence in [3_i64, 4] {
            let now = ms(77 + sequence.unsigned_abs());
            order.take(&came(1, sequence, hour_ago + sequence), now);
            assert!(went_back(&order));
            assert_eq!(newest(&mut output), (sequence.unsigned_abs(), now));
        }
        order.take(&came(2, 1, hour_ago), ms(2000));
        assert!(!went_back(&order));
        assert_eq!(newest(&mut output), (1, Duration::ZERO));
    }

    #[test]
    fn what_is_no_wrench_is_told_with_its_time() {
        let (mut order, mut output) = order();
        order.take(&came(1, 1, EPOCH_MS), ms(10));
        order.take(&RosWrench::NoWrench, ms(11));
        assert_eq!(output.read().spoiled, ms(11));
        order.take(&came(1, 2, EPOCH_MS + 2), ms(12));
        let read = *output.read();
        assert_eq!(
            (read.spoiled, read.sent.map(|sent| sent.index)),
            (ms(11), Some(2))
        );
    }
}
