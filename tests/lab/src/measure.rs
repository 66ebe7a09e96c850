//! What is measured of a run, against the ideal answer.
//!
//! | symbol | name in code              | unit  | meaning                                                           |
//! |--------|---------------------------|-------|-------------------------------------------------------------------|
//! | e_dir  | [`Measure::DirectionP95`] | deg   | angle between F and the ideal, where the ideal is above 0.1 N      |
//! | e_mag  | [`Measure::MagnitudeP95`] | %     | error of the norm of F over the ideal's, there                     |
//! | e_F    | [`Measure::ForceP95`]     | N     | norm of the difference of forces                                   |
//! | e_tau  | [`Measure::TorqueP95`]    | N m   | norm of the difference of torques                                  |
//! | dF     | [`Measure::Step`]         | N     | largest change of F in a millisecond                               |
//! | E_inj  | [`Measure::Energy`]       | J     | most that the hand has got out, hold of the samples left out        |
//! | J      | [`Measure::JndP95`]       | –     | 95th percentile over milliseconds of the error that is felt: `Felt` |
//! | J1     | [`Measure::Felt`]         | –     | its first version: the largest of the 95th percentiles and any step  |
//!
//! Thresholds: 18.4 degrees for direction (Barbagli et al. 2006), 7 % for magnitude (Pang, Tan, Durlach 1991), 12.7 % for torque at 60 mN m
//! (Jandura and Srinivasan 1994), and 7 % of the force or 0.1 N for a step.

use god_object::Vector6;
use god_object::spatial::{angular, linear};
use nalgebra::Vector3;

use crate::clock::Tick;
use crate::cpu_time::quantile;
use crate::felt::Felt;
use crate::port;
use crate::recipe::Recipe;

/// Ideal forces below this have no direction to compare with, and smaller errors are not felt, N.
pub(crate) const FELT_FORCE: f64 = 0.1;
/// Just-noticeable differences: of direction, degrees; of magnitude and torque, shares.
pub(crate) const JND_DIRECTION: f64 = 18.4;
pub(crate) const JND_MAGNITUDE: f64 = 0.07;
pub(crate) const JND_TORQUE: f64 = 0.127;
/// The torque at which [`JND_TORQUE`] was measured, N m; smaller ones are compared as if they were this.
const REFERENCE_TORQUE: f64 = 0.06;
/// A force is one above this, N: a rest distance away it is less.
pub(crate) const FIRST_FORCE: f64 = 1e-6;

macro_rules! measures {
    ($($(#[$doc:meta])* $name:ident $key:literal $unit:literal,)*) => {
        /// One of the numbers that a run is judged by.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Measure { $($(#[$doc])* $name,)* }

        impl Measure {
            /// All, in the order of the files.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// Key and unit of each.
            const TABLE: &[(&str, &str)] = &[$(($key, $unit),)*];
        }
    };
}

impl Measure {
    /// Name in tables and files.
    pub fn key(self) -> &'static str {
        Self::TABLE[self as usize].0
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        Self::TABLE[self as usize].1
    }
}

measures! {
    /// Largest depth of the body in an obstacle.
    Penetration "penetration" "m",
    /// Published poses at which the meshes intersect, by the independent check.
    Intersections "intersections" "poses",
    /// Farthest that the body went beyond the side that it belongs to.
    Astray "astray" "m",
    /// 95th percentile of the angle to the ideal force; NaN where none is to compare.
    DirectionP95 "direction_p95" "deg",
    /// Mean of that angle.
    DirectionMean "direction_mean" "deg",
    /// Largest of that angle.
    DirectionMax "direction_max" "deg",
    /// 95th percentile of the error of magnitude.
    MagnitudeP95 "magnitude_p95" "%",
    /// 95th percentile of the error of torque.
    TorqueP95 "torque_p95" "N m",
    /// 95th percentile of the norm of the difference of forces.
    ForceP95 "force_p95" "N",
    /// Largest change of force in a millisecond.
    Step "step" "N/ms",
    /// The same, less what the ideal changes then or a millisecond beside.
    ExcessStep "excess_step" "N/ms",
    /// Most energy that the hand has got out of the contact.
    Energy "energy" "J",
    /// Largest force across the ideal's direction over the ideal: on a frictionless surface, residual friction.
    Friction "friction" "-",
    /// Depth of the device when the first force is felt.
    FirstForceDepth "first_force_depth" "m",
    /// Time for which the force is off by more than 0.1 N.
    FalseForce "false_force" "s",
    /// Forces or poses that are not finite.
    NotFinite "not_finite" "ticks",
    /// Largest of [`Self::ExcessStep`] in just-noticeable differences.
    StepFelt "step_felt" "JND",
    /// 95th percentile of the error of torque in just-noticeable differences.
    TorqueFelt "torque_felt" "JND",
    /// Its first version: the largest of direction, magnitude, torque and step, each by itself.
    Felt "felt" "JND",
    /// 95th percentile of J, the error in just-noticeable differences.
    JndP95 "j_p95" "JND",
    /// Largest J of a millisecond.
    JndMax "j_max" "JND",
    /// Share of the time with J above 1.
    JndShare "j_share_above_1" "-",
    /// Largest delay of a force behind a step of the right answer that it was matched with.
    StepDelay "step_delay" "s",
}

/// All measures of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Measures {
    values: Vec<f64>,
    /// Of the recipe's own probes, in their order.
    pub probes: Vec<f64>,
}

impl Measures {
    /// Of a run of a recipe whose forces are felt as they are made.
    pub fn of(recipe: &Recipe, ticks: &[Tick]) -> Self {
        let felt = Felt::new(ticks, &recipe.answer().wrenches, recipe.scene.arm());
        Self::with_felt(recipe, ticks, &felt)
    }

    /// Of a run of a recipe whose forces reach the hand through the device port, as the right ones do: J is of what is felt there, and all
    /// else of the forces as the method makes them.
    pub(crate) fn through_port(recipe: &Recipe, ticks: &[Tick]) -> Self {
        let mut at_hand = ticks.to_vec();
        port::limit(&recipe.scene, &mut at_hand);
        let felt = Felt::new(&at_hand, &port::right_answer(recipe), recipe.scene.arm());
        Self::with_felt(recipe, ticks, &felt)
    }

    fn with_felt(recipe: &Recipe, ticks: &[Tick], felt: &Felt) -> Self {
        let ideal = &recipe.answer().wrenches;
        let errors = ForceErrors::new(ticks, ideal);
        let values = Measure::ALL
            .iter()
            .map(|measure| match measure {
                Measure::Penetration => largest(ticks.iter().map(|t| (recipe.depth)(&t.body))),
                Measure::Intersections => intersections(recipe, ticks),
                Measure::Astray => largest(ticks.iter().map(|t| (recipe.astray)(t.time, &t.body))),
                Measure::DirectionP95 => quantile(&errors.direction, 0.95),
                Measure::DirectionMean => {
                    errors.direction.iter().sum::<f64>() / errors.direction.len() as f64
                }
                Measure::DirectionMax => quantile(&errors.direction, 1.0),
                Measure::MagnitudeP95 => 100.0 * quantile(&errors.magnitude, 0.95),
                Measure::TorqueP95 => quantile(&errors.torque, 0.95),
                Measure::ForceP95 => quantile(&errors.force, 0.95),
                Measure::Step => errors.step,
                Measure::ExcessStep => errors.excess_step,
                Measure::Energy => energy(ticks),
                Measure::Friction => errors.friction,
                Measure::FirstForceDepth => first_force(ticks, ideal) / recipe.scene.stiffness(),
                Measure::FalseForce => errors.false_force,
                Measure::NotFinite => ticks.iter().filter(|tick| !is_finite(tick)).count() as f64,
                Measure::StepFelt => errors.step_jnd,
                Measure::TorqueFelt => quantile(&errors.torque_jnd, 0.95),
                Measure::Felt => errors.felt(),
                Measure::JndP95 => felt.p95(),
                Measure::JndMax => felt.most(),
                Measure::JndShare => felt.share_above_one(),
                Measure::StepDelay => felt.step_delay,
            })
            .collect();
        let probes = recipe.probes.iter().map(|probe| (probe.value)(ticks));
        Self {
            values,
            probes: probes.collect(),
        }
    }

    /// As they were kept; `None` where it is not one for each measure.
    pub(crate) fn kept(values: &[f64], probes: &[f64]) -> Option<Self> {
        (values.len() == Measure::ALL.len()).then(|| Self {
            values: values.to_vec(),
            probes: probes.to_vec(),
        })
    }

    /// One for each of [`Measure::ALL`].
    pub(crate) fn values(&self) -> &[f64] {
        &self.values
    }

    /// One of them.
    pub fn get(&self, measure: Measure) -> f64 {
        self.values[measure as usize]
    }
}

/// The largest of sizes; 0 of none, NaN where one is: f64::max would drop it.
pub(crate) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a })
}

fn is_finite(tick: &Tick) -> bool {
    let pose = tick.body;
    tick.wrench.iter().all(|x| x.is_finite())
        && pose.translation.vector.iter().all(|x| x.is_finite())
        && pose.rotation.coords.iter().all(|x| x.is_finite())
}

/// NaN where the obstacle moves: the check knows obstacles at rest, and those recipes have a depth of their own.
fn intersections(recipe: &Recipe, ticks: &[Tick]) -> f64 {
    if recipe.moving.is_some() {
        return f64::NAN;
    }
    let (checker, every) = (recipe.checker(), recipe.check_every);
    let mut last = None;
    let (mut published, mut count) = (0_u32, 0);
    for tick in ticks {
        if last != Some(tick.body) {
            if published.is_multiple_of(every) {
                count += u32::from(checker.penetrated(&tick.body).is_some());
            }
            published += 1;
            last = Some(tick.body);
        }
    }
    f64::from(count)
}

/// Work on the hand by trapezoids, at its most. What holding a force for a tick adds is left out: it is the same for all methods.
fn energy(ticks: &[Tick]) -> f64 {
    let (mut work, mut most) = (0.0_f64, 0.0_f64);
    for pair in ticks.windows(2) {
        let way = pair[1].device.translation.vector - pair[0].device.translation.vector;
        work += 0.5 * (linear(&pair[0].wrench) + linear(&pair[1].wrench)).dot(&way);
        most = most.max(work);
    }
    most
}

/// The ideal's force, N, when the first one is felt.
fn first_force(ticks: &[Tick], ideal: &[Vector6]) -> f64 {
    let mut both = ticks.iter().zip(ideal);
    both.find(|(tick, _)| linear(&tick.wrench).norm() > FIRST_FORCE)
        .map_or(f64::NAN, |(_, ideal)| linear(ideal).norm())
}

/// Errors of force, tick by tick where there is an ideal to compare with.
struct ForceErrors {
    force: Vec<f64>,
    direction: Vec<f64>,
    magnitude: Vec<f64>,
    torque: Vec<f64>,
    torque_jnd: Vec<f64>,
    step: f64,
    excess_step: f64,
    step_jnd: f64,
    friction: f64,
    false_force: f64,
}

impl ForceErrors {
    fn new(ticks: &[Tick], ideal: &[Vector6]) -> Self {
        let force = |i: usize| linear(&ticks[i].wrench);
        let mut errors = Self {
            force: Vec::new(),
            direction: Vec::new(),
            magnitude: Vec::new(),
            torque: Vec::new(),
            torque_jnd: Vec::new(),
            step: 0.0,
            excess_step: 0.0,
            step_jnd: 0.0,
            friction: 0.0,
            false_force: 0.0,
        };
        let mut wrong = 0_u32;
        for (i, ideal) in ideal.iter().enumerate() {
            let (right, torque) = (linear(ideal), angular(ideal));
            errors.force.push((force(i) - right).norm());
            wrong += u32::from((force(i) - right).norm() > FELT_FORCE);
            let off = (angular(&ticks[i].wrench) - torque).norm();
            errors.torque.push(off);
            let felt = JND_TORQUE * torque.norm().max(REFERENCE_TORQUE);
            errors.torque_jnd.push(off / felt);
            if right.norm() > FELT_FORCE {
                errors.compare(&force(i), &right);
            }
        }
        errors.false_force = f64::from(wrong) * crate::clock::TICK;
        if ideal.is_empty() {
            // Nothing to compare with: no error is known, and none is claimed to be small.
            errors.false_force = f64::NAN;
            errors.friction = f64::NAN;
            errors.excess_step = f64::NAN;
            errors.step_jnd = f64::NAN;
            for i in 1..ticks.len() {
                errors.step = errors.step.max((force(i) - force(i - 1)).norm());
            }
        }

        let ideal_step: Vec<f64> = ideal
            .windows(2)
            .map(|pair| (linear(&pair[1]) - linear(&pair[0])).norm())
            .collect();
        for i in 0..ideal_step.len() {
            let step = (force(i + 1) - force(i)).norm();
            let beside = i.saturating_sub(1)..(i + 2).min(ideal_step.len());
            let allowed = ideal_step[beside].iter().copied().fold(0.0, f64::max);
            let excess = (step - allowed).max(0.0);
            let felt = (JND_MAGNITUDE * force(i).norm()).max(FELT_FORCE);
            errors.step = errors.step.max(step);
            errors.excess_step = errors.excess_step.max(excess);
            errors.step_jnd = errors.step_jnd.max(excess / felt);
        }
        errors
    }

    fn compare(&mut self, force: &Vector3<f64>, ideal: &Vector3<f64>) {
        let size = ideal.norm();
        self.magnitude.push((force.norm() / size - 1.0).abs());
        let along = force.dot(ideal) / size;
        let across = (force - ideal * (along / size)).norm();
        if force.norm() > 0.0 {
            self.direction.push(across.atan2(along).to_degrees());
            self.friction = self.friction.max(across / size);
        }
    }

    fn felt(&self) -> f64 {
        if self.force.is_empty() || self.force.iter().chain(&self.torque).any(|e| e.is_nan()) {
            return f64::NAN; // f64::max would drop it
        }
        [
            quantile(&self.direction, 0.95) / JND_DIRECTION,
            quantile(&self.magnitude, 0.95) / JND_MAGNITUDE,
            quantile(&self.torque_jnd, 0.95),
            self.step_jnd,
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::Pose;

    fn ticks(forces: &[(f64, f64)]) -> Vec<Tick> {
        let at = |(i, (height, force)): (usize, &(f64, f64))| Tick {
            time: i as f64 * 1e-3,
            device: Pose::translation(0.0, 0.0, *height),
            body: Pose::identity(),
            wrench: Vector6::new(0.0, 0.0, *force, 0.0, 0.0, 0.0),
        };
        forces.iter().enumerate().map(at).collect()
    }

    #[test]
    fn a_spring_gives_back_what_it_took_and_a_late_one_more() {
        // 1000 N/m, in 2 mm and out; then the same without force on the way in.
        let heights = [0.0, -1e-3, -2e-3, -1e-3, 0.0];
        let spring = ticks(&heights.map(|height| (height, -1e3 * height)));
        assert!(energy(&spring).abs() < 1e-15);
        let late = ticks(&[
            (0.0, 0.0),
            (-2e-3, 0.0),
            (-2e-3, 2.0),
            (-1e-3, 1.0),
            (0.0, 0.0),
        ]);
        assert!((energy(&late) - 2e-3).abs() < 1e-15);
    }

    #[test]
    fn errors_of_force_are_those_of_their_definitions() {
        let run = ticks(&[(0.0, 2.0), (0.0, 2.0), (0.0, 3.0)]);
        let ideal = [Vector6::new(0.0, 2.0, 0.0, 0.0, 0.0, 0.0); 3];
        let errors = ForceErrors::new(&run, &ideal);
        assert_eq!(errors.direction, [90.0; 3]);
        assert_eq!(errors.magnitude, [0.0, 0.0, 0.5]);
        assert_eq!((errors.step, errors.excess_step), (1.0, 1.0));
        assert!((errors.step_jnd - 1.0 / 0.14).abs() < 1e-12);
        assert_eq!(errors.friction, 1.5);
        let none = ticks(&[(0.0, f64::NAN); 3]);
        assert!(ForceErrors::new(&none, &ideal).felt().is_nan());
    }
}
