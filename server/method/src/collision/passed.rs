//! Pairs of triangles that the last motion's searches came across: what is near the body where it went, and where it came to.
//!
//! A row that the body slides off has its successor next to it, and the search has looked there. So contacts along a motion are found
//! without another descent of the trees.

/// Pairs kept. Conforming surfaces have more; then the list says that it is not complete.
const CAPACITY: usize = 512;

/// One pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PassedPair {
    /// Index of the obstacle in the world.
    pub(crate) obstacle: u16,
    /// Triangles of the body and of the obstacle.
    pub(crate) triangles: (u32, u32),
}

/// The pairs of one motion, obstacle by obstacle. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct PassedPairs {
    pairs: Vec<PassedPair>,
    obstacle: u16,
    /// First pair of the present search.
    from: usize,
    overflowed: bool,
}

impl PassedPairs {
    pub(super) fn new() -> Self {
        Self {
            pairs: Vec::with_capacity(CAPACITY),
            obstacle: 0,
            from: 0,
            overflowed: false,
        }
    }

    /// Forgets all: a motion begins.
    pub(crate) fn clear(&mut self) {
        self.pairs.clear();
        self.from = 0;
        self.overflowed = false;
    }

    /// The next search is for this obstacle.
    pub(crate) fn begin(&mut self, obstacle: u16) {
        self.obstacle = obstacle;
        self.from = self.pairs.len();
    }

    /// The present search begins again.
    pub(super) fn restart(&mut self) {
        self.pairs.truncate(self.from);
    }

    #[inline]
    pub(super) fn push(&mut self, triangles: (u32, u32)) {
        if self.pairs.len() == CAPACITY {
            self.overflowed = true;
            return;
        }
        self.pairs.push(PassedPair {
            obstacle: self.obstacle,
            triangles,
        });
    }

    /// The pairs; `None` where there were more than are kept.
    pub(crate) fn all(&self) -> Option<&[PassedPair]> {
        (!self.overflowed).then_some(&self.pairs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_that_begins_again_forgets_its_own_pairs_and_an_overflow_is_said() {
        let mut passed = PassedPairs::new();
        passed.begin(0);
        passed.push((1, 2));
        passed.begin(1);
        passed.push((3, 4));
        passed.restart();
        passed.push((5, 6));
        let all = passed.all().map(<[_]>::to_vec);
        let pair = |obstacle, triangles| PassedPair {
            obstacle,
            triangles,
        };
        assert_eq!(all, Some(vec![pair(0, (1, 2)), pair(1, (5, 6))]));
        for _ in 0..CAPACITY {
            passed.push((7, 8));
        }
        assert_eq!(passed.all(), None);
        passed.clear();
        assert_eq!(passed.all(), Some(&[][..]));
    }
}
