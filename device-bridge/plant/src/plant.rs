//! Device and hand together: a wrench goes in, a pose comes out, in six degrees of freedom.
//!
//! | symbol | name in code | unit       | meaning                                                       |
//! |--------|--------------|------------|---------------------------------------------------------------|
//! | e      | `offset`     | m, rad     | from the intention to the grip                                |
//! | v      | `velocity`   | m/s, rad/s | of G                                                          |
//! | f      | `rendered`   | N, N m     | what the motors render                                        |
//! | u      | `commanded`  | N, N m     | what was commanded, a delay ago                               |
//! | w      | `push`       | N, N m     | of the hand's damping towards its intention, tremor, friction |
//!
//! `M v' = f + w - b v - k e`, `lag f' = u - f`, with u and w held: solved by a matrix exponential, so that the plant adds no
//! energy of its own (an explicit Euler step of 0.1 ms would shift the critical stiffness of a wall by a tenth). A command that
//! takes effect within a step ends it there: delays need not be whole steps. Coulomb friction alone asks for short steps.
//! Rotations are composed; their offset is a rotation vector, exact about an axis that stands still.

use std::time::Duration;

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::coulomb::friction;
use crate::encoder::Encoder;
use crate::exponential::HeldStep;
use crate::grip::Grip;
use crate::hand::Hand;
use crate::intention::Intention;
use crate::min_jerk::MinJerkPath;
use crate::motors::{DelayLine, Motors};
use crate::spatial::{Pose, displaced, stack};
use crate::tremor::Tremor;

/// Longest step unless [`Plant::with_longest_step`] says otherwise: a tenth of a 1 kHz tick, for hands that move.
const LONGEST_STEP: Duration = Duration::from_micros(100);
/// Longest step where there is Coulomb friction. An axis that stops does so within one.
const LONGEST_FRICTION_STEP: Duration = Duration::from_micros(20);
/// Durations whose exact steps are kept: those between two ticks of a loop, a few.
const KEPT_STEPS: usize = 6;

/// offset, velocity, rendered wrench.
type State = SVector<f64, 18>;
/// commanded wrench, push.
type Input = SVector<f64, 12>;
type Step = HeldStep<18, 12>;

/// A grip in a hand, pushed by motors. No allocation after `new`, but where a hand decides on another path.
#[derive(Clone, Debug)]
pub struct Plant {
    grip: Grip,
    hand: Hand,
    motors: Motors,
    encoder: Encoder,
    intention: Intention,
    tremor: Option<Tremor>,
    longest_step: Duration,
    steps: KnownSteps,
    line: DelayLine,
    /// Since the start.
    time: Duration,
    /// World from a frame at G that is parallel to the body's.
    pose: Pose,
    velocity: Vector6<f64>,
    commanded: Vector6<f64>,
    rendered: Vector6<f64>,
}

impl Plant {
    /// At rest where the hand's path begins, at time 0. Poses are those of the reference point G.
    #[must_use]
    pub fn new(grip: Grip, hand: Hand, path: MinJerkPath) -> Self {
        let (start, _) = path.at(0.0);
        let motors = Motors::default();
        Self {
            steps: KnownSteps::new(&grip, &hand, &motors),
            grip,
            hand,
            motors,
            encoder: Encoder::EXACT,
            intention: Intention::new(path),
            tremor: None,
            longest_step: if grip.coulomb6() == Vector6::zeros() {
                LONGEST_STEP
            } else {
                LONGEST_FRICTION_STEP
            },
            line: DelayLine::new(),
            time: Duration::ZERO,
            pose: start,
            velocity: Vector6::zeros(),
            commanded: Vector6::zeros(),
            rendered: Vector6::zeros(),
        }
    }

    /// The same with motors that are late.
    #[must_use]
    pub fn with_motors(mut self, motors: Motors) -> Self {
        self.motors = motors;
        self.steps = KnownSteps::new(&self.grip, &self.hand, &motors);
        self
    }

    /// The same with an encoder that counts.
    #[must_use]
    pub fn with_encoder(mut self, encoder: Encoder) -> Self {
        self.encoder = encoder;
        self
    }

    /// Lets the hand tremble: in free space the grip moves by exactly this displacement. Only a hand that holds the grip
    /// trembles.
    #[must_use]
    pub fn with_tremor(mut self, tremor: Tremor) -> Self {
        self.tremor = self.hand.holds().then_some(tremor);
        self
    }

    /// Another longest step: longer for a hand that stands, shorter for friction. Without friction and with a hand that stands,
    /// the answer does not depend on it.
    ///
    /// # Panics
    /// When `longest` is zero.
    #[must_use]
    pub fn with_longest_step(mut self, longest: Duration) -> Self {
        assert!(longest > Duration::ZERO, "a step takes time");
        self.longest_step = longest;
        self
    }

    /// Somewhere else, with another velocity (m/s, rad/s, world axes): a start out of rest.
    pub fn place(&mut self, pose: Pose, velocity: Vector6<f64>) {
        self.pose = pose;
        self.velocity = velocity;
    }

    /// Replaces the hand, such as by [`Hand::RELEASED`]; pose and velocity go on.
    pub fn set_hand(&mut self, hand: Hand) {
        self.hand = hand;
        self.steps = KnownSteps::new(&self.grip, &hand, &self.motors);
        if !hand.holds() {
            self.tremor = None;
        }
    }

    /// The hand decides now on another path; it follows it after its reaction time.
    pub fn decide(&mut self, path: MinJerkPath) {
        self.intention.decide(self.time.as_secs_f64(), path);
    }

    /// Commands a wrench (N, N m, at G, world axes), which takes effect a delay later and is saturated there.
    /// One that is not finite commands zero.
    pub fn command(&mut self, wrench: &Vector6<f64>) {
        let wrench = self.grip.saturated(wrench);
        if let Some(oldest) = self.line.send(self.time + self.motors.delay, wrench) {
            self.take_effect(oldest);
        }
        self.let_arrive();
    }

    /// Goes on to `time` since the start; earlier times change nothing.
    pub fn advance(&mut self, time: Duration) {
        while self.time < time {
            let nanos = self.longest_step.as_nanos();
            let passed = self.time.as_nanos() / nanos;
            let grid = Duration::from_nanos(((passed + 1) * nanos) as u64);
            let until = self
                .line
                .next()
                .map_or(grid, |effect| effect.min(grid))
                .min(time);
            self.step(until - self.time);
            self.time = until;
            self.let_arrive();
        }
    }

    /// Time since the start.
    #[must_use]
    pub fn time(&self) -> Duration {
        self.time
    }

    /// World from a frame at G that is parallel to the body's: as it is.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// The same as the encoders count it.
    #[must_use]
    pub fn measured_pose(&self) -> Pose {
        self.encoder.measure(&self.pose)
    }

    /// Of G, m/s; then angular, rad/s; world axes.
    #[must_use]
    pub fn velocity(&self) -> &Vector6<f64> {
        &self.velocity
    }

    /// What the motors render now, N and N m.
    #[must_use]
    pub fn rendered_wrench(&self) -> &Vector6<f64> {
        &self.rendered
    }

    /// Kinetic energy of grip and hand, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let inertia = self.grip.inertia() + self.hand.inertia();
        0.5 * self.velocity.dot(&(inertia * self.velocity))
    }

    fn let_arrive(&mut self) {
        if let Some(wrench) = self.line.arrived(self.time) {
            self.take_effect(wrench);
        }
    }

    fn take_effect(&mut self, wrench: Vector6<f64>) {
        self.commanded = wrench;
        if self.motors.lag == Duration::ZERO {
            self.rendered = wrench;
        }
    }

    fn step(&mut self, duration: Duration) {
        // The intention at the middle of the step stands for the whole step: second-order accurate.
        let middle = self.time.as_secs_f64() + 0.5 * duration.as_secs_f64();
        let (intended, intended_velocity) = self.intention.at(middle);
        let turned = self.pose.rotation * intended.rotation.inverse();
        let offset = stack(
            &(self.pose.translation.vector - intended.translation.vector),
            &turned.scaled_axis(),
        );
        let mut push = self.hand.damping6().component_mul(&intended_velocity);
        push += self.tremor_wrench(middle);

        let mut state = State::zeros();
        state.fixed_rows_mut::<6>(0).copy_from(&offset);
        state.fixed_rows_mut::<6>(6).copy_from(&self.velocity);
        state.fixed_rows_mut::<6>(12).copy_from(&self.rendered);
        let mut input = Input::zeros();
        input.fixed_rows_mut::<6>(0).copy_from(&self.commanded);
        input.fixed_rows_mut::<6>(6).copy_from(&push);

        let limits = self.grip.coulomb6();
        let stood = self.velocity;
        let step = self.steps.of(duration);
        let mut change = step.change * state + step.response * input;
        let mut stands = [false; 6];
        if limits != Vector6::zeros() {
            let free = self.velocity + change.fixed_rows::<6>(6);
            let response: Matrix6<f64> = step.response.fixed_view::<6, 6>(6, 6).into();
            let braked = friction(&free, &response, &limits);
            change += step.response.fixed_columns::<6>(6) * braked.force;
            stands = braked.stands;
        }

        let mut moved: Vector6<f64> = change.fixed_rows::<6>(0).into();
        self.velocity += change.fixed_rows::<6>(6);
        self.rendered += change.fixed_rows::<6>(12);
        for axis in (0..6).filter(|axis| stands[*axis]) {
            self.velocity[axis] = 0.0;
            if stood[axis] == 0.0 {
                moved[axis] = 0.0; // it stood, and stands
            }
        }
        let travel: Vector3<f64> = moved.fixed_rows::<3>(0).into();
        let turn: Vector3<f64> = moved.fixed_rows::<3>(3).into();
        self.pose = displaced(&self.pose, &travel, &turn);
    }

    /// The wrench that moves grip and hand in free space by the tremor's displacement.
    fn tremor_wrench(&self, time: f64) -> Vector6<f64> {
        let Some(tremor) = &self.tremor else {
            return Vector6::zeros();
        };
        let motion = tremor.at(time);
        let linear = |v: &Vector3<f64>| stack(v, &Vector3::zeros());
        (self.grip.inertia() + self.hand.inertia()) * linear(&motion.acceleration)
            + (self.grip.damping6() + self.hand.damping6()).component_mul(&linear(&motion.velocity))
            + self
                .hand
                .stiffness6()
                .component_mul(&linear(&motion.displacement))
    }
}

/// The exact steps of the durations met last.
#[derive(Clone, Debug)]
struct KnownSteps {
    rates: SMatrix<f64, 18, 18>,
    inputs: SMatrix<f64, 18, 12>,
    kept: Vec<(Duration, Step)>,
    /// The one to be replaced next.
    oldest: usize,
}

impl KnownSteps {
    fn new(grip: &Grip, hand: &Hand, motors: &Motors) -> Self {
        let inertia = grip.inertia() + hand.inertia();
        // A grip without mass does not move at all: there is no sense in the rest.
        let inverse = inertia.try_inverse().unwrap_or_else(Matrix6::zeros);
        let damping = Matrix6::from_diagonal(&(grip.damping6() + hand.damping6()));
        let stiffness = Matrix6::from_diagonal(&hand.stiffness6());
        let mut rates = SMatrix::<f64, 18, 18>::zeros();
        let mut inputs = SMatrix::<f64, 18, 12>::zeros();
        rates
            .fixed_view_mut::<6, 6>(0, 6)
            .copy_from(&Matrix6::identity());
        rates
            .fixed_view_mut::<6, 6>(6, 0)
            .copy_from(&(-inverse * stiffness));
        rates
            .fixed_view_mut::<6, 6>(6, 6)
            .copy_from(&(-inverse * damping));
        rates.fixed_view_mut::<6, 6>(6, 12).copy_from(&inverse);
        inputs.fixed_view_mut::<6, 6>(6, 6).copy_from(&inverse);
        if motors.lag > Duration::ZERO {
            let rate = Matrix6::identity() / motors.lag.as_secs_f64();
            rates.fixed_view_mut::<6, 6>(12, 12).copy_from(&-rate);
            inputs.fixed_view_mut::<6, 6>(12, 0).copy_from(&rate);
        }
        Self {
            rates,
            inputs,
            kept: Vec::with_capacity(KEPT_STEPS),
            oldest: 0,
        }
    }

    fn of(&mut self, duration: Duration) -> &Step {
        let known = self.kept.iter().position(|(kept, _)| *kept == duration);
        let place = known.unwrap_or_else(|| {
            let made = Step::new(&self.rates, &self.inputs, duration.as_secs_f64());
            if self.kept.len() < KEPT_STEPS {
                self.kept.push((duration, made));
                self.kept.len() - 1
            } else {
                let place = self.oldest;
                self.kept[place] = (duration, made);
                self.oldest = (place + 1) % KEPT_STEPS;
                place
            }
        });
        &self.kept[place].1
    }
}
