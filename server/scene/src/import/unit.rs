//! The unit in which a part's file is read.

use std::path::Path;

use crate::check::SUSPICIOUS_SIZES;
use crate::mesh_file::{RawMesh, is_gltf_path};
use crate::scene::LENGTH_UNITS;

/// A unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LengthUnit {
    /// As in files and on the command line.
    pub name: &'static str,
    /// m.
    pub metres: f64,
}

impl LengthUnit {
    const METRE: Self = Self {
        name: "m",
        metres: 1.0,
    };

    fn all() -> impl Iterator<Item = Self> {
        LENGTH_UNITS
            .into_iter()
            .map(|(name, metres)| Self { name, metres })
    }
}

impl std::str::FromStr for LengthUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::all().find(|unit| unit.name == text).ok_or_else(|| {
            let names: Vec<&str> = Self::all().map(|unit| unit.name).collect();
            format!("write one of {}", names.join(", "))
        })
    }
}

/// Smallest and largest part, m: beyond these no length of the method means anything.
const SIZES: [f64; 2] = [1e-6, 1e5];

/// The unit of a part, and whether nobody named it; or a sentence that says what to write.
///
/// A shell `around` it, m, makes the part larger. glTF is in metres. Other files are in the `named` unit; without one in metres, if that is a size that a hand can hold.
pub(super) fn unit_of(
    path: &Path,
    mesh: &RawMesh,
    named: Option<LengthUnit>,
    around: f64,
) -> Result<(LengthUnit, bool), String> {
    let longest = mesh.bounds().map_or(0.0, |(low, high)| (high - low).max());
    let (unit, assumed) = match named {
        _ if is_gltf_path(path) => (LengthUnit::METRE, false),
        Some(unit) => (unit, false),
        None => (LengthUnit::METRE, true),
    };
    if assumed && is_doubtful(longest + around) {
        return Err(format!(
            "names no unit, and its longest side is {}: nothing for a hand if that is in metres; {}",
            short(longest),
            advice(longest)
        ));
    }
    let size = longest * unit.metres + around;
    let [least, most] = SIZES;
    if (least..=most).contains(&size) {
        Ok((unit, assumed))
    } else {
        Err(format!(
            "has a longest side of {size:.3e} m, but must have one between {least} and {most} m; check its unit and its coordinates"
        ))
    }
}

/// Whether a longest side, m, is none of a part for a hand.
pub(super) fn is_doubtful(longest: f64) -> bool {
    let [least, most] = SUSPICIOUS_SIZES;
    let usual = (least..=most).contains(&longest);
    !usual
}

/// At most seven digits.
fn short(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

fn advice(longest: f64) -> String {
    let likely: Vec<String> = LengthUnit::all()
        .filter(|unit| !is_doubtful(longest * unit.metres))
        .map(|unit| format!("--unit {} ({:.4} m)", unit.name, longest * unit.metres))
        .collect();
    if likely.is_empty() {
        "write --unit with what it is in, --unit m if it is so small or large".to_owned()
    } else {
        format!("write {}", likely.join(" or "))
    }
}
