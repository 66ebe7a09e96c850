//! Anybody → haptics loop: the wish for force or for none.
//!
//! * Writers: whoever hears the operator (network, console).
//! * Reader: the haptics loop, which takes each wish once.

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

const NOTHING: u8 = 0;
const ARM: u8 = 1;
const DISARM: u8 = 2;

/// Carries the newest wish; clones carry the same one. Wait-free.
#[derive(Clone, Debug, Default)]
pub struct ArmSwitch(Arc<AtomicU8>);

impl ArmSwitch {
    /// Makes a wish. A wish for no force that was not yet taken is not undone by one for force.
    pub fn wish(&self, wish: ArmWish) {
        match wish {
            ArmWish::Arm => {
                // Fails where another wish waits: that one stands.
                let _ = self
                    .0
                    .compare_exchange(NOTHING, ARM, Ordering::Relaxed, Ordering::Relaxed);
            }
            ArmWish::Disarm => self.0.store(DISARM, Ordering::Relaxed),
        }
    }

    /// Takes the wish, if there is one.
    pub fn take(&self) -> Option<ArmWish> {
        match self.0.swap(NOTHING, Ordering::Relaxed) {
            ARM => Some(ArmWish::Arm),
            DISARM => Some(ArmWish::Disarm),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wish_is_taken_once_and_no_force_goes_first() {
        let switch = ArmSwitch::default();
        let other = switch.clone();
        assert_eq!(switch.take(), None);
        other.wish(ArmWish::Arm);
        assert_eq!(switch.take(), Some(ArmWish::Arm));
        assert_eq!(switch.take(), None);
        other.wish(ArmWish::Disarm);
        other.wish(ArmWish::Arm);
        assert_eq!(switch.take(), Some(ArmWish::Disarm));
    }
}
