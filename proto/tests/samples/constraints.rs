//! Parts of a constraint set.

use proptest::prelude::*;
use taut_proto::{
    ArrayVec, ConstraintPart, PoseF64,
    constraints::{
        ConstraintRow, MAX_PART_ROWS, MAX_PARTS, MAX_SET_ROWS, RowFeature, RowSeparation, SetHead,
    },
};

use super::values::{far, finite32, pose64, size32};

/// A part with a row of every kind.
pub fn part() -> ConstraintPart {
    let plain = ConstraintRow {
        obstacle: 2,
        on_body: RowFeature { kind: 0, index: 7 },
        on_obstacle: RowFeature { kind: 2, index: 9 },
        arm: [0.5, 0.25, -0.125],
        normal: [0.0, 0.0, 1.0],
        gap: 0.000_976_562_5,
        ..ConstraintRow::default()
    };
    let along = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let of = |separation| ConstraintRow {
        separation,
        ..plain
    };
    ConstraintPart {
        head: SetHead {
            sequence: 40,
            made_ns: 1_000_000_900,
            device_ns: 1_000_000_000,
            pose: PoseF64 {
                position: [0.5, 0.25, -0.125],
                rotation: [1.0, 0.0, 0.0, 0.0],
            },
            flags: 1,
        },
        rows_in_set: 9,
        part: 1,
        parts: 2,
        first_row: 2,
        rows: ArrayVec::from_iter([
            plain,
            of(RowSeparation::OfBody),
            of(RowSeparation::OfEdges(along)),
            of(RowSeparation::OfBall(0.25)),
            of(RowSeparation::OfRim([0.5; 3], [0.0, 0.0, 1.0], 0.125)),
            of(RowSeparation::OfRods(along, [0.5, 0.25])),
            ConstraintRow {
                obstacle_displacement: [0.5, 0.0, -0.25],
                shading_normal: Some([0.0, 0.5, 0.5]),
                ..plain
            },
        ]),
    }
}

/// As many rows as a datagram surely holds, at any place of a set.
pub fn any_part() -> impl Strategy<Value = ConstraintPart> {
    let head = varied!(SetHead {
        sequence: far(),
        made_ns: far(),
        device_ns: far(),
        pose: pose64(),
        flags: 0_u8..4,
    });
    (
        head,
        (1..=MAX_PARTS as u8).prop_flat_map(|parts| (0..parts, Just(parts))),
        prop::collection::vec(any_row(), 0..=11.min(MAX_PART_ROWS)),
        (0..=MAX_SET_ROWS as u16 - 11).prop_flat_map(|first| (Just(first), 0..=first)),
    )
        .prop_map(|(head, (part, parts), rows, (before, after))| {
            let first_row = before - after;
            ConstraintPart {
                head,
                rows_in_set: first_row + rows.len() as u16 + after,
                part,
                parts,
                first_row,
                rows: ArrayVec::from_iter(rows),
            }
        })
}

pub fn any_row() -> impl Strategy<Value = ConstraintRow> {
    let three = || prop::array::uniform3(finite32());
    let unit = || prop::array::uniform3(-1.0..=1.0_f32);
    let two = move || prop::array::uniform2(unit());
    let separation = prop_oneof![
        Just(RowSeparation::OfObstacle),
        Just(RowSeparation::OfBody),
        two().prop_map(RowSeparation::OfEdges),
        size32().prop_map(RowSeparation::OfBall),
        (three(), unit(), size32()).prop_map(|(c, a, r)| RowSeparation::OfRim(c, a, r)),
        (two(), prop::array::uniform2(size32())).prop_map(|(u, r)| RowSeparation::OfRods(u, r)),
    ];
    let feature = || {
        varied!(RowFeature {
            kind: 0_u8..16,
            index: any::<u32>(),
        })
    };
    varied!(ConstraintRow {
        obstacle: any::<u16>(),
        on_body: feature(),
        on_obstacle: feature(),
        arm: three(),
        normal: unit(),
        gap: finite32(),
        obstacle_displacement: prop_oneof![Just([0.0_f32; 3]), three()],
        separation,
        shading_normal: prop::option::of(unit()),
    })
}
