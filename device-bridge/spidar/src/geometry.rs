//! What a string-driven device is made of.

use nalgebra::Point3;

use crate::geometry_file::{GeometryError, read};
use crate::{PerString, Pose, STRINGS};

/// The frame, the grip and the motors of one device.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Name, for messages and pictures.
    pub name: String,
    /// Keys of the file whose values are assumptions, not published or measured.
    pub assumed: Vec<String>,
    /// Where each string leaves the frame, m, frame axes.
    pub motors: [Point3<f64>; STRINGS],
    /// Where each string is tied to the grip, m, grip axes.
    pub grips: [Point3<f64>; STRINGS],
    /// String length per encoder count, m; negative where the encoder counts backwards.
    pub metres_per_count: PerString,
    /// Least tension that keeps a string taut, N.
    pub tension_min: f64,
    /// Largest tension of a motor, N.
    pub tension_max: f64,
    /// Amplifier input per tension, V/N, where it is known.
    pub volts_per_newton: Option<f64>,
    /// Sign of the amplifier input that winds up: -1 where a motor turns the other way, else 1.
    pub winding: PerString,
    /// Rotor and drum, kg m^2.
    pub motor_inertia: f64,
    /// Radius at which the string is wound, m.
    pub drum_radius: f64,
    /// First-order lag of tension behind command, s.
    pub motor_time_constant: f64,
    /// Mass of the grip, kg.
    pub grip_mass: f64,
    /// Viscous damping of the device along each axis, N s/m.
    pub grip_damping: f64,
}

/// The shipped files, by name.
const SHIPPED: [(&str, &str, &str); 4] = [
    ("g6x3r", "g6x3r.toml", include_str!("../devices/g6x3r.toml")),
    ("g6x4r", "g6x4r.toml", include_str!("../devices/g6x4r.toml")),
    ("g6x5r", "g6x5r.toml", include_str!("../devices/g6x5r.toml")),
    ("wb", "wb.toml", include_str!("../devices/wb.toml")),
];

impl Geometry {
    /// Reads the text of a geometry file; `file` is its name in messages.
    ///
    /// # Errors
    /// Everything that is wrong with the file, each fault with line, key and what to do.
    pub fn parse(file: &str, text: &str) -> Result<Self, GeometryError> {
        read(file, text)
    }

    /// The names of the shipped geometries.
    pub fn shipped_names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, ..)| *name)
    }

    /// A shipped geometry by its name, in any case; `None` if there is none of that name.
    #[must_use]
    pub fn shipped(name: &str) -> Option<Self> {
        let (_, file, text) = SHIPPED
            .iter()
            .find(|(shipped, ..)| shipped.eq_ignore_ascii_case(name))?;
        // The tests read every shipped file.
        read(file, text).ok()
    }

    /// G: the longest lever of the grip, m. Angles times G are lengths of the same size as the strings' changes.
    #[must_use]
    pub fn arm(&self) -> f64 {
        self.grips
            .iter()
            .map(|grip| grip.coords.norm())
            .fold(0.0, f64::max)
    }

    /// The string lengths at a pose, m.
    #[must_use]
    pub fn lengths(&self, frame_from_grip: &Pose) -> PerString {
        std::array::from_fn(|i| (self.motors[i] - frame_from_grip * self.grips[i]).norm())
    }

    /// The string that is shortest at a pose, and its length in m.
    #[must_use]
    pub fn shortest(lengths: &PerString) -> (usize, f64) {
        let mut shortest = (0, lengths[0]);
        for (i, length) in lengths.iter().enumerate().skip(1) {
            if *length < shortest.1 {
                shortest = (i, *length);
            }
        }
        shortest
    }

    /// Half the smallest edge of the box that the motors span, m.
    #[must_use]
    pub fn half_width(&self) -> f64 {
        let sides = (0..3).map(|axis| self.span(axis));
        sides
            .map(|(low, high)| 0.5 * (high - low))
            .fold(f64::INFINITY, f64::min)
    }

    /// Least and largest coordinate of the motors along an axis, m.
    fn span(&self, axis: usize) -> (f64, f64) {
        let along = self.motors.iter().map(|motor| motor[axis]);
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        })
    }

    /// How far a point (frame axes, m) lies beyond the box that the motors span, along the worst axis; not above zero inside.
    #[must_use]
    pub fn beyond_box(&self, point: &Point3<f64>) -> f64 {
        (0..3)
            .map(|axis| {
                let (low, high) = self.span(axis);
                (low - point[axis]).max(point[axis] - high)
            })
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Amplifier inputs for tensions, V; `None` where the file gives no `volts_per_newton`.
    #[must_use]
    pub fn volts(&self, tensions: &PerString) -> Option<PerString> {
        let volts_per_newton = self.volts_per_newton?;
        Some(std::array::from_fn(|i| {
            tensions[i] * volts_per_newton * self.winding[i]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_geometries_are_read_and_symmetric() {
        for name in Geometry::shipped_names() {
            let Some(geometry) = Geometry::shipped(name) else {
                panic!("{name} cannot be read");
            };
            let lengths = geometry.lengths(&Pose::identity());
            for length in &lengths {
                // Opposite corners of a box, levers of one length: every string is as long as its mirror image.
                let twins = lengths.iter().filter(|l| (*l - length).abs() < 1e-12);
                assert!(twins.count() >= 4, "{name}: {lengths:?}");
            }
            assert!(!geometry.assumed.is_empty(), "{name} declares assumptions");
        }
    }

    #[test]
    fn the_published_dimensions_are_those_of_the_files() {
        let geometry = Geometry::shipped("G6X3R").expect("shipped");
        // Turned by -45 degrees about y, a square of 0.12 m stands on its corner.
        let corner = 0.06 * std::f64::consts::SQRT_2;
        assert!((geometry.motors[0] - Point3::new(-corner, -0.076, 0.0)).norm() < 1e-12);
        assert!((geometry.arm() - 0.0225).abs() < 1e-12);
        assert_eq!(geometry.metres_per_count[2], -1.66555e-5);
        assert_eq!(
            geometry.volts(&[10.0; 8]).map(|volts| volts[0]),
            Some(3.653)
        );
    }

    #[test]
    fn the_mdf_frame_has_its_own_order_and_windings() {
        let geometry = Geometry::shipped("g6x4r").expect("shipped");
        let volts = geometry.volts(&[1.0; 8]);
        let signs = volts.map(|volts| volts.map(|volt| (volt * 100.0).round()));
        assert_eq!(signs, Some([8.0, 8.0, -8.0, -8.0, -8.0, -8.0, 8.0, 8.0]));
        let counts = geometry.metres_per_count.map(f64::signum);
        assert_eq!(counts, [-1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0, -1.0]);
        assert!(
            (geometry.half_width() - 0.069).abs() < 1e-12
                && (geometry.arm() - 0.0225).abs() < 1e-12
        );
    }
}
