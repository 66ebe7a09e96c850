//! The lock of everything that threads of different classes share at the server: it inherits priority.
//!
//! A thread of the real-time class that finds a lock held gives its own priority to the holder until that lets go, so that nothing of the normal
//! class comes between. An ordinary mutex does not: a holder that waits for a core keeps the real-time thread waiting for as long.
//! Without a rival, taking and leaving is one atomic operation each.
//!
//! Source: L. Sha, R. Rajkumar, J. P. Lehoczky, "Priority inheritance protocols", IEEE Trans. Computers 39(9), 1990; futex(2), `FUTEX_LOCK_PI`.

/// A mutex that inherits priority on Linux.
pub(crate) type Mutex<T> = lock_api::Mutex<os::Lock, T>;
/// What holds it.
pub(crate) type MutexGuard<'a, T> = lock_api::MutexGuard<'a, os::Lock, T>;

/// Takes the lock. A panic while it is held leaves it usable: no datum under it can be left half-changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock()
}

#[cfg(target_os = "linux")]
mod os {
    use linux_futex::{PiFutex, Private};
    use std::sync::atomic::Ordering;

    /// 0 while nobody holds it, else the thread's number, as the kernel wants it.
    #[derive(Debug)]
    pub(crate) struct Lock(PiFutex<Private>);

    thread_local! {
        static THREAD: u32 = thread_number();
    }

    #[allow(unsafe_code, reason = "the thread's number is asked by a system call")]
    fn thread_number() -> u32 {
        // SAFETY: takes nothing and never fails.
        let number = unsafe { libc::gettid() };
        number.unsigned_abs()
    }

    #[allow(
        unsafe_code,
        reason = "a raw lock promises exclusion by an unsafe trait"
    )]
    // SAFETY: the value names the one thread that may be inside. It is set by a compare-exchange from 0, or by the kernel, which hands it to one waiter;
    // it is cleared by its holder alone, whose guard cannot leave its thread (`GuardNoSend`).
    unsafe impl lock_api::RawMutex for Lock {
        #[allow(
            clippy::declare_interior_mutable_const,
            reason = "the form of `lock_api`"
        )]
        const INIT: Lock = Lock(PiFutex::new(0));

        type GuardMarker = lock_api::GuardNoSend;

        fn lock(&self) {
            if self.try_lock() {
                return;
            }
            // `TryAgain`: the holder is about to exit.
            while self.0.lock_pi().is_err() {}
        }

        fn try_lock(&self) -> bool {
            let me = THREAD.with(|number| *number);
            let taken = self
                .0
                .value
                .compare_exchange(0, me, Ordering::Acquire, Ordering::Relaxed);
            taken.is_ok()
        }

        unsafe fn unlock(&self) {
            let me = THREAD.with(|number| *number);
            // Somebody waits: the kernel chooses whom to wake, and takes the priority back.
            let left = self
                .0
                .value
                .compare_exchange(me, 0, Ordering::Release, Ordering::Relaxed);
            if left.is_err() {
                self.0.unlock_pi();
            }
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod os {
    /// No thread has a real-time class here.
    pub(crate) type Lock = parking_lot::RawMutex;
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::{
        fs,
        sync::{
            Arc,
            atomic::{AtomicU32, Ordering},
        },
        thread,
        time::{Duration, Instant},
    };

    #[test]
    fn threads_exclude_each_other() {
        let shared = Arc::new(Mutex::new(0_u64));
        let workers: Vec<_> = (0..4)
            .map(|worker| {
                let shared = shared.clone();
                let work = move || {
                    for _ in 0..20_000 {
                        let mut value = lock(&shared);
                        let before = *value;
                        std::hint::black_box(worker);
                        *value = before + 1;
                    }
                };
                thread::Builder::new().spawn(work).expect("a thread")
            })
            .collect();
        for worker in workers {
            worker.join().expect("no panic");
        }
        assert_eq!(*lock(&shared), 80_000);
    }

    #[test]
    fn a_panic_under_the_lock_leaves_it_usable() {
        let shared = Arc::new(Mutex::new(1));
        let of_thread = shared.clone();
        let work = move || {
            let _held = lock(&of_thread);
            panic!("on purpose");
        };
        let ended = thread::Builder::new().spawn(work).expect("a thread").join();
        assert!(ended.is_err());
        assert_eq!(*lock(&shared), 1);
    }

    /// Field 18 of `/proc/self/task/TID/stat`: below 0 for the real-time class, as the thread is scheduled now.
    fn effective_priority(thread: u32) -> i32 {
        let stat = fs::read_to_string(format!("/proc/self/task/{thread}/stat")).expect("running");
        let (_, fields) = stat.rsplit_once(") ").expect("a name");
        let field = fields.split(' ').nth(15).expect("18 fields");
        field.parse().expect("a number")
    }

    #[test]
    fn who_holds_it_runs_at_the_priority_of_who_waits() {
        let shared = Arc::new(Mutex::new(()));
        let holder = Arc::new(AtomicU32::new(0));
        let held = lock(&shared);
        #[allow(unsafe_code, reason = "the thread's number is asked by a system call")]
        // SAFETY: takes nothing and never fails.
        let me = unsafe { libc::gettid() }.unsigned_abs();
        let before = effective_priority(me);
        let (of_thread, granted) = (shared.clone(), holder.clone());
        let waiting = move || {
            let raised = crate::realtime::raise(10);
            granted.store(if raised.is_some() { 1 } else { 2 }, Ordering::Release);
            drop(lock(&of_thread));
        };
        let waiter = thread::Builder::new().spawn(waiting).expect("a thread");
        let end = Instant::now() + Duration::from_secs(10);
        while holder.load(Ordering::Acquire) == 0 {
            thread::sleep(Duration::from_millis(1));
        }
        if holder.load(Ordering::Acquire) == 1 {
            // -11 is SCHED_FIFO 10.
            while effective_priority(me) != -11 && Instant::now() < end {
                thread::sleep(Duration::from_millis(1));
            }
            assert_eq!(effective_priority(me), -11, "was {before}");
        }
        drop(held);
        waiter.join().expect("no panic");
        assert_eq!(effective_priority(me), before);
    }
}
