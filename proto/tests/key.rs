//! The cluster key: its text, and what its proofs are bound to.

use taut_proto::{ClusterKey, Role, key::KeyError};

#[test]
fn a_key_survives_its_file() {
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        ClusterKey::parse(&format!("  {}\n", key.to_hex())),
        Ok(key.clone())
    );
    assert_eq!(ClusterKey::parse(&key.to_hex().to_uppercase()), Ok(key));
}

#[test]
fn two_keys_differ() {
    assert!(ClusterKey::generate() != ClusterKey::generate());
}

#[test]
fn a_key_is_not_shown_by_accident() {
    let key = ClusterKey::parse(&"ab".repeat(32)).unwrap_or_else(|error| panic!("{error}"));
    assert!(!format!("{key:?}").contains("ab"));
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

#[test]
fn a_proof_counts_for_one_key_connection_role_name_and_direction_only() {
    let key = ClusterKey::parse(&"1".repeat(64)).unwrap_or_else(|error| panic!("{error}"));
    let other = ClusterKey::parse(&"2".repeat(64)).unwrap_or_else(|error| panic!("{error}"));
    let (exporter, elsewhere) = ([7; 32], [8; 32]);
    let proof = key.client_proof(&exporter, Role::Render, "left");
    assert!(key.verify_client(&proof, &exporter, Role::Render, "left"));
    assert!(!other.verify_client(&proof, &exporter, Role::Render, "left"));
    assert!(!key.verify_client(&proof, &elsewhere, Role::Render, "left"));
    assert!(!key.verify_client(&proof, &exporter, Role::Device, "left"));
    assert!(!key.verify_client(&proof, &exporter, Role::Render, "right"));
    assert!(
        !key.verify_server(&proof, &exporter, Role::Render, "left"),
        "a proof cannot be sent back"
    );
}
