//! Why there are no motor boards.

use crate::own_thread::ThreadError;
use crate::serial_port::PortError;

/// Why there are no boards.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardsError {
    /// The port cannot be opened.
    #[error(transparent)]
    Port(#[from] PortError),
    /// Nobody answers on this port, or not eight motors.
    #[error(
        "on {0} there are motor boards with {1} motors together, but a SPIDAR-G needs 8; look at the boards' supply and at their cables"
    )]
    Motors(String, usize),
    /// They are there, and say nothing that is to be believed.
    #[error(
        "the motor boards on {0} answer, but not in time or not twice alike, so that nobody knows where the grip is; look at their cables, and whether this machine is busy"
    )]
    Counts(String),
    /// Nothing is known of the amplifiers.
    #[error(
        "the geometry {0} has no `volts_per_newton`, without which no current is known; write it into its file"
    )]
    NoVolts(String),
    /// The converters have no range for these motors.
    #[error(
        "the least tension of the geometry {name} is {least} N, but the converters of motor boards reach {most:.2} N with its `volts_per_newton`; correct its file"
    )]
    OutOfRange {
        /// The geometry's.
        name: String,
        /// As given, N.
        least: f64,
        /// N.
        most: f64,
    },
    /// No thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
}
