//! What several tables of the file have in common: paths, sub-tables, addresses, ports.

use std::net::IpAddr;
use std::path::{Path, PathBuf};

use crate::document::Section;
use crate::scene::shipped_scene_text;

/// Fastest stream or loop, 1/s.
pub(super) const MAX_RATE: f64 = 10_000.0;
/// Fewest states a second: an end, an edit and a new scene wait for the next.
pub(crate) const MIN_STATES: f64 = 1.0;
/// Fewest updates a second: constraints that are older than 100 ms fade, and so would the force between two.
pub(crate) const MIN_UPDATES: f64 = 20.0;

/// Paths in the file are relative to it.
pub(super) struct Files<'d> {
    pub(super) directory: &'d Path,
}

impl Files<'_> {
    pub(super) fn path(&self, section: &Section<'_>, key: &'static str) -> Option<PathBuf> {
        section.text(key).map(|text| self.directory.join(text))
    }

    /// A shipped scene's name as it is, else a file relative to the workbench's.
    pub(super) fn scene(&self, text: &str) -> String {
        if shipped_scene_text(text).is_some() {
            text.to_owned()
        } else {
            self.directory.join(text).display().to_string()
        }
    }

    /// A name of something shipped as it is, a file relative to the workbench's: one that has an ending or a folder.
    pub(super) fn named(&self, text: &str) -> String {
        if text.contains(['.', '/', '\\']) {
            self.directory.join(text).display().to_string()
        } else {
            text.to_owned()
        }
    }
}

/// An address to listen on.
pub(super) fn bind(section: &Section<'_>, default: IpAddr) -> IpAddr {
    let Some(text) = section.text("bind") else {
        return default;
    };
    text.parse().unwrap_or_else(|_| {
        let what = "which is no address; write one such as \"0.0.0.0\"";
        section.fault("bind", format_args!("is \"{text}\", {what}"));
        default
    })
}

/// Two ports that are not the same, unless both are free ones.
pub(super) fn ports(section: &Section<'_>, keys: [(&'static str, u16); 2]) -> [u16; 2] {
    let ports = keys.map(|(key, default)| port(section, key, default));
    if ports[0] == ports[1] && ports[0] != 0 {
        let [(first, _), (second, _)] = keys;
        let text = format!(
            "`{first}` and `{second}` in {} are both {}; choose another for one",
            section.name(),
            ports[0]
        );
        section.complain_of(second, text);
    }
    ports
}

pub(super) fn port(section: &Section<'_>, key: &'static str, default: u16) -> u16 {
    let port = section.integer(key, 0, i64::from(u16::MAX));
    port.unwrap_or(default)
}
