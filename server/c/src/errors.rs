//! Codes, sentences, and the border that no panic crosses.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// How a call ended.
#[allow(non_camel_case_types, reason = "the names that C sees")]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TautStatus {
    /// It did what it says.
    TAUT_OK = 0,
    /// An argument is NULL, not finite or out of range.
    TAUT_BAD_ARGUMENT = 1,
    /// A file cannot be read, or something is wrong in it.
    TAUT_BAD_FILE = 2,
    /// A buffer is too short; the length that is needed was written.
    TAUT_SHORT_BUFFER = 3,
    /// Another thread is in a call with the same handle.
    TAUT_BUSY = 4,
    /// A fault of the library. The handle answers `TAUT_PANIC` until it is reset or freed.
    TAUT_PANIC = 5,
}

/// Why a call did not do what it says.
pub(crate) struct Refusal {
    pub(crate) status: TautStatus,
    pub(crate) text: String,
}

impl Refusal {
    pub(crate) fn argument(text: impl Into<String>) -> Self {
        Self::of(TautStatus::TAUT_BAD_ARGUMENT, text)
    }

    pub(crate) fn file(error: &taut_scene::FileError) -> Self {
        Self::of(TautStatus::TAUT_BAD_FILE, error.to_string())
    }

    pub(crate) fn of(status: TautStatus, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { status, text }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::new(CString::default());
}

/// The sentence of the last call of this thread that failed; empty before the first. Valid until the next call of this thread fails.
#[unsafe(no_mangle)]
pub extern "C" fn taut_last_error() -> *const c_char {
    // Where the thread ends, other variables of the thread may still call: there is no sentence any more.
    LAST.try_with(|last| last.try_borrow().map_or(c"".as_ptr(), |text| text.as_ptr()))
        .unwrap_or(c"".as_ptr())
}

/// Runs `body`; an error or a panic becomes a code, and its sentence is kept.
pub(crate) fn guard(body: impl FnOnce() -> Result<(), Refusal>) -> TautStatus {
    let refusal = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return TautStatus::TAUT_OK,
        Ok(Err(refusal)) => refusal,
        Err(panic) => {
            let said = panic
                .downcast_ref::<&str>()
                .map(|text| (*text).to_owned())
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_default();
            Refusal::of(
                TautStatus::TAUT_PANIC,
                format!("a fault of the library ({said}); please report it"),
            )
        }
    };
    let text = CString::new(refusal.text.replace('\0', " ")).unwrap_or_default();
    // As in `taut_last_error`: the code alone is left.
    let _ = LAST.try_with(|last| {
        if let Ok(mut last) = last.try_borrow_mut() {
            *last = text;
        }
    });
    refusal.status
}

/// The target of a pointer that must not be NULL.
///
/// # Safety
/// If not NULL, the pointer is valid for reads for as long as the result is used.
pub(crate) unsafe fn reference<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, Refusal> {
    // SAFETY: valid, by the condition of this function.
    unsafe { pointer.as_ref() }.ok_or_else(|| Refusal::argument(format!("`{name}` is NULL")))
}

/// Writes to a pointer that must not be NULL.
///
/// # Safety
/// If not NULL, the pointer is valid for a write.
pub(crate) unsafe fn put<T>(pointer: *mut T, value: T, name: &str) -> Result<(), Refusal> {
    if pointer.is_null() {
        return Err(Refusal::argument(format!("`{name}` is NULL")));
    }
    // SAFETY: not NULL, and valid by the condition of this function.
    unsafe { pointer.write(value) };
    Ok(())
}

/// The text of a pointer that must not be NULL.
///
/// # Safety
/// If not NULL, the pointer is to a string that ends with a zero byte, valid for as long as the result is used.
pub(crate) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Refusal> {
    if pointer.is_null() {
        return Err(Refusal::argument(format!("`{name}` is NULL")));
    }
    // SAFETY: not NULL, and a string by the condition of this function.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str()
        .map_err(|_| Refusal::argument(format!("`{name}` is not UTF-8")))
}

/// Copies a text and a zero byte into a buffer of C; `needed`, if not NULL, gets the bytes with the zero byte.
///
/// # Safety
/// If not NULL, `buffer` is valid for writes of `length` bytes and `needed` for one write.
pub(crate) unsafe fn put_text(
    text: &str,
    buffer: *mut c_char,
    length: usize,
    needed: *mut usize,
) -> Result<(), Refusal> {
    let bytes = text.len() + 1;
    if !needed.is_null() {
        // SAFETY: not NULL, and valid by the condition of this function.
        unsafe { needed.write(bytes) };
    }
    if buffer.is_null() {
        return Err(Refusal::argument("`buffer` is NULL"));
    }
    if length < bytes {
        return Err(Refusal::of(
            TautStatus::TAUT_SHORT_BUFFER,
            format!("the buffer has {length} bytes, but {bytes} are needed"),
        ));
    }
    // SAFETY: `text` has `bytes - 1` bytes, the buffer at least `bytes`; Rust's text and a buffer that C may write do not overlap.
    unsafe {
        buffer
            .cast::<u8>()
            .copy_from_nonoverlapping(text.as_ptr(), text.len());
        buffer.add(text.len()).write(0);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_code_with_its_text() {
        assert_eq!(guard(|| panic!("index {} of 3", 7)), TautStatus::TAUT_PANIC);
        // SAFETY: a string that ends with a zero byte, until the next failure.
        let text = unsafe { CStr::from_ptr(taut_last_error()) };
        assert_eq!(
            text.to_str(),
            Ok("a fault of the library (index 7 of 3); please report it")
        );
    }

    /// Such as by the end of a `thread_local` variable of C++.
    #[test]
    fn a_call_while_its_thread_ends_is_answered_with_its_code() {
        struct AtEnd(std::sync::mpsc::Sender<(TautStatus, bool)>);
        impl Drop for AtEnd {
            fn drop(&mut self) {
                let status = guard(|| Err(Refusal::argument("late")));
                // SAFETY: a string that ends with a zero byte.
                let text = unsafe { CStr::from_ptr(taut_last_error()) };
                let _ = self.0.send((status, text.is_empty()));
            }
        }
        thread_local! {
            static AT_END: RefCell<Option<AtEnd>> = const { RefCell::new(None) };
        }
        let (told, hears) = std::sync::mpsc::channel();
        let thread = std::thread::Builder::new().name("ends".to_owned());
        let thread = thread.spawn(move || {
            // The first that is used is the last that ends.
            AT_END.with(|end| *end.borrow_mut() = Some(AtEnd(told)));
            guard(|| Err(Refusal::argument("early")))
        });
        let ended = thread.expect("a thread").join();
        assert_eq!(ended.ok(), Some(TautStatus::TAUT_BAD_ARGUMENT));
        assert_eq!(hears.recv(), Ok((TautStatus::TAUT_BAD_ARGUMENT, true)));
    }
}
