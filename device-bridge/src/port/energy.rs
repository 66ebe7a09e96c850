//! Energy observer at the device port: how much energy the coupling has put into the user's hand.
//!
//! | symbol | name in code | unit | meaning |
//! |--------|--------------|------|---------|
//! | F_k    | `held`       | N, N m | wrench on the user, held from sample k to k + 1 |
//! | E      | `delivered`  | J    | `sum F_k . (x_(k+1) - x_k)`, net energy given to the user |
//! | E_inj  | `injected`   | J    | largest E so far, at least 0 |
//!
//! A passive coupling only gives back what the user put in, so E never rises above zero. Because the
//! wrench is held between samples, its work over the measured displacement is exact in translation, and in
//! rotation up to the change of the axis within one sample; no velocity estimate enters.
//!
//! Source: Hannaford & Ryu 2002 (time-domain passivity observer), in its position form.

use nalgebra::{Point3, UnitQuaternion, Vector6};
use taut_plant::stack;

use crate::device::Pose;

/// Sums the work of the wrench at the device port. No allocation.
#[derive(Clone, Debug)]
pub struct EnergyObserver {
    reference_point: Point3<f64>,
    last: Option<(Point3<f64>, UnitQuaternion<f64>)>,
    /// Displacement and rotation between the last two poses.
    travel: Vector6<f64>,
    held: Vector6<f64>,
    delivered: f64,
    injected: f64,
}

impl EnergyObserver {
    /// An observer at rest; `reference_point` is G in the body's own frame.
    #[must_use]
    pub fn new(reference_point: Point3<f64>) -> Self {
        Self {
            reference_point,
            last: None,
            travel: Vector6::zeros(),
            held: Vector6::zeros(),
            delivered: 0.0,
            injected: 0.0,
        }
    }

    /// Adds the work since the last sample. `pose` is the new sample (body's own frame), `wrench` is what
    /// is written after it and held until the next. Returns the net energy delivered so far, in J.
    ///
    /// A sample that is not finite adds nothing and starts the measurement afresh.
    pub fn step(&mut self, pose: &Pose, wrench: &Vector6<f64>) -> f64 {
        self.measure(pose);
        self.hold(wrench);
        self.delivered
    }

    /// The first half of [`EnergyObserver::step`]: the work of the wrench held so far, up to the new sample, in J.
    pub(crate) fn measure(&mut self, pose: &Pose) -> f64 {
        let point = pose * self.reference_point;
        let mut work = 0.0;
        self.travel = Vector6::zeros();
        if let Some((last_point, last_rotation)) = self.last {
            let travel = point - last_point;
            let turn = (pose.rotation * last_rotation.inverse()).scaled_axis();
            self.travel = stack(&travel, &turn);
            let done = self.held.dot(&self.travel);
            if done.is_finite() {
                work = done;
                self.delivered += work;
                self.injected = self.injected.max(self.delivered);
            }
        }
        let finite = point.iter().all(|x| x.is_finite())
            && pose.rotation.coords.iter().all(|x| x.is_finite());
        self.last = finite.then_some((point, pose.rotation));
        work
    }

    /// The second half: what is written now and held until the next sample.
    pub(crate) fn hold(&mut self, wrench: &Vector6<f64>) {
        self.held = *wrench;
    }

    /// What does the work: the wrench on the hand since the last write.
    pub(crate) fn held(&self) -> &Vector6<f64> {
        &self.held
    }

    /// A sample that may not be trusted: the measurement starts afresh with the next one.
    pub(crate) fn skip(&mut self) {
        self.last = None;
        self.travel = Vector6::zeros();
    }

    /// Displacement of the reference point and rotation between the last two samples, m and rad.
    pub(crate) fn travel(&self) -> &Vector6<f64> {
        &self.travel
    }

    /// Net energy given to the user, in J; negative when the user has put energy in.
    #[must_use]
    pub fn delivered(&self) -> f64 {
        self.delivered
    }

    /// Most that the net energy ever was above zero, in J: what a passive coupling could not have given.
    #[must_use]
    pub fn injected(&self) -> f64 {
        self.injected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const STIFFNESS: f64 = 1000.0; // N/m
    const AMPLITUDE: f64 = 5e-3; // m
    const PERIOD: f64 = 1e-3; // s

    /// Ten cycles of 1 Hz into a spring whose force is `age` samples old.
    fn observe(age: usize) -> EnergyObserver {
        let mut observer = EnergyObserver::new(Point3::new(0.0, 0.0, 0.02));
        let depth = |k: usize| AMPLITUDE * (std::f64::consts::TAU * k as f64 * PERIOD).sin();
        for k in 0..10_000_usize {
            let force = -STIFFNESS * depth(k.saturating_sub(age));
            let pose = Pose::translation(depth(k), 0.0, 0.0);
            observer.step(&pose, &(Vector6::x() * force));
        }
        observer
    }

    /// What the zero-order hold of one sample and `age` more leak over ten cycles: the loop that force
    /// and displacement enclose, `pi K A^2 sin(w (T/2 + age T))` each.
    fn leak(age: f64) -> f64 {
        let omega = std::f64::consts::TAU;
        10.0 * std::f64::consts::PI
            * STIFFNESS
            * AMPLITUDE
            * AMPLITUDE
            * (omega * PERIOD * (0.5 + age)).sin()
    }

    #[test]
    fn a_sampled_spring_generates_only_the_leak_of_its_hold() {
        let observer = observe(0);
        assert!((observer.delivered() - leak(0.0)).abs() < 0.02 * leak(0.0));
        // Against the energy that went in and out: 10 cycles, twice each, of half K A^2.
        let exchanged = 20.0 * 0.5 * STIFFNESS * AMPLITUDE * AMPLITUDE;
        assert!(observer.injected() < 0.011 * exchanged);
    }

    #[test]
    fn a_stale_force_generates_the_energy_of_its_age() {
        let observer = observe(20);
        assert!((observer.injected() / leak(20.0) - 1.0).abs() < 0.02);
        assert!(observer.injected() > 30.0 * observe(0).injected());
    }

    #[test]
    fn pressing_and_releasing_a_passive_wall_injects_nothing() {
        let mut observer = EnergyObserver::new(Point3::origin());
        // In at full force, out at half: the user loses energy.
        for (x, force) in [(0.0, -1.0), (1.0, -0.5), (0.0, 0.0)] {
            observer.step(&Pose::translation(x, 0.0, 0.0), &(Vector6::x() * force));
        }
        assert_eq!(observer.delivered(), -0.5);
        assert_eq!(observer.injected(), 0.0);
    }

    #[test]
    fn torque_works_over_the_angle_turned() {
        let mut observer = EnergyObserver::new(Point3::origin());
        let torque = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.3);
        for k in 0..=100 {
            let turn = Pose::rotation(Vector3::z() * (0.05 * f64::from(k)));
            observer.step(&turn, &torque);
        }
        assert!((observer.delivered() - 0.3 * 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_broken_sample_adds_nothing() {
        let mut observer = EnergyObserver::new(Point3::origin());
        let push = Vector6::x();
        observer.step(&Pose::identity(), &push);
        observer.step(&Pose::translation(f64::NAN, 0.0, 0.0), &push);
        observer.step(&Pose::translation(9.0, 0.0, 0.0), &push);
        assert_eq!(observer.delivered(), 0.0);
    }
}
