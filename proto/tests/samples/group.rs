//! The members of a group.

use taut_proto::{Group, GroupMember, Role, group::GroupSecret};

/// Three members, one of each kind of address.
pub fn group() -> Group {
    let member = |sender: u16, node: &str, role, address: Option<&str>| GroupMember {
        sender,
        node: node.into(),
        role,
        address: address.and_then(|address| address.parse().ok()),
    };
    Group {
        generation: 9,
        secret: GroupSecret([5; 32]),
        members: vec![
            member(1, "left", Role::Render, Some("192.168.7.2:40001")),
            member(2, "right", Role::Render, Some("[fd00::2]:40002")),
            member(5, "watcher", Role::Observer, None),
        ],
        multicast: "239.255.72.87:4859".parse().ok(),
    }
}
