//! Awkward part files: what is in them, what is meant, and what `taut import` is expected to do.

mod clouds;
mod directions;
mod files;
mod openings;
mod surfaces;

use crate::import::solids::{Soup, VOLUME, part};

/// One file.
pub(crate) struct Case {
    /// File name, unique.
    pub file: &'static str,
    /// What is awkward.
    pub what: &'static str,
    pub bytes: Vec<u8>,
    /// Options beside `--out`, as on the command line.
    pub options: &'static str,
    /// The solid that is meant, m; empty where the file is refused.
    pub truth: Soup,
    /// How far the file itself is from that, m.
    pub error: f64,
    pub expected: Expected,
}

pub(crate) enum Expected {
    Imported {
        /// Of the findings, in order.
        kinds: &'static [&'static str],
        /// Connected parts.
        parts: usize,
        /// m^3.
        volume: f64,
    },
    /// What the refusal contains.
    Refused(&'static str),
}

/// Error of single precision for coordinates below 0.25 m: half a unit in the last place along each axis.
const SINGLE: f64 = 1.3e-8;

/// A file that is imported without a finding, as the box that most cases are made of.
fn good(file: &'static str, what: &'static str, bytes: Vec<u8>) -> Case {
    Case {
        file,
        what,
        bytes,
        options: "",
        truth: part(),
        error: SINGLE,
        expected: Expected::Imported {
            kinds: &[],
            parts: 1,
            volume: VOLUME,
        },
    }
}

fn bad(file: &'static str, what: &'static str, bytes: Vec<u8>, text: &'static str) -> Case {
    Case {
        file,
        what,
        bytes,
        options: "",
        truth: Vec::new(),
        error: 0.0,
        expected: Expected::Refused(text),
    }
}

impl Case {
    fn options(self, options: &'static str) -> Self {
        Self { options, ..self }
    }

    fn error(self, error: f64) -> Self {
        Self { error, ..self }
    }

    fn meant(self, truth: Soup) -> Self {
        Self { truth, ..self }
    }

    fn finds(mut self, found: &'static [&'static str]) -> Self {
        if let Expected::Imported { kinds, .. } = &mut self.expected {
            *kinds = found;
        }
        self
    }

    fn solids(mut self, count: usize, volume_m3: f64) -> Self {
        if let Expected::Imported { parts, volume, .. } = &mut self.expected {
            (*parts, *volume) = (count, volume_m3);
        }
        self
    }
}

pub(crate) fn cases() -> Vec<Case> {
    [
        files::formats(),
        files::units(),
        files::far_places(),
        surfaces::shared_vertices(),
        surfaces::thin_triangles(),
        surfaces::copies(),
        surfaces::whole_surfaces(),
        directions::turned(),
        directions::cavities(),
        directions::one_sided(),
        openings::holes(),
        openings::sheets(),
        openings::contacts(),
        clouds::clouds(),
        files::broken(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

const MM: f64 = 1e3;
