//! From tensions to the digits of the boards' converters.

use taut_spidar::{Geometry, PerString, STRINGS};

use super::error::BoardsError;

/// Digits per volt of the boards' converter, and its largest.
const DIGITS: (f64, f64) = (4096.0 / 3.3, 4095.0);

/// Digits of a board's converter per newton of a string's tension, with the sign of its winding.
pub(crate) fn digits_per_newton(geometry: &Geometry) -> Result<PerString, BoardsError> {
    let volts = geometry.volts(&[1.0; STRINGS]);
    let volts = volts.ok_or_else(|| BoardsError::NoVolts(geometry.name.clone()))?;
    Ok(volts.map(|volts| volts * DIGITS.0))
}

/// The digit that a tension is; zero where it is no number.
pub(crate) fn digit(tension: f64, per_newton: f64) -> i16 {
    // Within 16 bits, and zero for NaN.
    (tension * per_newton).round().clamp(-DIGITS.1, DIGITS.1) as i16
}

/// The geometry with no more tension than the converters can ask for: a wrench of which one string pulls less than its share is another wrench.
///
/// # Errors
/// [`BoardsError::NoVolts`]; [`BoardsError::OutOfRange`]: they cannot ask for the least tension.
pub(crate) fn within_range(geometry: &Geometry) -> Result<Geometry, BoardsError> {
    let per_newton = digits_per_newton(geometry)?;
    let largest = per_newton
        .iter()
        .fold(0.0_f64, |largest, digits| largest.max(digits.abs()));
    let most = DIGITS.1 / largest;
    if most <= geometry.tension_min {
        return Err(BoardsError::OutOfRange {
            name: geometry.name.clone(),
            least: geometry.tension_min,
            most,
        });
    }
    if most < geometry.tension_max {
        tracing::warn!(
            "{}: `tension_max` is {} N, but the converters of motor boards reach {most:.2} N: no string is asked for more",
            geometry.name,
            geometry.tension_max
        );
    }
    Ok(Geometry {
        tension_max: geometry.tension_max.min(most),
        ..geometry.clone()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_tension_is_asked_for_that_the_converters_do_not_reach() {
        let shipped = |name| Geometry::shipped(name).expect("shipped");
        // 20 N are 7.3 V there.
        let strong = within_range(&shipped("g6x3r")).expect("its least tension is reached");
        let asked = strong.tension_max * 0.3653 * DIGITS.0;
        assert!((asked - DIGITS.1).abs() < 1e-6, "{asked}");
        assert_eq!(strong.tension_min, 0.3);
        let own = shipped("g6x4r");
        assert_eq!(within_range(&own), Ok(own));

        let hopeless = Geometry {
            tension_min: 10.0,
            ..shipped("g6x3r")
        };
        let refused = within_range(&hopeless)
            .expect_err("10 N are 3.7 V")
            .to_string();
        assert!(
            refused.contains("10 N") && refused.contains("9.03 N"),
            "{refused}"
        );
    }
}
