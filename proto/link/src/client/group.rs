//! The group at a member: roster, keys, and datagrams from node to node.

use super::inbound::lock;
use std::{
    net::SocketAddr,
    sync::{Arc, Mutex},
};
use taut_proto::{
    Group, GroupMember, GroupOpener, GroupSealer, Payload, Role,
    group::GroupKeys,
    seal::{DatagramBuffer, OpenError, Opened},
};

/// Who is in, as the server told it last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Roster {
    /// Grows with every change of membership.
    pub generation: u32,
    /// The members, by number; this node is among them, device bridges are not.
    pub members: Vec<GroupMember>,
    /// Where the server sends states for all, if it does.
    pub multicast: Option<SocketAddr>,
}

pub(crate) struct GroupEnd {
    epoch: u32,
    own: u16,
    sealer: Mutex<GroupSealer>,
    opener: Mutex<GroupOpener>,
    roster: Mutex<Option<Arc<Roster>>>,
}

impl GroupEnd {
    pub(crate) fn new(epoch: u32, own: u16) -> GroupEnd {
        GroupEnd {
            epoch,
            own,
            sealer: Mutex::new(GroupSealer::new(epoch, own)),
            opener: Mutex::default(),
            roster: Mutex::default(),
        }
    }

    /// Takes what the server told. Derives keys: not for the receiving thread.
    pub(crate) fn learn(&self, group: Group, now_ns: u64) {
        let known = lock(&self.opener).generation();
        if known.is_none_or(|known| known < group.generation) {
            let keys = GroupKeys::derive(&group, self.epoch, self.own);
            let unneeded = lock(&self.opener).turn_to(keys, now_ns);
            drop(unneeded);
            lock(&self.sealer).learn(&group, now_ns);
        }
        let roster = Roster {
            generation: group.generation,
            members: group.members,
            multicast: group.multicast,
        };
        *lock(&self.roster) = Some(Arc::new(roster));
    }

    pub(crate) fn roster(&self) -> Option<Arc<Roster>> {
        lock(&self.roster).clone()
    }

    /// Number of this member.
    pub(crate) fn own(&self) -> u16 {
        self.own
    }

    /// Whether the roster names this member with this role.
    pub(crate) fn has_role(&self, member: u16, role: Role) -> bool {
        let roster = self.roster();
        roster.is_some_and(|roster| {
            let mut members = roster.members.iter();
            members.any(|other| other.sender == member && other.role == role)
        })
    }

    /// Address of a member, if it is known.
    pub(crate) fn address(&self, member: u16) -> Option<SocketAddr> {
        let roster = self.roster()?;
        let found = roster.members.iter().find(|other| other.sender == member)?;
        found.address
    }

    /// The sealed datagram; `None` before the first group, or if a group key may not carry it.
    pub(crate) fn seal<'a>(
        &self,
        payload: &Payload,
        now_ns: u64,
        buffer: &'a mut DatagramBuffer,
    ) -> Option<&'a [u8]> {
        lock(&self.sealer).seal(payload, now_ns, buffer).ok()
    }

    pub(crate) fn open(&self, datagram: &[u8], now_ns: u64) -> Result<Opened, OpenError> {
        lock(&self.opener).open(datagram, now_ns)
    }
}
