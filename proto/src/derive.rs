//! Keys out of secrets: HKDF with SHA-256.
//!
//! Source: RFC 5869. Extract runs once per secret, expand once per key; neither allocates.

use ring::hkdf;
use zeroize::Zeroizing;

/// A secret from which any number of independent keys come; it is in none of them.
pub(crate) struct Root(hkdf::Prk);

/// How many bytes to expand to.
struct Bytes(usize);

impl hkdf::KeyType for Bytes {
    fn len(&self) -> usize {
        self.0
    }
}

impl Root {
    /// `purpose` separates roots of one secret from each other.
    pub(crate) fn new(purpose: &[u8], secret: &[u8]) -> Root {
        Root(hkdf::Salt::new(hkdf::HKDF_SHA256, purpose).extract(secret))
    }

    /// `N` bytes that belong to `parts`, which have fixed lengths in every use of one root, but for the last.
    pub(crate) fn key<const N: usize>(&self, parts: &[&[u8]]) -> Zeroizing<[u8; N]> {
        const { assert!(N <= 255 * 32, "the most that HKDF-SHA-256 gives") };
        let mut key = Zeroizing::new([0; N]);
        let filled = self
            .0
            .expand(parts, Bytes(N))
            .and_then(|material| material.fill(&mut *key));
        match filled {
            Ok(()) => key,
            Err(_) => unreachable!("the length is below the limit"),
        }
    }
}
