//! Deadlines and the real-time class, so that what is measured is the network and not who else wants the processor.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::time::{Duration, Instant};

/// Asks for the first-in-first-out class at this priority for this thread and those that it will make; whether it was granted.
#[must_use]
pub fn request_fifo(priority: u8) -> bool {
    let parameters = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    #[allow(unsafe_code, reason = "no safe library asks for the real-time class")]
    // SAFETY: `parameters` is valid through the call, which changes nothing but this thread's class.
    let answer = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameters) };
    answer == 0
}

/// Keeps idle processors from sleeping deeply while it is held, as `taut serve` does; `None` where the system refuses it.
pub fn keep_cores_awake() -> Option<File> {
    let mut held = OpenOptions::new()
        .write(true)
        .open("/dev/cpu_dma_latency")
        .ok()?;
    held.write_all(&0_i32.to_ne_bytes()).ok()?;
    Some(held)
}

/// Deadlines one period apart. One that is missed is skipped, not caught up.
#[derive(Clone, Copy, Debug)]
pub struct Ticker {
    period: Duration,
    next: Instant,
}

impl Ticker {
    /// The first deadline is one period from now.
    pub fn new(period: Duration) -> Ticker {
        Ticker {
            period,
            next: Instant::now() + period,
        }
    }

    /// Sleeps to the next deadline.
    pub fn wait(&mut self) {
        let now = Instant::now();
        if self.next > now {
            std::thread::sleep(self.next - now);
            self.next += self.period;
        } else {
            self.next = now + self.period;
        }
    }
}
