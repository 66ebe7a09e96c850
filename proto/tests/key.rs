//! The cluster key, what is derived from it, credentials as files, and what proofs are bound to.

use std::mem::MaybeUninit;

use crate::samples::must;
use proptest::prelude::*;
use taut_proto::{
    ClusterKey, Credential, Holder, JoinKey, Role, ServerPin,
    credential::{CredentialError, NotAllowed},
    group::{GROUP_SECRET_BYTES, GroupSecret},
    key::KeyError,
    proof::{Claim, Grant},
};

fn key(digit: char) -> ClusterKey {
    must(ClusterKey::parse(&digit.to_string().repeat(64)))
}

fn node(name: &str) -> Holder {
    must(Holder::of(name))
}

fn roles() -> impl Strategy<Value = Role> {
    prop::sample::select(Role::NAMED.map(|(_, role)| role).to_vec())
}

#[test]
fn a_key_survives_its_file() {
    let key = must(ClusterKey::generate());
    assert_eq!(
        ClusterKey::parse(&format!("  {}\n", key.to_hex())),
        Ok(key.clone())
    );
    assert_eq!(ClusterKey::parse(&key.to_hex().to_uppercase()), Ok(key));
}

/// What the place of a secret holds before and after it was dropped there.
fn around_its_end<Secret>(secret: Secret) -> [Vec<u8>; 2] {
    let mut place = Box::new(MaybeUninit::new(secret));
    #[allow(
        unsafe_code,
        reason = "what is left of a value can be seen in no other way"
    )]
    // SAFETY: the secrets are 32 bytes without padding, and all of them are initialised; `place` outlives the value, and nobody uses it after its end.
    unsafe {
        let bytes = std::slice::from_raw_parts(place.as_ptr().cast::<u8>(), size_of::<Secret>());
        let before = bytes.to_vec();
        std::ptr::drop_in_place(place.as_mut_ptr());
        let bytes = std::slice::from_raw_parts(place.as_ptr().cast::<u8>(), size_of::<Secret>());
        [before, bytes.to_vec()]
    }
}

#[test]
fn secrets_are_wiped_when_they_are_let_go_of() {
    let join = key('7').join_secret(Role::Render, "front", Grant::Node { issue: 1 });
    for [before, after] in [
        around_its_end(key('7')),
        around_its_end(join),
        around_its_end(GroupSecret([7; GROUP_SECRET_BYTES])),
    ] {
        assert_ne!(before, [0; 32]);
        assert_eq!(after, [0; 32]);
    }
}

#[test]
fn two_keys_differ() {
    assert!(ClusterKey::generate() != ClusterKey::generate());
}

#[test]
fn a_secret_is_not_shown_by_accident() {
    let key = must(ClusterKey::parse(&"ab".repeat(32)));
    assert!(!format!("{key:?}").contains("ab"));
    let credential = key.credential(Role::Render, node("front"), 1);
    let text = credential.to_text();
    let secret = text
        .lines()
        .find_map(|line| line.strip_prefix("secret "))
        .unwrap_or_default();
    assert_eq!(secret.len(), 64);
    let join_key = JoinKey::from(credential.clone());
    for shown in [
        format!("{credential:?} {join_key:?}"),
        credential.fingerprint(),
        format!("{:?}", join_key.secret_for(Role::Render, "front")),
    ] {
        assert!(!shown.contains(&secret[..8]), "{shown}");
    }
}

#[test]
fn what_is_no_key_is_refused() {
    let digits = "0123456789abcdef".repeat(4);
    for (text, found) in [
        ("", 0),
        ("xyz", 0),
        (&digits[1..], 63),
        (&format!("{digits}0"), 65),
        (&format!("{}é", &digits[..62]), 62),
    ] {
        assert_eq!(
            ClusterKey::parse(text),
            Err(KeyError::Malformed { found }),
            "{text}"
        );
    }
}

/// Derivations are part of the protocol: a server of a later build must know the credentials of an earlier one. The values are from another
/// implementation (HKDF by hand in Python, the public key by OpenSSL).
#[test]
fn derivations_stay_as_they_are() {
    let key = key('1');
    assert_eq!(
        key.server_pin().to_hex(),
        "cfe789f138402069610fda3ecafdcdebe3409433b6ca523568e66e5a4bd842b1"
    );
    let text = key.credential(Role::Render, node("front"), 1).to_text();
    assert!(
        text.contains(
            "\nsecret 247ce44fa2503f98795487bb4af3708835f860f9fc2a68230e5f5e4484d14bb5\n"
        ),
        "{text}"
    );
}

#[test]
fn a_proof_counts_for_one_secret_connection_claim_and_direction_only() {
    let claim = Claim {
        role: Role::Render,
        node: "left",
        grant: Grant::Master,
    };
    let secret = key('1').join_secret(claim.role, claim.node, claim.grant);
    let other = key('2').join_secret(claim.role, claim.node, claim.grant);
    let (exporter, elsewhere) = ([7; 32], [8; 32]);
    let proof = secret.client_proof(&exporter, claim);
    assert!(secret.verify_client(&proof, &exporter, claim));
    assert!(!other.verify_client(&proof, &exporter, claim));
    assert!(!secret.verify_client(&proof, &elsewhere, claim));
    let role = Role::Device;
    assert!(!secret.verify_client(&proof, &exporter, Claim { role, ..claim }));
    let node = "right";
    assert!(!secret.verify_client(&proof, &exporter, Claim { node, ..claim }));
    let grant = Grant::Node { issue: 1 };
    assert!(!secret.verify_client(&proof, &exporter, Claim { grant, ..claim }));
    assert!(
        !secret.verify_server(&proof, &exporter, claim),
        "a proof cannot be sent back"
    );
}

#[test]
fn a_credential_opens_its_own_role_and_name_only() {
    let front = JoinKey::from(key('1').credential(Role::Render, node("front"), 1));
    assert!(front.secret_for(Role::Render, "front").is_ok());
    assert!(matches!(
        front.secret_for(Role::Device, "front"),
        Err(NotAllowed::Role {
            has: Role::Render,
            wanted: Role::Device
        })
    ));
    assert!(matches!(
        front.secret_for(Role::Render, "floor"),
        Err(NotAllowed::Node { .. })
    ));
    let any = JoinKey::from(key('1').credential(Role::Observer, Holder::AnyNode, 1));
    assert!(any.secret_for(Role::Observer, "whoever").is_ok());
    assert!(any.secret_for(Role::Operator, "whoever").is_err());
}

#[test]
fn the_pin_is_the_same_from_the_key_and_from_any_of_its_credentials() {
    let key = key('1');
    for (_, role) in Role::NAMED {
        let credential = key.credential(role, Holder::AnyNode, 3);
        assert_eq!(credential.pin(), key.server_pin());
    }
    assert!(key.server_pin() != self::key('2').server_pin());
}

#[test]
fn every_damage_of_a_credential_file_is_noticed() {
    let text = key('1')
        .credential(Role::Tracker, node("head tracker"), 7)
        .to_text();
    for at in 0..text.trim_end().len() {
        assert!(
            Credential::parse(&text[..at]).is_err(),
            "cut at {at} of\n{text}"
        );
        let mut bytes = text.clone().into_bytes();
        bytes[at] = if bytes[at] == b'1' { b'2' } else { b'1' };
        let changed = must(String::from_utf8(bytes));
        assert!(Credential::parse(&changed).is_err(), "{at} of\n{changed}");
    }
    assert_eq!(
        Credential::parse(&format!("{text}secret 12\n")),
        Err(CredentialError::Trailing)
    );
    assert_eq!(
        JoinKey::parse("-----BEGIN CERTIFICATE-----"),
        Err(CredentialError::NeitherKind)
    );
}

#[test]
fn a_credential_may_be_commented_and_have_the_line_ends_of_another_system() {
    let credential = key('1').credential(Role::Device, node("bridge"), 1);
    let text = format!(
        "# for the lab\r\n{}",
        credential.to_text().replace('\n', "\r\n")
    );
    assert_eq!(JoinKey::parse(&text), Ok(credential.into()));
}

proptest! {
    #[test]
    fn a_credential_survives_its_file(
        role in roles(),
        name in "[a-z][a-z0-9 _.-]{0,30}[a-z0-9]|\\*",
        issue in 1_u16..,
    ) {
        let credential = key('3').credential(role, node(&name), issue);
        prop_assert_eq!(Credential::parse(&credential.to_text()), Ok(credential.clone()));
        prop_assert_eq!(JoinKey::parse(&credential.to_text()), Ok(credential.into()));
    }

    /// A holder of one credential has none of the secrets of another.
    #[test]
    fn different_credentials_have_different_secrets(
        roles in (roles(), roles()),
        names in ("[ab]{0,3}", "[ab]{0,3}"),
        issues in (1_u16..4, 1_u16..4),
        kinds in (0..3, 0..3),
    ) {
        let grant = |kind, issue| match kind {
            0 => Grant::Master,
            1 => Grant::Node { issue },
            _ => Grant::AnyNode { issue },
        };
        let (one, other) = (grant(kinds.0, issues.0), grant(kinds.1, issues.1));
        let same = one == other
            && (one == Grant::Master
                || roles.0 == roles.1 && (matches!(one, Grant::AnyNode { .. }) || names.0 == names.1));
        let key = key('4');
        let equal = key.join_secret(roles.0, &names.0, one) == key.join_secret(roles.1, &names.1, other);
        prop_assert_eq!(equal, same);
    }

    #[test]
    fn arbitrary_text_is_refused_without_panic(text in "(?s).{0,300}") {
        let _ = JoinKey::parse(&text);
        let _ = ServerPin::parse(&text);
        prop_assert!(Credential::parse(&text).is_err());
    }
}
