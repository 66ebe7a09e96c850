//! Devices of a user's own: a shared library behind `include/taut_device.h`, or a file in Python.
//!
//! | file           | what                                                                  |
//! |----------------|-----------------------------------------------------------------------|
//! | `library`      | the C functions, with all that is unsafe                              |
//! | `python`       | a file in Python in a process of its own                              |
//! | `frame`        | what that process is asked and answers                                |
//! | `printed`      | what that process prints                                              |
//! | `taut_host.py` | the program of that process, which calls the file                     |
//! | `claims`       | what either may say of its device, and which samples are ones         |
//! | `talker`       | the thread that calls them                                            |
//! | `vendors`      | the vendors' libraries that a plug-in of ours calls                   |

mod claims;
mod error;
#[cfg(unix)]
mod frame;
mod library;
#[cfg(unix)]
mod printed;
#[cfg(unix)]
mod python;
mod talker;
mod vendors;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

pub use claims::{Claim, PluginInfo};
pub use error::PluginError;
#[cfg(unix)]
pub use frame::{ReadAnswer, read_answer};
pub use talker::Plugin;
pub use vendors::{VENDOR_LIBRARIES, VendorLibrary, VendorLibraryState};

use claims::RawSample;

/// What a device of a user's own is written in.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// A shared library.
    #[default]
    C,
    /// A file, run by this interpreter.
    Python {
        /// Its path, or a name that the `PATH` leads to.
        interpreter: PathBuf,
    },
}

/// What a call returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// `TAUT_DEVICE_OK`.
    Good,
    /// `TAUT_DEVICE_NOTHING_NEW`.
    NothingNew,
    /// `TAUT_DEVICE_NOT_READY`.
    NotReady,
    /// `TAUT_DEVICE_GONE`.
    Gone,
    /// Any other.
    Failed(i32),
}

impl From<i32> for Answer {
    fn from(code: i32) -> Self {
        match code {
            0 => Self::Good,
            1 => Self::NothingNew,
            2 => Self::NotReady,
            3 => Self::Gone,
            other => Self::Failed(other),
        }
    }
}

/// A device between its open and its close, which comes with its drop. It stays on its thread.
trait OpenDevice {
    fn read(&mut self) -> (Answer, RawSample);

    /// Force then torque, N and N m, the device's axes.
    fn write(&mut self, wrench: &[f64; 6]) -> Answer;

    /// What went wrong last, for people.
    fn error_text(&mut self, answer: Answer) -> String;
}

/// What opens a device, again after it was gone.
trait Opener: Send {
    /// Gives up, where it can, once `end` is true.
    fn open(
        &mut self,
        end: &Arc<AtomicBool>,
    ) -> Result<(Box<dyn OpenDevice + '_>, PluginInfo), PluginError>;
}

impl Language {
    fn opener(
        &self,
        path: &Path,
        options: &str,
        priority: u8,
    ) -> Result<Box<dyn Opener>, PluginError> {
        match self {
            Self::C => Ok(Box::new(library::LibraryOpener::new(path, options))),
            #[cfg(unix)]
            Self::Python { interpreter } => Ok(Box::new(python::PythonFile::new(
                interpreter,
                path,
                options,
                priority,
            )?)),
            #[cfg(not(unix))]
            Self::Python { .. } => Err(PluginError::NotHere),
        }
    }
}
