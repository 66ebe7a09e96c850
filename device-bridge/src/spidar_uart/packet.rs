//! Bytes of the boards' commands: board in bits 0 to 2 and command in bits 3 to 7 of the first, integers of 16 bits little-endian.

/// Asks a board what it is.
pub(crate) const INFO: u8 = 1;
/// Tells a board how long every command is, so that it can pass over those of others.
pub(crate) const SET_LENGTHS: u8 = 2;
/// Sets the currents, and asks for the counts.
pub(crate) const CURRENT: u8 = 6;
/// Commands, number 0 included.
pub(crate) const COMMANDS: usize = 12;
/// Boards on a line.
pub(crate) const MAX_BOARDS: u8 = 8;
/// Length of the answer to [`INFO`].
pub(crate) const INFO_ANSWER: usize = 7;
/// Zero bytes before and after the question for a board: they wake it, and clock its answer out.
pub(crate) const INFO_PADDING: (usize, usize) = (40, 26);

/// First byte of a packet.
pub(crate) fn header(board: u8, command: u8) -> u8 {
    command << 3 | board & 0b111
}

/// What a board is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardInfo {
    /// Number of the model, 1 to 7.
    pub model: u8,
    /// Targets that it interpolates between.
    pub targets: u8,
    /// Motors with their counters.
    pub motors: u8,
    /// Currents that it measures.
    pub currents: u8,
    /// Force sensors.
    pub forces: u8,
    /// Touch sensors.
    pub touches: u8,
}

impl BoardInfo {
    /// A board of a known model, as far as a cycle depends on it; `None` for another model.
    #[must_use]
    pub fn of_model(model: u8) -> Option<Self> {
        let (motors, forces) = match model {
            1 | 3 | 5 => (4, 0),
            2 | 4 | 6 => (3, 2),
            7 => (8, 4),
            _ => return None,
        };
        Some(Self {
            model,
            targets: 12,
            motors,
            currents: motors,
            forces,
            touches: 0,
        })
    }

    /// Reads the answer of `board`; `None` where it is none of a known model.
    #[must_use]
    pub fn parse(board: u8, answer: &[u8]) -> Option<Self> {
        let &[first, model, targets, motors, currents, forces, touches] = answer else {
            return None;
        };
        let known = Self::of_model(model)?;
        let fits = first == header(board, INFO) && (motors, forces) == (known.motors, known.forces);
        fits.then_some(Self {
            model,
            targets,
            motors,
            currents,
            forces,
            touches,
        })
    }

    /// The answer of `board`.
    #[must_use]
    pub fn answer(&self, board: u8) -> [u8; INFO_ANSWER] {
        [
            header(board, INFO),
            self.model,
            self.targets,
            self.motors,
            self.currents,
            self.forces,
            self.touches,
        ]
    }

    /// Length of every command with its first byte, by number.
    #[must_use]
    pub fn command_lengths(&self) -> [u8; COMMANDS] {
        let motors = 2 * self.motors;
        let jacobian = motors * self.forces;
        let force_control = if self.forces > 0 {
            motors + jacobian
        } else {
            motors
        };
        [
            1,
            1,
            1 + COMMANDS as u8,
            5 + motors + motors.max(jacobian),
            1,
            1 + 2 * motors,
            1 + motors,
            1 + motors + 3,
            1 + force_control + 3,
            2 + (2 * motors).max(8),
            3,
            2,
        ]
    }

    /// Length of the answer to `CURRENT`: positions, velocities, forces.
    #[must_use]
    pub fn cycle_answer(&self) -> usize {
        1 + 4 * usize::from(self.motors) + 2 * usize::from(self.forces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_bytes_are_these() {
        assert_eq!(
            (header(0, INFO), header(5, CURRENT), header(7, SET_LENGTHS)),
            (0x08, 0x35, 0x17)
        );
        let four = BoardInfo::parse(1, &[0x09, 5, 12, 4, 4, 0, 0]).expect("a board");
        assert_eq!(
            four.command_lengths(),
            [1, 1, 13, 21, 1, 17, 9, 12, 12, 18, 3, 2]
        );
        assert_eq!(four.cycle_answer(), 17);
        let eight = BoardInfo::of_model(7).expect("known");
        assert_eq!(eight.command_lengths()[usize::from(CURRENT)], 17);
        assert_eq!(eight.cycle_answer(), 41);
        for wrong in [
            &[0x08, 5, 12, 4, 4, 0, 0][..],
            &[0x09, 8, 12, 4, 4, 0, 0],
            &[0x09, 5, 12, 3, 4, 0, 0],
            &[0x09, 5, 12, 4, 4, 0],
        ] {
            assert_eq!(BoardInfo::parse(1, wrong), None, "{wrong:?}");
        }
    }
}
