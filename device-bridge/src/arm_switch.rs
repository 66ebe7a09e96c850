//! Anybody → the loop of a device: the wish for force or for none.
//!
//! * Writers: whoever hears the operator (network, console).
//! * Reader: the loop that ticks the port, which takes each wish once.

use std::io::{BufRead, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// What an operator wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmWish {
    /// Force.
    Arm,
    /// No force.
    Disarm,
}

const NOTHING: u8 = 0;
const ARM: u8 = 1;
const DISARM: u8 = 2;

/// Carries the newest wish. Wait-free; share it by `Arc`.
#[derive(Debug, Default)]
pub struct ArmSwitch {
    wish: AtomicU8,
    /// The last wish was for no force.
    off: AtomicBool,
}

impl ArmSwitch {
    /// Makes a wish. A wish for no force that was not yet taken is not undone by one for force.
    pub fn wish(&self, wish: ArmWish) {
        match wish {
            ArmWish::Arm => {
                // Fails where another wish waits: that one stands.
                let made =
                    self.wish
                        .compare_exchange(NOTHING, ARM, Ordering::Relaxed, Ordering::Relaxed);
                if made.is_ok() {
                    self.off.store(false, Ordering::Relaxed);
                }
            }
            ArmWish::Disarm => {
                self.off.store(true, Ordering::Relaxed);
                self.wish.store(DISARM, Ordering::Relaxed);
            }
        }
    }

    /// For the next session of the same process: a wish for force of before does not count, and where the last one was for no force it stands.
    pub fn begin_again(&self) {
        let _ = self.take();
        if self.off.load(Ordering::Relaxed) {
            self.wish(ArmWish::Disarm);
        }
    }

    /// Takes the wish, if there is one.
    pub fn take(&self) -> Option<ArmWish> {
        match self.wish.swap(NOTHING, Ordering::Relaxed) {
            ARM => Some(ArmWish::Arm),
            DISARM => Some(ArmWish::Disarm),
            _ => None,
        }
    }
}

/// Lets lines that are typed at the terminal move `switch`: `arm`, and `off` for no force. Where standard input is no terminal nobody
/// types.
pub fn listen_at_console(switch: &Arc<ArmSwitch>) {
    if !std::io::stdin().is_terminal() {
        return;
    }
    let typed = Arc::clone(switch);
    // The thread ends with the process, or where there is nothing more to read.
    let thread = std::thread::Builder::new()
        .name("console".to_owned())
        .spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                match wish_of(&line) {
                    Some(wish) => typed.wish(wish),
                    None => taut_log::say("type `arm` for force, `off` for none"),
                }
            }
        });
    if let Err(error) = thread {
        tracing::warn!("nobody listens at the console ({error}); arm by button or by `taut arm`");
    }
}

fn wish_of(line: &str) -> Option<ArmWish> {
    match line.trim() {
        "arm" => Some(ArmWish::Arm),
        "off" => Some(ArmWish::Disarm),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wish_is_taken_once_and_no_force_goes_first() {
        let switch = Arc::<ArmSwitch>::default();
        let other = Arc::clone(&switch);
        assert_eq!(switch.take(), None);
        other.wish(ArmWish::Arm);
        assert_eq!(switch.take(), Some(ArmWish::Arm));
        assert_eq!(switch.take(), None);
        other.wish(ArmWish::Disarm);
        other.wish(ArmWish::Arm);
        assert_eq!(switch.take(), Some(ArmWish::Disarm));
    }

    #[test]
    fn no_force_lasts_into_the_next_session_and_force_does_not() {
        let switch = ArmSwitch::default();
        switch.begin_again();
        assert_eq!(switch.take(), None);
        switch.wish(ArmWish::Arm);
        switch.begin_again();
        assert_eq!(switch.take(), None);
        switch.wish(ArmWish::Disarm);
        assert_eq!(switch.take(), Some(ArmWish::Disarm));
        for _ in 0..2 {
            switch.begin_again();
            assert_eq!(switch.take(), Some(ArmWish::Disarm), "also of long ago");
        }
        switch.wish(ArmWish::Arm);
        assert_eq!(switch.take(), Some(ArmWish::Arm));
        switch.begin_again();
        assert_eq!(switch.take(), None);
    }

    #[test]
    fn two_words_are_understood() {
        assert_eq!(wish_of(" arm\r"), Some(ArmWish::Arm));
        assert_eq!(wish_of("off"), Some(ArmWish::Disarm));
        assert_eq!(wish_of(""), None);
    }
}
