//! A clock of what a thread itself has used.

use rustix::time::{ClockId, clock_gettime};

/// CPU time that this thread has used, us: what others run on the machine does not count.
pub fn thread_cpu_us() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}
