//! What a process has of the system: memory, descriptors, threads.

use std::path::PathBuf;

/// Resources of a process at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resources {
    /// Resident memory, bytes.
    pub resident_bytes: u64,
    /// Open file descriptors.
    pub descriptors: u64,
    /// Threads.
    pub threads: u64,
}

impl Resources {
    /// Of the process with this number.
    pub fn of(process: u32) -> std::io::Result<Resources> {
        let place = PathBuf::from(format!("/proc/{process}"));
        let text = std::fs::read_to_string(place.join("statm"))?;
        let pages = text.split_whitespace().nth(1).and_then(|n| n.parse().ok());
        let pages: u64 = pages.ok_or(std::io::ErrorKind::InvalidData)?;
        let count = |what| std::fs::read_dir(place.join(what)).map(Iterator::count);
        Ok(Resources {
            resident_bytes: pages * rustix::param::page_size() as u64,
            descriptors: count("fd")? as u64,
            threads: count("task")? as u64,
        })
    }
}

/// Returns this process's free heap pages to the system, so that resident memory is memory in use; else it would show the most clients there ever
/// were at a time. Does nothing without glibc.
pub(super) fn give_back() {
    #[cfg(target_env = "gnu")]
    #[allow(unsafe_code, reason = "no safe library trims the allocator")]
    // SAFETY: it takes no pointer, and may be called at any time.
    unsafe {
        libc::malloc_trim(0)
    };
}
