//! Replay window: which sequence numbers of a sender have been seen, the last 1024 of them.
//!
//! Source: RFC 6479 (the sliding window of IPsec without bit shifting), its redundant word included.

/// Sequence numbers remembered. At 1 kHz a packet may come a second late and still count.
pub const WINDOW: u64 = 1024;

const WORD: u64 = 64;
/// One word more than the window: the newest word is cleared as a whole, while the oldest numbers still count.
const WORDS: usize = (WINDOW / WORD) as usize + 1;

/// The window. A new one accepts any number.
#[derive(Clone, Debug, Default)]
pub struct ReplayWindow {
    /// One past the highest number seen; 0 for none.
    next: u64,
    /// Bit of number n: word (n / 64) mod 17, bit n mod 64.
    seen: [u64; WORDS],
}

/// What a number is to the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Freshness {
    /// Never seen, above all others.
    Newest,
    /// Never seen, but overtaken by a higher one.
    Late,
    /// Seen before.
    Duplicate,
    /// Below the window: nobody can tell.
    TooOld,
}

impl ReplayWindow {
    /// What `sequence` is, without marking it: call before opening, [`ReplayWindow::mark`] after.
    pub fn check(&self, sequence: u64) -> Freshness {
        if sequence >= self.next {
            Freshness::Newest
        } else if sequence.saturating_add(WINDOW) < self.next {
            Freshness::TooOld
        } else if self.seen[word(sequence)] & bit(sequence) != 0 {
            Freshness::Duplicate
        } else {
            Freshness::Late
        }
    }

    /// Marks an authenticated number as seen. At most 17 steps.
    pub fn mark(&mut self, sequence: u64) {
        if sequence == u64::MAX || self.check(sequence) == Freshness::TooOld {
            return; // senders stop long before the last number
        }
        if sequence >= self.next {
            // Clear the words between the old highest and the new one: they held numbers a window ago.
            let (old, new) = (self.next.saturating_sub(1) / WORD, sequence / WORD);
            for step in 1..=(new - old).min(WORDS as u64) {
                self.seen[((old + step) % WORDS as u64) as usize] = 0;
            }
            self.next = sequence + 1;
        }
        self.seen[word(sequence)] |= bit(sequence);
    }

    /// One past the highest number seen; 0 for none.
    pub fn next(&self) -> u64 {
        self.next
    }
}

fn word(sequence: u64) -> usize {
    ((sequence / WORD) % WORDS as u64) as usize
}

fn bit(sequence: u64) -> u64 {
    1 << (sequence % WORD)
}
