//! What tests of several packages share.

use std::fmt::Display;

/// When this is `1`, a test that lacks something fails. The gate sets it.
pub const REQUIRE_VARIABLE: &str = "TAUT_REQUIRE";

/// Says that a test, or a part of it, is left out for lack of test data, a graphics driver or a device.
///
/// # Panics
/// `TAUT_REQUIRE=1`: nothing may be left out.
#[allow(
    clippy::disallowed_methods,
    reason = "tests may read the environment; the method may not"
)]
pub fn left_out(why: impl Display) {
    let required = std::env::var_os(REQUIRE_VARIABLE).is_some_and(|value| value == "1");
    assert!(
        !required,
        "left out: {why}; {REQUIRE_VARIABLE}=1 asks for every test"
    );
    println!("left out: {why}");
}
