//! What a client believes of the group: states that the server confirms, and those that it does not know of.

use taut_proto::{
    Confirmation,
    confirmation::{MAX_CONFIRMED, MAX_UNHEARD, PATIENCE_NS, SentState, Trust, Unconfirmed},
};

const MS: u64 = 1_000_000;

fn genuine(tick: u64) -> SentState {
    SentState {
        tick,
        state_hash: tick.wrapping_mul(0x9e37_79b9_7f4a_7c15),
    }
}

/// The newest states up to `newest`, as the server tells them when it was asked at `asked_ns`.
fn confirmation(asked_ns: u64, newest: u64) -> Confirmation {
    let mut confirmation = Confirmation {
        asked_ns,
        ..Confirmation::default()
    };
    for tick in (1..=newest).rev() {
        if !confirmation.add(genuine(tick)) {
            break;
        }
    }
    confirmation
}

/// A client that took ticks 1 to `newest`, one a millisecond.
fn client(newest: u64) -> Unconfirmed {
    let mut waiting = Unconfirmed::default();
    for tick in 1..=newest {
        let SentState { tick, state_hash } = genuine(tick);
        assert_eq!(waiting.take(tick, state_hash, tick * MS), Trust::Kept);
    }
    waiting
}

#[test]
fn genuine_states_are_confirmed_whatever_is_lost() {
    let mut waiting = client(0);
    for exchange in 1..100 {
        let now = 50 * exchange;
        for tick in now - 49..=now {
            if tick % 7 != 0 {
                let sent = genuine(tick);
                let trust = waiting.take(sent.tick, sent.state_hash, tick * MS);
                assert_eq!(trust, Trust::Kept);
            }
        }
        // Every second confirmation is lost: each state is in two.
        if exchange % 2 == 0 {
            let confirmation = confirmation(now * MS, now);
            assert_eq!(waiting.confirm(&confirmation), Trust::Kept);
        }
    }
}

#[test]
fn a_state_that_the_server_did_not_send_is_found_by_the_first_confirmation_that_was_asked_for_after_it()
 {
    for tick in [7, 60, 61, 1 << 60] {
        let mut waiting = client(50);
        // Of a tick of its own, or of one that is taken, before the genuine one.
        let _ = waiting.take(tick, 99, 51 * MS);
        // Asked for before it came: it may be newer than what the server knew then.
        if tick > 50 {
            assert_eq!(waiting.confirm(&confirmation(50 * MS, 50)), Trust::Kept);
        }
        let confirmation = confirmation(52 * MS, 60);
        assert_eq!(waiting.confirm(&confirmation), Trust::Forged { tick });
        assert_eq!(waiting.newest(), Some(60));
    }
}

#[test]
fn a_state_while_the_server_sends_none_is_forged() {
    let mut waiting = Unconfirmed::default();
    let _ = waiting.take(1, 1, MS);
    let silent = confirmation(2 * MS, 0);
    assert_eq!(waiting.confirm(&silent), Trust::Forged { tick: 1 });
}

#[test]
fn what_nobody_confirms_is_not_believed_for_long() {
    let mut waiting = client(1);
    assert!(!waiting.is_overdue(PATIENCE_NS));
    assert!(waiting.is_overdue(MS + PATIENCE_NS));
    let next = genuine(2);
    let trust = waiting.take(next.tick, next.state_hash, MS + PATIENCE_NS);
    assert_eq!(trust, Trust::Unconfirmed);
    // Older than all that the server tells of: nobody knows any more.
    let mut waiting = client(1);
    let confirmation = confirmation(300 * MS, 1 + MAX_CONFIRMED as u64);
    assert_eq!(waiting.confirm(&confirmation), Trust::Unconfirmed);
    waiting.clear();
    assert_eq!(waiting.confirm(&confirmation), Trust::Kept);
}

#[test]
fn a_group_that_brings_nothing_of_what_the_server_sends_is_not_believed() {
    let mut waiting = client(0);
    for exchange in 1..=u64::from(MAX_UNHEARD) {
        let trust = waiting.confirm(&confirmation(50 * exchange * MS, 50 * exchange));
        let last = exchange == u64::from(MAX_UNHEARD);
        let expected = if last { Trust::Unheard } else { Trust::Kept };
        assert_eq!(trust, expected);
    }
    // A server that sends nothing is no reason.
    let mut waiting = client(0);
    for exchange in 1..20 {
        let trust = waiting.confirm(&confirmation(50 * exchange * MS, 3));
        assert_eq!(trust, Trust::Kept);
    }
}
