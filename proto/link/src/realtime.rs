//! The real-time class for a while: what comes between a datagram and the swap of a frame is not to wait for anybody's compiler.

/// The calling thread is of the real-time class until this is dropped, on the same thread.
#[derive(Debug)]
pub(crate) struct Raised(());

/// Asks for the class that is first in, first out, at `priority`; `None` where the system refuses it, or where the thread has a real-time class
/// already. Threads that it makes do not inherit it.
pub(crate) fn raise(priority: u8) -> Option<Raised> {
    // Not made before it is true: dropped, it lowers.
    os::raise(priority).then(|| Raised(()))
}

impl Drop for Raised {
    fn drop(&mut self) {
        os::lower();
    }
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code, reason = "the scheduler is asked by system calls")]
mod os {
    pub(super) fn raise(priority: u8) -> bool {
        // SAFETY: takes numbers only; 0 names the calling thread.
        let present = unsafe { libc::sched_getscheduler(0) };
        present == libc::SCHED_OTHER
            && set(
                libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK,
                libc::c_int::from(priority),
            )
    }

    pub(super) fn lower() {
        set(libc::SCHED_OTHER, 0); // never refused: it is what every thread has
    }

    fn set(class: libc::c_int, priority: libc::c_int) -> bool {
        let parameters = libc::sched_param {
            sched_priority: priority,
        };
        // SAFETY: `parameters` is valid for the call; 0 names the calling thread.
        let answer = unsafe { libc::sched_setscheduler(0, class, &raw const parameters) };
        answer == 0
    }
}

#[cfg(not(target_os = "linux"))]
mod os {
    pub(super) fn raise(_priority: u8) -> bool {
        false
    }

    pub(super) fn lower() {}
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    fn class() -> libc::c_int {
        #[allow(unsafe_code, reason = "the scheduler is asked by system calls")]
        // SAFETY: takes numbers only; 0 names the calling thread.
        let class = unsafe { libc::sched_getscheduler(0) };
        class & !libc::SCHED_RESET_ON_FORK
    }

    #[test]
    fn the_class_is_as_before_when_it_is_over_and_a_higher_one_is_left_alone() {
        let before = class();
        let raised = raise(1);
        assert_eq!(raised.is_some(), class() == libc::SCHED_FIFO);
        if raised.is_some() {
            assert!(raise(2).is_none(), "it has it already");
            assert_eq!(class(), libc::SCHED_FIFO, "and keeps it");
        }
        drop(raised);
        assert_eq!(class(), before);
    }
}
