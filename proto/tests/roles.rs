//! What each role may do, and who is shut out.

use crate::samples::must;
use taut_proto::{
    Act, JoinPolicy, Revoked, Role,
    proof::{Claim, Grant},
    revocation::{RevokedError, ShutOut},
};

/// Written once more, by hand: a change of the table must be meant twice.
#[test]
fn each_role_may_do_exactly_this() {
    use Act::*;
    let may: [(Role, &[Act]); 6] = [
        (
            Role::Render,
            &[KeepPath, GetStates, GetMeshes, KeepFrames, Report, Log],
        ),
        (
            Role::Device,
            &[KeepPath, GetStates, Report, Log, GiveInput, GetWrenches],
        ),
        (Role::Tracker, &[KeepPath, Log, GiveHead]),
        (Role::Operator, &[KeepPath, GetStates, Log, Arm]),
        (Role::Observer, &[KeepPath, GetStates]),
        (Role::Force, &[KeepPath, Log, GiveForce]),
    ];
    for (role, acts) in may {
        for act in Act::ALL {
            assert_eq!(role.may(act), acts.contains(&act), "{role}: {act}");
        }
    }
}

#[test]
fn acts_have_bits_of_their_own_and_roles_their_names() {
    let bits: u16 = Act::ALL.iter().map(|act| act.bit()).sum();
    assert_eq!(bits.count_ones() as usize, Act::ALL.len());
    for (name, role) in Role::NAMED {
        assert_eq!(name.parse(), Ok(role));
        assert_eq!(role.name(), name);
    }
    assert!("admin".parse::<Role>().is_err());
}

fn entry(text: &str) -> Revoked {
    must(text.parse())
}

#[test]
fn an_entry_shuts_out_what_it_says_and_nothing_else() {
    let claims = [
        (Role::Render, "front", Grant::Master),
        (Role::Render, "front", Grant::Node { issue: 1 }),
        (Role::Render, "front", Grant::Node { issue: 2 }),
        (Role::Device, "front", Grant::Node { issue: 1 }),
        (Role::Observer, "front", Grant::AnyNode { issue: 1 }),
        (Role::Observer, "web", Grant::AnyNode { issue: 1 }),
        (Role::Observer, "web", Grant::AnyNode { issue: 3 }),
        (Role::Observer, "web", Grant::Master),
    ];
    for (text, covered) in [
        ("front", &[0, 1, 2, 3, 4][..]),
        ("front#1", &[1, 3]),
        ("front#2", &[1, 2, 3]),
        ("render:front", &[0, 1, 2]),
        ("render:front#1", &[1]),
        ("observer:*", &[4, 5, 6]),
        ("observer:*#2", &[4, 5]),
        ("floor", &[]),
    ] {
        let entry = entry(text);
        assert_eq!(entry.to_string(), text);
        for (index, (role, node, grant)) in claims.into_iter().enumerate() {
            let claim = Claim { role, node, grant };
            assert_eq!(
                entry.covers(claim),
                covered.contains(&index),
                "{text}: {claim:?}"
            );
        }
    }
}

#[test]
fn what_is_no_entry_is_refused() {
    assert_eq!("*".parse::<Revoked>(), Err(RevokedError::Everybody));
    for text in ["", "admin:front", "front#0", "front#x", "render:", "a*"] {
        assert!(text.parse::<Revoked>().is_err(), "{text:?}");
    }
}

#[test]
fn a_policy_names_what_is_closed() {
    let claim = Claim {
        role: Role::Observer,
        node: "web",
        grant: Grant::AnyNode { issue: 1 },
    };
    assert_eq!(JoinPolicy::default().check(claim), Ok(()));
    let closed = JoinPolicy {
        roles: vec![Role::Render, Role::Device],
        ..JoinPolicy::default()
    };
    assert_eq!(closed.check(claim), Err(ShutOut::Role(Role::Observer)));
    let revoked = JoinPolicy {
        revoked: vec![entry("floor"), entry("observer:*")],
        ..JoinPolicy::default()
    };
    assert_eq!(
        revoked.check(claim),
        Err(ShutOut::Revoked(entry("observer:*")))
    );
}
