//! Buttons: the change of one, or the state of all.

use crate::PayloadError;
use crate::message::Fields;

/// The type of a [`ButtonChange`].
pub const CHANGE: &str = "vrpn_Button Change";
/// The type of [`ButtonStates`].
pub const STATES: &str = "vrpn_Button States";

/// Most buttons of a device, as the protocol has it.
pub const MAX_BUTTONS: i32 = 256;

/// One button went down or up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ButtonChange {
    /// Which, from 0.
    pub button: i32,
    /// Whether it is down now.
    pub pressed: bool,
}

/// All buttons of a device; sent at the start of a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ButtonStates(
    /// Whether each is down.
    pub Vec<bool>,
);

impl ButtonChange {
    /// Reads a payload of 8 bytes: number and state.
    ///
    /// # Errors
    /// [`PayloadError`] where it is shorter.
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let mut fields = Fields(payload);
        match (fields.i32(), fields.i32()) {
            (Some(button), Some(state)) => Ok(Self {
                button,
                pressed: state != 0,
            }),
            _ => Err(PayloadError::of(payload, "change of a button")),
        }
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        [self.button, i32::from(self.pressed)]
            .iter()
            .flat_map(|number| number.to_be_bytes())
            .collect()
    }
}

impl ButtonStates {
    /// Reads a payload: how many, then one number each.
    ///
    /// # Errors
    /// [`PayloadError`] for a count below zero, above [`MAX_BUTTONS`] or beyond the payload.
    pub fn decode(payload: &[u8]) -> Result<Self, PayloadError> {
        let error = PayloadError::of(payload, "state of buttons");
        let mut fields = Fields(payload);
        let count = fields.i32().ok_or(error)?;
        if !(0..=MAX_BUTTONS).contains(&count) {
            return Err(error);
        }
        (0..count)
            .map(|_| fields.i32().map(|state| state != 0))
            .collect::<Option<_>>()
            .map(Self)
            .ok_or(error)
    }

    /// The payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        std::iter::once(self.0.len() as i32)
            .chain(self.0.iter().map(|pressed| i32::from(*pressed)))
            .flat_map(i32::to_be_bytes)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_and_states_come_back() {
        let change = ButtonChange {
            button: 3,
            pressed: true,
        };
        assert_eq!(ButtonChange::decode(&change.encode()), Ok(change));
        let states = ButtonStates(vec![true, false, true]);
        assert_eq!(ButtonStates::decode(&states.encode()), Ok(states));
    }

    #[test]
    fn counts_that_lie_are_errors() {
        for count in [-1_i32, 2, 257] {
            let mut payload = count.to_be_bytes().to_vec();
            payload.extend([0; 4]);
            assert!(ButtonStates::decode(&payload).is_err(), "{count}");
        }
        assert!(ButtonChange::decode(&[0; 7]).is_err());
    }
}
