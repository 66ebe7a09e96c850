//! Conforming contact in variants that cover every two levels of two factors: nothing penetrates, the rows that were chosen give the force of
//! all, and the order of the obstacles says nothing. Times and dense meshes: the example of the same name.

use taut_method_tests::variants::covering;
use taut_method_tests::variants::measure::{Course, run};
use taut_method_tests::variants::oracle::Oracle;

/// Triangles of a mesh: few enough for debug builds.
const TRIANGLES: u32 = 300;

#[test]
fn no_variant_penetrates_and_every_one_has_the_force_of_all_rows() {
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 60,
        stride: 10,
    };
    let mut wrong = Vec::new();
    for variant in covering(TRIANGLES, 1) {
        let outcome = run(&variant, &course, &mut oracle, || 0.0);
        assert_eq!(outcome.penetrations, 0, "{variant:?}");
        assert_eq!(outcome.failures, 0, "{variant:?}");
        let error = outcome.errors.iter().copied().fold(0.0, f64::max);
        let right = error <= 0.01; // false for NaN
        if !right {
            wrong.push(format!("{error} {variant:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
