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
    varied!(Arrive {
        term: far(),
        frame: far(),
        ready_ns: far(),
        state_hash: any::<u64>(),
        state_time_ns: far(),
        missed: any::<u32>(),
        swapped_frame: far(),
        swapped_ns: far(),
        lit_frame: far(),
        lit_ns: far(),
        draw_us: any::<u32>(),
        period_us: 0..=100_000_000_u32,
    })
}

pub fn any_release() -> impl Strategy<Value = Release> {
    let members = prop::collection::btree_set(any::<u16>(), 0..=MAX_MEMBERS);
    let head = varied!(ReleaseHead {
        term: far(),
        master: any::<u16>(),
        frame: far(),
        swap_ns: far(),
        period_us: 0..=1_000_000_u32,
        skew_ns: any::<u32>(),
        waited: any::<u32>(),
        late: any::<u32>(),
        members: members.prop_map(ArrayVec::from_iter),
    });
    let head = head.prop_map(|mut head| {
        let of_members = ((1_u64 << head.members.len()) - 1) as u32;
        head.waited &= of_members;
        head.late &= of_members;
        head
    });
    varied!(Release {
        head,
        state: any_hot(),
    })
}
