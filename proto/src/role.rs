//! Roles, and what each may do: the one table. The server asks it for everything that a client does or is sent; nobody else decides.
//!
//! | act            | render | device | tracker | operator | observer | force |
//! |----------------|--------|--------|---------|----------|----------|-------|
//! | keep the path  | yes    | yes    | yes     | yes      | yes      | yes   |
//! | get states     | yes    | yes    |         | yes      | yes      |       |
//! | get meshes     | yes    |        |         |          |          |       |
//! | keep frames    | yes    |        |         |          |          |       |
//! | report         | yes    | yes    |         |          |          |       |
//! | log            | yes    | yes    | yes     | yes      |          | yes   |
//! | give input     |        | yes    |         |          |          |       |
//! | get wrenches   |        | yes    |         |          |          |       |
//! | give the head  |        |        | yes     |          |          |       |
//! | arm            |        |        |         | yes      |          |       |
//! | give a force   |        |        |         |          |          | yes   |
//!
//! Everybody who is let in also gets the scene description: it holds screens and names, no geometry.

use crate::{codec::wire_tag, limits::Rate};
use std::{fmt, str::FromStr};

/// What a client is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Draws screens of the workbench.
    Render,
    /// The device bridge: the only one whose INPUT counts; one at a time.
    Device,
    /// Watches.
    Observer,
    /// Watches and operates: records traces, arms.
    Operator,
    /// Says where the viewer's head is; one at a time.
    Tracker,
    /// Gives a force from outside (a robot's sensor, a simulation) for the hand to feel; one at a time.
    Force,
}

/// Something that a client does, or is sent, once it is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Act {
    /// Time requests and signs of life.
    KeepPath,
    /// States, at its rate.
    GetStates,
    /// Meshes by hash.
    GetMeshes,
    /// The swap barrier: to say that a frame is drawn.
    KeepFrames,
    /// Reports of what it drew or did.
    Report,
    /// Lines for the workbench's log.
    Log,
    /// Readings of the device.
    GiveInput,
    /// Wrenches and constraint sets.
    GetWrenches,
    /// Where the viewer's head is.
    GiveHead,
    /// To ask for force at the device, or for none.
    Arm,
    /// A wrench that is added to the contact's.
    GiveForce,
}

impl Act {
    /// All.
    pub const ALL: [Act; 11] = [
        Act::KeepPath,
        Act::GetStates,
        Act::GetMeshes,
        Act::KeepFrames,
        Act::Report,
        Act::Log,
        Act::GiveInput,
        Act::GetWrenches,
        Act::GiveHead,
        Act::Arm,
        Act::GiveForce,
    ];

    /// Bit of this act in a set of acts.
    pub const fn bit(self) -> u16 {
        1 << self as u16
    }

    /// What it is, after "may not".
    pub fn name(self) -> &'static str {
        match self {
            Act::KeepPath => "keep the path",
            Act::GetStates => "get states",
            Act::GetMeshes => "get meshes",
            Act::KeepFrames => "keep frames",
            Act::Report => "report",
            Act::Log => "log",
            Act::GiveInput => "give device input",
            Act::GetWrenches => "get wrenches",
            Act::GiveHead => "give the viewer's head",
            Act::Arm => "arm",
            Act::GiveForce => "give a force",
        }
    }
}

impl fmt::Display for Act {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Role {
    /// All, with their names in files and on the command line.
    pub const NAMED: [(&'static str, Role); 6] = [
        ("render", Role::Render),
        ("device", Role::Device),
        ("tracker", Role::Tracker),
        ("operator", Role::Operator),
        ("observer", Role::Observer),
        ("force", Role::Force),
    ];

    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        let mut named = Role::NAMED.into_iter();
        named
            .find(|(_, role)| *role == self)
            .map_or("", |(name, _)| name)
    }

    /// What it is to people.
    pub fn title(self) -> &'static str {
        match self {
            Role::Render => "render node",
            Role::Device => "device bridge",
            Role::Tracker => "head tracker",
            Role::Force => "force source",
            Role::Operator => "operator",
            Role::Observer => "observer",
        }
    }

    /// Whether it may do `act`: the table at the head of this file.
    pub const fn may(self, act: Act) -> bool {
        self.acts() & act.bit() != 0
    }

    /// Whether a workbench has at most one at a time.
    pub const fn is_single(self) -> bool {
        matches!(self, Role::Device | Role::Tracker | Role::Force)
    }

    /// Datagrams that one session may send: several times what an honest one does (1 kHz of input, an ARRIVE every half millisecond,
    /// ten time requests a second), so that nobody meets it but who floods.
    pub const fn datagram_rate(self) -> Rate {
        match self {
            Role::Device => Rate {
                per_second: 10_000,
                burst: 2_000,
            },
            Role::Render => Rate {
                per_second: 5_000,
                burst: 1_000,
            },
            Role::Tracker | Role::Force => Rate {
                per_second: 3_000,
                burst: 500,
            },
            Role::Operator | Role::Observer => Rate {
                per_second: 200,
                burst: 200,
            },
        }
    }

    const fn acts(self) -> u16 {
        Act::KeepPath.bit()
            | match self {
                Role::Render => {
                    Act::GetStates.bit()
                        | Act::GetMeshes.bit()
                        | Act::KeepFrames.bit()
                        | Act::Report.bit()
                        | Act::Log.bit()
                }
                Role::Device => {
                    Act::GetStates.bit()
                        | Act::Report.bit()
                        | Act::Log.bit()
                        | Act::GiveInput.bit()
                        | Act::GetWrenches.bit()
                }
                Role::Tracker => Act::Log.bit() | Act::GiveHead.bit(),
                Role::Force => Act::Log.bit() | Act::GiveForce.bit(),
                Role::Operator => Act::GetStates.bit() | Act::Log.bit() | Act::Arm.bit(),
                Role::Observer => Act::GetStates.bit(),
            }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A text that names no role.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no role \"{0}\": use render, device, tracker, operator, observer or force")]
pub struct UnknownRole(pub String);

impl FromStr for Role {
    type Err = UnknownRole;

    fn from_str(text: &str) -> Result<Role, UnknownRole> {
        let named = Role::NAMED.iter().find(|(name, _)| *name == text);
        named
            .map(|(_, role)| *role)
            .ok_or_else(|| UnknownRole(text.to_owned()))
    }
}

// The same numbers are in proofs and secrets.
wire_tag!(Role, "role" { Render = 0, Device = 1, Observer = 2, Operator = 3, Tracker = 4, Force = 5 });
