//! The buttons of a device that mean something to the port: the dead-man's, and the one that arms.

/// Watches two buttons. A number beyond the buttons is a button that nobody can hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Buttons {
    dead_man: Option<u8>,
    arm: Option<u8>,
    before: Option<u16>,
}

impl Buttons {
    pub(super) fn new(dead_man: Option<u8>, arm: Option<u8>) -> Self {
        Self {
            dead_man,
            arm,
            before: None,
        }
    }

    /// `down` are the buttons that are pressed, if that is known. Whether the dead-man's button is held (or there is none), and whether
    /// a button that arms was pressed just now: the dead-man's does too.
    pub(super) fn step(&mut self, down: Option<u16>) -> (bool, bool) {
        let Some(down) = down else {
            return (self.dead_man.is_none(), false);
        };
        // What is held at the start was not pressed.
        let pressed = down & !self.before.replace(down).unwrap_or(u16::MAX);
        let held = self.dead_man.is_none_or(|number| is_in(down, number));
        let arms = [self.dead_man, self.arm];
        let armed = arms
            .into_iter()
            .flatten()
            .any(|number| is_in(pressed, number));
        (held, armed)
    }
}

fn is_in(buttons: u16, number: u8) -> bool {
    u32::from(number) < u16::BITS && buttons >> number & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_button_is_pressed_once_and_held_as_long_as_it_is_down() {
        let mut buttons = Buttons::new(Some(1), Some(3));
        assert_eq!(buttons.step(None), (false, false), "nobody knows");
        assert_eq!(buttons.step(Some(0b0010)), (true, false), "held before");
        assert_eq!(buttons.step(Some(0)), (false, false));
        assert_eq!(buttons.step(Some(0b0010)), (true, true));
        assert_eq!(buttons.step(Some(0b0010)), (true, false));
        assert_eq!(buttons.step(Some(0b1010)), (true, true), "the other one");
    }

    #[test]
    fn without_a_dead_mans_button_it_is_always_held_and_one_beyond_the_last_never() {
        assert_eq!(Buttons::new(None, None).step(Some(0)), (true, false));
        assert_eq!(
            Buttons::new(Some(16), None).step(Some(u16::MAX)),
            (false, false)
        );
    }
}
