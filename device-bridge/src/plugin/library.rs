//! The functions of a library as `include/taut_device.h` declares them. All that is unsafe of plug-ins is here.
#![allow(
    unsafe_code,
    reason = "C functions that are found at run time; each block says what it relies on"
)]

use std::ffi::{CString, c_char, c_void};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use libloading::Library;

use super::claims::{PluginInfo, RawInfo, RawSample, until_zero};
use super::{Answer, OpenDevice, Opener, PluginError};

/// `TAUT_DEVICE_VERSION`.
const VERSION: u32 = 1;
const ENTRY: &str = "taut_device_entry";
/// Longest text of an error that is read, with its end.
const TEXT: usize = 256;

/// Whether the system's loader finds this file and can load it, with every symbol that it needs. It stays loaded until the process ends, as does
/// what it began.
///
/// # Errors
/// What the system says.
pub(super) fn loads(file: &str) -> Result<(), String> {
    #[cfg(unix)]
    let open = |file| {
        use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
        // SAFETY: a library on the loader's paths is code that an administrator installed; its initialisers run here.
        unsafe { Library::open(Some(file), RTLD_NOW | RTLD_LOCAL) }
    };
    #[cfg(not(unix))]
    // SAFETY: as above.
    let open = |file| unsafe { Library::new(file) };
    std::mem::forget(open(file).map_err(|error| error.to_string())?);
    Ok(())
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

/// Loads a library in the thread that calls it, and opens its device.
pub(super) struct LibraryOpener {
    path: PathBuf,
    options: String,
    loaded: Option<PluginLibrary>,
}

impl LibraryOpener {
    pub(super) fn new(path: &Path, options: &str) -> Self {
        Self {
            path: path.to_owned(),
            options: options.to_owned(),
            loaded: None,
        }
    }
}

impl Opener for LibraryOpener {
    fn open(
        &mut self,
        _end: &Arc<AtomicBool>,
    ) -> Result<(Box<dyn OpenDevice + '_>, PluginInfo), PluginError> {
        let library = match self.loaded.take() {
            Some(library) => library,
            None => PluginLibrary::load(&self.path)?,
        };
        let (device, info) = self.loaded.insert(library).open(&self.options)?;
        Ok((Box::new(device), info))
    }
}

/// A library whose table fits. It stays loaded until the process ends: threads of its own may run in it.
struct PluginLibrary {
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
    fn load(path: &Path) -> Result<Self, PluginError> {
        let whole = path.canonicalize().map_err(|error| {
            PluginError::Missing(path.to_owned(), error.to_string(), "plugin:/path/lib.so")
        })?;
        // SAFETY: the user names the library as trusted code; its initialisers run here, in the one thread that calls it.
        let library = unsafe { Library::new(&whole) }
            .map_err(|error| PluginError::Load(whole.clone(), error.to_string()))?;
        // Never unloaded: its functions stay valid, for its own threads too.
        let library: &'static Library = Box::leak(Box::new(library));
        // SAFETY: the header declares the symbol with this signature; what is named so and is something else is no plug-in.
        let entry = unsafe { library.get::<Entry>(ENTRY.as_bytes()) };
        let entry = entry.map_err(|_| PluginError::NoEntry(whole.clone()))?;
        let misfit = |what: String| PluginError::Table(whole.clone(), what);
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
    fn open(&self, options: &str) -> Result<(OpenLibrary<'_>, PluginInfo), PluginError> {
        let failed = |cause: String| PluginError::Open(self.path.clone(), cause);
        let options =
            CString::new(options).map_err(|_| failed("an option contains a 0".to_owned()))?;
        let mut device = std::ptr::null_mut();
        // SAFETY: both pointers are valid during the call.
        let answer = unsafe { (self.table.open)(options.as_ptr(), &raw mut device) }.into();
        if answer != Answer::Good {
            return Err(failed(self.error_text(std::ptr::null_mut(), answer)));
        }
        let mut open = OpenLibrary {
            library: self,
            device,
        };
        let mut info = RawInfo::UNSET;
        // SAFETY: the device is open, and `info` is of the header's layout.
        let answer = unsafe { (self.table.info)(device, &raw mut info) }.into();
        if answer != Answer::Good {
            return Err(failed(open.error_text(answer)));
        }
        let info = PluginInfo::of(&info);
        let info = info.map_err(|claim| PluginError::Info(self.path.clone(), claim))?;
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

/// A library's device between its open and its close. Not `Send`: it stays on its thread.
struct OpenLibrary<'a> {
    library: &'a PluginLibrary,
    device: *mut c_void,
}

impl OpenDevice for OpenLibrary<'_> {
    fn read(&mut self) -> (Answer, RawSample) {
        let mut sample = RawSample::UNSET;
        // SAFETY: the device is open, and `sample` is of the header's layout.
        let answer = unsafe { (self.library.table.read)(self.device, &raw mut sample) };
        (answer.into(), sample)
    }

    fn write(&mut self, wrench: &[f64; 6]) -> Answer {
        // SAFETY: the device is open, and six numbers are there.
        unsafe { (self.library.table.write)(self.device, wrench.as_ptr()) }.into()
    }

    fn error_text(&mut self, answer: Answer) -> String {
        self.library.error_text(self.device, answer)
    }
}

impl Drop for OpenLibrary<'_> {
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
