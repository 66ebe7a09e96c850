//! `taut doctor --device`: what a string-driven device can render, as figures and as a picture.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use taut_bridge::string_geometry;
use taut_spidar::{Extreme, picture, summary, workspace_map};

use crate::shared::failure::Failure;

const MM: f64 = 1e3;

/// What was found about a device.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct DeviceReport {
    /// The device's name.
    pub device: String,
    /// Keys of its file that are assumptions.
    pub assumed: Vec<String>,
    /// Ratio of the largest to the smallest singular value of the strings at the centre, moments over the grip's arm.
    pub condition: f64,
    /// Pure force at the centre, N.
    pub force_n: Extremes,
    /// Pure torque at the centre, N m.
    pub torque_nm: Extremes,
    /// Where the strings can be taut without any wrench.
    pub pretension: Pretension,
    /// The picture.
    pub picture: PathBuf,
}

/// Largest pure forces or torques.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Extremes {
    /// Along the weakest of the six axis directions.
    pub weakest_axis: f64,
    /// Along the weakest of 26 directions: axes, edges and corners of a cube.
    pub weakest: f64,
    /// The direction of that, a unit vector.
    pub weakest_direction: [f64; 3],
    /// Along the strongest of them.
    pub strongest: f64,
}

/// Poses around the centre.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Pretension {
    /// Radius of the positions, mm.
    pub radius_mm: f64,
    /// Largest rotation, degrees.
    pub rotation_deg: f64,
    /// Share of these poses at which all strings can be taut without any wrench, percent.
    pub share_percent: f64,
    /// Largest force that is left over at zero command at the others, N.
    pub stray_force_n: f64,
}

/// Examines the device `named`: a shipped geometry by its name, or a geometry file. Writes the picture to `out`.
///
/// # Errors
/// A file that cannot be read, is no geometry, or a picture that cannot be written.
pub(crate) fn examine(named: &str, out: Option<&Path>) -> Result<DeviceReport, Failure> {
    let geometry = string_geometry(named).map_err(Failure::bad_input)?;
    let default = PathBuf::from(format!("{}-workspace.svg", file_name_of(&geometry.name)));
    let path = out.map_or(default, Path::to_owned);
    let summary = summary(&geometry);
    let svg = picture(&geometry, &summary, &workspace_map(&geometry));
    std::fs::write(&path, svg).map_err(|error| {
        Failure::bad_input(format!(
            "{}: the picture cannot be written: {error}; choose another place by --out",
            path.display()
        ))
    })?;
    let centre = &summary.centre;
    Ok(DeviceReport {
        device: geometry.name,
        assumed: geometry.assumed,
        condition: centre.condition,
        force_n: extremes(
            &centre.axis_force,
            &centre.weakest_force,
            &centre.strongest_force,
        ),
        torque_nm: extremes(
            &centre.axis_torque,
            &centre.weakest_torque,
            &centre.strongest_torque,
        ),
        pretension: Pretension {
            radius_mm: MM * summary.ball_radius,
            rotation_deg: summary.ball_rotation.to_degrees(),
            share_percent: 100.0 * summary.ball_pretension,
            stray_force_n: summary.ball_stray_force,
        },
        picture: path,
    })
}

/// A device's name as part of a file name.
fn file_name_of(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() {
            c.to_ascii_lowercase()
        } else {
            '-'
        }
    };
    name.chars().map(plain).collect()
}

fn extremes(axis: &Extreme, weakest: &Extreme, strongest: &Extreme) -> Extremes {
    Extremes {
        weakest_axis: axis.size,
        weakest: weakest.size,
        weakest_direction: weakest.direction.into(),
        strongest: strongest.size,
    }
}

impl fmt::Display for DeviceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row = |f: &mut fmt::Formatter<'_>,
                   what: &str,
                   unit: &str,
                   digits: usize,
                   e: &Extremes| {
            let [x, y, z] = e.weakest_direction;
            writeln!(
                f,
                "{what} at the centre: {:.digits$} {unit} along the weakest axis; {:.digits$} to {:.digits$} {unit} over 26 directions, weakest along ({x:.2}, {y:.2}, {z:.2})",
                e.weakest_axis, e.weakest, e.strongest
            )
        };
        writeln!(
            f,
            "{}: condition {:.1} at the centre",
            self.device, self.condition
        )?;
        row(f, "pure force", "N", 1, &self.force_n)?;
        row(f, "pure torque", "N m", 3, &self.torque_nm)?;
        let taut = &self.pretension;
        writeln!(
            f,
            "all strings taut without any wrench: at {:.0} % of the poses within {:.0} mm and {:.0} degrees; elsewhere up to {:.2} N are left over at zero command",
            taut.share_percent, taut.radius_mm, taut.rotation_deg, taut.stray_force_n
        )?;
        if !self.assumed.is_empty() {
            writeln!(f, "assumed, not measured: {}", self.assumed.join(", "))?;
        }
        write!(f, "picture: {}", self.picture.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shipped_device_is_examined_and_drawn() {
        let directory = tempfile::tempdir().expect("no directory for the picture");
        let out = directory.path().join("map.svg");
        let report = examine("G6X5R", Some(&out)).expect("a shipped device");
        assert!((report.force_n.weakest_axis - 6.77).abs() < 0.01);
        assert!(report.to_string().contains("6.8 N along the weakest axis"));
        assert!(std::fs::read_to_string(&out).is_ok_and(|svg| svg.starts_with("<svg")));
    }

    #[test]
    fn what_is_no_device_is_explained() {
        let Err(error) = examine("no-such-device", None) else {
            panic!("there is none");
        };
        let sentence = error.to_string();
        assert!(
            sentence.contains("no-such-device") && sentence.contains("g6x3r"),
            "{sentence}"
        );
    }
}
