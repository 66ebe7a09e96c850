//! What the nodes of a swap barrier tell each other.

use proptest::prelude::*;
use taut_proto::{
    ArrayVec,
    barrier::{Arrive, MAX_MEMBERS, Release, ReleaseHead},
};

use super::hot::{any_hot, hot};
use super::values::far;

pub fn arrive() -> Arrive {
    Arrive {
        term: 1,
        frame: 1001,
        ready_ns: 16_000_000_000,
        state_hash: 0x0102_0304_0506_0708,
        state_time_ns: 15_990_000_000,
        missed: 3,
        swapped_frame: 1000,
        swapped_ns: 15_995_000_000,
        lit_frame: 999,
        lit_ns: 15_991_000_000,
        draw_us: 4200,
        period_us: 8333,
    }
}

pub fn release() -> Release {
    Release {
        head: ReleaseHead {
            term: 1,
            master: 0,
            frame: 1001,
            swap_ns: 16_000_300_000,
            period_us: 16_667,
            skew_ns: 12_000,
            waited: 0b01,
            late: 0b10,
            members: ArrayVec::from_iter([3, 9]),
        },
        state: hot(),
    }
}

pub fn any_arrive() -> impl Strategy<Value = Arrive> {
    (
        (far(), far(), far(), any::<u64>(), far()),
        (
            any::<u32>(),
            (far(), far()),
            (far(), far()),
            any::<u32>(),
            0..=100_000_000_u32,
        ),
    )
        .prop_map(
            |(
                (term, frame, ready_ns, state_hash, state_time_ns),
                (missed, (swapped_frame, swapped_ns), (lit_frame, lit_ns), draw_us, period_us),
            )| Arrive {
                term,
                frame,
                ready_ns,
                state_hash,
                state_time_ns,
                missed,
                swapped_frame,
                swapped_ns,
                lit_frame,
                lit_ns,
                draw_us,
                period_us,
            },
        )
}

pub fn any_release() -> impl Strategy<Value = Release> {
    let members = prop::collection::btree_set(any::<u16>(), 0..=MAX_MEMBERS);
    (
        (far(), any::<u16>(), far(), far()),
        (0..=1_000_000_u32, any::<u32>(), any::<u32>(), any::<u32>()),
        members,
        any_hot(),
    )
        .prop_map(
            |(
                (term, master, frame, swap_ns),
                (period_us, skew_ns, waited, late),
                members,
                state,
            )| {
                let of_members = ((1_u64 << members.len()) - 1) as u32;
                Release {
                    head: ReleaseHead {
                        term,
                        master,
                        frame,
                        swap_ns,
                        period_us,
                        skew_ns,
                        waited: waited & of_members,
                        late: late & of_members,
                        members: members.into_iter().collect(),
                    },
                    state,
                }
            },
        )
}
