//! The functions of a library as `include/taut_device.h` declares them. All that is unsafe of plug-ins is here.
#![allow(
    unsafe_code,
    reason = "C functions that are found at run time; each block says what it relies on"
)]

use std::ffi::{CString, c_char, c_void};
use std::path::{Path, PathBuf};

use libloading::Library;

use super::claims::{Claim, PluginInfo};

/// `TAUT_DEVICE_VERSION`.
const VERSION: u32 = 1;
/// The one symbol.
const ENTRY: &str = "taut_device_entry";
/// Longest text of an error that is read, with its end.
const TEXT: usize = 256;

/// `taut_device_info`.
#[repr(C)]
pub(super) struct RawInfo {
    pub(super) name: [u8; 64],
    pub(super) sensed: u32,
    pub(super) actuated: u32,
    pub(super) max_force: f64,
    pub(super) max_torque: f64,
    pub(super) max_stiffness: f64,
    pub(super) max_rotational_stiffness: f64,
    pub(super) rate: f64,
}

/// `taut_device_sample`.
#[derive(Clone, Copy)]
#[repr(C)]
pub(super) struct RawSample {
    pub(super) position: [f64; 3],
    pub(super) orientation: [f64; 4],
    pub(super) velocity: [f64; 3],
    pub(super) angular_velocity: [f64; 3],
    pub(super) age: f64,
    pub(super) buttons: u32,
    pub(super) measured: u32,
}

impl RawSample {
    /// What a library gets: a number that it does not set is none.
    pub(super) const UNSET: Self = Self {
        position: [f64::NAN; 3],
        orientation: [f64::NAN; 4],
        velocity: [f64::NAN; 3],
        angular_velocity: [f64::NAN; 3],
        age: f64::NAN,
        buttons: 0,
        measured: 0,
    };
}

type Entry = unsafe extern "C" fn() -> *const RawTable;

/// `taut_device_table`; a null pointer to a function is `None`.
#[derive(Clone, Copy)]
#[repr(C)]
struct RawTable {
    version: u32,
    size: u32,
    open: Option<unsafe extern "C" fn(*const c_char, *mut *mut c_void) -> i32>,
    info: Option<unsafe extern "C" fn(*mut c_void, *mut RawInfo) -> i32>,
    read: Option<unsafe extern "C" fn(*mut c_void, *mut RawSample) -> i32>,
    write: Option<unsafe extern "C" fn(*mut c_void, *const f64) -> i32>,
    close: Option<unsafe extern "C" fn(*mut c_void) -> i32>,
    error_text: Option<unsafe extern "C" fn(*mut c_void, *mut c_char, usize)>,
}

/// What a call returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
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

/// Why a plug-in is no device.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PluginError {
    /// The file.
    #[error("there is no plug-in at {path} ({cause}); write its whole path, plugin:/path/lib.so")]
    Missing {
        /// As written.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// The system cannot load it.
    #[error(
        "the plug-in {path} cannot be loaded: {cause}; build it for this machine, and install the libraries that it needs"
    )]
    Load {
        /// Whole.
        path: PathBuf,
        /// What the system says.
        cause: String,
    },
    /// It is another library.
    #[error(
        "{path} exports no function `taut_device_entry`, so it is no plug-in; a vendor's library needs one around it: docs/devices.md, Write a device in C"
    )]
    NoEntry {
        /// Whole.
        path: PathBuf,
    },
    /// Another version of the interface, or half a table.
    #[error(
        "the plug-in {path} does not fit: {what}; compile it with the taut_device.h of this release"
    )]
    Table {
        /// Whole.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// It found no device.
    #[error(
        "the plug-in {path} cannot open its device: {cause}; plug it in and switch it on, and look at the plug-in's options"
    )]
    Open {
        /// Whole.
        path: PathBuf,
        /// What it says.
        cause: String,
    },
    /// It says what no device is.
    #[error("the plug-in {path} says what no device is: {claim}; mend its `info`")]
    Info {
        /// Whole.
        path: PathBuf,
        /// What.
        claim: Claim,
    },
    /// It does not come back.
    #[error(
        "the plug-in {path} did not open its device within {seconds} s; switch the device off and on, and end other programs that use it"
    )]
    Hangs {
        /// As written.
        path: PathBuf,
        /// That were waited.
        seconds: u64,
    },
    /// No thread.
    #[error("cannot start a thread for the plug-in: {0}; end other programs or raise the limit")]
    Thread(String),
}

/// A library whose table fits. It stays loaded until the process ends: threads of its own may run in it.
pub(super) struct PluginLibrary {
    path: PathBuf,
    table: Fitting,
}

/// A table without holes.
#[derive(Clone, Copy)]
struct Fitting {
    open: unsafe extern "C" fn(*const c_char, *mut *mut c_void) -> i32,
    info: unsafe extern "C" fn(*mut c_void, *mut RawInfo) -> i32,
    read: unsafe extern "C" fn(*mut c_void, *mut RawSample) -> i32,
    write: unsafe extern "C" fn(*mut c_void, *const f64) -> i32,
    close: unsafe extern "C" fn(*mut c_void) -> i32,
    error_text: unsafe extern "C" fn(*mut c_void, *mut c_char, usize),
}

impl PluginLibrary {
    /// Loads `path` and asks for its table.
    pub(super) fn load(path: &Path) -> Result<Self, PluginError> {
        let whole = path.canonicalize().map_err(|error| PluginError::Missing {
            path: path.to_owned(),
            cause: error.to_string(),
        })?;
        // SAFETY: the user names the library as trusted code; its initialisers run here, in the one thread that calls it.
        let library = unsafe { Library::new(&whole) }.map_err(|error| PluginError::Load {
            path: whole.clone(),
            cause: error.to_string(),
        })?;
        // Never unloaded: its functions stay valid, for its own threads too.
        let library: &'static Library = Box::leak(Box::new(library));
        // SAFETY: the header declares the symbol with this signature; what is named so and is something else is no plug-in.
        let entry = unsafe { library.get::<Entry>(ENTRY.as_bytes()) };
        let entry = entry.map_err(|_| PluginError::NoEntry {
            path: whole.clone(),
        })?;
        let misfit = |what: String| PluginError::Table {
            path: whole.clone(),
            what,
        };
        // SAFETY: the function takes nothing.
        let raw = unsafe { entry() };
        if raw.is_null() || !raw.is_aligned() {
            return Err(misfit("it gives no table of functions".to_owned()));
        }
        // SAFETY: every version of the table begins with these two numbers, and it stays valid (header).
        let (version, size) = unsafe { ((*raw).version, (*raw).size) };
        if version != VERSION {
            return Err(misfit(format!(
                "its table is of version {version}, and {VERSION} is understood"
            )));
        }
        if size as usize != size_of::<RawTable>() {
            return Err(misfit(format!(
                "its table has {size} bytes, and version {VERSION} has {}",
                size_of::<RawTable>()
            )));
        }
        // SAFETY: version and size are those of `RawTable`; the table is not changed any more (header).
        let raw = unsafe { *raw };
        let hole = |name: &str| misfit(format!("its table has no function `{name}`"));
        let table = Fitting {
            open: raw.open.ok_or_else(|| hole("open"))?,
            info: raw.info.ok_or_else(|| hole("info"))?,
            read: raw.read.ok_or_else(|| hole("read"))?,
            write: raw.write.ok_or_else(|| hole("write"))?,
            close: raw.close.ok_or_else(|| hole("close"))?,
            error_text: raw.error_text.ok_or_else(|| hole("error_text"))?,
        };
        Ok(Self { path: whole, table })
    }

    /// Opens the device and asks what it is; closed again when it is dropped.
    pub(super) fn open(&self, options: &str) -> Result<(OpenDevice<'_>, PluginInfo), PluginError> {
        let failed = |cause: String| PluginError::Open {
            path: self.path.clone(),
            cause,
        };
        let options =
            CString::new(options).map_err(|_| failed("an option contains a 0".to_owned()))?;
        let mut device = std::ptr::null_mut();
        // SAFETY: both pointers are valid during the call.
        let answer = unsafe { (self.table.open)(options.as_ptr(), &raw mut device) }.into();
        if answer != Answer::Good {
            return Err(failed(self.error_text(std::ptr::null_mut(), answer)));
        }
        let mut open = OpenDevice {
            library: self,
            device,
        };
        let mut info = RawInfo {
            name: [0; 64],
            sensed: 0,
            actuated: 0,
            max_force: f64::NAN,
            max_torque: f64::NAN,
            max_stiffness: f64::NAN,
            max_rotational_stiffness: f64::NAN,
            rate: f64::NAN,
        };
        // SAFETY: the device is open, and `info` is of the header's layout.
        let answer = unsafe { (self.table.info)(device, &raw mut info) }.into();
        if answer != Answer::Good {
            return Err(failed(open.error_text(answer)));
        }
        let info = PluginInfo::of(&info).map_err(|claim| PluginError::Info {
            path: self.path.clone(),
            claim,
        })?;
        Ok((open, info))
    }

    fn error_text(&self, device: *mut c_void, answer: Answer) -> String {
        let mut text = [0_u8; TEXT];
        // SAFETY: `text` is writable for one byte less than what it has, so that its last stays 0; `device` is open, or null after a failed open.
        unsafe { (self.table.error_text)(device, text.as_mut_ptr().cast(), TEXT - 1) };
        let said = until_zero(&text);
        if said.is_empty() {
            format!("{answer:?}, without a word")
        } else {
            said
        }
    }
}

/// The text before the first 0.
pub(super) fn until_zero(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    String::from_utf8_lossy(&bytes[..end.unwrap_or(bytes.len())])
        .trim()
        .to_owned()
}

/// A device between its open and its close. Not `Send`: it stays on its thread.
pub(super) struct OpenDevice<'a> {
    library: &'a PluginLibrary,
    device: *mut c_void,
}

impl OpenDevice<'_> {
    pub(super) fn read(&mut self) -> (Answer, RawSample) {
        let mut sample = RawSample::UNSET;
        // SAFETY: the device is open, and `sample` is of the header's layout.
        let answer = unsafe { (self.library.table.read)(self.device, &raw mut sample) };
        (answer.into(), sample)
    }

    pub(super) fn write(&mut self, wrench: &[f64; 6]) -> Answer {
        // SAFETY: the device is open, and six numbers are there.
        unsafe { (self.library.table.write)(self.device, wrench.as_ptr()) }.into()
    }

    pub(super) fn error_text(&mut self, answer: Answer) -> String {
        self.library.error_text(self.device, answer)
    }
}

impl Drop for OpenDevice<'_> {
    fn drop(&mut self) {
        // SAFETY: the device is open, and this is the last call for it.
        let answer: Answer = unsafe { (self.library.table.close)(self.device) }.into();
        if answer != Answer::Good {
            tracing::warn!(
                "the plug-in {} could not close its device ({answer:?}): make sure that it pushes no more",
                self.library.path.display()
            );
        }
    }
}
