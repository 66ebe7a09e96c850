//! Which thread receives datagrams: the one that is for it, or the one that draws, while it waits for the RELEASE of its frame.
//!
//! A RELEASE that one thread receives and another one waits for costs a wake-up more, and what wake-ups take is what sets the nodes' swaps apart.
//! So the thread that draws asks for the seat when it begins to wait, and is given it after the next datagram; there is one receiver at any time,
//! and datagrams are taken in the order in which they came. It gives the seat back when the frame is shown.

use super::inbound::lock;
use std::{
    sync::{
        Condvar, Mutex, PoisonError,
        atomic::{AtomicU8, Ordering},
    },
    time::Duration,
};

/// The receiving thread has it.
const AT_RECEIVER: u8 = 0;
/// It has it still, and is asked for it.
const ASKED: u8 = 1;
/// The thread that draws has it.
const AT_DRAWER: u8 = 2;

#[derive(Default)]
pub(crate) struct Seat {
    holder: AtomicU8,
    /// For the receiving thread, while it has nothing to receive.
    idle: Mutex<()>,
    given_back: Condvar,
}

impl Seat {
    /// The thread that draws begins to wait.
    pub(crate) fn ask(&self) {
        let _ =
            self.holder
                .compare_exchange(AT_RECEIVER, ASKED, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Whether the thread that draws is the receiver now; until it says otherwise.
    pub(crate) fn is_at_drawer(&self) -> bool {
        self.holder.load(Ordering::Acquire) == AT_DRAWER
    }

    /// The thread that draws waits no more. The receiving thread is not woken: what it does now would come between here and the swap. It
    /// finds out by itself within its own wait, or by [`Seat::wake_receiver`].
    pub(crate) fn give_back(&self) {
        self.holder.store(AT_RECEIVER, Ordering::Release);
    }

    /// The swap was called: whoever receives may go on.
    pub(crate) fn wake_receiver(&self) {
        // A notice between its look and its wait would be missed.
        drop(lock(&self.idle));
        self.given_back.notify_one();
    }

    /// For the receiving thread, between two datagrams: whether it leaves the seat now, because it was asked for it.
    pub(crate) fn leave(&self) -> bool {
        let left =
            self.holder
                .compare_exchange(ASKED, AT_DRAWER, Ordering::AcqRel, Ordering::Relaxed);
        left.is_ok()
    }

    /// For the receiving thread: waits until it has the seat again, for at most `longest`; whether it has.
    pub(crate) fn wait(&self, longest: Duration) -> bool {
        let idle = lock(&self.idle);
        if self.is_at_drawer() {
            drop(
                self.given_back
                    .wait_timeout(idle, longest)
                    .unwrap_or_else(PoisonError::into_inner),
            );
        }
        !self.is_at_drawer()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn one_has_the_seat_at_any_time_and_it_is_left_only_when_asked_for() {
        let seat = Seat::default();
        assert!(!seat.leave() && seat.wait(Duration::ZERO));
        seat.ask();
        assert!(
            !seat.is_at_drawer() && seat.wait(Duration::ZERO),
            "it receives on"
        );
        assert!(seat.leave() && seat.is_at_drawer());
        assert!(!seat.leave() && !seat.wait(Duration::ZERO));
        seat.ask(); // it has it
        assert!(seat.is_at_drawer());
        seat.give_back();
        assert!(seat.wait(Duration::ZERO) && !seat.leave());
        seat.ask();
        seat.give_back(); // not needed any more
        assert!(!seat.leave());
    }

    #[test]
    fn the_receiver_goes_on_when_it_is_told_and_does_not_sleep_for_ever_when_not() {
        let seat = Seat::default();
        seat.ask();
        assert!(seat.leave());
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| {
                let began = Instant::now();
                while !seat.wait(Duration::from_secs(60)) {}
                began.elapsed()
            });
            std::thread::sleep(Duration::from_millis(20));
            seat.give_back();
            seat.wake_receiver();
            let waited = waiting.join().expect("it ends");
            assert!(waited < Duration::from_secs(50), "{waited:?}");
        });
        seat.ask();
        assert!(seat.leave());
        assert!(!seat.wait(Duration::from_millis(1)));
    }
}
