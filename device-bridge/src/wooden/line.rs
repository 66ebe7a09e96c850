//! Where reports come from and go to: hidraw, or a socket in its place.

use std::io::ErrorKind;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[cfg(feature = "hid")]
use super::report::{HOST, TEENSY};

/// A device that reads and writes whole reports.
pub trait ReportLine: Send {
    /// Waits at most `timeout` for one report; 0 bytes where none came.
    ///
    /// # Errors
    /// The device is gone, in words for people.
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, String>;

    /// Writes a report, its number first.
    ///
    /// # Errors
    /// The device is gone, in words for people.
    fn write(&mut self, report: &[u8]) -> Result<(), String>;
}

/// USB ids of the boards: a Teensy, an mbed.
#[cfg(feature = "hid")]
const IDS: [(u16, u16); 2] = [(TEENSY_VENDOR, 0x0486), (0x1234, 0x0006)];
#[cfg(feature = "hid")]
const TEENSY_VENDOR: u16 = 0x16c0;

/// Whether reports go through this interface of a device. A Teensy has a second one under the same ids, number 1: its emulated serial port.
#[cfg(feature = "hid")]
pub(crate) fn is_board(ids: (u16, u16), interface: i32) -> bool {
    IDS.contains(&ids) && (ids.0 != TEENSY_VENDOR || interface <= 0) // below 0: not known
}

/// Opens the device at `path`, a hidraw or a socket; without one the first board on USB.
pub(crate) fn open(path: Option<&Path>) -> Result<Box<dyn ReportLine>, String> {
    if let Some(path) = path.filter(|path| is_socket(path)) {
        return Ok(Box::new(SocketLine::connect(path)?));
    }
    open_hid(path)
}

fn is_socket(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    path.metadata()
        .is_ok_and(|about| about.file_type().is_socket())
}

#[cfg(feature = "hid")]
fn open_hid(path: Option<&Path>) -> Result<Box<dyn ReportLine>, String> {
    let said = |error: hidapi::HidError| error.to_string();
    let hid = hidapi::HidApi::new().map_err(said)?;
    let wanted = path.and_then(Path::to_str);
    let found = hid.device_list().find(|device| match wanted {
        Some(path) => device.path().to_str() == Ok(path),
        None => is_board(
            (device.vendor_id(), device.product_id()),
            device.interface_number(),
        ),
    });
    let found = found
        .ok_or_else(|| "no such board is plugged in (USB 16c0:0486 or 1234:0006)".to_owned())?;
    Ok(Box::new(HidLine {
        device: found.open_device(&hid).map_err(said)?,
        length: match found.vendor_id() {
            TEENSY_VENDOR => 1 + TEENSY,
            _ => HOST,
        },
    }))
}

#[cfg(not(feature = "hid"))]
fn open_hid(_path: Option<&Path>) -> Result<Box<dyn ReportLine>, String> {
    Err("this program was built without HID; build it with the feature `hid`".to_owned())
}

/// A board at `/dev/hidraw*`.
#[cfg(feature = "hid")]
struct HidLine {
    device: hidapi::HidDevice,
    /// Of a report to it, with its number.
    length: usize,
}

#[cfg(feature = "hid")]
impl ReportLine for HidLine {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, String> {
        let milliseconds = i32::try_from(timeout.as_millis()).unwrap_or(i32::MAX);
        self.device
            .read_timeout(buffer, milliseconds)
            .map_err(|error| error.to_string())
    }

    fn write(&mut self, report: &[u8]) -> Result<(), String> {
        let mut whole = [0; 1 + TEENSY];
        whole[..report.len()].copy_from_slice(report);
        self.device
            .write(&whole[..self.length])
            .map(drop)
            .map_err(|error| error.to_string())
    }
}

/// A board that takes no report for so long is gone. Before that a write waits, as one of hidraw does: the last word is not lost because a board is busy.
const TAKEN_WITHIN: Duration = Duration::from_millis(200);

/// A socket keeps the borders of reports as hidraw does.
pub struct SocketLine {
    socket: UnixDatagram,
    own: PathBuf,
}

impl SocketLine {
    /// Connects to a simulated board.
    ///
    /// # Errors
    /// Nobody is there, in words for people.
    pub fn connect(path: &Path) -> Result<Self, String> {
        let said = |error: std::io::Error| error.to_string();
        let own = path.with_extension(format!("host-{}", std::process::id()));
        let _ = std::fs::remove_file(&own); // of a process before with this number
        let socket = UnixDatagram::bind(&own).map_err(said)?;
        let line = Self { socket, own };
        line.socket.connect(path).map_err(said)?;
        line.socket
            .set_write_timeout(Some(TAKEN_WITHIN))
            .map_err(said)?;
        Ok(line)
    }
}

impl Drop for SocketLine {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.own);
    }
}

impl ReportLine for SocketLine {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, String> {
        let said = |error: std::io::Error| error.to_string();
        // A time of zero would wait for ever, and a short one for a tick of the kernel.
        let received = if timeout.is_zero() {
            self.socket.set_nonblocking(true).map_err(said)?;
            let received = self.socket.recv(buffer);
            self.socket.set_nonblocking(false).map_err(said)?;
            received
        } else {
            self.socket.set_read_timeout(Some(timeout)).map_err(said)?;
            self.socket.recv(buffer)
        };
        match received {
            Ok(bytes) => Ok(bytes),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                Ok(0)
            }
            Err(error) => Err(error.to_string()),
        }
    }

    fn write(&mut self, report: &[u8]) -> Result<(), String> {
        self.socket
            .send(report)
            .map(drop)
            .map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::thread;

    use super::*;

    #[cfg(feature = "hid")]
    #[test]
    fn the_emulated_serial_port_of_a_teensy_is_no_board() {
        let [teensy, mbed] = IDS;
        assert!(is_board(teensy, 0) && is_board(teensy, -1));
        assert!(!is_board(teensy, 1));
        assert!(is_board(mbed, 1));
        assert!(!is_board((TEENSY_VENDOR, 0x0483), 0), "a serial one");
    }

    #[test]
    fn a_report_waits_for_a_board_that_is_busy() {
        let place = tempfile::tempdir().expect("a directory");
        let path = place.path().join("board");
        let board = UnixDatagram::bind(&path).expect("a board");
        let long = Duration::from_secs(60);
        board.set_read_timeout(Some(long)).expect("set");
        let mut line = SocketLine::connect(&path).expect("its line");
        let other = UnixDatagram::unbound().expect("a socket");
        other.set_nonblocking(true).expect("set");
        while other.send_to(&[1], &path).is_ok() {} // until no more fits
        assert_eq!(line.read(&mut [0; 64], Duration::ZERO), Ok(0));
        let (waits, waited) = channel();
        thread::scope(|scope| {
            let writer = scope.spawn(|| {
                waits.send(()).expect("heard");
                line.write(&[2])
            });
            waited.recv().expect("about to write");
            let mut report = [0; 64];
            while board.recv(&mut report).expect("a report") > 0 && report[0] != 2 {}
            assert_eq!(writer.join().expect("written"), Ok(()));
        });
    }
}
