//! The replay window against a set that remembers everything.

use proptest::prelude::*;
use std::collections::HashSet;
use taut_proto::replay::{Freshness, ReplayWindow, WINDOW};

#[test]
fn a_number_counts_once() {
    let mut window = ReplayWindow::default();
    for number in [5, 3, 4, 2_000, 1_999, 1_500] {
        assert_ne!(window.check(number), Freshness::Duplicate);
        window.mark(number);
        assert_eq!(window.check(number), Freshness::Duplicate);
    }
    assert_eq!(window.check(2_001 - WINDOW), Freshness::Late);
    assert_eq!(window.check(2_000 - WINDOW), Freshness::TooOld);
    assert_eq!(window.check(2_001), Freshness::Newest);
}

#[test]
fn the_oldest_numbers_are_remembered_while_the_newest_word_is_half_full() {
    let mut window = ReplayWindow::default();
    for number in 0..WINDOW {
        window.mark(number);
    }
    window.mark(WINDOW); // begins a new word; 1 .. 63 share their place with it, were there no word to spare
    assert_eq!(window.check(63), Freshness::Duplicate);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_window_agrees_with_a_set(steps in prop::collection::vec((0_u64..3_000, prop::bool::ANY), 1..400)) {
        let mut window = ReplayWindow::default();
        let mut seen = HashSet::new();
        let mut next = 0_u64;
        for (number, jump) in steps {
            // Now and then a far jump forward, otherwise around the front.
            let number = if jump { next + number } else { next.saturating_sub(number) };
            let expected = if number >= next {
                Freshness::Newest
            } else if number + WINDOW < next {
                Freshness::TooOld
            } else if seen.contains(&number) {
                Freshness::Duplicate
            } else {
                Freshness::Late
            };
            prop_assert_eq!(window.check(number), expected);
            if matches!(expected, Freshness::Newest | Freshness::Late) {
                window.mark(number);
                seen.insert(number);
                next = next.max(number + 1);
            }
            prop_assert_eq!(window.next(), next);
        }
    }
}
