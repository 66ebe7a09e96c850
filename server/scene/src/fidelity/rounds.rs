//! Rows that are made anew for each force: rounds of implicit constraints on exact forms.
//!
//! | symbol | unit | meaning                                                       |
//! |--------|------|---------------------------------------------------------------|
//! | kappa  | 1/m  | curvature of the contact                                      |
//! | p      | m    | how deep the device is                                        |
//! | eps    | rad  | angle between the row's normal and the surface's              |
//! | phi    | rad  | rotation since the row was made                               |
//!
//! **Slides.** A round takes the row at the place that the last one led to. On a circle of the radius R = 1 / kappa the device is R - p from the centre and
//! eps past the row's place; projected on the row it is R high and (R - p) sin(eps) aside, whose normal is eps' on, tan(eps') = (1 - kappa p) sin(eps). What
//! is left is eps - eps': kappa p eps of a small angle, and eps^3 / 2 of a large one. A depth that leaves more than 0.85 of a small angle is given up.
//! That takes rows of which the method knows the true distance beyond their place: those of exact forms. A row of a facet is its plane.
//!
//! **Turns.** A row is linear in the rotation: a round is a Newton step, phi to phi^2 / 2.

use std::f64::consts::FRAC_PI_2;

/// Least share of an error that a round may leave to be of use.
const CONVERGING: f64 = 0.85;

/// What rounds leave of an angle by which a late row of an exact form is turned, rad.
#[must_use]
pub fn left_of_slide(angle: f64, curvature: f64, depth: f64, rounds: u32) -> f64 {
    let contraction = curvature * depth;
    let converging = contraction < CONVERGING && angle < FRAC_PI_2; // false for NaN
    if !converging {
        return angle;
    }
    (0..rounds).fold(angle, |angle, _| {
        angle - ((1.0 - contraction) * angle.sin()).atan()
    })
}

/// What rounds leave of a rotation since a row was made, rad.
#[must_use]
pub fn left_of_turn(angle: f64, rounds: u32) -> f64 {
    (0..rounds).fold(angle, |angle, _| 0.5 * angle * angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::Vector2;

    #[test]
    fn a_round_on_a_circle_leaves_as_much_as_said() {
        let (radius, depth) = (0.02_f64, 3e-3_f64);
        for angle in [0.02_f64, 0.1, 0.5] {
            let device = Vector2::new(angle.sin(), angle.cos()) * (radius - depth);
            let mut normal = Vector2::new(0.0, 1.0);
            for rounds in 1..=3 {
                // Where the row leads to, and the surface's normal there.
                let led = device + normal * (radius - device.dot(&normal));
                normal = led.normalize();
                let left = device.angle(&normal);
                let said = left_of_slide(angle, radius.recip(), depth, rounds);
                assert!(
                    (left - said).abs() < 1e-9,
                    "{angle} {rounds}: {left} {said}"
                );
            }
        }
    }

    #[test]
    fn rounds_that_do_not_shrink_leave_everything() {
        assert_eq!(left_of_slide(0.1, 100.0, 9e-3, 2), 0.1);
        assert_eq!(left_of_slide(0.1, 50.0, 2e-3, 0), 0.1);
        assert_eq!(left_of_slide(2.0, 50.0, 2e-3, 2), 2.0);
        // What a small angle leaves, and a flat contact.
        assert!((left_of_slide(1e-3, 50.0, 2e-3, 1) - 1e-4).abs() < 1e-8);
        assert!(left_of_slide(0.1, 0.0, 2e-3, 1) < 1e-3);
        assert_eq!(left_of_turn(0.1, 0), 0.1);
        assert!((left_of_turn(0.1, 2) - 0.5 * 0.005 * 0.005).abs() < 1e-15);
    }
}
