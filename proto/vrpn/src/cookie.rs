//! The greeting: 24 bytes of text, sent by both sides as soon as a connection stands.
//!
//! `vrpn: ver. 07.38  0`, then zeros. The first number must be the same on both sides, the second may differ; the last
//! digit asks the other side to keep a log (0: no).

/// Bytes of a cookie.
pub const COOKIE_BYTES: usize = 24;

/// The version that this side speaks; any minor version is understood.
const OWN: Version = Version {
    major: 7,
    minor: 35,
};

/// A peer's version of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version {
    /// Peers of another major version do not understand each other.
    pub major: u8,
    /// Of no matter.
    pub minor: u8,
}

/// A greeting that is not VRPN's, or that of a version with which there is no talking.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CookieError {
    /// Not VRPN at all.
    #[error("the server does not speak VRPN; check its address and port")]
    NotVrpn,
    /// Another major version.
    #[error("the server speaks version {major} of VRPN, this program version 7; update the server")]
    OtherMajor {
        /// Of the server.
        major: u8,
    },
}

/// This side's greeting.
#[must_use]
pub fn cookie() -> [u8; COOKIE_BYTES] {
    let mut bytes = [0; COOKIE_BYTES];
    let text = format!("vrpn: ver. {:02}.{:02}  0", OWN.major, OWN.minor);
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    bytes
}

/// Reads the other side's greeting.
///
/// # Errors
/// [`CookieError`]: the connection must be closed.
pub fn check(bytes: &[u8; COOKIE_BYTES]) -> Result<Version, CookieError> {
    let digits = |at: usize| -> Result<u8, CookieError> {
        std::str::from_utf8(&bytes[at..at + 2])
            .ok()
            .and_then(|text| text.parse().ok())
            .ok_or(CookieError::NotVrpn)
    };
    if !bytes.starts_with(b"vrpn: ver. ") || bytes[13] != b'.' {
        return Err(CookieError::NotVrpn);
    }
    let (major, minor) = (digits(11)?, digits(14)?);
    if major != OWN.major {
        return Err(CookieError::OtherMajor { major });
    }
    Ok(Version { major, minor })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greeting_of_a_real_server_is_understood_and_ours_is_of_its_form() {
        let real = *b"vrpn: ver. 07.38  0\0\0\0\0\0";
        let version = check(&real).expect("a VRPN server");
        assert_eq!((version.major, version.minor), (7, 38));
        assert_eq!(check(&cookie()), Ok(OWN));
        assert_eq!(cookie()[..14], real[..14]);
    }

    #[test]
    fn other_protocols_and_other_majors_are_refused() {
        assert_eq!(
            check(b"HTTP/1.1 400 Bad Request"),
            Err(CookieError::NotVrpn)
        );
        assert_eq!(
            check(b"vrpn: ver. 06.02  0\0\0\0\0\0"),
            Err(CookieError::OtherMajor { major: 6 })
        );
        assert_eq!(
            check(b"vrpn: ver. x7.38  0\0\0\0\0\0"),
            Err(CookieError::NotVrpn)
        );
    }
}
