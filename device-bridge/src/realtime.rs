//! What a periodic loop asks of the operating system: absolute sleeps, priority, locked memory, a core, cores that stay awake.
//!
//! Each request says what was granted or why not; nothing is lost silently, and whether a loop goes on
//! without is the caller's decision. This is the only place with operating system calls. Where a system
//! has no such call, the sleep falls back to the standard library and requests are waived.

mod awake;
mod beat;

use std::fmt;
use std::time::Duration;

pub use awake::{AWAKE, Awake, keep_cores_awake};
pub use beat::{CLEAR_OF_KERNEL_TICK, Ticker, first_on_beat};

/// The answer to one request to the operating system.
#[derive(Clone, Debug, PartialEq, Eq)]
#[must_use]
pub enum RealtimeGrant {
    /// It holds from now on, for the thread (or process) that asked.
    Granted {
        /// What holds.
        what: String,
    },
    /// It does not hold.
    Waived {
        /// What was asked for.
        what: String,
        /// Why not, and how to mend it.
        why: String,
    },
}

impl RealtimeGrant {
    fn of(what: String, asked: Result<(), String>) -> Self {
        match asked {
            Ok(()) => Self::Granted { what },
            Err(why) => Self::Waived { what, why },
        }
    }

    /// True when the request was granted.
    #[must_use]
    pub fn is_granted(&self) -> bool {
        matches!(self, Self::Granted { .. })
    }
}

impl fmt::Display for RealtimeGrant {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Granted { what } => write!(out, "{what}: granted"),
            Self::Waived { what, why } => write!(out, "{what}: waived, {why}"),
        }
    }
}

/// Time of the monotonic clock that [`sleep_until`] waits on.
#[must_use]
pub fn monotonic_now() -> Duration {
    os::monotonic_now()
}

/// Sleeps until the monotonic clock reads `deadline`; returns at once when it has passed. An absolute
/// deadline does not drift, whatever the loop's own work takes.
pub fn sleep_until(deadline: Duration) {
    os::sleep_until(deadline);
}

/// Asks for the first-in-first-out real-time class at `priority` (1 to 99) for this thread.
pub fn request_fifo(priority: u8) -> RealtimeGrant {
    let what = format!("SCHED_FIFO priority {priority}");
    let advice = "run as root, or grant it: `ulimit -r 99` or LimitRTPRIO=99 in the service unit";
    let asked = os::request_fifo(priority).map_err(|why| format!("{why}; {advice}"));
    RealtimeGrant::of(what, asked)
}

/// Leaves the real-time class, which a thread inherits from the one that started it.
#[cfg(unix)]
pub(crate) fn leave_fifo() {
    os::leave_fifo();
}

/// Asks to keep all memory of this process in RAM, now and later.
pub fn lock_memory() -> RealtimeGrant {
    let what = "locked memory".to_owned();
    let advice = "grant it: `ulimit -l unlimited` or LimitMEMLOCK=infinity in the service unit";
    let asked = os::lock_memory().map_err(|why| format!("{why}; {advice}"));
    RealtimeGrant::of(what, asked)
}

/// Whether this process may lock any amount of memory; it locks none.
#[must_use]
pub fn may_lock_memory() -> bool {
    os::may_lock_memory()
}

/// Asks to run this thread on one core only, counted from 0.
pub fn pin_to_core(core: usize) -> RealtimeGrant {
    let what = format!("core {core}");
    let advice = "name a core that this process may use";
    let asked = os::pin_to_core(core).map_err(|why| format!("{why}; {advice}"));
    RealtimeGrant::of(what, asked)
}

/// Asks that sleeps of this thread end within a microsecond of their deadline, where the normal class
/// allows 50 us. Without effect, and without harm, in the real-time class.
pub fn sharpen_timers() -> RealtimeGrant {
    let what = "timer slack of 1 ns".to_owned();
    RealtimeGrant::of(what, os::sharpen_timers())
}

#[cfg(target_os = "linux")]
#[allow(
    unsafe_code,
    reason = "clock, scheduler and memory lock are system calls"
)]
mod os {
    use std::io;
    use std::time::Duration;

    pub(super) fn monotonic_now() -> Duration {
        let mut now = libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        // SAFETY: `now` is a valid timespec for the kernel to fill; CLOCK_MONOTONIC always exists.
        unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
        // The monotonic clock starts at boot: never negative.
        Duration::new(now.tv_sec.unsigned_abs(), now.tv_nsec as u32)
    }

    pub(super) fn sleep_until(deadline: Duration) {
        let until = libc::timespec {
            tv_sec: deadline.as_secs().min(i32::MAX as u64) as libc::time_t,
            tv_nsec: libc::c_long::from(deadline.subsec_nanos() as i32),
        };
        loop {
            // SAFETY: `until` is a valid timespec that outlives the call; an absolute sleep writes no remainder.
            let error = unsafe {
                libc::clock_nanosleep(
                    libc::CLOCK_MONOTONIC,
                    libc::TIMER_ABSTIME,
                    &raw const until,
                    std::ptr::null_mut(),
                )
            };
            // A signal wakes early; the deadline stays, so sleep on.
            if error != libc::EINTR {
                return;
            }
        }
    }

    pub(super) fn request_fifo(priority: u8) -> Result<(), String> {
        let parameters = libc::sched_param {
            sched_priority: i32::from(priority),
        };
        // SAFETY: `parameters` is valid for the call; 0 names the calling thread.
        done(unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) })
    }

    pub(super) fn leave_fifo() {
        let parameters = libc::sched_param { sched_priority: 0 };
        // SAFETY: `parameters` is valid for the call; 0 names the calling thread. Whoever may have a class may leave it.
        unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const parameters) };
    }

    pub(super) fn lock_memory() -> Result<(), String> {
        // Under a finite limit the lock might succeed now and let a later allocation fail: never that.
        if !may_lock_memory() {
            return Err("the limit on locked memory is finite".to_owned());
        }
        // SAFETY: takes flags only and changes no memory that Rust can see.
        done(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
    }

    /// Raises the limit where this process may.
    pub(super) fn may_lock_memory() -> bool {
        let unlimited = libc::rlimit {
            rlim_cur: libc::RLIM_INFINITY,
            rlim_max: libc::RLIM_INFINITY,
        };
        // SAFETY: `unlimited` is a valid rlimit for the call.
        let raised = unsafe { libc::setrlimit(libc::RLIMIT_MEMLOCK, &raw const unlimited) } == 0;
        raised || !memory_limit_binds()
    }

    /// Whether the limit on locked memory holds for this process: it does not for one with the capability to lock memory, which
    /// containers often have without that to raise limits. Tried with more address space than the limit, of which no page is ever used.
    fn memory_limit_binds() -> bool {
        let mut limit = libc::rlimit {
            rlim_cur: 0,
            rlim_max: 0,
        };
        // SAFETY: `limit` is a valid rlimit for the kernel to fill.
        if unsafe { libc::getrlimit(libc::RLIMIT_MEMLOCK, &raw mut limit) } != 0 {
            return true;
        }
        // A limit near the size of the address space finds no place, and then counts as one that binds.
        let Some(length) = usize::try_from(limit.rlim_cur)
            .ok()
            .and_then(|limit| limit.checked_add(1 << 20))
        else {
            return true;
        };
        // SAFETY: a new private mapping at an address of the kernel's choice, without any right of access; it overlaps nothing. Locked on
        // fault, so no page of it is made; unmapped at once, and nobody else knows of it.
        unsafe {
            let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_NORESERVE;
            let place = libc::mmap(std::ptr::null_mut(), length, libc::PROT_NONE, flags, -1, 0);
            if place == libc::MAP_FAILED {
                return true;
            }
            let locked = libc::mlock2(place, length, libc::MLOCK_ONFAULT) == 0;
            libc::munmap(place, length);
            !locked
        }
    }

    pub(super) fn pin_to_core(core: usize) -> Result<(), String> {
        if core >= libc::CPU_SETSIZE as usize {
            return Err(format!("there is no core {core}"));
        }
        // SAFETY: a zeroed cpu_set_t is the empty set, and `core` is inside it (checked above); 0 names the
        // calling thread.
        done(unsafe {
            let mut cores: libc::cpu_set_t = std::mem::zeroed();
            libc::CPU_SET(core, &mut cores);
            libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const cores)
        })
    }

    pub(super) fn sharpen_timers() -> Result<(), String> {
        // SAFETY: PR_SET_TIMERSLACK takes one integer and changes the calling thread only.
        done(unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, 1 as libc::c_ulong, 0, 0, 0) })
    }

    fn done(status: libc::c_int) -> Result<(), String> {
        if status == 0 {
            Ok(())
        } else {
            let error = io::Error::last_os_error();
            Err(match error.raw_os_error() {
                Some(libc::EPERM) => "this user may not".to_owned(),
                Some(libc::ENOMEM) => "the limit on locked memory is too low".to_owned(),
                _ => format!("the system refused ({error})"),
            })
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod os {
    use std::sync::OnceLock;
    use std::time::{Duration, Instant};

    static START: OnceLock<Instant> = OnceLock::new();

    pub(super) fn monotonic_now() -> Duration {
        START.get_or_init(Instant::now).elapsed()
    }

    pub(super) fn sleep_until(deadline: Duration) {
        std::thread::sleep(deadline.saturating_sub(monotonic_now()));
    }

    fn unknown() -> Result<(), String> {
        Err("known on Linux only".to_owned())
    }

    pub(super) fn request_fifo(_priority: u8) -> Result<(), String> {
        unknown()
    }

    /// Nobody is in it.
    pub(super) fn leave_fifo() {}

    pub(super) fn lock_memory() -> Result<(), String> {
        unknown()
    }

    pub(super) fn may_lock_memory() -> bool {
        false
    }

    pub(super) fn pin_to_core(_core: usize) -> Result<(), String> {
        unknown()
    }

    pub(super) fn sharpen_timers() -> Result<(), String> {
        unknown()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sleep_never_ends_before_its_deadline() {
        for delay_us in [0, 300, 2000] {
            let deadline = monotonic_now() + Duration::from_micros(delay_us);
            sleep_until(deadline);
            assert!(monotonic_now() >= deadline);
        }
        sleep_until(Duration::ZERO);
    }

    #[test]
    fn memory_is_locked_where_it_may_be_and_only_there() {
        // Locked for the whole process of this test binary, which is small.
        assert_eq!(lock_memory().is_granted(), may_lock_memory());
    }

    #[test]
    fn a_refused_request_says_why_and_how_to_mend_it() {
        let refused = pin_to_core(1_000_000);
        assert!(!refused.is_granted());
        assert!(refused.to_string().contains("there is no core"));
        // Above the largest priority: refused to everybody.
        assert!(request_fifo(200).to_string().contains("LimitRTPRIO"));
    }
}
