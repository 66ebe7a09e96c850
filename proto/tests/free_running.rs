//! Nodes that run free, and their way back.

use crate::barrier::{MS, arrived, in_step, made_for, release_when_due, released, state_of};
use taut_proto::barrier::{MAX_MISSES, Master, NodeState, PROBATION_FRAMES, Swap, WARM_UP_FRAMES};

/// One frame of a wall at whose pace node 1 draws, 24 per second. Node 2 is made for 120, and draws it in 5 ms unless it hangs. The time of the
/// next release.
fn frame_of_slow_wall(master: &mut Master, last: u64, hangs: bool) -> u64 {
    let frame = released(master) + 1;
    master.hear(2, last);
    if !hangs {
        let _ = master.arrive(last + 5 * MS, 2, &made_for(8_333, arrived(frame)));
    }
    let _ = master.arrive(last + 6 * MS, 1, &made_for(41_667, arrived(frame)));
    release_when_due(master)
}

#[test]
fn a_node_that_hung_comes_back_to_a_wall_that_is_slower_than_itself() {
    let (mut master, mut last) = in_step(Swap::Immediate, &[1, 2]);
    for _ in 0..MAX_MISSES {
        last = frame_of_slow_wall(&mut master, last, true);
    }
    assert_eq!(state_of(&master, 2), Some(NodeState::FreeRunning));
    for _ in 0..PROBATION_FRAMES + WARM_UP_FRAMES {
        last = frame_of_slow_wall(&mut master, last, false);
    }
    assert_eq!(master.period_ns(), 41_667_000);
    assert_eq!(state_of(&master, 2), Some(NodeState::Synced));
}
