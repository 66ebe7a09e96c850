//! Constraint sets: divided into datagrams, mixed up by a network, and whole again or not used.

use crate::samples::*;
use assert_no_alloc::assert_no_alloc;
use proptest::prelude::*;
use taut_proto::{
    Assembler, ConstraintPart, ConstraintSet, DecodeError, Division, Kind, PartTaken, Payload,
    constraint_parts::SLOTS,
    constraints::{
        ConstraintRow, MAX_PART_ROWS, MAX_PARTS, MAX_SET_ROWS, RowSeparation, SET_PAUSED, SetHead,
    },
    seal::{KEY_MATERIAL_BYTES, Opener, Sealer},
};

fn set(sequence: u64, rows: usize) -> ConstraintSet {
    let row = |k: usize| ConstraintRow {
        obstacle: k as u16,
        gap: sequence as f32,
        ..ConstraintRow::default()
    };
    ConstraintSet {
        head: SetHead {
            sequence,
            ..SetHead::default()
        },
        rows: (0..rows).map(row).collect(),
    }
}

fn parts(set: &ConstraintSet) -> Vec<ConstraintPart> {
    let division = Division::of(set);
    (0..division.parts())
        .map(|part| division.part(set, part))
        .collect()
}

/// Most bytes that a row can have.
fn largest_row() -> ConstraintRow {
    ConstraintRow {
        obstacle_displacement: [1.0; 3],
        shading_normal: Some([0.0; 3]),
        separation: RowSeparation::OfRods([[0.0; 3]; 2], [0.0; 2]),
        ..ConstraintRow::default()
    }
}

#[test]
fn the_fullest_set_of_the_largest_rows_fits_its_parts_and_every_part_a_datagram() {
    let full = ConstraintSet {
        rows: vec![largest_row(); MAX_SET_ROWS],
        ..set(1, 0)
    };
    let parts = parts(&full);
    assert!(parts.len() <= MAX_PARTS, "{}", parts.len());
    let sealer = Sealer::new(&[7; KEY_MATERIAL_BYTES], 1, 0);
    let mut assembler = Assembler::new();
    for (k, part) in parts.iter().enumerate() {
        let _ = sealed(&sealer, &Payload::Constraints(part.clone()));
        let last = k + 1 == parts.len();
        let expected = if last {
            PartTaken::Whole
        } else {
            PartTaken::Waiting
        };
        assert_eq!(assembler.take(part), expected);
    }
    assert_eq!(assembler.newest(), Some(&full));
}

#[test]
fn a_set_without_rows_is_a_set() {
    let mut assembler = Assembler::new();
    let empty = set(3, 0);
    assert_eq!(parts(&empty).len(), 1);
    assert_eq!(assembler.take(&parts(&empty)[0]), PartTaken::Whole);
    assert_eq!(assembler.newest(), Some(&empty));
}

#[test]
fn a_set_that_lost_a_part_is_not_used_and_the_next_whole_one_is() {
    let mut assembler = Assembler::new();
    let [first, second] = [set(1, 60), set(2, 60)];
    for part in &parts(&first)[1..] {
        assert_eq!(assembler.take(part), PartTaken::Waiting);
    }
    assert_eq!(assembler.newest(), None);
    for part in &parts(&second) {
        let _ = assembler.take(part);
    }
    assert_eq!(assembler.newest(), Some(&second));
    // What was missing comes at last: too late.
    assert_eq!(assembler.take(&parts(&first)[0]), PartTaken::Overtaken);
    assert_eq!(assembler.newest(), Some(&second));
}

#[test]
fn a_set_sent_twice_makes_up_for_what_was_lost_and_a_repeat_is_a_sign_of_life() {
    let mut assembler = Assembler::new();
    let set = set(1, 60);
    let parts = parts(&set);
    assert_eq!(parts.len(), 3);
    let taken: Vec<_> = [0, 2, 0, 1, 2].map(|k| assembler.take(&parts[k])).to_vec();
    use PartTaken::{Repeated, Waiting, Whole};
    assert_eq!(taken, [Waiting, Waiting, Waiting, Whole, Repeated]);
    assert_eq!(assembler.newest(), Some(&set));
}

#[test]
fn a_pause_holds_until_a_newer_reading_whatever_changes_places() {
    let head = |reading: u64, flags: u8| {
        let mut set = set(1, 60);
        (set.head.device_ns, set.head.flags) = (reading, flags);
        parts(&set)
    };
    let (given, paused) = (head(10, 0), head(10, SET_PAUSED));
    let (older, newer) = (head(9, 0), head(11, 0));
    let flags = |assembler: &Assembler| assembler.newest().expect("whole").head.flags;
    // On its way, and whole.
    let mut assembler = Assembler::new();
    for part in [&given[0], &paused[1], &older[0], &given[2]] {
        assembler.take(part);
    }
    assert_eq!(flags(&assembler), SET_PAUSED);
    for part in [&given[0], &older[1], &given[2]] {
        assert_eq!(assembler.take(part), PartTaken::Repeated);
        assert_eq!(flags(&assembler), SET_PAUSED);
    }
    assert_eq!(assembler.take(&newer[1]), PartTaken::Repeated);
    assert_eq!(flags(&assembler), 0);
    assembler.take(&paused[0]);
    assert_eq!(flags(&assembler), 0, "of an older reading");
}

#[test]
fn parts_of_sets_that_overlap_in_time_still_make_whole_sets() {
    // Every set's last part comes seven sets late: as much as the slots hold.
    let mut assembler = Assembler::new();
    let sets: Vec<_> = (1..50).map(|sequence| set(sequence, 60)).collect();
    for (k, now) in sets.iter().enumerate() {
        for part in &parts(now)[..2] {
            assert_eq!(assembler.take(part), PartTaken::Waiting);
        }
        if let Some(earlier) = k.checked_sub(SLOTS - 1) {
            assert_eq!(assembler.take(&parts(&sets[earlier])[2]), PartTaken::Whole);
            assert_eq!(assembler.newest(), Some(&sets[earlier]));
        }
    }
}

#[test]
fn parts_that_contradict_each_other_make_no_set() {
    let three = parts(&set(1, 60));
    let mut other_size = three[1].clone();
    other_size.rows_in_set += 1;
    let mut other_pose = three[1].clone();
    other_pose.head.pose.position[0] = 1.0;
    let mut other_count = three[1].clone();
    other_count.parts += 1;
    for odd in [other_size, other_pose, other_count] {
        let mut assembler = Assembler::new();
        assert_eq!(assembler.take(&three[0]), PartTaken::Waiting);
        assert_eq!(assembler.take(&odd), PartTaken::Refused);
    }
    // Every part is here, yet a row is not.
    let mut overlapping = three[1].clone();
    overlapping.first_row -= 1;
    let mut assembler = Assembler::new();
    for part in [&three[0], &overlapping] {
        assert_eq!(assembler.take(part), PartTaken::Waiting);
    }
    assert_eq!(assembler.take(&three[2]), PartTaken::Refused);
    assert_eq!(assembler.newest(), None);
}

#[test]
fn impossible_places_and_unknown_contents_are_refused() {
    let good = bytes_of(&Payload::Constraints(part()));
    let bent = |at: usize, with: u8| {
        let mut bytes = good.clone();
        bytes[at] = with;
        Payload::decode(Kind::Constraints, &bytes)
    };
    let place = Err(DecodeError::Inconsistent {
        what: "place in the set",
    });
    assert_eq!(bent(80, 1), place, "nine rows do not fit a set of one");
    assert_eq!(bent(82, 2), place, "part 2 of 2, from 0");
    assert_eq!(refused(bent(81, 5)), "ConstraintPart.rows_in_set");
    assert_eq!(refused(bent(83, 129)), "ConstraintPart.parts");
    let has = 88 + 11;
    for (at, with, unknown) in [
        (87, 0x80, "set flags"),
        (has, 0x20, "row content"),
        (has, 7, "separation"),
    ] {
        let refused = bent(at, with);
        assert!(matches!(refused, Err(DecodeError::UnknownTag { what, .. }) if what == unknown));
    }
}

#[test]
fn receiving_takes_no_memory() {
    let full = set(1, MAX_SET_ROWS);
    let sealer = Sealer::new(&[7; KEY_MATERIAL_BYTES], 1, 0);
    let datagrams: Vec<_> = (0..4)
        .flat_map(|round| {
            let again = ConstraintSet {
                head: SetHead {
                    sequence: 1 + round,
                    ..full.head
                },
                rows: full.rows.clone(),
            };
            parts(&again)
        })
        .map(|part| sealed(&sealer, &Payload::Constraints(part)))
        .collect();
    let mut opener = Opener::new(&[7; KEY_MATERIAL_BYTES], 1, 0);
    let mut assembler = Assembler::new();
    let mut out = ConstraintSet::new();
    let mut whole = 0;
    assert_no_alloc(|| {
        for datagram in &datagrams {
            if let Ok(opened) = opener.open(datagram)
                && let Payload::Constraints(part) = &opened.payload
                && assembler.take(part) == PartTaken::Whole
                && let Some(newest) = assembler.newest()
            {
                out.clone_from(newest);
                whole += 1;
            }
        }
    });
    assert_eq!((whole, out.rows.len()), (4, MAX_SET_ROWS));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_set_comes_back_through_any_order_of_its_parts(
        rows in prop::collection::vec(any_row(), 0..120),
        order in any::<u64>(),
    ) {
        let sent = ConstraintSet { rows, ..set(5, 0) };
        let mut parts = parts(&sent);
        let mut assembler = Assembler::new();
        let mut taken = PartTaken::Waiting;
        let mut dice = order;
        while !parts.is_empty() {
            prop_assert_eq!(taken, PartTaken::Waiting);
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let part = parts.swap_remove((dice >> 33) as usize % parts.len());
            prop_assert!(part.rows.len() <= MAX_PART_ROWS);
            // Through the bytes, too.
            match Payload::decode(Kind::Constraints, &bytes_of(&Payload::Constraints(part))) {
                Ok(Payload::Constraints(part)) => taken = assembler.take(&part),
                other => return Err(TestCaseError::fail(format!("{other:?}"))),
            }
        }
        prop_assert_eq!(taken, PartTaken::Whole);
        prop_assert_eq!(assembler.newest(), Some(&sent));
    }

    #[test]
    fn whatever_parts_arrive_sets_are_whole_and_never_go_back(
        arrivals in prop::collection::vec((1_u64..12, 0_usize..3, 0_usize..3), 0..200),
    ) {
        // Sizes differ from set to set, so that a mixture would show.
        let sets: Vec<_> = (0..12).map(|k| set(k, 26 + 5 * k as usize)).collect();
        let mut assembler = Assembler::new();
        let mut last = 0;
        for (sequence, part, repeats) in arrivals {
            let parts = parts(&sets[sequence as usize]);
            for _ in 0..=repeats {
                let _ = assembler.take(&parts[part % parts.len()]);
            }
            if let Some(newest) = assembler.newest() {
                let sequence = newest.head.sequence;
                prop_assert!(sequence >= last);
                last = sequence;
                prop_assert_eq!(newest, &sets[sequence as usize]);
            }
        }
    }

    #[test]
    fn any_bytes_are_a_part_or_an_error(bytes in prop::collection::vec(any::<u8>(), 88..400)) {
        let mut assembler = Assembler::new();
        if let Ok(Payload::Constraints(part)) = Payload::decode(Kind::Constraints, &bytes) {
            let _ = assembler.take(&part);
        }
    }

    #[test]
    fn bent_parts_never_panic(at in any::<prop::sample::Index>(), byte in any::<u8>()) {
        let mut bytes = bytes_of(&Payload::Constraints(part()));
        let at = at.index(bytes.len());
        bytes[at] = byte;
        let mut assembler = Assembler::new();
        if let Ok(Payload::Constraints(part)) = Payload::decode(Kind::Constraints, &bytes) {
            let _ = assembler.take(&part);
        }
    }
}
