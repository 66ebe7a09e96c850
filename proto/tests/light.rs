//! How far apart screens light up, from what their nodes tell.

use crate::barrier::{MS, arrived, in_step, release_when_due, released};
use proptest::prelude::*;
use taut_proto::barrier::{Arrive, SWAP_TOLD_NS, Swap};

#[test]
fn the_light_of_screens_is_compared_beside_their_calls() {
    let (mut master, last) = in_step(Swap::Immediate, &[1, 2]);
    let shown = released(&master);
    let now = last + 20 * MS;
    let arrives = |call, light| Arrive {
        swapped_frame: shown,
        swapped_ns: last + call,
        lit_frame: shown,
        lit_ns: light,
        ..arrived(shown + 1)
    };
    let _ = master.arrive(now, 1, &arrives(70_000, last + 9 * MS));
    assert_eq!(master.take_light(), None, "one has not told");
    let _ = master.arrive(now, 2, &arrives(90_000, last + 12 * MS));
    let lit = master.take_light().expect("both have told");
    assert_eq!((lit.frame, lit.skew_ns), (shown, 3 * MS));
    release_when_due(&mut master);
    let newest = master.newest().expect("released");
    assert_eq!(newest.skew_ns, 20_000, "that of the calls");

    // A node that knows no light keeps nobody's skew of calls back, and makes none of light.
    let shown = released(&master);
    let now = now + 50 * MS;
    for (session, call) in [(1, 10_000), (2, 30_000)] {
        let arrives = Arrive {
            swapped_frame: shown,
            swapped_ns: now + call,
            lit_frame: if session == 1 { shown } else { 0 },
            lit_ns: now + MS,
            ..arrived(shown + 1)
        };
        let skew = master.arrive(now, session, &arrives).1;
        assert_eq!(
            skew.map(|skew| skew.skew_ns),
            (session == 2).then_some(20_000)
        );
    }
    assert_eq!(master.take_light(), None);
}

#[test]
fn light_that_nobody_takes_makes_room_for_newer() {
    let (mut master, _) = in_step(Swap::Immediate, &[1, 2]);
    let mut frames = Vec::new();
    for _ in 0..20 {
        let shown = released(&master);
        let now = master.newest().map_or(0, |newest| newest.swap_ns) + MS;
        let now = now.max(MS) + shown * 17 * MS;
        for session in [1, 2] {
            let lit = Arrive {
                lit_frame: shown,
                lit_ns: now,
                ..arrived(shown + 1)
            };
            let _ = master.arrive(now, session, &lit);
        }
        frames.push(shown);
        release_when_due(&mut master);
    }
    let kept: Vec<u64> = std::iter::from_fn(|| master.take_light())
        .map(|lit| lit.frame)
        .collect();
    assert_eq!(kept, frames[frames.len() - 8..]);
}

/// What a node may tell of light: frames about the released one or any, moments about now or any.
fn any_light() -> impl Strategy<Value = (u16, i64, u64, i64, u64)> {
    (
        1_u16..4,
        -10_i64..3,
        prop_oneof![4 => Just(0), 1 => 0_u64..1 << 61],
        -12_000_000_000_i64..12_000_000_000,
        prop_oneof![4 => Just(0), 1 => 0_u64..1 << 61],
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever nodes tell of their light: frames go on, and what is made of it is of members, each once, and as far apart as can be believed.
    #[test]
    fn no_light_that_is_told_disturbs_frames(arrives in prop::collection::vec(any_light(), 1..60)) {
        let (mut master, mut last) = in_step(Swap::Immediate, &[1, 2, 3]);
        for tellings in arrives.chunks(3) {
            let shown = released(&master);
            let now = last + 5 * MS;
            for session in 1..=3 {
                let _ = master.arrive(now, session, &arrived(shown + 1));
            }
            for (session, about, any_frame, around, any_ns) in tellings {
                let light = Arrive {
                    lit_frame: if *any_frame > 0 { *any_frame } else { shown.saturating_add_signed(*about) },
                    lit_ns: if *any_ns > 0 { *any_ns } else { now.saturating_add_signed(*around) },
                    ..arrived(shown + 1)
                };
                let _ = master.arrive(now, *session, &light);
            }
            last = release_when_due(&mut master);
            prop_assert_eq!(released(&master), shown + 1);
            while let Some(lit) = master.take_light() {
                prop_assert!(lit.frame <= shown && lit.skew_ns <= 2 * SWAP_TOLD_NS, "{lit:?}");
                prop_assert!((2..=3).contains(&lit.swaps.len()), "{lit:?}");
                let mut sessions: Vec<u16> = lit.swaps.iter().map(|swap| swap.session).collect();
                sessions.sort_unstable();
                sessions.dedup();
                prop_assert_eq!(sessions.len(), lit.swaps.len());
            }
        }
        prop_assert_eq!(master.counts().lapses, 0);
    }
}
