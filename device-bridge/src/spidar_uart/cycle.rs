//! The boards of a line: what a cycle sends, and what it must be answered to the byte.
//!
//! ```text
//!   host   [6|0] currents 00 .. 00 [6|1] currents 00 .. 00 [1|0] 00 00 00 00 00
//!   boards                [6|0] positions velocities  [6|1] positions velocities [1|0] model targets motors currents ..
//! ```
//!
//! Each byte of the host clocks one byte of an answer out. There is no checksum. What frames an answer is that the first bytes of the last
//! one, which are known, stand where they must: a byte more or less anywhere before puts others there.

use taut_spidar::STRINGS;

use super::packet::{BoardInfo, CURRENT, INFO, INFO_ANSWER, SET_LENGTHS, header};

/// Zero bytes after the last command of a cycle.
const LAST_PADDING: usize = 5;
/// Fewest zero bytes after a command, and how many more than the answer needs.
const PADDING: (usize, usize) = (5, 20);
/// Bytes of the last answer that are waited for: its first byte clocks one, the zero bytes the others.
const CLOSING: usize = LAST_PADDING;

/// Why an answer is not believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BrokenCycle {
    /// Bytes are missing.
    #[error("the motor boards did not answer in full")]
    Short,
    /// Bytes that cannot stand where they do.
    #[error("the motor boards' answer is damaged")]
    Damaged,
}

/// The boards that a line has, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cycle {
    boards: Vec<(u8, BoardInfo)>,
}

impl Cycle {
    /// Of boards with their numbers on the line; `None` unless they have eight motors together.
    #[must_use]
    pub fn new(boards: Vec<(u8, BoardInfo)>) -> Option<Self> {
        let motors: usize = boards
            .iter()
            .map(|(_, info)| usize::from(info.motors))
            .sum();
        (motors == STRINGS).then_some(Self { boards })
    }

    /// Tells every board the lengths of its commands.
    pub fn set_up(&self, out: &mut Vec<u8>) {
        out.clear();
        for (board, info) in &self.boards {
            out.push(header(*board, SET_LENGTHS));
            out.extend(info.command_lengths());
        }
        out.resize(out.len() + LAST_PADDING, 0);
    }

    /// The bytes of one cycle with `currents`, digits.
    pub fn send(&self, currents: &[i16; STRINGS], out: &mut Vec<u8>) {
        out.clear();
        let mut motor = 0;
        for (board, info) in &self.boards {
            let begin = out.len();
            out.push(header(*board, CURRENT));
            for current in &currents[motor..motor + usize::from(info.motors)] {
                out.extend(current.to_le_bytes());
            }
            motor += usize::from(info.motors);
            let sent = out.len() - begin;
            let padding = (info.cycle_answer() + PADDING.1)
                .saturating_sub(sent)
                .max(PADDING.0);
            out.resize(out.len() + padding, 0);
        }
        if let Some((first, _)) = self.boards.first() {
            out.push(header(*first, INFO));
        }
        out.resize(out.len() + LAST_PADDING, 0);
    }

    /// Reads what came since the last cycle: counters of 16 bits, by motor. It may begin with what was left of the last answer before.
    ///
    /// # Errors
    /// [`BrokenCycle`]: nothing of it is believed.
    pub fn hear(&self, bytes: &[u8]) -> Result<[i16; STRINGS], BrokenCycle> {
        let (first, info) = self.boards.first().ok_or(BrokenCycle::Short)?;
        let closing = info.answer(*first);
        // The last answer of the cycle before, as far as it was not clocked out then.
        let left = (0..=INFO_ANSWER - CLOSING)
            .rev()
            .find(|left| bytes.starts_with(&closing[INFO_ANSWER - left..]))
            .unwrap_or(0);
        // Where nothing was left, the last byte of that answer may still begin alike: an answer begins by its first byte.
        let mut rest = &bytes[left..];
        let mut counters = [0; STRINGS];
        let mut motor = 0;
        for (board, info) in &self.boards {
            let length = info.cycle_answer();
            let (answer, after) = rest.split_at_checked(length).ok_or(BrokenCycle::Short)?;
            if answer[0] != header(*board, CURRENT) {
                return Err(BrokenCycle::Damaged);
            }
            let positions = answer[1..].chunks_exact(2).take(usize::from(info.motors));
            for position in positions {
                counters[motor] = i16::from_le_bytes([position[0], position[1]]);
                motor += 1;
            }
            rest = after;
        }
        match rest.len() {
            0..CLOSING => Err(BrokenCycle::Short),
            CLOSING..=INFO_ANSWER if closing.starts_with(rest) => Ok(counters),
            _ => Err(BrokenCycle::Damaged),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_boards() -> Cycle {
        let four = BoardInfo::of_model(5).expect("known");
        Cycle::new(vec![(0, four), (1, four)]).expect("eight motors")
    }

    #[test]
    fn a_cycle_has_the_published_length_and_bytes() {
        let mut out = Vec::new();
        let currents = [1, -2, 300, 0, 5, 6, 7, -4095];
        two_boards().send(&currents, &mut out);
        assert_eq!(out.len(), 80, "0.40 ms at 2,000,000 baud");
        assert_eq!(out[..9], [0x30, 1, 0, 0xfe, 0xff, 0x2c, 1, 0, 0]);
        assert_eq!(out[9..37], [0; 28]);
        assert_eq!(out[37..46], [0x31, 5, 0, 6, 0, 7, 0, 0x01, 0xf0]);
        assert_eq!(out[74..], [0x08, 0, 0, 0, 0, 0]);
        let eight = BoardInfo::of_model(7).expect("known");
        Cycle::new(vec![(3, eight)])
            .expect("eight")
            .send(&currents, &mut out);
        assert_eq!(out.len(), 67, "0.34 ms");
        two_boards().set_up(&mut out);
        assert_eq!(out[..13], [0x10, 1, 1, 13, 21, 1, 17, 9, 12, 12, 18, 3, 2]);
        let three = BoardInfo::of_model(2).expect("known");
        assert_eq!(
            Cycle::new(vec![(0, three)]),
            None,
            "three motors are too few"
        );
    }

    fn answer() -> Vec<u8> {
        let mut bytes = Vec::new();
        for (board, first) in [(0, -2_i16), (1, 1000)] {
            bytes.push(header(board, CURRENT));
            for motor in 0..4_i16 {
                bytes.extend((first + motor).to_le_bytes());
            }
            bytes.extend([0; 8]);
        }
        bytes.extend([0x08, 5, 12, 4, 4]);
        bytes
    }

    #[test]
    fn an_answer_is_read_whole_or_not_at_all() {
        let cycle = two_boards();
        let good = answer();
        let wanted = Ok([-2, -1, 0, 1, 1000, 1001, 1002, 1003]);
        assert_eq!(cycle.hear(&good), wanted);
        let with_rest: Vec<u8> = [&[0, 0][..], &good].concat();
        assert_eq!(
            cycle.hear(&with_rest),
            wanted,
            "the rest of the answer before"
        );
        assert_eq!(
            cycle.hear(&[&good[..], &[0, 0]].concat()),
            wanted,
            "in full"
        );
        for at in 0..good.len() {
            let mut short = good.clone();
            short.remove(at);
            assert!(cycle.hear(&short).is_err(), "a byte lost at {at}");
            let mut long = good.clone();
            long.insert(at, 0xa5);
            assert!(cycle.hear(&long).is_err(), "a byte more at {at}");
            assert!(cycle.hear(&good[..at]).is_err(), "cut at {at}");
        }
        assert!(
            cycle.hear(&[&good[..], &good[..]].concat()).is_err(),
            "doubled"
        );
    }
}
