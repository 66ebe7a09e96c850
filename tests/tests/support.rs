//! What the tests of nodes that draw share.

use taut_tests::workbench::TestWorkbench;

/// A node without a window, as quick as can be.
pub(crate) const SMALL: [&str; 5] = ["--headless", "--width", "64", "--height", "64"];

/// Whether this machine can draw; said aloud where it cannot.
pub(crate) fn draws(workbench: &TestWorkbench) -> bool {
    workbench.adapter().map_err(taut_test_kit::left_out).is_ok()
}
