//! What a string-driven device's electronics must offer: counts in, tensions out.

use std::time::Duration;

use crate::fault::StringFault;
use crate::{PerString, STRINGS};

/// One reading of the electronics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// When the counters were latched, on the clock of `now`; never after `now`.
    pub time: Duration,
    /// Encoder counts since switching on.
    pub counts: [i32; STRINGS],
    /// Measured tensions, N, where the electronics measure motor currents.
    pub tensions: Option<PerString>,
    /// One bit per button, bit 0 the first; 1 is pressed.
    pub buttons: u16,
}

/// Encoders and motors. One implementation per motor controller; [`crate::SimulatedStrings`] is the one without any.
///
/// `now` never goes back between calls; neither method allocates, locks or waits.
pub trait StringHardware: Send {
    /// The newest reading at `now`.
    ///
    /// # Errors
    /// [`StringFault::Hardware`] if there is none to be trusted.
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault>;

    /// Commands the motors to pull with `tensions` (N, each within the geometry's limits) from `now` on.
    fn write_tensions(&mut self, now: Duration, tensions: &PerString);

    /// Whether the motors have let go of the strings of their own accord since this was asked last; until it was asked they render nothing.
    fn let_go(&mut self) -> bool {
        false
    }
}
