//! `[vrpn]`, `[observers]` and `[zenoh]`: who may look on without taut's own client. All are off unless the file says otherwise.

use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;

use super::parts::{Files, MIN_STATES, bind, port};
use super::ros_names::is_word;
use super::token::read_token;
use crate::document::{Range, Section};

/// Fastest stream to those who look on, 1/s.
const MAX_RATE: f64 = 1000.0;
/// Fastest stream of JSON lines, 1/s: no screen shows more, and no script reads more.
const MAX_LINE_RATE: f64 = 60.0;
/// Last domain of ROS 2 that has ports on every system.
const LAST_ROS_DOMAIN: i64 = 101;
/// Most that may be let in.
const MAX_CLIENTS: i64 = 1024;
/// Longest name of a VRPN device, and of a workbench among Zenoh's keys.
const MAX_NAME: usize = 64;

/// The VRPN server.
#[derive(Clone, Debug, PartialEq)]
pub struct Vrpn {
    /// Whether there is one.
    pub enabled: bool,
    /// Interface of its ports; VRPN knows IPv4 only.
    pub bind: Ipv4Addr,
    /// TCP and UDP port; 0 takes a free one.
    pub port: u16,
    /// Reports of each sensor per second.
    pub rate: f64,
    /// Name of the device.
    pub tracker: String,
    /// Most clients at a time.
    pub max_clients: usize,
}

/// JSON lines over WebSocket and HTTP.
#[derive(Clone, Debug, PartialEq)]
pub struct ObserverStream {
    /// Whether there are any.
    pub enabled: bool,
    /// Interface of the port. Other than loopback it needs a token.
    pub bind: IpAddr,
    /// TCP port; 0 takes a free one.
    pub port: u16,
    /// States per second.
    pub rate: f64,
    /// File with the token that observers must show.
    pub token_file: Option<PathBuf>,
    /// Most observers at a time.
    pub max_observers: usize,
}

/// Publication through Zenoh routers.
#[derive(Clone, Debug, PartialEq)]
pub struct Zenoh {
    /// Whether there is any.
    pub enabled: bool,
    /// Name of this workbench among the keys: `taut/<name>/...`.
    pub name: String,
    /// Routers that are dialled, as Zenoh writes them: `tcp/router.example:7447`.
    pub connect: Vec<String>,
    /// Zenoh's own configuration, for TLS and access: a JSON5 file.
    pub config: Option<PathBuf>,
    /// States per second.
    pub rate: f64,
    /// Also as a node of ROS 2, as rmw_zenoh sees one.
    pub ros: bool,
    /// `ROS_DOMAIN_ID` of that node.
    pub ros_domain: u8,
}

impl Default for Vrpn {
    fn default() -> Self {
        Self {
            enabled: false,
            bind: Ipv4Addr::LOCALHOST,
            port: 3883,
            rate: 120.0,
            tracker: "taut".to_owned(),
            max_clients: 16,
        }
    }
}

impl Default for ObserverStream {
    fn default() -> Self {
        Self {
            enabled: false,
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            port: 4860,
            rate: 60.0,
            token_file: None,
            max_observers: 128,
        }
    }
}

impl Default for Zenoh {
    fn default() -> Self {
        Self {
            enabled: false,
            name: "workbench".to_owned(),
            connect: Vec::new(),
            config: None,
            rate: 60.0,
            ros: false,
            ros_domain: 0,
        }
    }
}

impl ObserverStream {
    /// The token, if the file names one.
    ///
    /// # Errors
    /// A sentence, where its file cannot be read or holds none.
    pub fn token(&self) -> Result<Option<String>, String> {
        let file = self.token_file.as_deref();
        file.map(|file| read_token("observers", file)).transpose()
    }
}

pub(super) fn vrpn(section: &Section<'_>) -> Vrpn {
    let default = Vrpn::default();
    let bind = match bind(section, IpAddr::V4(default.bind)) {
        IpAddr::V4(address) => address,
        IpAddr::V6(_) => {
            let what = "is an IPv6 address, which VRPN does not know; write an IPv4 one";
            section.fault("bind", what);
            default.bind
        }
    };
    Vrpn {
        enabled: section.boolean("enabled").unwrap_or(false),
        bind,
        port: port(section, "port", default.port),
        rate: rate(section, MAX_RATE, default.rate),
        tracker: name(section, "tracker").unwrap_or(default.tracker),
        max_clients: most(section, "max_clients", default.max_clients),
    }
}

pub(super) fn observers(section: &Section<'_>, files: &Files<'_>) -> ObserverStream {
    let default = ObserverStream::default();
    let stream = ObserverStream {
        enabled: section.boolean("enabled").unwrap_or(false),
        bind: bind(section, default.bind),
        port: port(section, "port", default.port),
        rate: rate(section, MAX_LINE_RATE, default.rate),
        token_file: files.path(section, "token_file"),
        max_observers: most(section, "max_observers", default.max_observers),
    };
    if stream.enabled && !stream.bind.is_loopback() && stream.token_file.is_none() {
        section.fault(
            "bind",
            "lets other machines in, but there is no token; name one by token_file = \"observers.token\", or bind to \"127.0.0.1\"",
        );
    }
    stream
}

pub(super) fn zenoh(section: &Section<'_>, files: &Files<'_>) -> Zenoh {
    let default = Zenoh::default();
    let zenoh = Zenoh {
        enabled: section.boolean("enabled").unwrap_or(false),
        name: name(section, "name").unwrap_or(default.name),
        connect: section.words("connect"),
        config: files.path(section, "config"),
        rate: rate(section, MAX_RATE, default.rate),
        ros: section.boolean("ros").unwrap_or(false),
        ros_domain: section
            .integer("ros_domain", 0, LAST_ROS_DOMAIN)
            .unwrap_or(default.ros_domain),
    };
    if zenoh.ros && !is_word(&zenoh.name) {
        let what = "which is no namespace of ROS 2; write letters, digits and `_`, no digit first, or ros = false";
        section.fault("name", format_args!("is \"{}\", {what}", zenoh.name));
    }
    if zenoh.enabled && zenoh.connect.is_empty() && zenoh.config.is_none() {
        let text = "[zenoh] names no router; write connect = [\"tcp/router.example:7447\"], or config = \"zenoh.json5\"";
        section.complain(section.at(), text);
    }
    zenoh
}

/// A state that did not change is told again once a second, and no rate is slower.
fn rate(section: &Section<'_>, fastest: f64, default: f64) -> f64 {
    section.number_or("rate", Range::Between(MIN_STATES, fastest), default)
}

fn most(section: &Section<'_>, key: &'static str, default: usize) -> usize {
    section.integer(key, 1, MAX_CLIENTS).unwrap_or(default)
}

/// A name that needs no quoting anywhere.
fn name(section: &Section<'_>, key: &'static str) -> Option<String> {
    let text = section.text(key)?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if text.is_empty() || text.len() > MAX_NAME || !text.chars().all(is_plain) {
        let wanted = format_args!("1 to {MAX_NAME} letters, digits, `-`, `_` or `.`");
        section.fault(key, format_args!("is \"{text}\"; write {wanted}"));
        return None;
    }
    Some(text.to_owned())
}
