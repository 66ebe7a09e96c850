//! Who is shut out without a new cluster key: credentials by name and issue, and whole roles.
//!
//! | written          | shuts out                                                                    |
//! |------------------|------------------------------------------------------------------------------|
//! | `front`          | every client of that name, whatever it holds                                 |
//! | `front#1`        | credentials for that name of issue 1 and before; a later issue stays good    |
//! | `device:front#1` | the same, of one role only                                                   |
//! | `observer:*`     | every credential for any name of that role                                   |
//! | `observer:*#2`   | those of issue 2 and before                                                  |
//!
//! Who holds the cluster key itself can take any name and any role: only a new key shuts him out.

use crate::{
    Role,
    credential::{CredentialError, Holder},
    proof::{Claim, Grant},
    role::UnknownRole,
};
use std::{fmt, str::FromStr};

/// One entry of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Revoked {
    /// Only of this role; `None` is of any.
    role: Option<Role>,
    holder: Holder,
    /// This issue and those before; `None` is all.
    issue: Option<u16>,
}

/// Why a text is no entry.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RevokedError {
    /// The role.
    #[error(transparent)]
    Role(#[from] UnknownRole),
    /// The name.
    #[error(transparent)]
    Name(#[from] CredentialError),
    /// The issue.
    #[error("\"{0}\" names no issue: write a number from 1 to 65535 after the #")]
    Issue(String),
    /// Any name of any role would be everybody.
    #[error("\"*\" alone would shut everybody out: write the role before it, such as observer:*")]
    Everybody,
}

impl FromStr for Revoked {
    type Err = RevokedError;

    fn from_str(text: &str) -> Result<Revoked, RevokedError> {
        let (role, rest) = match text.split_once(':') {
            Some((role, rest)) => (Some(role.parse()?), rest),
            None => (None, text),
        };
        let (name, issue) = match rest.rsplit_once('#') {
            Some((name, issue)) => {
                let number = issue.parse().ok().filter(|issue| *issue > 0);
                let number = number.ok_or_else(|| RevokedError::Issue(text.to_owned()))?;
                (name, Some(number))
            }
            None => (rest, None),
        };
        let holder = Holder::of(name)?;
        if holder == Holder::AnyNode && role.is_none() {
            return Err(RevokedError::Everybody);
        }
        Ok(Revoked {
            role,
            holder,
            issue,
        })
    }
}

impl fmt::Display for Revoked {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(role) = self.role {
            write!(f, "{role}:")?;
        }
        write!(f, "{}", self.holder)?;
        match self.issue {
            Some(issue) => write!(f, "#{issue}"),
            None => Ok(()),
        }
    }
}

impl Revoked {
    /// Whether the entry shuts out a client that joins by `claim`.
    pub fn covers(&self, claim: Claim<'_>) -> bool {
        if self.role.is_some_and(|role| role != claim.role) {
            return false;
        }
        let issue_is_covered = |issue: u16| self.issue.is_none_or(|last| issue <= last);
        match (&self.holder, claim.grant) {
            (Holder::Node(name), Grant::Node { issue }) => {
                name == claim.node && issue_is_covered(issue)
            }
            // The name without an issue: whoever comes by it.
            (Holder::Node(name), _) => name == claim.node && self.issue.is_none(),
            (Holder::AnyNode, Grant::AnyNode { issue }) => issue_is_covered(issue),
            (Holder::AnyNode, _) => false,
        }
    }
}

/// Who may join at all, of those who can prove something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JoinPolicy {
    /// Roles that are let in.
    pub roles: Vec<Role>,
    /// Who is not.
    pub revoked: Vec<Revoked>,
}

/// Every role, nobody revoked.
impl Default for JoinPolicy {
    fn default() -> JoinPolicy {
        JoinPolicy {
            roles: Role::NAMED.map(|(_, role)| role).to_vec(),
            revoked: Vec::new(),
        }
    }
}

/// What a policy says against a client.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShutOut {
    /// Its role is closed.
    #[error(
        "this workbench lets in no {0}: its workbench file (network.roles; for forces also wrench_in.enabled) names the roles that it does"
    )]
    Role(Role),
    /// Its credential is revoked.
    #[error("its credential is revoked (\"{0}\" in network.revoked): ask for a new one")]
    Revoked(Revoked),
}

impl JoinPolicy {
    /// Whether a client that has proven `claim` may join.
    pub fn check(&self, claim: Claim<'_>) -> Result<(), ShutOut> {
        if !self.roles.contains(&claim.role) {
            return Err(ShutOut::Role(claim.role));
        }
        match self.revoked.iter().find(|entry| entry.covers(claim)) {
            Some(entry) => Err(ShutOut::Revoked(entry.clone())),
            None => Ok(()),
        }
    }
}
