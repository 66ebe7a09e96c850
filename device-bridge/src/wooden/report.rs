//! HID reports: seven integers of 16 bits, little-endian, each way.

/// Length of a report of the board.
pub(crate) const BOARD: usize = 14;
/// Length of a report of the host, its number 0 included.
pub(crate) const HOST: usize = 15;
/// Sets the encoders' counters.
const SET_COUNTERS: i16 = 1;

/// What the board says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardReport {
    /// Counters a to f: three motors, three of the wrist.
    pub encoders: [i16; 6],
    /// Flags; one says whether the counters were set.
    pub info: i16,
}

impl BoardReport {
    /// Reads one; `None` where it has not 14 bytes.
    #[must_use]
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; BOARD] = bytes.try_into().ok()?;
        let word = |i: usize| i16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]);
        Some(Self {
            encoders: std::array::from_fn(word),
            info: word(6),
        })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> [u8; BOARD] {
        let [a, b, c, d, e, f] = self.encoders;
        let words = [a, b, c, d, e, f, self.info];
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
}
