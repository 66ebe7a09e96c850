//! Every length, gain and limit of the method, with unit and reason.
//!
//! | symbol   | name in code                    | unit  | paper   | meaning                                            |
//! |----------|---------------------------------|-------|---------|----------------------------------------------------|
//! | k_s      | [`Settings::k_s`]               | –     | 0.5     | share of the pose difference covered in one update |
//! | k_h      | [`Settings::k_h`]               | 1/s^2 | –       | coupling constant                                  |
//! | tau      | [`Settings::damping_time`]      | s     | –       | damping of a contact over its stiffness            |
//! | K_t      | [`Settings::stiffness`]         | N/m   | –       | k_h k_s m: what the hand feels in translation      |
//! | delta_c  | [`Settings::rest_distance`]     | m     | –       | gap at which the god-object rests                  |
//! | delta_min| [`Settings::minimum_gap`]       | m     | –       | gap below which it never comes                     |
//! | Delta-t  | [`Adaptation::duration`]        | s     | –       | time over which a violated new constraint enters   |
//! | epsilon  | [`Adaptation::threshold`]       | m     | < 0     | new constraints less deep than this enter at once  |
//!
//! Source: Ortega et al. 2007, Sections 4, 5 and 6. The lengths derive from one: the size of the body.

mod check;

pub use check::SettingsError;

use crate::quasi_statics::SolverKind;

/// Rest distance per metre of body size: 10 um for a body of 0.1 m. People feel nothing below 50 um, and a clearance of
/// 50 um must still be a clearance.
const REST_DISTANCE_PER_SIZE: f64 = 1e-4;
/// Minimum gap per metre of body size: 1 um for a body of 0.1 m, a tenth of the rest distance.
const MINIMUM_GAP_PER_SIZE: f64 = 1e-5;
/// Activation distance per metre of body size: 0.4 mm for a body of 0.1 m. What moves is covered by look-ahead; this is for
/// what begins to move.
const ACTIVATION_DISTANCE_PER_SIZE: f64 = 4e-3;
/// Longest look-ahead per metre of body size: what it may cost is bounded by `look_ahead_pairs`, so that this binds nobody but a device that
/// jumps. A cube of 1 mm at 5 m/s and 70 updates a second goes 143 of its lengths while a set is used.
const LOOK_AHEAD_LIMIT_PER_SIZE: f64 = 1000.0;
/// Longest look-ahead of any body, m: what the settings' message to a device bridge may hold.
const LONGEST_LOOK_AHEAD: f64 = 1e6;
/// Rest distance per clearance of the tightest fit: two walls take a fifth of the play, and what is left is played in.
const REST_DISTANCE_PER_CLEARANCE: f64 = 0.1;
/// Share of the rest distance below which a motion is none: keeps the god-object bit-identical at rest.
const MOTION_TOLERANCE_PER_REST_DISTANCE: f64 = 5e-3;
/// Most rounds of implicit constraints: what three do not mend, the next update does.
const MAX_IMPLICIT_ROUNDS: u32 = 3;
/// Rounds of implicit constraints where no mesh meets a mesh.
const ROUNDS_OF_EXACT_SHAPES: u32 = 2;

/// What stands in the metric for the inertia tensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RotationMetric {
    /// The inertia tensor of the body about the reference point.
    Inertia,
    /// `m r^2` about every axis: a free choice that fits the torque to the device, r in metres.
    RadiusOfGyration(f64),
}

/// How a constraint that is violated when it first appears is let in, Section 5, Figure 6.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptation {
    /// Time over which the bound rises from where the device is to its place, s.
    pub duration: f64,
    /// Negative, m. Where the device is less deep in a new constraint than its magnitude, that enters at once, so that a new contact is felt.
    pub threshold: f64,
}

impl Default for Adaptation {
    /// 20 ms, 2 mm: the paper's 1 mm of a way of which its updates cover half.
    fn default() -> Self {
        Self {
            duration: 0.02,
            threshold: -2e-3,
        }
    }
}

/// Gains, limits, lengths and capacities of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Share of the pose difference that one update covers, in (0, 1].
    pub k_s: f64,
    /// Coupling constant, 1/s^2.
    pub k_h: f64,
    /// Damping of a contact over its stiffness, s: a wall of 1000 N/m and 20 ms damps as 20 N s/m. 0, the default, is the paper's
    /// spring. What the sampling bears is the device's matter, as for the stiffness.
    pub damping_time: f64,
    /// The rotational part of the metric.
    pub rotation_metric: RotationMetric,
    /// Constraint adaptation; `None` lets every constraint in at once.
    pub adaptation: Option<Adaptation>,
    /// Publish contacts before they touch, with their gaps. Off: the paper's cone of touching contacts.
    pub look_ahead: bool,
    /// Bound the energy that the hand takes out over a run by what it and obstacles that move have put in, see
    /// [`EnergyObserver`](crate::surface::EnergyObserver).
    pub passive: bool,
    /// Largest force on the hand, N; clamped by norm.
    pub force_limit: f64,
    /// Largest torque on the hand, N m; clamped by norm.
    pub torque_limit: f64,
    /// Gap at which the god-object comes to rest, m.
    pub rest_distance: f64,
    /// Gap below which the god-object never comes, m.
    pub minimum_gap: f64,
    /// Continuous collision detection stops at most this far above `minimum_gap`, m.
    pub gap_tolerance: f64,
    /// Feature pairs nearer than this make constraints, m; look-ahead adds the way that body and device may go until the
    /// next set.
    pub activation_distance: f64,
    /// Most that look-ahead adds to the activation distance, m.
    pub look_ahead_limit: f64,
    /// Pairs of triangles, and of their features, that one collection may look at; up to twice as many where several obstacles need more than in the one
    /// before. It looks nearest first: one that would cost more reaches less far. Late updates must not make later ones still later.
    pub look_ahead_pairs: u64,
    /// A motion whose fastest point covers less than this is none, m; and a constraint that a motion violates by less than a thousandth of it is
    /// left out of a set whose rows are chosen.
    pub motion_tolerance: f64,
    /// Capacity of the constraint set. Where it does not hold every row, the set says that it is truncated.
    pub max_constraints: usize,
    /// Most repetitions of project, move, collect within one update.
    pub max_substeps: u32,
    /// How often a projection is repeated with its rows re-linearised where it led to, in both loops; 0 leaves them linear.
    /// A motion that does not turn the body needs none; in the coupling, one round a cylinder or a sphere does.
    pub implicit_rounds: u32,
    /// Most evaluations of one feature pair's gap in one collision search.
    pub max_advancement_steps: u32,
    /// Nominal microseconds of work ([`Work::nominal_us`](crate::collision::Work::nominal_us)) after which an update starts
    /// no further sub-step; `None` is no budget.
    pub work_budget: Option<u64>,
    /// Solver of the god-object loop's and the coupling's projections.
    pub solver: SolverKind,
}

impl Settings {
    /// Defaults for a body whose bounding box has the longest side `size`, in metres.
    pub fn for_size(size: f64) -> Self {
        Self {
            k_s: 1.0,
            k_h: 1000.0,
            damping_time: 0.0,
            rotation_metric: RotationMetric::Inertia,
            adaptation: Some(Adaptation::default()),
            look_ahead: true,
            passive: false,
            force_limit: 20.0,
            torque_limit: 0.5,
            rest_distance: REST_DISTANCE_PER_SIZE * size,
            minimum_gap: MINIMUM_GAP_PER_SIZE * size,
            gap_tolerance: 0.1 * MINIMUM_GAP_PER_SIZE * size,
            activation_distance: ACTIVATION_DISTANCE_PER_SIZE * size,
            look_ahead_limit: (LOOK_AHEAD_LIMIT_PER_SIZE * size).min(LONGEST_LOOK_AHEAD),
            look_ahead_pairs: 1000,
            motion_tolerance: MOTION_TOLERANCE_PER_REST_DISTANCE * REST_DISTANCE_PER_SIZE * size,
            max_constraints: 1024,
            max_substeps: 10,
            implicit_rounds: 0,
            max_advancement_steps: 200,
            work_budget: None,
            solver: SolverKind::ActiveSet,
        }
    }

    /// The same for a scene in which some fit leaves the body only `clearance` (m) on each side: the rest distance becomes a tenth of that where
    /// it was more, and the lengths that hang on it become shorter in proportion. What is not a positive finite number changes nothing.
    #[must_use]
    pub fn with_clearance(self, clearance: f64) -> Self {
        let rest_distance = REST_DISTANCE_PER_CLEARANCE * clearance;
        let shorter = rest_distance > 0.0 && rest_distance < self.rest_distance; // false for NaN
        if !shorter {
            return self;
        }
        let share = rest_distance / self.rest_distance;
        Self {
            rest_distance,
            minimum_gap: self.minimum_gap * share,
            gap_tolerance: self.gap_tolerance * share,
            motion_tolerance: self.motion_tolerance * share,
            ..self
        }
    }

    /// The same for a world in which no mesh meets a mesh: rows are few there, and those of round features bend as the body slides, so they are
    /// re-linearised. With linear rows the force round a cylinder turns once an update.
    #[must_use]
    pub fn for_exact_shapes(self) -> Self {
        Self {
            implicit_rounds: self.implicit_rounds.max(ROUNDS_OF_EXACT_SHAPES),
            ..self
        }
    }

    /// The tightest fit that the rest distance suits, m on each side: see [`Self::with_clearance`].
    pub fn least_clearance(&self) -> f64 {
        self.rest_distance / REST_DISTANCE_PER_CLEARANCE
    }

    /// The method as published: a cone of touching contacts, one projection and one collision search per update.
    pub fn paper(size: f64) -> Self {
        Self {
            k_s: 0.5,
            k_h: 2000.0,
            look_ahead: false,
            max_substeps: 1,
            implicit_rounds: 0,
            ..Self::for_size(size)
        }
    }

    /// The translational stiffness that the hand feels, `k_h k_s m`, N/m.
    pub fn stiffness(&self, mass: f64) -> f64 {
        self.k_h * self.k_s * mass
    }

    /// Bound of a row in the god-object loop, m: the body may move as far as the contact is away; one nearer than the
    /// rest distance is eased out. Without look-ahead: the paper's cone.
    #[inline]
    pub(crate) fn motion_bound(&self, gap: f64) -> f64 {
        let bound = self.rest_distance - gap;
        if self.look_ahead {
            bound
        } else {
            bound.max(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_at_every_scale() {
        for size in [1e-4, 0.1, 100.0] {
            assert_eq!(Settings::for_size(size).validate(), Ok(()));
            assert_eq!(Settings::paper(size).validate(), Ok(()));
        }
    }

    #[test]
    fn a_tight_fit_shortens_the_rest_distance_and_what_hangs_on_it_and_a_loose_one_nothing() {
        let part = Settings::for_size(1.0);
        let tight = part.with_clearance(2e-4);
        assert_eq!(tight.validate(), Ok(()));
        assert!((tight.rest_distance - 2e-5).abs() < 1e-12, "{tight:?}");
        assert!((tight.least_clearance() - 2e-4).abs() < 1e-12);
        let ratio = |s: &Settings| s.minimum_gap / s.rest_distance;
        assert!((ratio(&tight) - ratio(&part)).abs() < 1e-12);
        for loose in [1e-2, 0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(part.with_clearance(loose), part, "{loose}");
        }
    }

    #[test]
    fn lengths_out_of_order_and_nan_are_named() {
        let mut settings = Settings::for_size(0.1);
        settings.rest_distance = settings.activation_distance;
        assert!(
            settings
                .validate()
                .is_err_and(|e| e.to_string().contains("activation_distance"))
        );
        settings = Settings::for_size(0.1);
        settings.k_h = f64::NAN;
        assert!(
            settings
                .validate()
                .is_err_and(|e| e.to_string().contains("k_h"))
        );
        settings = Settings::for_size(0.1);
        settings.rest_distance = f64::NAN;
        assert!(settings.validate().is_err());
    }
}
