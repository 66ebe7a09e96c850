//! What tests, benches and examples of several packages share.

mod base64;
mod clock;
mod dense;
mod hand;
pub mod random;
pub mod relay;
pub mod strings;
mod xorshift;

use std::fmt::Display;

pub use base64::base64;
pub use clock::thread_cpu_us;
pub use dense::{Soup, subdivided};
pub use hand::SlidingHand;

/// A scene: a ball over a half-space, both exact: 1000 N/m.
pub const BALL_ON_FLOOR: &str = r#"
name = "ball on floor"
[god_object]
shape = { sphere = { radius = 0.020 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.040] }
[[obstacle]]
name = "floor"
shape = { plane = { axis = "z" } }
[coupling]
k_s = 0.5
k_h = 2000.0
"#;

/// When this is `1`, a test that lacks something fails. The gate sets it.
pub const REQUIRE_VARIABLE: &str = "TAUT_REQUIRE";

/// Says that a test, or a part of it, is left out for lack of test data, a graphics driver or a device.
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
