//! Why a string-driven device has no pose that may be trusted.

/// A fault of strings, encoders or pose. The force must go to zero.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum StringFault {
    /// A length is not a number, or not above zero.
    #[error("string {string} has no length; check its encoder's cable", string = .0 + 1)]
    NotFinite(usize),
    /// Fewer than six strings can be measured.
    #[error("only {0} of 8 strings can be measured, and a pose needs 6; check motors and encoders")]
    TooFewStrings(usize),
    /// The iterations ran out.
    #[error("no pose fits the string lengths; put the grip at the centre and calibrate")]
    NotConverged,
    /// The strings do not fix all six degrees of freedom here.
    #[error("the strings do not fix the pose here; move the grip towards the centre")]
    Singular,
    /// The grip is turned beyond 90 degrees, where strings cross.
    #[error("the grip is turned by {degrees:.0} degrees, beyond 90; turn it back", degrees = .angle.to_degrees())]
    TurnedTooFar {
        /// Rotation from rest, rad.
        angle: f64,
    },
    /// A string is so short that its direction means nothing.
    #[error("the grip is {mm:.1} mm from motor {number}; move it back", mm = .distance * 1e3, number = .string + 1)]
    NearMotor {
        /// The string, from 0.
        string: usize,
        /// Its length, m.
        distance: f64,
    },
    /// A string is slack, so that its length means nothing.
    #[error("string {number} is slack ({tension:.2} N); check its motor", number = .string + 1)]
    Slack {
        /// The string, from 0.
        string: usize,
        /// Its tension, N.
        tension: f64,
    },
    /// Eight lengths that no pose has together.
    #[error("the string lengths disagree by {mm:.2} mm{hint}; calibrate, and look for a slack or slipped string", mm = .disagreement * 1e3, hint = named(*.suspect))]
    Inconsistent {
        /// Norm of the residual, m.
        disagreement: f64,
        /// The string that explains it, from 0, where one does.
        suspect: Option<usize>,
    },
    /// The hardware itself reports a fault or no new counts.
    #[error("the motor controller does not answer; check its cable and its supply")]
    Hardware,
}

fn named(suspect: Option<usize>) -> String {
    suspect.map_or_else(String::new, |string| {
        format!(", most likely string {}", string + 1)
    })
}
