//! The spring between hand and body that a limit of force saturates.
//!
//! Stiffness is `kappa M`, kappa = k_h k_s: what the right answers of the recipes have. Beyond the limit of the force, or of the torque, its part is
//! scaled to the limit, as the force on the hand is. Source: the saturated virtual coupling of Barbic and James 2008.

use god_object::quasi_statics::Metric;
use god_object::spatial::{angular, linear};
use god_object::{Settings, Vector6};
use nalgebra::Matrix6;

use super::contacts::limited;
use super::settle::{Spring, settle};

/// The scale of a saturated part is found by so many solutions.
const ROUNDS: u32 = 8;
/// Change of a scale that is none.
const SAME: f64 = 1e-6;
/// N and N m: poses of a metre are rounded to 1e-16 of it, and springs have some thousand newtons to a metre.
const ROUNDING: f64 = 1e-12;

/// `M` times a number, as a matrix.
pub(super) fn mass_matrix(metric: &Metric, times: f64) -> Matrix6<f64> {
    let mut matrix = Matrix6::identity() * (metric.mass() * times);
    let inertia = metric.inertia_in_world() * times;
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
    matrix
}

/// What force and torque of a wrench are scaled by, so that neither is above its limit.
fn scales(wrench: &Vector6, settings: &Settings) -> [f64; 2] {
    [
        (settings.force_limit / linear(wrench).norm()).min(1.0),
        (settings.torque_limit / angular(wrench).norm()).min(1.0),
    ]
}

/// The force on the hand of a wrench: limited, and none where it is rounding of the poses.
pub(super) fn on_hand(wrench: &Vector6, settings: &Settings) -> Vector6 {
    // False for NaN, which has to be seen.
    if wrench.iter().all(|x| x.abs() < ROUNDING) {
        return Vector6::zeros();
    }
    limited(wrench, settings)
}

/// The motion after which the spring to a hand that is `difference` away and the springs of the contacts
/// balance.
pub(super) fn balance(
    stiffness: &Matrix6<f64>,
    difference: &Vector6,
    (springs, contact_stiffness): (&[Spring], f64),
    settings: &Settings,
) -> Option<Vector6> {
    let mut by = [1.0; 2];
    let mut motion = Vector6::zeros();
    for _ in 0..ROUNDS {
        let mut matrix = *stiffness;
        for (row, mut entries) in matrix.row_iter_mut().enumerate() {
            entries *= by[row / 3];
        }
        let pull = matrix * difference;
        motion = settle(&matrix, &pull, springs, contact_stiffness)?;
        let now = scales(&(stiffness * (difference - motion)), settings);
        let same = (now[0] - by[0]).abs().max((now[1] - by[1]).abs()) <= SAME;
        by = now;
        if same {
            break;
        }
    }
    Some(motion)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_is_pressed_with_no_more_than_the_limit() {
        let settings = Settings::for_size(0.01);
        let way = Vector6::z();
        let contact = Spring {
            jacobian: way,
            push: way,
            depth: 0.0,
        };
        let stiffness = Matrix6::identity() * 1000.0;
        let contact_stiffness = 1e5;
        let deep = way * -0.05;
        let motion = balance(
            &stiffness,
            &deep,
            (&[contact], contact_stiffness),
            &settings,
        );
        let depth = -motion.expect("not singular").z;
        let force = contact_stiffness * depth;
        assert!((force - settings.force_limit).abs() < 1e-3, "{force} N");
        // Where nothing is touched the body is where the hand is, however far that is.
        let free = balance(
            &stiffness,
            &-deep,
            (&[contact], contact_stiffness),
            &settings,
        );
        assert!((free.expect("not singular") + deep).norm() < 1e-15);
    }
}
