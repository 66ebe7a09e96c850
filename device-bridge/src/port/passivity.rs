//! Passivity controller: damping that takes out the energy which the port gave out, and a reserve that bounds what it can give out at all.
//!
//! | symbol | name in code | unit | meaning |
//! |--------|--------------|------|---------|
//! | E      | `debt`       | J    | energy given to the hand that neither it nor a moving obstacle had put in; negative is credit |
//! | v      | `velocity`   | m/s, rad/s | of the reference point, between the last two samples that differ |
//! | T      | `span`       | s    | between these, a tick or more |
//! | alpha  | `damping`    | N s/m | `E / (T v^2)`, at most `max_damping` |
//! | K, r   | [`ContactBound`] | N/m, m | the stiffest contact that the port renders |
//!
//! While E > 0 the wrench gets `-alpha v` on top, so that the time to the next sample takes E back, as far as the damping's limit allows; what
//! is left waits for the next. A spring stores energy that the hand has put in and may give it back: that is credit, kept up to
//! `max_credit`. After [`WINDOW`] without a commanded wrench nothing is stored any more, and credit is forgotten.
//!
//! Damping cannot undo a force that should not be there: one of a surface which a late network moves under a hand that rests. So a commanded wrench (f, t)
//! is also scaled to what a spring of the stiffest contact has when all that it stores is in reserve,
//!
//! ```text
//!   |f|^2 / (2 K) + |t|^2 / (2 K r^2) <= max_debt - E
//! ```
//!
//! A contact that the hand pressed itself is never scaled: it stores no more than was put in. What is scaled is let go as a spring of stiffness K is, which
//! the slew limit explains by the motion, and from no reserve at all a hand that presses on meets that spring where it is. The reserve
//! forgives debt by [`FORGIVEN`]; damping does not, for it would feed the oscillation that it is to calm.
//!
//! Sources: Hannaford & Ryu 2002, time-domain passivity control, impedance causality; Franken, Stramigioli, Misra, Secchi & Macchelli 2011, a reserve of
//! energy that bounds the force.

use nalgebra::{Vector3, Vector6};
use taut_plant::stack;

use super::settings::ContactBound;

/// Free motion after which no credit is left, s.
const WINDOW: f64 = 0.03;

/// Debt that the reserve forgives, W: a hundredth of what a hand dissipates in an ordinary motion.
const FORGIVEN: f64 = 1e-3;

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
    /// Most energy that is kept account of either way, J: what the stiffest contact stores at the largest force.
    pub max_credit: f64,
    /// Energy below which nothing is damped, J: what the zero-order hold of a gentle contact leaks.
    pub dead_band: f64,
    /// Most that the hand may be given that neither it nor a moving obstacle had put in, J.
    pub max_debt: f64,
}

impl Default for PassivitySettings {
    /// Observe; 20 N s/m, 0.02 N m s/rad; 0.2 J (20 N at 1000 N/m); 0.01 mJ; 10 mJ (4.5 N of a contact of 1000 N/m that is there at once).
    fn default() -> Self {
        Self {
            mode: Passivity::Observe,
            max_damping: 20.0,
            max_rotational_damping: 0.02,
            max_credit: 0.2,
            dead_band: 1e-5,
            max_debt: 0.01,
        }
    }
}

impl PassivitySettings {
    /// The usual limits in this mode.
    #[must_use]
    pub fn of(mode: Passivity) -> Self {
        Self {
            mode,
            ..Self::default()
        }
    }
}

/// Accounts for the energy and damps. No allocation.
#[derive(Clone, Debug)]
pub(super) struct PassivityController {
    settings: PassivitySettings,
    contact: ContactBound,
    debt: f64,
    /// Of that, what the reserve counts no longer, J; damping does.
    forgiven: f64,
    /// Time without a commanded wrench, s.
    free: f64,
    /// Work of moving obstacles as it was told last, J.
    obstacles: Option<f64>,
}

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
    pub(super) fn new(settings: PassivitySettings, mut contact: ContactBound) -> Self {
        let explains = contact.stiffness > 0.0 && contact.radius_of_gyration > 0.0; // false for NaN
        if !explains {
            // What the slew limit is not to explain by motion is a contact all the same.
            contact = ContactBound::default();
        }
        Self {
            settings,
            contact,
            debt: 0.0,
            forgiven: 0.0,
            free: 0.0,
            obstacles: None,
        }
    }

    /// Another source of commands: its obstacles have their own account.
    pub(super) fn restart(&mut self) {
        self.obstacles = None;
    }

    /// Takes the net work of moving obstacles on the hand, J, since whenever it was first told, with a force of which `rendered` came to the hand where
    /// it was `commanded`. What is not finite is left alone.
    pub(super) fn grant(&mut self, total: f64, commanded: &Vector6<f64>, rendered: &Vector6<f64>) {
        if !total.is_finite() {
            return;
        }
        let done = total - self.obstacles.replace(total).unwrap_or(total);
        let share = rendered.dot(commanded) / commanded.norm_squared();
        if share > 0.0 {
            self.debt -= done * share.min(1.0);
        }
    }

    /// `work` is what the wrench has given to the hand since the last tick, J, which was `seconds` ago; `travel` the displacement of the reference
    /// point and the rotation between the newest samples, over `span`, s; `commanded` the wrench before the controller.
    pub(super) fn step(
        &mut self,
        work: f64,
        travel: &Vector6<f64>,
        span: f64,
        seconds: f64,
        commanded: &Vector6<f64>,
    ) -> Damping {
        let settings = &self.settings;
        if settings.mode == Passivity::Observe {
            return Damping::NONE;
        }
        let is_free = *commanded == Vector6::zeros();
        self.free = if is_free { self.free + seconds } else { 0.0 };
        if work.is_finite() {
            self.debt = (self.debt + work).clamp(-settings.max_credit, settings.max_credit);
        }
        if self.free >= WINDOW {
            self.debt = self.debt.max(0.0);
        }
        self.forgiven = (self.forgiven + FORGIVEN * seconds).clamp(0.0, self.debt.max(0.0));
        let due = self.debt > settings.dead_band && span > 0.0; // false for NaN
        if !due {
            return Damping::NONE;
        }
        let linear: Vector3<f64> = travel.fixed_rows::<3>(0) / span;
        let angular: Vector3<f64> = travel.fixed_rows::<3>(3) / span;
        // Translation first: it carries nearly all of the energy. The rotation takes what is left.
        let (force, taken) = self.brake(&linear, settings.max_damping, SLOWEST.0, self.debt, span);
        let (torque, _) = self.brake(
            &angular,
            settings.max_rotational_damping,
            SLOWEST.1,
            self.debt - taken,
            span,
        );
        Damping {
            wrench: stack(&force, &torque),
            debt: self.debt,
        }
    }

    /// Net work of moving obstacles as it was told last, J.
    pub(super) fn obstacle_work(&self) -> f64 {
        self.obstacles.unwrap_or(0.0)
    }

    /// The commanded wrench, scaled to what the reserve allows.
    pub(super) fn within_reserve(&self, commanded: &Vector6<f64>) -> Vector6<f64> {
        if self.settings.mode == Passivity::Observe {
            return *commanded;
        }
        let ContactBound {
            stiffness,
            radius_of_gyration: radius,
        } = self.contact;
        let force = commanded.fixed_rows::<3>(0).norm_squared();
        let torque = commanded.fixed_rows::<3>(3).norm_squared() / (radius * radius);
        let stored = 0.5 * (force + torque) / stiffness;
        let reserve = (self.settings.max_debt + self.forgiven - self.debt).max(0.0);
        let fits = stored <= reserve; // false for NaN
        if fits {
            *commanded
        } else {
            commanded * (reserve / stored).sqrt()
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
        let settings = PassivitySettings::of(Passivity::Control);
        PassivityController::new(settings, ContactBound::default())
    }

    const T: f64 = 1e-3;

    #[test]
    fn it_takes_out_what_came_out_in_one_tick_if_it_may() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        let damping = controller.step(1e-4, &travel, T, T, &Vector6::x());
        // 1e-4 J at 0.1 m/s in 1 ms: 10 N s/m.
        assert!((damping.wrench.x + 1.0).abs() < 1e-12);
        // At the same velocity that force gives -1e-4 J: the debt is paid.
        let paid = controller.step(damping.wrench.x * travel.x, &travel, T, T, &Vector6::x());
        assert_eq!(paid.wrench, Vector6::zeros());
    }

    #[test]
    fn its_damping_is_bounded_and_the_rest_waits() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        for _ in 0..10 {
            let damping = controller.step(0.01, &travel, T, T, &Vector6::x());
            assert!(
                (damping.wrench.x + 2.0).abs() < 1e-12,
                "20 N s/m at 0.1 m/s"
            );
        }
        let standing = controller.step(0.0, &Vector6::zeros(), T, T, &Vector6::x());
        assert_eq!(standing.wrench, Vector6::zeros());
        assert!(standing.debt > 0.09);
    }

    #[test]
    fn credit_is_kept_in_contact_and_forgotten_in_free_space() {
        let travel = Vector6::x() * (0.1 * T);
        let mut in_contact = controller();
        let _ = in_contact.step(-0.01, &travel, T, T, &Vector6::x());
        let back = in_contact.step(0.009, &travel, T, T, &Vector6::x());
        assert_eq!(back, Damping::NONE);

        let mut let_go = controller();
        let _ = let_go.step(-0.01, &travel, T, T, &Vector6::x());
        for _ in 0..31 {
            let _ = let_go.step(0.0, &travel, T, T, &Vector6::zeros());
        }
        let acts = let_go.step(0.009, &travel, T, T, &Vector6::x());
        assert!(acts.debt > 0.0 && acts.wrench.x < 0.0);
    }

    /// A hand whose way along x the caller says, m, under `commanded` N along x: what it is given in all, J, and the force at the end, N.
    fn along(
        controller: &mut PassivityController,
        commanded: f64,
        way: impl Iterator<Item = f64>,
    ) -> (f64, f64) {
        let wrench = Vector6::x() * commanded;
        let (mut given, mut held) = (0.0, 0.0);
        for step in way {
            let travel = Vector6::x() * step;
            given += held * step;
            let damping = controller.step(held * step, &travel, T, T, &wrench);
            held = controller.within_reserve(&wrench).x + damping.wrench.x;
        }
        (given, held)
    }

    #[test]
    fn a_force_that_is_there_at_once_gives_no_more_than_the_reserve_and_a_hand_that_presses_on_meets_the_contact()
     {
        let standing = |ticks| std::iter::repeat_n(0.0, ticks);
        let (_, force) = along(&mut controller(), 20.0, standing(10));
        assert!((force - 4.472).abs() < 1e-3, "sqrt(2 K 10 mJ), not {force}");
        let mut pushed = controller();
        let (given, force) = along(&mut pushed, 20.0, std::iter::repeat_n(1e-4, 500));
        let forgiven = 0.5 * FORGIVEN;
        assert!((0.007..0.0102 + forgiven).contains(&given), "{given}");
        assert!(force.abs() < 2.1, "{force}: nothing but damping is left");
        // Nothing is left: a hand that turns round builds a spring of K up from there.
        let (_, force) = along(&mut pushed, 20.0, std::iter::repeat_n(-1e-5, 1000));
        assert!(
            (10.0..13.0).contains(&force),
            "1 cm of 1000 N/m, and what was forgiven: {force}"
        );
    }

    #[test]
    fn a_contact_that_was_pressed_is_given_back_whole() {
        let mut controller = controller();
        let (mut given, mut depth) = (0.0, 0.0_f64);
        for tick in 0..4000 {
            // 12 mm deep and out again, at most 19 mm/s; K all the way.
            let next = 0.006 * (1.0 - (f64::from(tick) * T * std::f64::consts::PI / 2.0).cos());
            let (force, travel) = (1000.0 * depth, Vector6::x() * (depth - next));
            given += force * travel.x;
            let commanded = Vector6::x() * (1000.0 * next);
            let _ = controller.step(force * travel.x, &travel, T, T, &commanded);
            assert_eq!(controller.within_reserve(&commanded), commanded, "{tick}");
            depth = next;
        }
        assert!(given.abs() < 1e-3, "{given}");
    }

    #[test]
    fn what_a_moving_obstacle_gives_is_no_debt_as_far_as_its_force_is_felt() {
        let push = Vector6::x() * 10.0;
        for (share, scaled) in [(1.0, false), (0.5, true), (0.0, true)] {
            let mut controller = controller();
            for tick in 0..100 {
                controller.grant(7.0 + 1e-3 * f64::from(tick), &push, &(push * share));
                let _ = controller.step(1e-3, &(Vector6::x() * 1e-4), T, T, &push);
            }
            let left = controller.within_reserve(&(Vector6::x() * 4.0));
            assert_eq!(left.x < 3.9, scaled, "{share}: {left}");
        }
        let mut controller = controller();
        controller.grant(f64::NAN, &push, &push);
        assert_eq!(controller.obstacle_work(), 0.0);
    }

    proptest::proptest! {
        #[test]
        fn whatever_is_commanded_and_however_the_hand_moves_it_is_given_no_more_than_the_reserve(
            seed in 0_u64..1 << 32,
            most in 1.0..20.0_f64,
        ) {
            let mut state = seed;
            let mut random = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
            };
            let mut controller = controller();
            let (mut velocity, mut held, mut commanded) = (Vector6::zeros(), Vector6::zeros(), Vector6::zeros());
            let (mut given, mut most_given) = (0.0, 0.0_f64);
            for tick in 0..2000 {
                if tick % 17 == 0 {
                    commanded = Vector6::from_fn(|k, _| if k < 3 { most * random() } else { 0.1 * most * random() });
                }
                // What moves a hand of 0.3 kg by 10 N, or turns it as much at 0.1 m.
                velocity += Vector6::from_fn(|k, _| (if k < 3 { 1.0 } else { 10.0 }) * 0.03 * random());
                velocity *= 0.98;
                let travel = velocity * T;
                let work = held.dot(&travel);
                given += work;
                most_given = most_given.max(given);
                let damping = controller.step(work, &travel, T, T, &commanded);
                held = controller.within_reserve(&commanded) + damping.wrench;
            }
            // One tick at a third of a metre per second.
            proptest::prop_assert!(most_given < 0.01 + 2.0 * FORGIVEN + 0.002, "{most_given}");
        }
    }

    #[test]
    fn work_that_is_not_finite_changes_nothing() {
        let mut controller = controller();
        let travel = Vector6::x() * (0.1 * T);
        let damping = controller.step(f64::NAN, &travel, T, T, &Vector6::x());
        assert_eq!(damping, Damping::NONE);
    }
}
