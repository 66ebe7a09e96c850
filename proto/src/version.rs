//! The versions of the protocol: one number for datagrams and control messages alike.
//!
//! Each end states the range that it speaks; the highest number that is in both is used for the session, and stands in every frame and datagram of
//! it. What can never change, because it comes before that: the frame around a control message, the beginning of `Hello` and all of `Refused`
//! (see [`crate::control`]). Where the ranges have nothing in common the server refuses, and both ends name both.

use crate::{
    DecodeError, EncodeError,
    codec::{Reader, Wire, Writer},
};
use std::fmt;

/// Newest version that this build speaks, and the layout that is in the golden file.
pub const PROTOCOL_VERSION: u8 = 4;

/// The first version whose Hello states a range. Programs before it knew one version, and are refused by name.
pub const FIRST_NEGOTIATED: u8 = 4;

/// First two bytes of every datagram and control message, little-endian on the wire.
pub const MAGIC: u16 = 0x4857;

/// Versions that an end speaks, without a gap: 1 ≤ min ≤ max.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct VersionRange {
    min: u8,
    max: u8,
}

impl VersionRange {
    /// What this build speaks.
    pub const SUPPORTED: VersionRange = VersionRange {
        min: FIRST_NEGOTIATED,
        max: PROTOCOL_VERSION,
    };

    /// From `min` to `max`; `None` unless 1 ≤ `min` ≤ `max`.
    pub const fn new(min: u8, max: u8) -> Option<VersionRange> {
        if min >= 1 && min <= max {
            Some(VersionRange { min, max })
        } else {
            None
        }
    }

    /// This version and no other; 0, which is none, counts as 1.
    pub const fn only(version: u8) -> VersionRange {
        let version = if version == 0 { 1 } else { version };
        VersionRange {
            min: version,
            max: version,
        }
    }

    /// The oldest.
    pub const fn min(self) -> u8 {
        self.min
    }

    /// The newest.
    pub const fn max(self) -> u8 {
        self.max
    }

    /// Whether it has this version.
    pub const fn contains(self, version: u8) -> bool {
        self.min <= version && version <= self.max
    }

    /// The highest version that both speak.
    pub fn highest_common(self, other: VersionRange) -> Option<u8> {
        let highest = self.max.min(other.max);
        (self.contains(highest) && other.contains(highest)).then_some(highest)
    }
}

/// As in "speaks protocol version 4", "speaks protocol version 4 to 6".
impl fmt::Display for VersionRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.min == self.max {
            write!(f, "{}", self.max)
        } else {
            write!(f, "{} to {}", self.min, self.max)
        }
    }
}

impl Wire for VersionRange {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.min.write(to)?;
        self.max.write(to)
    }

    fn read(from: &mut Reader<'_>) -> Result<VersionRange, DecodeError> {
        let (min, max) = (u8::read(from)?, u8::read(from)?);
        VersionRange::new(min, max).ok_or(DecodeError::Inconsistent { what: "versions" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(min: u8, max: u8) -> VersionRange {
        VersionRange::new(min, max).expect("a range")
    }

    #[test]
    fn the_highest_common_version_is_used_whoever_asks() {
        for (one, other, common) in [
            (range(4, 4), range(4, 4), Some(4)),
            (range(4, 5), range(5, 6), Some(5)),
            (range(2, 9), range(4, 6), Some(6)),
            (range(4, 5), range(6, 7), None),
            (range(3, 3), VersionRange::SUPPORTED, None),
        ] {
            assert_eq!(one.highest_common(other), common);
            assert_eq!(other.highest_common(one), common);
        }
        assert_eq!(VersionRange::new(0, 4), None);
        assert_eq!(VersionRange::new(5, 4), None);
        assert_eq!(
            format!("{} and {}", range(4, 4), range(4, 6)),
            "4 and 4 to 6"
        );
    }
}
