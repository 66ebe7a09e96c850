//! Passivity controller: damping that takes out the energy which the port gave out.
//!
//! | symbol | name in code | unit | meaning |
//! |--------|--------------|------|---------|
//! | E      | `debt`       | J    | energy given to the hand that it had not put in; negative is credit |
//! | v      | `velocity`   | m/s, rad/s | of the reference point, over the last tick |
//! | alpha  | `damping`    | N s/m | `E / (T v^2)`, at most `max_damping` |
//!
//! While E > 0 the wrench gets `-alpha v` on top, so that the next tick takes E back, as far as the damping's limit allows; what
//! is left waits for the next tick. A spring stores energy that the hand has put in and may give it back: that is credit, kept up to
//! `max_credit`. After [`WINDOW`] ticks without a commanded wrench nothing is stored any more, and credit is forgotten.
//!
//! Source: Hannaford & Ryu 2002, time-domain passivity control; impedance causality.

use nalgebra::{Vector3, Vector6};

use super::clamp::join;

/// Ticks of free motion after which no credit is left.
const WINDOW: u32 = 30;

/// Slower than this nothing can be taken out, and a noisy velocity would only rattle: m/s, rad/s.
const SLOWEST: (f64, f64) = (1e-3, 1e-2);

/// Whether energy is only observed or taken out too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Passivity {
    /// Measured and reported.
    #[default]
    Observe,
    /// Taken out by damping.
    Control,
}

/// Limits of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassivitySettings {
    /// What is done.
    pub mode: Passivity,
    /// Largest damping, N s/m. A sampled damper is itself stable only well below mass over period.
    pub max_damping: f64,
    /// Largest rotational damping, N m s/rad.
    pub max_rotational_damping: f64,
    /// Most energy that may be owed to the hand, J: what the stiffest contact stores at the largest force.
    pub max_credit: f64,
    /// Energy below which nothing is done, J: what the zero-order hold of a gentle contact leaks.
    pub dead_band: f64,
}

impl Default for PassivitySettings {
    /// Observe; 20 N s/m, 0.02 N m s/rad; 0.2 J (20 N at 1000 N/m); 0.01 mJ.
    fn default() -> Self {
        Self {
            mode: Passivity::Observe,
            max_damping: 20.0,
            max_rotational_damping: 0.02,
            max_credit: 0.2,
            dead_band: 1e-5,
        }
    }
}

/// Accounts for the energy and damps. No allocation.
#[derive(Clone, Debug)]
pub(super) struct PassivityController {
    settings: PassivitySettings,
    debt: f64,
    free_ticks: u32,
}

/// What the controller adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Damping {
    /// N, N m.
    pub(super) wrench: Vector6<f64>,
    /// Energy that it is to take out, J; zero when it does nothing.
    pub(super) debt: f64,
}

impl Damping {
    const NONE: Self = Self {
        wrench: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        debt: 0.0,
    };
}

impl PassivityController {
    pub(super) fn new(settings: PassivitySettings) -> Self {
        Self {
            settings,
            debt: 0.0,
            free_ticks: 0,
        }
    }

    /// `work` is what the wrench of the last tick has given to the hand, J; `travel` the displacement of the reference point and the
    /// rotation meanwhile, over `seconds`; `commanded` the wrench before the controller.
    pub(super) fn step(
        &mut self,
        work: f64,
        travel: &Vector6<f64>,
        seconds: f64,
        commanded: &Vector6<f64>,
    ) -> Damping {
        let settings = &self.settings;
        if settings.mode == Passivity::Observe {
            return Damping::NONE;
        }
        let is_free = *commanded == Vector6::zeros();
        self.free_ticks = if is_free { self.free_ticks + 1 } else { 0 };
        if work.is_finite() {
            self.debt = (self.debt + work).max(-settings.max_credit);
        }
        if self.free_ticks >= WINDOW {
            self.free_ticks = WINDOW;
            self.debt = self.debt.max(0.0);
        }
        let due = self.debt > settings.dead_band && seconds > 0.0; // false for NaN
        if !due {
            return Damping::NONE;
        }
        let linear: Vector3<f64> = travel.fixed_rows::<3>(0) / seconds;
        let angular: Vector3<f64> = travel.fixed_rows::<3>(3) / seconds;
        // Translation first: it carries nearly all of the energy. The rotation takes what is left.
        let (force, taken) =
            self.brake(&linear, settings.max_damping, SLOWEST.0, self.debt, seconds);
        let (torque, _) = self.brake(
            &angular,
            settings.max_rotational_damping,
            SLOWEST.1,
            self.debt - taken,
            seconds,
        );
        Damping {
            wrench: join(&force, &torque),
            debt: self.debt,
        }
    }

    /// The force against `velocity` that takes `energy` out within `seconds`, and what it will take at this velocity.
    fn brake(
        &self,
        velocity: &Vector3<f64>,
        max_damping: f64,
        slowest: f64,
        energy: f64,
        seconds: f64,
    ) -> (Vector3<f64>, f64) {
        let speed = velocity.norm();
        let brakes = speed > slowest && energy > 0.0; // false for NaN
        if !brakes {
            return (Vector3::zeros(), 0.0);
        }
        let damping = (energy / (seconds * speed * speed)).min(max_damping);
        (-velocity * damping, damping * speed * speed * seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn controller() -> PassivityController {
        PassivityController::new(PassivitySettings {
            mode: Passivity::Control,
            ..PassivitySettings::default()
        })
    }

    const T: f64 = 1e-3;

    #[test]
    fn it_takes_out_what_came_out_in_one_tick_if_it_may() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        let damping = controller.step(1e-4, &travel, T, &Vector6::x());
        // 1e-4 J at 0.1 m/s in 1 ms: 10 N s/m.
        assert!((damping.wrench.x + 1.0).abs() < 1e-12);
        // At the same velocity that force gives -1e-4 J: the debt is paid.
        let paid = controller.step(damping.wrench.x * travel.x, &travel, T, &Vector6::x());
        assert_eq!(paid.wrench, Vector6::zeros());
    }

    #[test]
    fn its_damping_is_bounded_and_the_rest_waits() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        for _ in 0..10 {
            let damping = controller.step(0.01, &travel, T, &Vector6::x());
            assert!(
                (damping.wrench.x + 2.0).abs() < 1e-12,
                "20 N s/m at 0.1 m/s"
            );
        }
        let standing = controller.step(0.0, &Vector6::zeros(), T, &Vector6::x());
        assert_eq!(standing.wrench, Vector6::zeros());
        assert!(standing.debt > 0.09);
    }

    #[test]
    fn credit_is_kept_in_contact_and_forgotten_in_free_space() {
        let travel = Vector6::x() * (0.1 * T);
        let mut in_contact = controller();
        let _ = in_contact.step(-0.01, &travel, T, &Vector6::x());
        let back = in_contact.step(0.009, &travel, T, &Vector6::x());
        assert_eq!(back, Damping::NONE);

        let mut let_go = controller();
        let _ = let_go.step(-0.01, &travel, T, &Vector6::x());
        for _ in 0..WINDOW {
            let _ = let_go.step(0.0, &travel, T, &Vector6::zeros());
        }
        let acts = let_go.step(0.009, &travel, T, &Vector6::x());
        assert!(acts.debt > 0.0 && acts.wrench.x < 0.0);
    }

    #[test]
    fn work_that_is_not_finite_changes_nothing() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        let damping = controller.step(f64::NAN, &travel, T, &Vector6::x());
        assert_eq!(damping, Damping::NONE);
    }
}
