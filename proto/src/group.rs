//! The group: who is in, and keys that all members share.
//!
//! The server draws a secret and tells it to the members over their control streams (TLS), together with the roster; a membership that changes gets a new
//! secret and the next generation, so that who left cannot read on, and who came cannot read back. From the secret each sender has a key of its own:
//!
//! material(sender) = HKDF(secret, sender ‖ generation), and from it the keys of [`crate::seal`].
//!
//! Header flags tell a group datagram from a pairwise one: bit 15 is [`FLAG_GROUP`], bits 0 and 1 are the low bits of the generation.
//!
//! **A group key proves "a member" and no more**: any member can derive the key of any sender. So it may carry only what harms nobody's hand,
//! see [`may_carry`]: pictures from the server, frames from node to node, signs of life. Device input, wrenches and constraint sets stay under the pairwise keys of a session; the
//! server opens nothing that is sealed by a group key.
//!
//! Generations change without a gap: sealers begin with a new one [`SPREAD_NS`] after they learned it, so that the others have it too, and openers
//! take the one before for [`PREVIOUS_NS`] more. Who comes understands the others when that time is over: the generation before is not for it.

use crate::{
    DecodeError, EncodeError, Header, Kind, Payload, Role, Untrusted,
    codec::{Reader, Wire, Writer, wire_struct},
    derive::Root,
    range::{COUNT_32, SESSION},
    seal::{DatagramBuffer, KEY_MATERIAL_BYTES, OpenError, Opened, Opener, SealError, Sealer},
};
use arrayvec::ArrayVec;
use std::{
    fmt,
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
};

/// Bytes of a group secret.
pub const GROUP_SECRET_BYTES: usize = 32;
/// Header flag of every datagram under a group key.
pub const FLAG_GROUP: u16 = 1 << 15;
/// Sender number of the server in datagram headers.
pub const SERVER_SENDER: u16 = 0;
/// How long a sealer stays with the generation before, ns: the new one reaches the other members meanwhile.
pub const SPREAD_NS: u64 = 50_000_000;
/// How long an opener takes the generation before, ns: the others may have learned the new one later.
pub const PREVIOUS_NS: u64 = 500_000_000;

/// Generations that may be on their way at once: as many as the server makes within the spread, and as the header flags tell apart.
const MAX_TRANSITIONS: usize = 3;
/// Bits of the generation in the header flags.
const GENERATION_FLAGS: u32 = 0b11;
const ROOT_PURPOSE: &[u8] = b"taut group keys 1";

/// The secret of one generation.
#[derive(Clone, PartialEq, Eq)]
pub struct GroupSecret(pub [u8; GROUP_SECRET_BYTES]);

impl Drop for GroupSecret {
    fn drop(&mut self) {
        zeroize::Zeroize::zeroize(&mut self.0);
    }
}

impl fmt::Debug for GroupSecret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("GroupSecret(secret)")
    }
}

wire_struct! {
    /// One member, as the roster tells it.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct GroupMember {
        /// Session number: `sender` in datagram headers.
        pub sender: u16 => SESSION,
        /// Name of the node.
        pub node: Untrusted,
        /// What it is.
        pub role: Role,
        /// Where its hot plane listens, as the server sees it; `None` before its first datagram, and for QUIC datagrams.
        pub address: Option<SocketAddr>,
    }
}

wire_struct! {
    /// What the server tells the members: at join, and whenever it changes.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct Group {
        /// Grows with every change of membership; the same while only addresses change.
        pub generation: u32 => COUNT_32,
        /// Secret of this generation.
        pub secret: GroupSecret,
        /// Who is in, by sender number. Devices are not: nothing is sent to them under a group key.
        pub members: Vec<GroupMember>,
        /// Where the server sends states for all, if it does.
        pub multicast: Option<SocketAddr>,
    }
}

impl Group {
    /// The key material of `sender` in this generation.
    pub fn material(&self, sender: u16) -> [u8; KEY_MATERIAL_BYTES] {
        *Root::new(ROOT_PURPOSE, &self.secret.0)
            .key(&[&sender.to_le_bytes(), &self.generation.to_le_bytes()])
    }

    /// The member of this number.
    pub fn member(&self, sender: u16) -> Option<&GroupMember> {
        self.members.iter().find(|member| member.sender == sender)
    }
}

/// Whether who plays `role` is told the group's keys.
pub fn is_member(role: Role) -> bool {
    match role {
        Role::Render | Role::Observer | Role::Operator => true,
        Role::Device | Role::Tracker | Role::Force => false,
    }
}

/// Whether a group key may carry `kind` from `sender`. States come from the server alone; what moves a device or reports to the server never
/// travels so.
pub fn may_carry(kind: Kind, sender: u16) -> bool {
    match kind {
        Kind::Hot => sender == SERVER_SENDER,
        Kind::Heartbeat => true,
        // Between nodes, when the server is gone; with the server they are under the pair's own key.
        Kind::Arrive | Kind::Release => sender != SERVER_SENDER,
        Kind::EventAck
        | Kind::TimeRequest
        | Kind::TimeResponse
        | Kind::Input
        | Kind::Head
        | Kind::Wrench
        | Kind::Constraints
        | Kind::Confirm
        | Kind::PathChallenge
        | Kind::PathResponse
        | Kind::Force
        | Kind::PassedForce => false,
    }
}

/// Whether a header says that its datagram is under a group key.
pub fn is_grouped(header: &Header) -> bool {
    header.flags & FLAG_GROUP != 0
}

fn flags_of(generation: u32) -> u16 {
    FLAG_GROUP | (generation & GENERATION_FLAGS) as u16
}

/// Seals what one member, or the server, says to the group.
pub struct GroupSealer {
    epoch: u32,
    sender: u16,
    present: Option<(u32, Sealer)>,
    /// The next ones, and when each begins, ns.
    coming: ArrayVec<(u32, Sealer, u64), MAX_TRANSITIONS>,
}

impl GroupSealer {
    /// Without a key yet. One per epoch and sender: two would give one number twice.
    pub fn new(epoch: u32, sender: u16) -> GroupSealer {
        GroupSealer {
            epoch,
            sender,
            present: None,
            coming: ArrayVec::new(),
        }
    }

    /// Learns a generation; one that is not newer changes nothing, so that its numbers never start again.
    pub fn learn(&mut self, group: &Group, now_ns: u64) {
        self.advance(now_ns);
        let newest = self.coming.last().map(|(generation, ..)| *generation);
        let newest = newest.or(self.present.as_ref().map(|(generation, _)| *generation));
        if newest.is_some_and(|newest| newest >= group.generation) {
            return;
        }
        let sealer = Sealer::flagged(
            &group.material(self.sender),
            self.epoch,
            self.sender,
            flags_of(group.generation),
        );
        let begins = match self.present {
            None => now_ns,
            Some(_) => now_ns.saturating_add(SPREAD_NS),
        };
        if self.coming.is_full() {
            self.coming.pop(); // never used: the newest takes its place
        }
        self.coming.push((group.generation, sealer, begins));
        self.advance(now_ns);
    }

    /// Seals `payload` for the group. No allocation.
    pub fn seal<'a>(
        &mut self,
        payload: &Payload,
        now_ns: u64,
        buffer: &'a mut DatagramBuffer,
    ) -> Result<&'a [u8], SealError> {
        self.sealer(payload.kind(), now_ns)?.seal(payload, buffer)
    }

    /// Seals a payload that is encoded already. No allocation.
    pub fn seal_bytes<'a>(
        &mut self,
        kind: Kind,
        payload: &[u8],
        now_ns: u64,
        buffer: &'a mut DatagramBuffer,
    ) -> Result<&'a [u8], SealError> {
        self.sealer(kind, now_ns)?.seal_bytes(kind, payload, buffer)
    }

    /// The generation in use; `None` before the first.
    pub fn generation(&self) -> Option<u32> {
        self.present.as_ref().map(|(generation, _)| *generation)
    }

    fn sealer(&mut self, kind: Kind, now_ns: u64) -> Result<&Sealer, SealError> {
        if !may_carry(kind, self.sender) {
            return Err(SealError::Misplaced);
        }
        self.advance(now_ns);
        match &self.present {
            Some((_, sealer)) => {
                sealer.roll_by_time(now_ns);
                Ok(sealer)
            }
            None => Err(SealError::NoGroup),
        }
    }

    fn advance(&mut self, now_ns: u64) {
        while self
            .coming
            .first()
            .is_some_and(|(_, _, begins)| now_ns >= *begins)
        {
            let (generation, sealer, _) = self.coming.remove(0);
            self.present = Some((generation, sealer));
        }
    }
}

/// The openers of one generation, one per sender.
pub struct GroupKeys {
    generation: u32,
    /// By sender number.
    senders: Vec<(u16, Opener)>,
}

impl GroupKeys {
    /// Derives the keys of the server and of every member but `own`. Some ten microseconds per member: not for a receiving thread.
    pub fn derive(group: &Group, epoch: u32, own: u16) -> GroupKeys {
        let flags = flags_of(group.generation);
        let mut numbers: Vec<u16> = group.members.iter().map(|member| member.sender).collect();
        numbers.push(SERVER_SENDER);
        numbers.retain(|number| *number != own);
        numbers.sort_unstable();
        numbers.dedup();
        let opener = |sender| Opener::flagged(&group.material(sender), epoch, sender, flags);
        GroupKeys {
            generation: group.generation,
            senders: numbers
                .into_iter()
                .map(|sender| (sender, opener(sender)))
                .collect(),
        }
    }

    fn open(&mut self, sender: u16, datagram: &[u8]) -> Result<Opened, OpenError> {
        let place = self
            .senders
            .binary_search_by_key(&sender, |(number, _)| *number);
        match place {
            Ok(place) => self.senders[place].1.open(datagram),
            Err(_) => Err(OpenError::Forged),
        }
    }
}

/// Opens what the members and the server say to the group, each datagram once.
#[derive(Default)]
pub struct GroupOpener {
    present: Option<GroupKeys>,
    /// The generations before, oldest first, and until when each counts, ns.
    previous: ArrayVec<(GroupKeys, u64), MAX_TRANSITIONS>,
}

impl GroupOpener {
    /// Takes a generation; one that is not newer changes nothing, so that nothing opens twice. Returns what is not needed any more, to be
    /// dropped where that may take time.
    pub fn turn_to(&mut self, keys: GroupKeys, now_ns: u64) -> Option<GroupKeys> {
        if self
            .present
            .as_ref()
            .is_some_and(|present| present.generation >= keys.generation)
        {
            return Some(keys);
        }
        let last = self.present.replace(keys)?;
        let unneeded = match self.previous.is_full() {
            true => Some(self.previous.remove(0).0),
            false => None,
        };
        self.previous
            .push((last, now_ns.saturating_add(PREVIOUS_NS)));
        unneeded
    }

    /// The newest generation; `None` before the first.
    pub fn generation(&self) -> Option<u32> {
        self.present.as_ref().map(|keys| keys.generation)
    }

    /// Opens `datagram`. Nothing that is not authentic has an effect. No allocation.
    pub fn open(&mut self, datagram: &[u8], now_ns: u64) -> Result<Opened, OpenError> {
        let header = Header::parse(datagram).map_err(OpenError::Header)?;
        if !is_grouped(&header) {
            return Err(OpenError::Forged);
        }
        if !may_carry(header.kind, header.sender) {
            return Err(OpenError::Misplaced);
        }
        let previous = self
            .previous
            .iter_mut()
            .filter(|(_, until)| now_ns < *until)
            .map(|(keys, _)| keys);
        let mut refused = OpenError::Forged;
        // Where generations were left out, two may have the same flags: then both are tried.
        for keys in self.present.iter_mut().chain(previous) {
            if flags_of(keys.generation) != header.flags {
                continue;
            }
            match keys.open(header.sender, datagram) {
                Err(OpenError::Forged) => {}
                Err(error @ OpenError::Replayed) => refused = error,
                opened => return opened,
            }
        }
        Err(refused)
    }
}

impl Wire for GroupSecret {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.0.write(to)
    }
    fn read(from: &mut Reader<'_>) -> Result<GroupSecret, DecodeError> {
        Ok(GroupSecret(Wire::read(from)?))
    }
}

/// On the wire: 4 or 6, the bytes of the address in network order, the port. Scopes of IPv6 are of one machine and not told.
impl Wire for SocketAddr {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        match self.ip() {
            IpAddr::V4(ip) => {
                4u8.write(to)?;
                ip.octets().write(to)?;
            }
            IpAddr::V6(ip) => {
                6u8.write(to)?;
                ip.octets().write(to)?;
            }
        }
        self.port().write(to)
    }
    fn read(from: &mut Reader<'_>) -> Result<SocketAddr, DecodeError> {
        let ip = match u8::read(from)? {
            4 => IpAddr::from(Ipv4Addr::from(<[u8; 4]>::read(from)?)),
            6 => IpAddr::from(Ipv6Addr::from(<[u8; 16]>::read(from)?)),
            tag => {
                return Err(DecodeError::UnknownTag {
                    what: "address family",
                    tag,
                });
            }
        };
        Ok(SocketAddr::new(ip, u16::read(from)?))
    }
}
