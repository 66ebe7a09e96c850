//! Where a client's datagrams go: only where the client was seen to receive.
//!
//! An authentic datagram proves who sealed it, not where it was sent from: whoever holds it back and sends it on from an address of his choice
//! could turn the stream there. So a new address gets one small challenge, at most one in [`CHALLENGE_PERIOD_NS`], and becomes the client's address
//! when the answer comes from it; until then all goes where it went. The address that the control plane comes from needs no challenge for the
//! first path: QUIC has shown that the client receives there. Source: RFC 9000, sections 8.2 and 9.3.
//!
//! A state machine: times and tokens are arguments.

use crate::{codec::wire_struct, range::NAME};
use std::net::{IpAddr, SocketAddr};

/// Shortest distance between two challenges of one session, ns.
pub const CHALLENGE_PERIOD_NS: u64 = 50_000_000;

wire_struct! {
    /// Body of a challenge and of its answer.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct PathToken {
        /// Drawn at random for one address.
        pub token: u64 => NAME,
    }
}

/// An address that is not proven yet.
#[derive(Clone, Copy, Debug)]
struct Claim {
    address: SocketAddr,
    token: u64,
}

/// The path to one client.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClientPath {
    proven: Option<SocketAddr>,
    claim: Option<Claim>,
    /// From when on the next challenge may go, ns.
    next_ns: u64,
}

impl ClientPath {
    /// Where the client is known to receive.
    pub fn proven(&self) -> Option<SocketAddr> {
        self.proven
    }

    /// The newest authentic datagram came from `from`, the control plane from `control`; the challenge to send to `from` now, if one is due.
    pub fn hear(
        &mut self,
        from: SocketAddr,
        control: IpAddr,
        now_ns: u64,
        draw_token: impl FnOnce() -> Option<u64>,
    ) -> Option<PathToken> {
        if self.proven == Some(from) {
            self.claim = None; // it is here still, or again
            return None;
        }
        if self.proven.is_none() && from.ip().to_canonical() == control.to_canonical() {
            self.proven = Some(from);
            return None;
        }
        if now_ns < self.next_ns {
            return None;
        }
        let claim = match self.claim {
            Some(claim) if claim.address == from => claim,
            _ => Claim {
                address: from,
                token: draw_token()?,
            },
        };
        self.claim = Some(claim);
        self.next_ns = now_ns.saturating_add(CHALLENGE_PERIOD_NS);
        Some(PathToken { token: claim.token })
    }

    /// An answer came from `from`; whether that is the client's address from now on, and was not before.
    pub fn answer(&mut self, from: SocketAddr, answer: PathToken) -> bool {
        match self.claim {
            Some(claim) if claim.address == from && claim.token == answer.token => {
                self.claim = None;
                self.proven = Some(from);
                true
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOME: ([u8; 4], u16) = ([10, 0, 0, 7], 40_000);
    const AWAY: ([u8; 4], u16) = ([10, 0, 0, 9], 41_000);
    const THIRD: ([u8; 4], u16) = ([10, 0, 0, 11], 42_000);

    fn at(address: ([u8; 4], u16)) -> SocketAddr {
        SocketAddr::from(address)
    }

    fn settled() -> ClientPath {
        let mut path = ClientPath::default();
        let control = at(HOME).ip();
        assert_eq!(path.hear(at(HOME), control, 0, || None), None);
        assert_eq!(path.proven(), Some(at(HOME)));
        path
    }

    #[test]
    fn a_new_address_counts_when_its_own_challenge_was_answered_from_there() {
        let mut path = settled();
        let control = at(HOME).ip();
        let token = PathToken { token: 77 };
        assert_eq!(path.hear(at(AWAY), control, 1, || Some(77)), Some(token));
        assert_eq!(path.proven(), Some(at(HOME)), "the old path is kept");
        assert!(!path.answer(at(AWAY), PathToken { token: 78 }), "guessed");
        assert!(!path.answer(at(HOME), token), "from elsewhere");
        assert!(path.answer(at(AWAY), token));
        assert_eq!(path.proven(), Some(at(AWAY)));
        assert!(!path.answer(at(AWAY), token), "once");
    }

    #[test]
    fn challenges_are_few_however_many_addresses_are_claimed() {
        let mut path = settled();
        let control = at(HOME).ip();
        let mut sent = 0;
        for millisecond in 0..1000 {
            let from = if millisecond % 2 == 0 { AWAY } else { THIRD };
            let challenge = path.hear(at(from), control, millisecond * 1_000_000, || Some(1));
            sent += u64::from(challenge.is_some());
        }
        assert!(sent <= 1000 * 1_000_000 / CHALLENGE_PERIOD_NS, "{sent}");
        assert_eq!(path.proven(), Some(at(HOME)));
    }

    #[test]
    fn a_first_path_from_another_host_than_the_control_plane_is_challenged() {
        let mut path = ClientPath::default();
        let challenge = path.hear(at(AWAY), at(HOME).ip(), 0, || Some(5));
        assert_eq!(challenge, Some(PathToken { token: 5 }));
        assert_eq!(path.proven(), None);
        assert!(path.answer(at(AWAY), PathToken { token: 5 }));
    }
}
