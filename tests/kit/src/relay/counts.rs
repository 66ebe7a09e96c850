//! What a relay did, counted.

use std::sync::atomic::{AtomicU64, Ordering};

use super::fate::{Fate, Loss};

macro_rules! counts {
    ($($(#[$doc:meta])* $field:ident),* $(,)?) => {
        /// What a relay did in one direction, all flows together.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct RelayCounts { $($(#[$doc])* pub $field: u64,)* }

        #[derive(Debug, Default)]
        pub(super) struct Cells { $($field: AtomicU64,)* }

        impl Cells {
            pub(super) fn read(&self) -> RelayCounts {
                RelayCounts { $($field: self.$field.load(Ordering::SeqCst),)* }
            }
        }
    };
}

counts! {
    /// Datagrams that came.
    received,
    /// Datagrams that were sent on, second copies and damaged ones included.
    passed,
    /// Lost each for itself.
    lost,
    /// Lost in bursts.
    lost_in_bursts,
    /// Lost in black holes, of the plan or of the switch.
    swallowed,
    /// Lost because they are too long.
    too_long,
    /// Held back until the next one had passed.
    swapped,
    /// Passed twice.
    doubled,
    /// Passed with a wrong bit.
    flipped,
    /// Datagrams that the system did not take.
    send_errors,
}

impl RelayCounts {
    /// Datagrams that did not pass.
    pub fn all_lost(&self) -> u64 {
        self.lost + self.lost_in_bursts + self.swallowed + self.too_long
    }
}

impl Cells {
    pub(super) fn count(&self, fate: &Fate) {
        add(&self.received);
        match fate.lost {
            Some(Loss::Alone) => return add(&self.lost),
            Some(Loss::Burst) => return add(&self.lost_in_bursts),
            Some(Loss::BlackHole) => return add(&self.swallowed),
            Some(Loss::TooLong) => return add(&self.too_long),
            None => {}
        }
        let extras = [
            (fate.swapped, &self.swapped),
            (fate.doubled, &self.doubled),
            (fate.flipped.is_some(), &self.flipped),
        ];
        for (happened, cell) in extras {
            if happened {
                add(cell);
            }
        }
    }

    pub(super) fn sent(&self, taken: bool) {
        add(if taken {
            &self.passed
        } else {
            &self.send_errors
        });
    }
}

fn add(cell: &AtomicU64) {
    cell.fetch_add(1, Ordering::SeqCst);
}
