//! HID reports: seven integers of 16 bits, little-endian, each way. A Teensy's are longer, and say nothing behind them.

/// Length of what a board says.
pub(crate) const BOARD: usize = 14;
/// Length of a Teensy's reports, either way, without a number.
pub(crate) const TEENSY: usize = 64;
/// Length of a report of the host, its number 0 included.
pub(crate) const HOST: usize = 15;
/// Sets the encoders' counters.
const SET_COUNTERS: i16 = 1;
/// What a pressed button adds to counter d.
const PRESSED: i16 = 10_000;

/// What the board says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardReport {
    /// Counters a to f: three motors, three of the wrist.
    pub encoders: [i16; 6],
    /// 1 from the board's own button for calibration on, until the counters are set.
    pub info: i16,
    /// Whether the button at the handle is pressed.
    pub button: bool,
}

impl BoardReport {
    /// Reads one; `None` where it has neither 14 bytes nor a Teensy's 64.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let is_whole = [BOARD, TEENSY].contains(&bytes.len());
        let bytes: &[u8; BOARD] = bytes.first_chunk().filter(|_| is_whole)?;
        let word = |i: usize| i16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]);
        let mut encoders: [i16; 6] = std::array::from_fn(word);
        let button = encoders[3] > PRESSED / 2;
        if button {
            encoders[3] -= PRESSED;
        }
        Some(Self {
            encoders,
            info: word(6),
            button,
        })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; BOARD] {
        let [a, b, c, d, e, f] = self.encoders;
        let pressed = if self.button { PRESSED } else { 0 };
        let words = [a, b, c, d.wrapping_add(pressed), e, f, self.info];
        std::array::from_fn(|i| words[i / 2].to_le_bytes()[i % 2])
    }
}

/// What the host says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostReport {
    /// Currents of the three motors, mA.
    Currents([i16; 3]),
    /// From now on the counters are these.
    SetCounters([i16; 6]),
}

impl HostReport {
    /// Its bytes, the report's number first.
    #[must_use]
    pub fn bytes(&self) -> [u8; HOST] {
        let words = match *self {
            Self::Currents([x, y, z]) => [x, y, z, 0, 0, 0, 0],
            Self::SetCounters([a, b, c, d, e, f]) => [d, e, f, SET_COUNTERS, a, b, c],
        };
        std::array::from_fn(|i| match i.checked_sub(1) {
            None => 0,
            Some(i) => words[i / 2].to_le_bytes()[i % 2],
        })
    }

    /// Reads one; `None` where it is none.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let &[0, ref rest @ ..] = bytes else {
            return None;
        };
        let rest: &[u8; BOARD] = rest.try_into().ok()?;
        let word = |i: usize| i16::from_le_bytes([rest[2 * i], rest[2 * i + 1]]);
        match word(3) {
            0 => Some(Self::Currents([word(0), word(1), word(2)])),
            SET_COUNTERS => Some(Self::SetCounters([4, 5, 6, 0, 1, 2].map(word))),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_bytes_are_these() {
        let report = BoardReport {
            encoders: [1, -2, 300, 4, 5, -6],
            info: 1,
            button: false,
        };
        assert_eq!(
            report.bytes(),
            [1, 0, 0xfe, 0xff, 0x2c, 1, 4, 0, 5, 0, 0xfa, 0xff, 1, 0]
        );
        assert_eq!(BoardReport::parse(&report.bytes()), Some(report));
        assert_eq!(BoardReport::parse(&report.bytes()[..13]), None);
        let push = HostReport::Currents([1000, -1, 0]);
        assert_eq!(
            push.bytes(),
            [0, 0xe8, 3, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]
        );
        let set = HostReport::SetCounters([1, 2, 3, 4, 5, 6]);
        assert_eq!(set.bytes(), [0, 4, 0, 5, 0, 6, 0, 1, 0, 1, 0, 2, 0, 3, 0]);
        for report in [push, set] {
            assert_eq!(HostReport::parse(&report.bytes()), Some(report));
            assert_eq!(HostReport::parse(&report.bytes()[1..]), None);
        }
    }

    #[test]
    fn a_teensy_s_longer_report_and_a_pressed_button_are_read() {
        let pressed = BoardReport {
            encoders: [1, -2, 300, -40, 5, -6],
            info: 0,
            button: true,
        };
        let mut bytes = pressed.bytes().to_vec();
        assert_eq!(bytes[6..8], 9_960_i16.to_le_bytes());
        assert_eq!(BoardReport::parse(&bytes), Some(pressed));
        bytes.resize(TEENSY, 0xa5);
        assert_eq!(BoardReport::parse(&bytes), Some(pressed));
        for length in [0, 13, 15, 63] {
            assert_eq!(BoardReport::parse(&bytes[..length]), None, "{length}");
        }
    }
}
