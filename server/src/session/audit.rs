//! The audit trail: who joined, who was refused, who armed, what failed. For the journal, under the target `taut::audit`.
//!
//! One line per event, with its fields by name and the peer's address. It is not chatty: of the refusals of one address the first
//! is logged at once and the others as a sum, once a minute; so is what was turned away before it had said anything.

use std::fmt;
use std::net::{IpAddr, SocketAddr};
use std::sync::Mutex;
use std::time::Duration;

use taut_link::proto::proof::Grant;
use taut_link::proto::text::Printable;
use taut_link::{ClientStatus, Counters, LinkEvent, Role};

use super::refusals::{Refusals, SUM_PERIOD};
use crate::shared::lock::lock;

/// Clients that are known by name; more are never in.
const MAX_PRESENT: usize = 4096;

/// Writes an event of this name, with its fields.
macro_rules! record {
    ($event:expr, $($fields:tt)*) => {
        tracing::info!(target: taut_log::AUDIT_TARGET, event = $event, $($fields)*)
    };
}

/// A client, as the trail names it.
#[derive(Clone, Debug)]
struct Peer {
    session: u16,
    node: String,
    role: Role,
    credential: String,
    address: SocketAddr,
}

impl From<&ClientStatus> for Peer {
    fn from(status: &ClientStatus) -> Self {
        Self {
            session: status.session,
            node: status.node.clone(),
            role: status.role,
            credential: credential(status),
            address: status.address,
        }
    }
}

/// The text of a field: in quotes, unless it is one plain word, so that a line can be taken apart.
struct Field<'a>(&'a str);

impl fmt::Display for Field<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_plain = |c: char| c.is_alphanumeric() || "-_.:*#/".contains(c);
        if !self.0.is_empty() && self.0.chars().all(is_plain) {
            f.write_str(self.0)
        } else {
            write!(f, "{:?}", self.0)
        }
    }
}

/// What it showed, as `[network] revoked` names it.
fn credential(status: &ClientStatus) -> String {
    let role = status.role;
    match status.grant {
        Grant::Master => "the cluster key".to_owned(),
        Grant::Node { issue } => format!("{role}:{}#{issue}", status.node),
        Grant::AnyNode { issue } => format!("{role}:*#{issue}"),
    }
}

/// Writes the trail of one session.
#[derive(Debug, Default)]
pub struct AuditTrail {
    present: Vec<Peer>,
    refusals: Refusals<IpAddr>,
    turned_away: u64,
    looked: Duration,
}

impl AuditTrail {
    /// Takes an event at session time `now`; whether it is one to tell people of: a refusal like those before is not.
    pub fn follow(&mut self, event: &LinkEvent, now: Duration) -> bool {
        match event {
            LinkEvent::Joined(status) => {
                let who = Peer::from(status);
                record!("joined", node = %Field(&who.node), role = %who.role, credential = %Field(&who.credential), address = %who.address, session = who.session);
                if self.present.len() < MAX_PRESENT {
                    self.present.push(who);
                }
            }
            LinkEvent::Left { status, reason } => {
                self.present.retain(|who| who.session != status.session);
                record!("left", node = %Field(&status.node), role = %status.role, address = %status.address, session = status.session, reason);
            }
            LinkEvent::Refused {
                address,
                node,
                text,
                ..
            } => {
                if !self.refusals.is_first(address.ip(), now) {
                    return false;
                }
                record!("refused", node = %Field(&node.to_string()), %address, reason = text);
            }
            LinkEvent::Forbidden { node, act, .. } => {
                if let Some(who) = self.who(node) {
                    record!("forbidden", node = %Field(&who.node), role = %who.role, credential = %Field(&who.credential), address = %who.address, %act);
                }
            }
            LinkEvent::Arm { node, arm } => {
                if let Some(who) = self.who(node) {
                    record!(arming(*arm), node = %Field(&who.node), role = %who.role, credential = %Field(&who.credential), address = %who.address);
                }
            }
            LinkEvent::FreeRunning { node, free } => {
                frames(node, if *free { "free-running" } else { "in-step" });
            }
            LinkEvent::NoPlace { node } => frames(node, "no-place"),
            LinkEvent::StatesForged { node } => frames(node, "forged-states"),
            LinkEvent::Silent { .. } | LinkEvent::Stats { .. } | LinkEvent::Log { .. } => {}
        }
        true
    }

    /// Takes an event of the device port.
    pub fn follow_port(&mut self, what: &str, is_fault: bool) {
        record!(if is_fault { "fault" } else { "device" }, what);
    }

    /// Takes what is told of a force from outside.
    pub fn follow_external(&mut self, what: &str) {
        record!("wrench-in", what);
    }

    /// Tells the sums that are due at session time `now`.
    pub fn look(&mut self, counters: &Counters, now: Duration) {
        for (address, times) in self.refusals.due(now) {
            refused_more(address, times);
        }
        let times = counters.turned_away - self.turned_away;
        if times > 0 && now >= self.looked + SUM_PERIOD {
            record!("turned-away", times);
            (self.turned_away, self.looked) = (counters.turned_away, now);
        }
    }

    /// Tells the sums that are left at the end.
    pub fn end(&mut self) {
        for (address, times) in self.refusals.due(Duration::MAX) {
            refused_more(address, times);
        }
    }

    fn who(&self, node: &str) -> Option<&Peer> {
        self.present.iter().find(|who| who.node == node)
    }
}

fn arming(arm: bool) -> &'static str {
    if arm { "arm" } else { "disarm" }
}

/// A node keeps frames by itself or in step, or names forged states.
fn frames(node: &str, what: &str) {
    record!("frames", node = %Field(node), what);
}

/// Further ones were not let in; `None`: from many addresses.
fn refused_more(address: Option<IpAddr>, times: u64) {
    match address {
        Some(address) => record!("refused", %address, times),
        None => record!("refused", address = "many", times),
    }
}

/// The trail of a page from which an operator acts: what was done, what was refused, and the peer. For any thread.
#[derive(Debug)]
pub(crate) struct PageAudit {
    /// By what name it stands in the trail.
    node: &'static str,
    refusals: Mutex<Refusals<(IpAddr, &'static str)>>,
}

impl PageAudit {
    pub(crate) fn new(node: &'static str) -> Self {
        Self {
            node,
            refusals: Mutex::default(),
        }
    }

    /// Somebody who has shown the token asked for force, or for none.
    pub(crate) fn acted(&self, arm: bool, address: SocketAddr) {
        let node = self.node;
        record!(arming(arm), node, role = %Role::Operator, credential = "the page's token", %address);
    }

    /// Somebody who has shown the token asked for pictures of the screens.
    pub(crate) fn saw(&self, address: SocketAddr) {
        let node = self.node;
        record!("pictures", node, role = %Role::Operator, credential = "the page's token", %address);
    }

    /// Somebody who has shown the token changed the scene.
    pub(crate) fn edited(address: SocketAddr, revision: u64, what: &str) {
        let node = super::operator::NODE;
        record!("edit", node, role = %Role::Operator, credential = "the page's token", %address, revision, what = %Field(&Printable(what).to_string()));
    }

    /// Somebody was refused. Of one address and reason the first is told at once, further ones as a sum.
    pub(crate) fn refused(&self, address: SocketAddr, reason: &'static str, now: Duration) {
        let node = self.node;
        let mut refusals = lock(&self.refusals);
        if refusals.is_first((address.ip(), reason), now) {
            record!("refused", node, %address, reason);
        }
    }

    /// Tells the sums that are due at session time `now`; at the end, those that are left.
    pub(crate) fn look(&self, now: Duration) {
        let node = self.node;
        let mut refusals = lock(&self.refusals);
        for (who, times) in refusals.due(now) {
            match who {
                Some((address, reason)) => record!("refused", node, %address, reason, times),
                None => record!("refused", node, address = "many", times),
            }
        }
    }
}
