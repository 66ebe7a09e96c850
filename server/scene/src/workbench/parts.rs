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

/// Reads a table and complains of the keys that were not asked for.
pub(super) fn table<T>(
    parent: &Section<'_>,
    key: &'static str,
    read: impl FnOnce(&Section<'_>) -> T,
) -> Option<T> {
    let section = parent.section(key)?;
    let value = read(&section);
    section.finish();
    Some(value)
}

/// An address to listen on.
pub(super) fn bind(section: &Section<'_>, default: IpAddr) -> Option<IpAddr> {
    let Some(text) = section.text("bind") else {
        return (!section.has("bind")).then_some(default);
    };
    let address = text.parse();
    if address.is_err() {
        let at = section.at_key("bind");
        section.complain(
            at,
            format!(
                "`bind` in {} is \"{text}\", which is no address; write one such as \"0.0.0.0\"",
                section.name()
            ),
        );
    }
    address.ok()
}

pub(super) fn port(section: &Section<'_>, key: &'static str, default: u16) -> u16 {
    section
        .integer(key, 0, i64::from(u16::MAX))
        .and_then(|n| u16::try_from(n).ok())
        .unwrap_or(default)
}
