//! Lengths as messages show them.

use nalgebra::Point3;

/// Units of messages, the largest first, and their lengths, m.
const UNITS: [(&str, f64); 4] = [("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9)];

/// A length, m, with four digits in the unit that leaves one to three of them before the point.
pub(crate) fn length_text(metres: f64) -> String {
    let fits = |(_, unit): &(&str, f64)| metres.abs() >= *unit;
    let (name, unit) = UNITS.into_iter().find(fits).unwrap_or(UNITS[3]);
    let value = metres / unit;
    if value != 0.0 && !(1e-2..1e6).contains(&value.abs()) {
        return format!("{value:.3e} {name}");
    }
    let before = value.abs().max(1.0).log10() as usize;
    format!("{value:.*} {name}", 3_usize.saturating_sub(before))
}

/// The sides of a box, m: four decimals, and the digits of a side too thin for them.
pub(crate) fn size_text(sides: [f64; 3]) -> String {
    let [x, y, z] = sides.map(|side| match side {
        1e-3.. => format!("{side:.4}"),
        _ => format!("{side:.3e}"),
    });
    format!("{x} x {y} x {z} m")
}

/// A place as messages show it.
pub(crate) fn place_text(place: &Point3<f64>) -> String {
    // In a part of micrometres five decimals would all be zero.
    let is_small = place.iter().all(|c| c.abs() < 1e-3) && place.iter().any(|c| *c != 0.0);
    if is_small {
        return format!("({:.3e}, {:.3e}, {:.3e}) m", place.x, place.y, place.z);
    }
    format!("({:.5}, {:.5}, {:.5}) m", place.x, place.y, place.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_a_unit_that_shows_four_digits() {
        for (metres, text) in [
            (60.0, "60.00 m"),
            (0.06, "60.00 mm"),
            (4e-5, "40.00 um"),
            (6e-3, "6.000 mm"),
            (1e-10, "0.100 nm"),
            (1.0, "1.000 m"),
            (999.96e-3, "1000.0 mm"),
            (0.0, "0.000 nm"),
            (f64::INFINITY, "inf m"),
        ] {
            assert_eq!(length_text(metres), text);
        }
    }
}
