//! Every attack of the hostile test bed, in its short form: each promise is kept.

use std::collections::BTreeSet;
use std::path::Path;

use taut_network_tests::hostile::{GROUPS, attacks};
use taut_network_tests::report::Extent;

/// Runs the attacks of a group one after the other.
fn attack(group: &str) {
    let extent = Extent::quick(Path::new(env!("CARGO_BIN_EXE_taut-network-tests")));
    let (_, attacks) = GROUPS
        .into_iter()
        .find(|(name, _)| *name == group)
        .expect("a group");
    let mut broken = Vec::new();
    for attack in attacks {
        let finding = (attack.run)(&extent);
        println!("{}: {finding:?}", attack.name);
        if !finding.is_ok_and(|finding| finding.kept) {
            broken.push(attack.name);
        }
    }
    assert!(broken.is_empty(), "not kept: {broken:?}");
}

/// A test for each group, and one that there are no others.
macro_rules! groups {
    ($($group:ident),*) => {
        $(
            #[test]
            fn $group() {
                attack(stringify!($group));
            }
        )*

        #[test]
        fn every_group_has_a_test_and_every_attack_a_name_of_its_own() {
            assert_eq!(GROUPS.map(|(name, _)| name), [$(stringify!($group)),*]);
            let mut names = BTreeSet::new();
            assert!(attacks().all(|attack| names.insert(attack.name)));
        }
    };
}

groups!(origin, device, edge, joining, cluster, operation, program);
