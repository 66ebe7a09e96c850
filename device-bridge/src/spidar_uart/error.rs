//! Why there are no motor boards.

/// Why there are no boards.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BoardsError {
    /// The port cannot be opened.
    #[error(
        "the serial port {path} cannot be opened ({cause}); look at the cable and at `taut doctor`, and let your user open it: sudo usermod -aG dialout $USER, then log in again"
    )]
    Port {
        /// As given.
        path: String,
        /// What the system says.
        cause: String,
    },
    /// Nobody answers, or not eight motors.
    #[error(
        "on {path} there are motor boards with {motors} motors together, but a SPIDAR-G needs 8; look at the boards' supply and at their cables"
    )]
    Motors {
        /// As given.
        path: String,
        /// That were found.
        motors: usize,
    },
    /// They are there, and say nothing that is to be believed.
    #[error(
        "the motor boards on {path} answer, but not in time or not twice alike, so that nobody knows where the grip is; look at their cables, and whether this machine is busy"
    )]
    Counts {
        /// As given.
        path: String,
    },
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
    #[error(
        "cannot start a thread for the motor boards: {0}; end other programs or raise the limit"
    )]
    Thread(String),
}
