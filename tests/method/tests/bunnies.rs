//! Bunnies that a hand slides over each other: the rows that were chosen give the force of all of them.

use taut_method_tests::variants::bunnies::{SLIDES, load};
use taut_method_tests::variants::measure::quantile;

/// The sets of one slide; the faster one, whose hand is up to 3 mm ahead of what the rows were chosen for, is measured and not promised.
#[test]
fn a_bunny_that_slides_over_another_is_felt_as_by_every_pair() {
    let Some(bunny) = load("bunny_27k.ply") else {
        taut_test_kit::left_out("bunny_27k.ply is not in the data directory");
        return;
    };
    let slide = SLIDES[0];
    let errors = slide.errors(&slide.world(&bunny));
    let at = |share| quantile(&errors, share);
    let shown = [0.9, 0.98, 0.99, 1.0].map(at);
    println!("{} sets, off by {shown:?}", errors.len());
    assert!(at(0.99) <= 0.01, "off by {shown:?}");
}
