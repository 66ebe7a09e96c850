//! What waits, by bucket: the earliest bucket comes out first, and what went into one last.

/// Marks the end of a list.
const NONE: u32 = u32::MAX;

/// At most `CAPACITY` that wait in 64 buckets to each of `WORDS`. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct Buckets<T, const WORDS: usize, const CAPACITY: usize> {
    /// First of each list; without meaning where the bucket is empty.
    heads: [[u32; 64]; WORDS],
    /// Which buckets are not empty, a bit each; none before word `first`.
    filled: [u64; WORDS],
    first: usize,
    waiting: Vec<(T, u32)>,
    free: u32,
}

impl<T: Copy, const WORDS: usize, const CAPACITY: usize> Buckets<T, WORDS, CAPACITY> {
    /// Every place is written to, so that no search is the first to touch its pages.
    pub(super) fn new(unused: T) -> Self {
        let mut waiting = vec![(unused, NONE); CAPACITY];
        waiting.clear();
        Self {
            heads: [[NONE; 64]; WORDS],
            filled: [0; WORDS],
            first: 0,
            waiting,
            free: NONE,
        }
    }

    pub(super) fn clear(&mut self) {
        self.filled = [0; WORDS];
        self.first = 0;
        self.waiting.clear();
        self.free = NONE;
    }

    /// False when there is no room. A bucket past the last is one of the others.
    #[inline]
    pub(super) fn push(&mut self, bucket: usize, item: T) -> bool {
        let (word, bit) = (bucket / 64 % WORDS, bucket % 64);
        let next = if self.filled[word] >> bit & 1 == 0 {
            NONE
        } else {
            self.heads[word][bit]
        };
        let place = if self.free != NONE {
            let place = self.free;
            self.free = self.waiting[place as usize].1;
            self.waiting[place as usize] = (item, next);
            place
        } else if self.waiting.len() < CAPACITY {
            self.waiting.push((item, next));
            self.waiting.len() as u32 - 1
        } else {
            return false;
        };
        self.heads[word][bit] = place;
        self.filled[word] |= 1 << bit;
        self.first = self.first.min(word);
        true
    }

    /// One of the earliest and its bucket; none when all that wait come later than in bucket `last`.
    #[inline]
    pub(super) fn pop(&mut self, last: usize) -> Option<(usize, T)> {
        while self.filled.get(self.first)? == &0 {
            self.first += 1;
        }
        let word = self.first;
        let bit = self.filled[word].trailing_zeros() as usize % 64;
        let bucket = 64 * word + bit;
        if bucket > last {
            return None;
        }
        let place = self.heads[word][bit];
        let (item, next) = self.waiting[place as usize];
        self.heads[word][bit] = next;
        if next == NONE {
            self.filled[word] &= !(1 << bit);
        }
        self.waiting[place as usize].1 = self.free;
        self.free = place;
        Some((bucket, item))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: usize = 16;
    const ALL: usize = 64 * WORDS;
    const CAPACITY: usize = 3000;

    #[test]
    fn what_waits_comes_out_by_bucket_and_places_are_used_again() {
        let mut buckets = Buckets::<usize, WORDS, CAPACITY>::new(0);
        let bucket = |k: usize| k * 7919 % ALL;
        for _ in 0..3 {
            buckets.clear();
            for k in 0..CAPACITY {
                assert!(buckets.push(bucket(k), k));
            }
            assert!(!buckets.push(0, 0), "full");
            let mut before = (0, usize::MAX);
            let mut seen = [false; CAPACITY];
            for _ in 0..CAPACITY {
                let (now, k) = buckets.pop(ALL).expect("one more");
                assert_eq!(now, bucket(k));
                assert!(!std::mem::replace(&mut seen[k], true));
                // Of one bucket the last comes out first.
                assert!(now > before.0 || (now == before.0 && k < before.1), "{k}");
                before = (now, k);
            }
            assert!(buckets.pop(ALL).is_none());
            // An earlier one than the last that came out.
            assert!(buckets.push(0, 5));
            assert_eq!(buckets.pop(0), Some((0, 5)));
            assert!(buckets.push(ALL / 2, 6));
            assert!(buckets.pop(ALL / 2 - 1).is_none());
        }
    }
}
