//! What is known of a force from outside, outside the loop that adds it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use god_object::spatial::{Vector6, angular, linear};

/// Why a value is not felt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// Older than may be felt when it came.
    Old,
    /// Its time is that of no clock that is known, or ahead of it.
    NotOnClock,
    /// Its time is not after that of the value before.
    WentBack,
    /// It was no wrench.
    Spoiled,
}

impl Refused {
    /// All, with their names in metrics.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("old", Self::Old),
        ("not-on-clock", Self::NotOnClock),
        ("went-back", Self::WentBack),
        ("no-wrench", Self::Spoiled),
    ];
}

/// What is known of it outside the loop. One writer: the haptics thread.
#[derive(Debug, Default)]
pub struct ExternalWrenchStatistics {
    pub(super) taken: AtomicU64,
    refused: [AtomicU64; Refused::NAMED.len()],
    /// Of a receiver that has no counters of its own; it writes them.
    pub lost: AtomicU64,
    /// The same of values that came again, too late, or without what tells their time.
    pub dropped: AtomicU64,
    /// Of the value that is felt now, ns; the most that it ever was while felt.
    age_ns: AtomicU64,
    largest_age_ns: AtomicU64,
    felt: AtomicBool,
    /// Norms of force and torque that are added now, as bits of an `f64`.
    added_bits: [AtomicU64; 2],
}

impl ExternalWrenchStatistics {
    /// Values that were felt.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// Values that were not, by the reason's name.
    #[must_use]
    pub fn refused(&self) -> [(&'static str, u64); Refused::NAMED.len()] {
        Refused::NAMED.map(|(name, why)| (name, self.refused[why as usize].load(Ordering::Relaxed)))
    }

    /// Age of the value that is felt now; `None` while none is.
    #[must_use]
    pub fn age(&self) -> Option<Duration> {
        self.is_felt()
            .then(|| Duration::from_nanos(self.age_ns.load(Ordering::Relaxed)))
    }

    /// The most that the age of a value was while anything of it was felt.
    #[must_use]
    pub fn largest_age(&self) -> Duration {
        Duration::from_nanos(self.largest_age_ns.load(Ordering::Relaxed))
    }

    /// Whether anything of it goes to the device port now.
    #[must_use]
    pub fn is_felt(&self) -> bool {
        self.felt.load(Ordering::Relaxed)
    }

    /// Norms of the force, N, and the torque, N m, that are added now.
    #[must_use]
    pub fn added(&self) -> [f64; 2] {
        let value = |bits: &AtomicU64| f64::from_bits(bits.load(Ordering::Relaxed));
        [value(&self.added_bits[0]), value(&self.added_bits[1])]
    }

    pub(super) fn refuse(&self, why: Refused) {
        self.refused[why as usize].fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn tell(&self, age: Option<Duration>, added: &Vector6) {
        self.felt.store(age.is_some(), Ordering::Relaxed);
        if let Some(age) = age {
            let age = u64::try_from(age.as_nanos()).unwrap_or(u64::MAX);
            self.age_ns.store(age, Ordering::Relaxed);
            self.largest_age_ns.fetch_max(age, Ordering::Relaxed);
        }
        let norms = [linear(added).norm(), angular(added).norm()];
        for (bits, norm) in self.added_bits.iter().zip(norms) {
            bits.store(norm.to_bits(), Ordering::Relaxed);
        }
    }
}
