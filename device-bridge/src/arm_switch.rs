//! Anybody → the loop of a device: the wish for force or for none.
//!
//! * Writers: whoever hears the operator (network, console).
//! * Reader: the loop that ticks the port, which takes each wish once.

use std::io::{BufRead, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// What an operator wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmWish {
    /// Force.
    Arm,
    /// No force.
    Disarm,
}

/// A wish for force waits.
const ARM: u8 = 1;
/// A wish for no force waits.
const DISARM: u8 = 2;
/// The last wish was for no force.
const OFF: u8 = 4;

/// Carries the newest wish. Lock-free; share it by `Arc`.
#[derive(Debug, Default)]
pub struct ArmSwitch {
    /// What waits, and what was wished last: of several who wish at once both are one's.
    wish: AtomicU8,
}

impl ArmSwitch {
    /// Makes a wish. A wish for no force that was not yet taken is not undone by one for force.
    pub fn wish(&self, wish: ArmWish) {
        match wish {
            ArmWish::Arm => self.change(|known| if known & DISARM == 0 { ARM } else { known }),
            ArmWish::Disarm => self.change(|_| DISARM | OFF),
        }
    }

    /// For the next session of the same process: a wish for force of before does not count, and where the last one was for no force it stands.
    pub fn begin_again(&self) {
        self.change(|known| if known & OFF == 0 { 0 } else { DISARM | OFF });
    }

    /// Takes the wish, if there is one.
    pub fn take(&self) -> Option<ArmWish> {
        match self.wish.fetch_and(OFF, Ordering::Relaxed) & !OFF {
            ARM => Some(ArmWish::Arm),
            DISARM => Some(ArmWish::Disarm),
            _ => None,
        }
    }

    /// In one step, whoever else wishes.
    fn change(&self, to: impl Fn(u8) -> u8) {
        let [set, seen] = [Ordering::Relaxed; 2];
        let _ = self.wish.fetch_update(set, seen, |known| Some(to(known))); // there is always one
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
    fn of_several_who_wish_at_once_the_one_for_no_force_lasts() {
        for _ in 0..2000 {
            let switch = ArmSwitch::default();
            std::thread::scope(|scope| {
                for wish in [ArmWish::Arm, ArmWish::Disarm, ArmWish::Arm] {
                    let switch = &switch;
                    scope.spawn(move || switch.wish(wish));
                }
            });
            assert_eq!(switch.take(), Some(ArmWish::Disarm));
            switch.begin_again();
            assert_eq!(switch.take(), Some(ArmWish::Disarm), "in the next session");
        }
    }

    #[test]
    fn two_words_are_understood() {
        assert_eq!(wish_of(" arm\r"), Some(ArmWish::Arm));
        assert_eq!(wish_of("off"), Some(ArmWish::Disarm));
        assert_eq!(wish_of(""), None);
    }
}
