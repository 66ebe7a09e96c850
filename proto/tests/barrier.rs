//! The barrier under a virtual clock and a bad network: one master, some nodes, everything lost, doubled, delayed and dying by a seed.

use crate::barrier_support::*;
use proptest::prelude::*;
use taut_proto::barrier::{
    ARRIVE_PERIOD_NS, Answer, Arrive, Drawn, HUSH_NS, LEAD_NS, MAX_MEMBERS, MAX_MISSES, Master,
    MasterSettings, Newest, Node, NodeState, PROBATION_FRAMES, ReleaseHead, SILENCE_NS,
    SLOWEST_ARRIVE_NS, SWAP_TOLD_NS, Swap, Turn, WARM_UP_FRAMES,
};

pub const MS: u64 = 1_000_000;
const PERIOD: u64 = 16_666_667;
/// Ten frames per second at least.
const SLOWEST: u64 = 100 * MS;

fn settings(swap: Swap) -> MasterSettings {
    MasterSettings {
        swap,
        period_ns: PERIOD,
        slowest_ns: SLOWEST,
    }
}

/// A master with these nodes in step, at the moment after a release; all arrive at once in every frame.
pub fn in_step(swap: Swap, sessions: &[u16]) -> (Master, u64) {
    let mut master = Master::new(settings(swap), 0, 1, 1);
    let mut now = MS;
    for &session in sessions {
        let _ = master.arrive(now, session, &Arrive::default());
    }
    for _ in 0..8 {
        now = release_when_due(&mut master);
        let frame = released(&master) + 1;
        for &session in sessions {
            let _ = master.arrive(now + MS, session, &arrived(frame));
        }
    }
    now = release_when_due(&mut master);
    for member in master.members() {
        assert_eq!(member.state, NodeState::Synced);
    }
    (master, now)
}

pub fn arrived(frame: u64) -> Arrive {
    Arrive {
        term: 1,
        frame,
        ready_ns: 1,
        ..Arrive::default()
    }
}

/// The arrival at the frame after `shown`, with the moment when that was shown.
fn swapped_at(shown: u64, swapped_ns: u64) -> Arrive {
    Arrive {
        swapped_frame: shown,
        swapped_ns,
        ..arrived(shown + 1)
    }
}

pub fn released(master: &Master) -> u64 {
    master.newest().map_or(0, |newest| newest.frame)
}

/// Polls at the moment that the master asks for, and not a nanosecond before.
pub fn release_when_due(master: &mut Master) -> u64 {
    let wake = master.wake_ns().expect("there are nodes");
    assert!(master.poll(wake - 1, Newest::default()).is_none());
    assert!(master.poll(wake, Newest::default()).is_some());
    wake
}

#[test]
fn frames_keep_the_rhythm_while_all_are_in_time() {
    let (mut master, mut last) = in_step(Swap::Immediate, &[1, 2]);
    for _ in 0..100 {
        let now = frame_in_time(&mut master, last);
        assert_eq!(now - last, PERIOD);
        last = now;
    }
    assert_eq!(master.counts().lapses, 0);
}

#[test]
fn a_planned_swap_keeps_the_rhythm_and_is_told_ahead() {
    let (mut master, mut last) = in_step(Swap::Scheduled, &[1, 2]);
    let mut last_swap = master.newest().map_or(0, |newest| newest.swap_ns);
    for _ in 0..100 {
        last = frame_in_time(&mut master, last);
        let swap = master.newest().map_or(0, |newest| newest.swap_ns);
        assert_eq!((swap - last, swap - last_swap), (300_000, PERIOD));
        last_swap = swap;
    }
}

#[test]
fn a_late_node_costs_one_deadline_and_none_until_it_is_back() {
    let (mut master, start) = in_step(Swap::Immediate, &[1, 2]);
    let (mut last, mut gaps) = (start, Vec::new());
    for round in 0..40 {
        let frame = released(&master) + 1;
        let _ = master.arrive(last + 5 * MS, 1, &arrived(frame));
        // The other one is away for eight frames, then in time again.
        if !(0..8).contains(&round) {
            let _ = master.arrive(last + 6 * MS, 2, &arrived(frame));
        }
        let now = release_when_due(&mut master);
        gaps.push(now - last);
        last = now;
    }
    let slow = gaps.iter().filter(|gap| **gap > PERIOD).count();
    assert_eq!(slow, 1, "{gaps:?}");
    assert!(gaps.iter().all(|gap| *gap <= 25 * MS), "{gaps:?}");
    let states: Vec<_> = master.members().map(|member| member.state).collect();
    assert_eq!(states, [NodeState::Synced, NodeState::Synced]);
    assert_eq!(master.counts().lapses, 1);
}

#[test]
fn a_dead_node_is_left_after_ten_frames_and_out_after_half_a_second() {
    let (mut master, mut last) = in_step(Swap::Immediate, &[1, 2]);
    let died = last;
    let (mut frames, mut left) = (0, None);
    while master.members().count() == 2 {
        let _ = master.arrive(last + MS, 1, &arrived(released(&master) + 1));
        last = release_when_due(&mut master);
        frames += 1;
        if left.is_none() && state_of(&master, 2) == Some(NodeState::FreeRunning) {
            left = Some(frames);
        }
    }
    assert_eq!(left, Some(MAX_MISSES));
    assert!((SILENCE_NS..SILENCE_NS + 2 * PERIOD).contains(&(last - died)));
    assert_eq!((master.counts().evicted, master.counts().freed), (1, 1));

    // One that never drew a frame is not late, but silent.
    let (mut master, mut last) = in_step(Swap::Immediate, &[1]);
    let died = last;
    let _ = master.arrive(last, 2, &Arrive::default());
    while master.members().count() == 2 {
        let _ = master.arrive(last + MS, 1, &arrived(released(&master) + 1));
        last = release_when_due(&mut master);
    }
    assert!((SILENCE_NS..SILENCE_NS + 2 * PERIOD).contains(&(last - died)));
}

pub fn state_of(master: &Master, session: u16) -> Option<NodeState> {
    let mut members = master.members();
    members.find(|m| m.session == session).map(|m| m.state)
}

/// One frame for which nodes 1 and 2 arrive in time. The time of the next release.
fn frame_in_time(master: &mut Master, last: u64) -> u64 {
    let second = arrived(released(master) + 1);
    frame_of_wall(master, last, Some((5 * MS, second)))
}

/// One frame of a wall: node 1 draws in 5 ms, node 2 says so where `second` has something to say. The time of the next release.
fn frame_of_wall(master: &mut Master, last: u64, second: Option<(u64, Arrive)>) -> u64 {
    let frame = released(master) + 1;
    let _ = master.arrive(last + 5 * MS, 1, &arrived(frame));
    if let Some((after, arrive)) = second {
        let _ = master.arrive(last + after, 2, &arrive);
    }
    release_when_due(master)
}

pub fn made_for(period_us: u32, arrive: Arrive) -> Arrive {
    Arrive {
        period_us,
        ..arrive
    }
}

#[test]
fn a_node_slows_the_others_while_it_draws_and_not_below_the_least_rate() {
    let (mut master, last) = in_step(Swap::Immediate, &[1]);
    // It joins: nothing of it counts before it draws.
    let joining = made_for(100_000, Arrive::default());
    let last = frame_of_wall(&mut master, last, Some((MS, joining)));
    assert_eq!(master.period_ns(), PERIOD);
    let drawn = made_for(100_000, arrived(released(&master) + 1));
    frame_of_wall(&mut master, last, Some((MS, drawn)));
    assert_eq!(
        (master.period_ns(), master.patience_ns()),
        (100 * MS, 150 * MS)
    );
    // Slower than that it is left to itself, at its first word.
    let slower = made_for(100_001, Arrive::default());
    let _ = master.arrive(2000 * MS, 2, &slower);
    assert_eq!(state_of(&master, 2), Some(NodeState::FreeRunning));
    assert_eq!((master.period_ns(), master.counts().freed), (PERIOD, 1));
}

#[test]
fn a_node_below_the_least_rate_changes_nothing_for_the_wall_and_stays_a_member() {
    let (mut master, start) = in_step(Swap::Immediate, &[1]);
    let (mut last, mut drawing) = (start, None);
    let (mut shown, mut gaps) = (0, Vec::new());
    let _ = master.arrive(last, 2, &made_for(2_000_000, Arrive::default()));
    for _ in 0..600 {
        // A frame every two seconds, alive in between.
        let (begun, frame) = *drawing.get_or_insert((last, released(&master) + 1));
        let second = (last - begun >= 2000 * MS).then(|| {
            (drawing, shown) = (None, shown + 1);
            (MS, made_for(2_000_000, arrived(frame)))
        });
        master.hear(2, last);
        let now = frame_of_wall(&mut master, last, second);
        gaps.push(now - last);
        last = now;
    }
    assert_eq!(shown, 4, "it takes part in its way");
    assert!(gaps.iter().all(|gap| *gap == PERIOD), "{gaps:?}");
    assert_eq!(state_of(&master, 2), Some(NodeState::FreeRunning));
    let counts = master.counts();
    assert_eq!((counts.freed, counts.evicted, counts.lapses), (1, 0, 0));
}

#[test]
fn a_node_that_is_slower_than_it_says_is_left_after_thirty_frames_and_comes_back_by_itself() {
    let (mut master, mut last) = in_step(Swap::Immediate, &[1, 2]);
    let mut frames_until = |wanted: NodeState, takes: u64| {
        let mut drawing: Option<(u64, u64)> = None;
        for frames in 1..200 {
            let (begun, frame) = *drawing.get_or_insert((last, released(&master) + 1));
            let done = begun + takes;
            // Whatever it draws is told when it is done, be it frames later.
            let second = (done < last + PERIOD).then(|| {
                drawing = None;
                (
                    done.saturating_sub(last).max(MS),
                    made_for(16_667, arrived(frame)),
                )
            });
            master.hear(2, last);
            last = frame_of_wall(&mut master, last, second);
            if state_of(&master, 2) == Some(wanted) {
                return frames;
            }
        }
        panic!("never {wanted:?}");
    };
    // It draws in 50 ms from now on.
    assert_eq!(frames_until(NodeState::Late, 50 * MS), 1);
    assert_eq!(
        frames_until(NodeState::FreeRunning, 50 * MS),
        PROBATION_FRAMES
    );
    // In 5 ms again.
    let back = frames_until(NodeState::Synced, 5 * MS);
    let most = PROBATION_FRAMES + WARM_UP_FRAMES + 2;
    assert!((PROBATION_FRAMES..=most).contains(&back), "{back}");
    assert_eq!(master.counts().lapses, 1, "it cost one deadline");
}

#[test]
fn nodes_that_never_come_into_step_hold_the_others_up_for_a_while_and_no_longer() {
    // A fast one joins some that are made for what they cannot do.
    let (mut master, mut last) = in_step(Swap::Immediate, &[1]);
    for session in [2, 3] {
        let slow = made_for(100_000, Arrive::default());
        let _ = master.arrive(last, session, &slow);
        let first = made_for(100_000, arrived(released(&master) + 1));
        let _ = master.arrive(last + MS, session, &first);
    }
    let start = last;
    let mut held = 0;
    while last - start < 10_000 * MS {
        for session in [2, 3] {
            master.hear(session, last);
        }
        let now = frame_of_wall(&mut master, last, None);
        held += u32::from(now - last > PERIOD);
        last = now;
    }
    assert!(held <= PROBATION_FRAMES, "{held} slow frames");
    let states: Vec<_> = master.members().map(|m| m.state).collect();
    assert_eq!(
        states,
        [
            NodeState::Synced,
            NodeState::FreeRunning,
            NodeState::FreeRunning
        ]
    );
}

#[test]
fn nodes_that_are_all_too_slow_are_shown_together_still() {
    let mut master = Master::new(settings(Swap::Immediate), 0, 1, 1);
    for session in [1, 2] {
        let _ = master.arrive(MS, session, &Arrive::default());
    }
    let mut last = release_when_due(&mut master);
    for _ in 0..20 {
        let frame = released(&master) + 1;
        let _ = master.arrive(last + 80 * MS, 1, &arrived(frame));
        let _ = master.arrive(last + 100 * MS, 2, &arrived(frame));
        // Nobody is in step before five frames: until then each waits for both, as long as they take.
        let in_step = master.members().any(|m| m.state == NodeState::Synced);
        if in_step {
            break;
        }
        let now = last + 100 * MS;
        assert!(master.poll(now, Newest::default()).is_some());
        assert_eq!(master.newest().map(|newest| newest.late), Some(0));
        last = now;
    }
    let states: Vec<_> = master.members().map(|m| m.state).collect();
    assert_eq!(states, [NodeState::Synced, NodeState::Synced]);
}

#[test]
fn swaps_are_compared_when_all_have_told() {
    let (mut master, last) = in_step(Swap::Immediate, &[1, 2]);
    let shown = released(&master);
    let mut told = |session, after| {
        let arrive = swapped_at(shown, last + after);
        master.arrive(last + 5 * MS, session, &arrive).1
    };
    assert_eq!(told(1, 70_000), None);
    let skew = told(2, 90_000).expect("both have told");
    assert_eq!(
        (skew.frame, skew.skew_ns, skew.overhead_ns),
        (shown, 20_000, 90_000)
    );
    let after: Vec<_> = skew
        .swaps
        .iter()
        .map(|s| (s.session, s.after_first_ns))
        .collect();
    assert_eq!(after, [(1, 0), (2, 20_000)]);
    release_when_due(&mut master);
    assert_eq!(master.newest().map(|newest| newest.skew_ns), Some(20_000));
}

#[test]
fn a_wrong_picture_is_counted() {
    let (mut master, last) = in_step(Swap::Immediate, &[1]);
    let before = master.counts();
    assert_eq!(before.mismatches, 0);
    assert!(before.compared > 0);
    let wrong = Arrive {
        state_hash: 99,
        ..arrived(released(&master) + 1)
    };
    let _ = master.arrive(last + MS, 1, &wrong);
    assert_eq!(master.counts().mismatches, 1);
    let _ = master.arrive(last + MS, 1, &wrong);
    assert_eq!(
        master.counts().mismatches,
        1,
        "a repeated message counts once"
    );
}

#[test]
fn a_frame_that_nobody_began_is_refused() {
    let (mut master, last) = in_step(Swap::Immediate, &[1]);
    let ahead = arrived(released(&master) + 2);
    assert_eq!(master.arrive(last, 1, &ahead).0, Answer::Refused);
    assert_eq!(master.counts().refused, 1);
}

#[test]
fn the_thirty_third_node_is_told_apart() {
    let sessions: Vec<u16> = (1..=MAX_MEMBERS as u16).collect();
    let (mut master, last) = in_step(Swap::Immediate, &sessions);
    let (answer, _) = master.arrive(last, 99, &Arrive::default());
    assert_eq!(
        (answer, master.members().count()),
        (Answer::Full, MAX_MEMBERS)
    );
    master.leave(7);
    assert_eq!(
        master.arrive(last, 99, &Arrive::default()).0,
        Answer::Repeat
    );
}

#[test]
fn a_node_that_hears_nothing_draws_on_its_own_again() {
    let mut node = Node::new(1, 0);
    assert_eq!(node.turn(0), Turn::Free);
    assert!(node.message(0).is_some_and(|message| message.frame == 0));
    assert_eq!(node.message(1), None);
    let mut head = ReleaseHead {
        term: 1,
        frame: 7,
        ..ReleaseHead::default()
    };
    assert!(node.release(MS, &head));
    assert!(!node.release(MS, &head), "a copy");
    assert_eq!(node.turn(MS), Turn::Draw { frame: 8 });
    node.drawn(2 * MS, Default::default());
    assert!(
        node.message(2 * MS)
            .is_some_and(|message| message.frame == 8)
    );
    let mut now = 2 * MS;
    while let Turn::Wait { until_ns } = node.turn(now) {
        assert!(until_ns > now && now < 600 * MS);
        now = until_ns;
        let _ = node.message(now);
    }
    assert_eq!(node.turn(now), Turn::Free);
    head.frame = 9;
    assert!(node.release(now, &head));
    assert_eq!(node.turn(now), Turn::Draw { frame: 10 });
}

#[test]
fn a_swap_that_cannot_have_been_is_not_measured() {
    let (mut master, last) = in_step(Swap::Immediate, &[1, 2]);
    let shown = released(&master);
    let now = last + 5 * MS;
    for (session, swapped_ns) in [(1, last), (2, now + SWAP_TOLD_NS + 1)] {
        let arrive = swapped_at(shown, swapped_ns);
        assert_eq!(master.arrive(now, session, &arrive).1, None);
    }
    release_when_due(&mut master);
    assert_eq!(master.newest().map(|newest| newest.skew_ns), Some(0));
}

#[test]
fn a_swap_is_planned_only_while_all_that_are_waited_for_know_the_time() {
    let (mut master, last) = in_step(Swap::Scheduled, &[1, 2]);
    let mut now = last;
    let mut swap_ns = |ready_ns: u64| {
        let frame = released(&master) + 1;
        let _ = master.arrive(now + 5 * MS, 1, &arrived(frame));
        let second = Arrive {
            ready_ns,
            ..arrived(frame)
        };
        let _ = master.arrive(now + 5 * MS, 2, &second);
        now = release_when_due(&mut master);
        (now, master.newest().map_or(0, |newest| newest.swap_ns))
    };
    let (now, planned) = swap_ns(7);
    assert!(planned >= now + LEAD_NS);
    assert_eq!(swap_ns(0).1, 0);
    assert_eq!(swap_ns(0).1, 0);
    let (now, planned) = swap_ns(9);
    assert!(planned >= now + LEAD_NS);
}

#[test]
fn a_node_that_lets_a_frame_pass_arrives_at_the_one_that_it_draws() {
    let mut node = Node::new(1, 1_000_000);
    let mut head = ReleaseHead {
        frame: 1,
        term: 1,
        ..ReleaseHead::default()
    };
    assert!(node.release(MS, &head));
    assert_eq!(node.turn(MS), Turn::Draw { frame: 2 });
    head.frame = 2;
    assert!(node.release(18 * MS, &head));
    assert_eq!(node.turn(18 * MS), Turn::Draw { frame: 3 });
    node.drawn(20 * MS, Drawn::default());
    let arrives = node.message(20 * MS).map(|message| message.frame);
    assert_eq!(arrives, Some(3));
}

/// What a node sends while it waits, from the RELEASE of the frame before on: times after that RELEASE, ns.
fn copies(drawn_ns: u64, until_ns: u64) -> Vec<u64> {
    let mut node = Node::new(1, 0);
    let head = ReleaseHead {
        frame: 1,
        term: 1,
        period_us: 16_667,
        members: [1].into_iter().collect(),
        ..ReleaseHead::default()
    };
    assert!(node.release(MS, &head));
    assert_eq!(node.turn(MS), Turn::Draw { frame: 2 });
    node.drawn(MS + drawn_ns, Drawn::default());
    let times = (MS + drawn_ns..MS + until_ns).step_by(1000);
    times
        .filter(|now| node.message(*now).is_some())
        .map(|now| now - MS)
        .collect()
}

#[test]
fn copies_come_ever_more_rarely_and_none_shortly_before_the_release_is_due() {
    let due = 16_667_000;
    for drawn in [3 * MS, 8 * MS, due - HUSH_NS / 2, due + MS] {
        let sent = copies(drawn, due + 40 * MS);
        assert_eq!(sent[0], drawn, "the first is never held back");
        let hushed = |at: &&u64| **at > due - HUSH_NS && **at < due + ARRIVE_PERIOD_NS;
        assert_eq!(sent[1..].iter().filter(hushed).count(), 0, "{sent:?}");
        let longest = sent.windows(2).map(|pair| pair[1] - pair[0]).max();
        assert!(longest <= Some(SLOWEST_ARRIVE_NS + HUSH_NS + ARRIVE_PERIOD_NS));
        // A RELEASE that was lost is asked for soon after it was due, and again.
        let after = sent.iter().filter(|at| **at >= due + ARRIVE_PERIOD_NS);
        let asked = after.clone().take(2).collect::<Vec<_>>();
        let soon = due.max(drawn) + 2 * ARRIVE_PERIOD_NS;
        assert!(
            *asked[0] <= soon && *asked[1] <= soon + ARRIVE_PERIOD_NS,
            "{sent:?}"
        );
        assert!(sent.len() < 24, "{}", sent.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 48, ..ProptestConfig::default() })]

    /// Whatever is lost, doubled, overtaken, and whoever dies or stops: frames go on, in order, and equal frames show equal states.
    #[test]
    fn frames_go_on_whatever_happens(world in any_world()) {
        let seen = world.run();
        seen.assert_truth()?;
        seen.assert_progress(&world)?;
    }

    /// The same when the server dies: one of the living leads, all the living follow.
    #[test]
    fn the_living_agree_on_a_master(world in any_world_without_server()) {
        let seen = world.run();
        seen.assert_truth()?;
        seen.assert_one_master(&world)?;
    }

    /// The same when the server was only away for a while: it leads all of them again.
    #[test]
    fn a_server_that_comes_back_leads_again(world in any_world_whose_server_pauses()) {
        let seen = world.run();
        seen.assert_truth()?;
        seen.assert_server_leads(&world)?;
    }
}
