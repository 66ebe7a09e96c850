//! Limits against floods: token buckets by source and by session, and who may try to join. Pure: times are arguments, memory is fixed.
//!
//! | symbol | name in code          | unit | meaning                                                        |
//! |--------|-----------------------|------|----------------------------------------------------------------|
//! | r      | [`Rate::per_second`]  | 1/s  | what is let through in the long run                            |
//! | b      | [`Rate::burst`]       | –    | what is let through at once                                    |
//! | TAT    | `free_ns`             | ns   | when the bucket would be full again: theoretical arrival time  |
//!
//! A bucket is one number, by the generic cell rate algorithm: an arrival conforms if TAT − now ≤ (b − 1)/r, and then moves TAT on by 1/r.
//! Source: ITU-T I.371, annex A. In any time t at most b + r·t arrivals conform.

use std::{
    collections::hash_map::RandomState,
    hash::{BuildHasher, Hash},
    net::{IpAddr, Ipv6Addr, SocketAddr},
};

/// How much is let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    /// In the long run, 1/s; at least 1.
    pub per_second: u32,
    /// At once; at least 1.
    pub burst: u32,
}

const NS_PER_S: u64 = 1_000_000_000;

/// What one source has left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TokenBucket {
    free_ns: u64,
}

impl TokenBucket {
    /// Whether an arrival at `now_ns` is let through; if so, it is counted. A clock that stands still or goes back lets nothing extra through.
    pub fn take(&mut self, rate: Rate, now_ns: u64) -> bool {
        let period = NS_PER_S / u64::from(rate.per_second.max(1));
        let tolerance = period.saturating_mul(u64::from(rate.burst.max(1) - 1));
        let free = self.free_ns.max(now_ns);
        if free - now_ns > tolerance {
            return false;
        }
        self.free_ns = free.saturating_add(period);
        true
    }
}

/// Slots that one key can be in: the oldest of them makes room.
const WAYS: usize = 4;

/// A table of fixed size: a key that finds no room takes the place of the one of its four neighbours that was seen longest ago. The hash
/// is keyed, so that nobody chooses his neighbours.
#[derive(Clone, Debug)]
pub struct SourceTable<K, V, S = RandomState> {
    slots: Box<[Slot<K, V>]>,
    hasher: S,
}

#[derive(Clone, Debug)]
struct Slot<K, V> {
    key: Option<K>,
    value: V,
    seen_ns: u64,
}

/// What may be in a [`SourceTable`].
pub trait Tracked: Default {
    /// Whether it must stay although there is no room.
    fn is_held(&self) -> bool {
        false
    }
}

impl Tracked for TokenBucket {}

impl<K: Copy + Eq + Hash, V: Tracked, S: BuildHasher> SourceTable<K, V, S> {
    /// Room for `sets` × 4 keys, hashed by `hasher`.
    pub fn with_hasher(sets: usize, hasher: S) -> SourceTable<K, V, S> {
        let empty = || Slot {
            key: None,
            value: V::default(),
            seen_ns: 0,
        };
        SourceTable {
            slots: (0..sets.max(1) * WAYS).map(|_| empty()).collect(),
            hasher,
        }
    }

    /// Keys that there is room for.
    pub fn capacity(&self) -> usize {
        self.slots.len()
    }

    /// What is known of `key`, which is noted if it is new; `None` if all its neighbours are held. No allocation.
    pub fn entry(&mut self, key: K, now_ns: u64) -> Option<&mut V> {
        let sets = self.slots.len() / WAYS;
        let set = (self.hasher.hash_one(key) % sets as u64) as usize;
        let set = &mut self.slots[set * WAYS..(set + 1) * WAYS];
        let place = match set.iter().position(|slot| slot.key == Some(key)) {
            Some(place) => place,
            None => {
                let place = (0..WAYS)
                    .filter(|place| !set[*place].value.is_held())
                    .min_by_key(|place| (set[*place].key.is_some(), set[*place].seen_ns))?;
                set[place].key = Some(key);
                set[place].value = V::default();
                place
            }
        };
        set[place].seen_ns = now_ns;
        Some(&mut set[place].value)
    }
}

/// Datagrams of sources that have not proven anything: what of them is worth the cryptography.
#[derive(Clone, Debug)]
pub struct UnknownSources<S = RandomState> {
    sources: SourceTable<SocketAddr, TokenBucket, S>,
    all: TokenBucket,
    of_one: Rate,
    of_all: Rate,
}

/// Sets of the table of unknown sources: 1024 addresses.
const UNKNOWN_SETS: usize = 256;

impl UnknownSources {
    /// `of_one` for each source, `of_all` for all of them together, whose number nobody can bound.
    pub fn new(of_one: Rate, of_all: Rate) -> UnknownSources {
        UnknownSources::with_hasher(of_one, of_all, RandomState::new())
    }
}

impl<S: BuildHasher> UnknownSources<S> {
    /// The same with a hash of the caller's.
    pub fn with_hasher(of_one: Rate, of_all: Rate, hasher: S) -> UnknownSources<S> {
        UnknownSources {
            sources: SourceTable::with_hasher(UNKNOWN_SETS, hasher),
            all: TokenBucket::default(),
            of_one,
            of_all,
        }
    }

    /// Whether a datagram from `source` may be looked at. No allocation.
    pub fn admit(&mut self, source: SocketAddr, now_ns: u64) -> bool {
        let of_one = self.of_one;
        self.sources
            .entry(source, now_ns)
            .is_some_and(|bucket| bucket.take(of_one, now_ns))
            && self.all.take(self.of_all, now_ns)
    }
}

/// Limits of joining, per address: all who share one share them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JoinLimits {
    /// Attempts.
    pub attempts: Rate,
    /// Attempts under way at once.
    pub at_once: u16,
    /// Wrong proofs that cost nothing.
    pub free_failures: u8,
    /// Wait after the first that does, ns; doubles with each.
    pub first_wait_ns: u64,
    /// Longest wait, ns.
    pub longest_wait_ns: u64,
}

impl Default for JoinLimits {
    /// 32 attempts a second and 128 at once, for a laboratory of nodes behind one address; 24 under way; after three wrong proofs
    /// 0.25 s, 0.5 s, 1 s, 2 s: a node of the same address that holds the right key still gets in within its own patience of 3 s.
    fn default() -> JoinLimits {
        JoinLimits {
            attempts: Rate {
                per_second: 32,
                burst: 128,
            },
            at_once: 24,
            free_failures: 3,
            first_wait_ns: NS_PER_S / 4,
            longest_wait_ns: 2 * NS_PER_S,
        }
    }
}

/// Who may try to join.
#[derive(Clone, Debug)]
pub struct JoinGuard<S = RandomState> {
    table: SourceTable<IpAddr, Attempts, S>,
    limits: JoinLimits,
}

#[derive(Clone, Copy, Debug, Default)]
struct Attempts {
    bucket: TokenBucket,
    under_way: u16,
    failures: u8,
    blocked_until_ns: u64,
}

impl Tracked for Attempts {
    fn is_held(&self) -> bool {
        self.under_way > 0
    }
}

/// How an attempt to join ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Attempt {
    /// The client proved its secret.
    Proven,
    /// Its proof was wrong.
    WrongProof,
    /// It broke off, or was refused for another reason.
    Ended,
}

/// Sets of the table of joining addresses: 1024 addresses.
const JOIN_SETS: usize = 256;

impl JoinGuard {
    /// Nobody has tried yet.
    pub fn new(limits: JoinLimits) -> JoinGuard {
        JoinGuard::with_hasher(limits, RandomState::new())
    }
}

impl<S: BuildHasher> JoinGuard<S> {
    /// The same with a hash of the caller's.
    pub fn with_hasher(limits: JoinLimits, hasher: S) -> JoinGuard<S> {
        JoinGuard {
            table: SourceTable::with_hasher(JOIN_SETS, hasher),
            limits,
        }
    }

    /// Whether `address` may try now; if so, [`JoinGuard::end`] must follow.
    pub fn begin(&mut self, address: IpAddr, now_ns: u64) -> bool {
        let limits = self.limits;
        let Some(attempts) = self.table.entry(network_of(address), now_ns) else {
            return false;
        };
        let may = now_ns >= attempts.blocked_until_ns
            && attempts.under_way < limits.at_once
            && attempts.bucket.take(limits.attempts, now_ns);
        if may {
            attempts.under_way += 1;
        }
        may
    }

    /// An attempt that was let through is over.
    pub fn end(&mut self, address: IpAddr, attempt: Attempt, now_ns: u64) {
        let limits = self.limits;
        let Some(attempts) = self.table.entry(network_of(address), now_ns) else {
            return;
        };
        attempts.under_way = attempts.under_way.saturating_sub(1);
        match attempt {
            Attempt::Proven => {
                attempts.failures = 0;
                attempts.blocked_until_ns = 0;
            }
            Attempt::WrongProof => {
                attempts.failures = attempts.failures.saturating_add(1);
                if let Some(beyond) = attempts.failures.checked_sub(limits.free_failures + 1) {
                    let wait = limits.first_wait_ns.saturating_mul(1 << beyond.min(20));
                    attempts.blocked_until_ns =
                        now_ns.saturating_add(wait.min(limits.longest_wait_ns));
                }
            }
            Attempt::Ended => {}
        }
    }
}

/// An IPv6 network hands a host 2⁶⁴ addresses: they count as one. An IPv4 address in the form of IPv6 counts as itself.
pub(crate) fn network_of(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => {
            let [a, b, c, d, ..] = address.segments();
            IpAddr::V6(Ipv6Addr::new(a, b, c, d, 0, 0, 0, 0))
        }
        v4 => v4,
    }
}
