//! Terms: the server and the nodes that lead while it is away, each above the one before.

use crate::barrier::{MS, arrived, in_step, release_when_due, released};
use taut_proto::barrier::{
    Answer, Arrive, FARTHEST_AHEAD, MOST_TERMS_AHEAD, Master, RECLAIM_NS, ReleaseHead,
    SUCCESSION_NS, Succession, Successor, Swap, TERMS_LEFT_OUT,
};

/// An ARRIVE of the term of a node.
fn of_term(term: u64, frame: u64) -> Arrive {
    Arrive {
        term,
        frame,
        ..Arrive::default()
    }
}

#[test]
fn the_server_takes_the_frames_back_from_a_node_that_led_meanwhile() {
    let (mut master, now) = in_step(Swap::Immediate, &[1, 2]);
    let before = master.newest().expect("released").clone();
    for session in [1, 2] {
        let _ = master.arrive(now + MS, session, &arrived(before.frame + 1));
    }
    let _ = master.arrive(now + MS, 3, &of_term(4, before.frame + 3000));
    assert_eq!(
        released(&master),
        before.frame,
        "nothing is released by an appeal"
    );
    let _ = release_when_due(&mut master);
    let after = master.newest().expect("released").clone();
    assert_eq!((after.term, after.master), (4 + TERMS_LEFT_OUT, 0));
    assert!(after.rank() > before.rank());
    assert!(after.frame > before.frame + 3000, "frames ascend");
    // Whoever was in step with the server is still.
    assert_eq!(after.waited, before.waited);
    assert_eq!(master.counts().reclaimed, 1);
}

#[test]
fn a_node_that_claims_term_after_term_moves_the_server_once_a_second() {
    let (mut master, now) = in_step(Swap::Immediate, &[1, 2]);
    let mut claim = |now, term, ahead| {
        let frame = released(&master).saturating_add(ahead);
        let (answer, _) = master.arrive(now, 1, &of_term(term, frame));
        let _ = release_when_due(&mut master);
        let newest = master.newest().expect("released");
        (answer, newest.term, newest.frame)
    };
    let (_, term, first) = claim(now, 7, FARTHEST_AHEAD);
    assert_eq!(term, 7 + TERMS_LEFT_OUT);
    let (_, term, next) = claim(now + RECLAIM_NS - 1, 1000, 0);
    assert_eq!((term, next), (7 + TERMS_LEFT_OUT, first + 1), "too soon");
    // What no term can be is refused, and changes nothing: neither the term nor the frame.
    let known = term;
    for (term, ahead) in [
        (known + MOST_TERMS_AHEAD + 1, 0),
        (u64::from(u32::MAX), 0),
        (u64::MAX, 0),
        (known + 1, FARTHEST_AHEAD + 1),
        (known + 1, u64::MAX),
    ] {
        let (answer, after, _) = claim(now + 2 * RECLAIM_NS, term, ahead);
        assert_eq!((answer, after), (Answer::Refused, known));
    }
    let (_, term, _) = claim(now + 2 * RECLAIM_NS, known + MOST_TERMS_AHEAD, 0);
    assert_eq!(term, known + MOST_TERMS_AHEAD + TERMS_LEFT_OUT);
    assert_eq!(master.counts().reclaimed, 2);
}

#[test]
fn after_every_claim_that_counts_a_node_can_lead_still() {
    let (mut master, mut now) = in_step(Swap::Immediate, &[1, 2]);
    for _ in 0..100 {
        now += RECLAIM_NS;
        let term = released_term(&master) + MOST_TERMS_AHEAD;
        let _ = master.arrive(now, 1, &of_term(term, released(&master)));
        let _ = release_when_due(&mut master);
    }
    let of_server = master.newest().expect("released").clone();
    let mut successor = Succession::new(1, now);
    successor.release(now, &of_server);
    let Successor::Stand { term, first } = successor.poll(now + SUCCESSION_NS) else {
        panic!("it is its turn");
    };
    let own = ReleaseHead {
        term,
        master: 1,
        frame: first,
        ..of_server.clone()
    };
    assert!(own.rank() > of_server.rank(), "its frames are followed");
    let mut other = Succession::new(2, now);
    other.release(now, &of_server);
    assert!(other.may_follow(now + SUCCESSION_NS, 1, &own));
}

fn released_term(master: &Master) -> u64 {
    master.newest().map_or(0, |newest| newest.term)
}

#[test]
fn a_member_is_followed_only_while_the_server_is_silent() {
    let of_server = ReleaseHead {
        term: 1,
        frame: 70,
        members: [2, 3].into_iter().collect(),
        ..ReleaseHead::default()
    };
    let of_member = |term, frame| ReleaseHead {
        term,
        master: 2,
        frame,
        ..of_server.clone()
    };
    let mut successor = Succession::new(3, 0);
    assert!(
        !successor.may_follow(1000 * MS, 2, &of_member(2, 1094)),
        "no part"
    );
    successor.release(0, &of_server);
    for now in (0..1000).step_by(20) {
        successor.hear(now * MS);
        assert!(!successor.may_follow(now * MS, 2, &of_member(2, 1094)));
    }
    let silent = 980 * MS + SUCCESSION_NS;
    assert!(successor.may_follow(silent, 2, &of_member(2, 1094)));
    // Only for itself, and not so far ahead that nobody could follow it any more.
    assert!(!successor.may_follow(silent, 3, &of_member(2, 1094)));
    assert!(!successor.may_follow(silent, 0, &of_server));
    assert!(!successor.may_follow(silent, 2, &of_member(u64::from(u32::MAX), 1094)));
    let slower = ReleaseHead {
        period_us: of_server.period_us + 1,
        ..of_member(2, 1094)
    };
    assert!(
        !successor.may_follow(silent, 2, &slower),
        "frames grow no slower"
    );
    assert!(!successor.may_follow(silent, 2, &of_member(2, u64::MAX)));
}

#[test]
fn a_node_that_was_stopped_blames_nobody_however_short_the_silence() {
    for silence in [30 * MS, SUCCESSION_NS, 600 * MS] {
        let head = ReleaseHead {
            term: 1,
            frame: 7,
            members: [1, 2].into_iter().collect(),
            ..ReleaseHead::default()
        };
        let mut node = Succession::new(1, 0).after_silence(silence);
        node.release(0, &head);
        node.look(silence / 10);
        let mut now = 2 * silence;
        node.look(now);
        assert_eq!(node.poll(now), Successor::No);
        for _ in 0..10 {
            now += silence / 10;
            node.look(now);
        }
        assert!(matches!(node.poll(now), Successor::Stand { .. }));
    }
}
