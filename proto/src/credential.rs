//! Credentials: what a node is given instead of the cluster key, and the file that holds one.
//!
//! ```text
//! taut credential 1
//! role render
//! node front
//! issue 1
//! server 5c0e…            64 digits: fingerprint of the server's public key
//! secret 91ab…            64 digits
//! check 0f4c5d6e7a8b9c0d  of the lines above: tells a damaged copy
//! ```
//!
//! `node *` is any name. A line that begins with `#` and an empty line mean nothing; every other line is needed, in this order.

use crate::{
    ClusterKey, Role,
    control::MAX_NODE_NAME_BYTES,
    pin::{ServerPin, grouped},
    proof::{Grant, JoinSecret},
    text::{hex, parse_hex},
};
use ring::digest::{SHA256, digest};
use std::fmt::{self, Write as _};

/// First line of a credential file, and the domain of its check.
const TITLE: &str = "taut credential 1";
/// Digits of the check.
const CHECK_DIGITS: usize = 16;
/// Most bytes of a key file of either kind.
pub const MAX_KEY_TEXT_BYTES: usize = 4096;

/// Whom a credential is for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Holder {
    /// The node of this name.
    Node(String),
    /// Any node of the role.
    AnyNode,
}

impl Holder {
    /// The holder of a name, `*` being any.
    pub fn of(name: &str) -> Result<Holder, CredentialError> {
        if name == "*" {
            return Ok(Holder::AnyNode);
        }
        if !is_node_name(name) || name.contains(['*', ':', '#']) {
            return Err(CredentialError::BadName {
                name: name.to_owned(),
            });
        }
        Ok(Holder::Node(name.to_owned()))
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Holder::Node(node) => f.write_str(node),
            Holder::AnyNode => f.write_str("*"),
        }
    }
}

/// Whether a node may be called so: 1 to [`MAX_NODE_NAME_BYTES`] printable bytes, not all blank, no blanks around it.
pub fn is_node_name(name: &str) -> bool {
    !name.is_empty()
        && name.trim() == name
        && name.len() <= MAX_NODE_NAME_BYTES
        && name.chars().all(|c| !c.is_control())
}

/// Why a text is no credential.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CredentialError {
    /// It is another kind of text.
    #[error(
        "it is neither a cluster key (64 hexadecimal digits) nor a credential: make one with `taut keys`"
    )]
    NeitherKind,
    /// A line is missing or has another name.
    #[error("it ends or differs where \"{wanted}\" is due: the copy is incomplete, copy it again")]
    Missing {
        /// What the line begins with.
        wanted: &'static str,
    },
    /// A value makes no sense.
    #[error("its {what} makes no sense: the copy is damaged, copy it again")]
    BadValue {
        /// Which.
        what: &'static str,
    },
    /// There is more.
    #[error("it goes on after its last line: copy it again")]
    Trailing,
    /// The check does not fit the lines.
    #[error("its check does not fit its lines: the copy is damaged or was edited, copy it again")]
    BadCheck,
    /// A name that no node can have.
    #[error(
        "\"{name}\" is no name of a node with a credential: 1 to {MAX_NODE_NAME_BYTES} printable bytes without * : #, or * for any"
    )]
    BadName {
        /// The name.
        name: String,
    },
    /// The cluster key is malformed.
    #[error(transparent)]
    Key(#[from] crate::key::KeyError),
}

/// Lets its holder join one workbench as one role, under one name or any.
#[derive(Clone, PartialEq, Eq)]
pub struct Credential {
    role: Role,
    holder: Holder,
    issue: u16,
    pin: ServerPin,
    secret: JoinSecret,
}

impl fmt::Debug for Credential {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Credential {
            role,
            holder,
            issue,
            ..
        } = self;
        write!(f, "Credential({role} {holder} #{issue}, secret)")
    }
}

impl Credential {
    pub(crate) fn new(
        role: Role,
        holder: Holder,
        issue: u16,
        pin: ServerPin,
        secret: JoinSecret,
    ) -> Credential {
        Credential {
            role,
            holder,
            issue,
            pin,
            secret,
        }
    }

    /// What its holder may join as.
    pub fn role(&self) -> Role {
        self.role
    }

    /// Under which name.
    pub fn holder(&self) -> &Holder {
        &self.holder
    }

    /// Which issue of it, from 1.
    pub fn issue(&self) -> u16 {
        self.issue
    }

    /// The server that it is for.
    pub fn pin(&self) -> ServerPin {
        self.pin
    }

    /// What it is known by; the secret cannot be found from it.
    pub fn fingerprint(&self) -> String {
        grouped(&self.secret.fingerprint())
    }

    /// The text of its file. Show it to nobody but its holder.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail.
        let _ = write!(
            text,
            "{TITLE}\nrole {}\nnode {}\nissue {}\nserver {}\nsecret {}\n",
            self.role,
            self.holder,
            self.issue,
            self.pin.to_hex(),
            hex(self.secret.bytes()),
        );
        let check = check_of(&text);
        let _ = writeln!(text, "check {check}");
        text
    }

    /// Reads the text of a file.
    pub fn parse(text: &str) -> Result<Credential, CredentialError> {
        let mut lines = text
            .lines()
            .map(str::trim_end)
            .filter(|line| !line.is_empty() && !line.starts_with('#'));
        if lines.next() != Some(TITLE) {
            return Err(CredentialError::NeitherKind);
        }
        let mut checked = format!("{TITLE}\n");
        let mut value = |wanted: &'static str| {
            let line = lines.next().unwrap_or_default();
            let value = line
                .strip_prefix(wanted)
                .and_then(|rest| rest.strip_prefix(' '))
                .ok_or(CredentialError::Missing { wanted })?;
            if wanted != "check" {
                checked.push_str(line);
                checked.push('\n');
            }
            Ok::<_, CredentialError>(value)
        };
        let (role, node, issue) = (value("role")?, value("node")?, value("issue")?);
        let (server, secret, check) = (value("server")?, value("secret")?, value("check")?);
        if lines.next().is_some() {
            return Err(CredentialError::Trailing);
        }
        if check.len() != CHECK_DIGITS || check != check_of(&checked) {
            return Err(CredentialError::BadCheck);
        }
        let bad = |what| CredentialError::BadValue { what };
        Ok(Credential {
            role: role.parse().map_err(|_| bad("role"))?,
            holder: Holder::of(node)?,
            issue: issue
                .parse()
                .ok()
                .filter(|issue| *issue > 0)
                .ok_or(bad("issue"))?,
            pin: ServerPin::parse(server).map_err(|_| bad("server"))?,
            secret: JoinSecret::new(parse_hex(secret).map_err(|_| bad("secret"))?),
        })
    }
}

/// Not against forgery, which needs the secret, but against copies that lost or changed something.
fn check_of(lines: &str) -> String {
    let mut check = hex(digest(&SHA256, lines.as_bytes()).as_ref());
    check.truncate(CHECK_DIGITS);
    check
}

/// Why a key does not let its holder join so.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotAllowed {
    /// Another role.
    #[error(
        "its holder may join as {}, not as {}: give the credential of the {} (--key)",
        .has.title(), .wanted.title(), .wanted.title()
    )]
    Role {
        /// What it is for.
        has: Role,
        /// What was wanted.
        wanted: Role,
    },
    /// Another name.
    #[error(
        "it is for the node \"{has}\", not for \"{wanted}\": use that node's own, or its name (--node)"
    )]
    Node {
        /// What it is for.
        has: String,
        /// What was wanted.
        wanted: String,
    },
}

/// What a client joins with: the cluster key, or a credential.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JoinKey {
    /// Its holder may be anything.
    Master(ClusterKey),
    /// Its holder may be what it says.
    Credential(Credential),
}

impl From<ClusterKey> for JoinKey {
    fn from(key: ClusterKey) -> JoinKey {
        JoinKey::Master(key)
    }
}

impl From<Credential> for JoinKey {
    fn from(credential: Credential) -> JoinKey {
        JoinKey::Credential(credential)
    }
}

impl JoinKey {
    /// Reads the text of a key file of either kind.
    pub fn parse(text: &str) -> Result<JoinKey, CredentialError> {
        let text = text.trim();
        let first = text.lines().find(|line| !line.starts_with('#'));
        if first.is_some_and(|line| line.starts_with("taut")) {
            return Credential::parse(text).map(JoinKey::Credential);
        }
        // What has digits at its beginning was meant as a key.
        if text.starts_with(|c: char| c.is_ascii_hexdigit()) {
            return Ok(JoinKey::Master(ClusterKey::parse(text)?));
        }
        Err(CredentialError::NeitherKind)
    }

    /// The server to whom alone it may be proven.
    pub fn pin(&self) -> ServerPin {
        match self {
            JoinKey::Master(key) => key.server_pin(),
            JoinKey::Credential(credential) => credential.pin,
        }
    }

    /// The one name that it is for; `None` if any will do.
    pub fn node_name(&self) -> Option<&str> {
        match self {
            JoinKey::Credential(Credential {
                holder: Holder::Node(node),
                ..
            }) => Some(node),
            _ => None,
        }
    }

    /// The one role that it is for; `None` if any will do.
    pub fn role(&self) -> Option<Role> {
        match self {
            JoinKey::Master(_) => None,
            JoinKey::Credential(credential) => Some(credential.role),
        }
    }

    /// What to join with as `role` under the name `node`.
    pub fn secret_for(&self, role: Role, node: &str) -> Result<(Grant, JoinSecret), NotAllowed> {
        let credential = match self {
            JoinKey::Master(key) => {
                return Ok((Grant::Master, key.join_secret(role, node, Grant::Master)));
            }
            JoinKey::Credential(credential) => credential,
        };
        if credential.role != role {
            return Err(NotAllowed::Role {
                has: credential.role,
                wanted: role,
            });
        }
        let issue = credential.issue;
        let grant = match &credential.holder {
            Holder::Node(has) if has != node => {
                return Err(NotAllowed::Node {
                    has: has.clone(),
                    wanted: node.to_owned(),
                });
            }
            Holder::Node(_) => Grant::Node { issue },
            Holder::AnyNode => Grant::AnyNode { issue },
        };
        Ok((grant, credential.secret.clone()))
    }
}
