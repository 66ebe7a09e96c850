//! Every attack of the hostile test bed, in its short form: each promise is kept.

use std::path::Path;

use taut_network_tests::hostile::attacks;
use taut_network_tests::report::Extent;

#[test]
fn every_promise_is_kept_under_attack() {
    let extent = Extent::quick(Path::new(env!("CARGO_BIN_EXE_taut-network-tests")));
    let mut names = std::collections::BTreeSet::new();
    let mut broken = Vec::new();
    for attack in attacks() {
        assert!(names.insert(attack.name), "two attacks `{}`", attack.name);
        let finding = (attack.run)(&extent);
        println!("{}: {finding:?}", attack.name);
        if !finding.is_ok_and(|finding| finding.kept) {
            broken.push(attack.name);
        }
    }
    assert!(broken.is_empty(), "not kept: {broken:?}");
}
