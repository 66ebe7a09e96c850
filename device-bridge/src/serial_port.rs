//! The serial port that a board is on.

use std::time::Duration;

use serialport::SerialPort;

pub(crate) type Port = Box<dyn SerialPort>;

/// A serial port that cannot be opened: which, and what the system says.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the serial port {0} cannot be opened ({1}); look at the cable and at `taut doctor`, and let your user open it: sudo usermod -aG dialout $USER, then log in again"
)]
pub struct PortError(String, String);

impl PortError {
    pub(crate) fn new(path: &str, cause: impl ToString) -> Self {
        Self(path.to_owned(), cause.to_string())
    }
}

/// Opens the port at `path`, whose reads wait for `patience`.
pub(crate) fn open(path: &str, baud: u32, patience: Duration) -> Result<Port, PortError> {
    let port = serialport::new(path, baud).timeout(patience).open();
    port.map_err(|cause| PortError::new(path, cause))
}
