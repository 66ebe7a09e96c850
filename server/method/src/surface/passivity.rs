//! Energy at the device's port, measured, and on request bounded: the user never takes out more than was put in.
//!
//! | symbol  | name in code  | unit   | meaning                                                                   |
//! |---------|---------------|--------|---------------------------------------------------------------------------|
//! | F       | `wrench`      | N, N m | on the hand at the reference point, held from one sample to the next      |
//! | dx      | `moved`       | m, rad | what the device moved from one sample to the next                         |
//! | E       | `given`       | J      | `sum F . dx`: what the hand has received; negative is what it has put in   |
//! | W       | `granted`     | J      | what obstacles that move have put in                                      |
//! | W - E   | `reserve`     | J      | what may still be given                                                   |
//!
//! The observer is exact for a held force, whatever the device does. The controller can only expect the next motion: it
//! takes it to be as the last one or a quarter longer, and where the held wrench would then give more than the reserve it
//! adds damping along the motion, `- alpha M dx`: the least change, in the metric, that takes that power. A motion that starts or turns
//! within one sample can exceed the reserve by `|F| |change of dx|`; the next samples take it back. The damping is clamped: it takes at most
//! twice the power that the wrench gives, so that it resists no harder than the wrench pushed.
//!
//! Source: time-domain passivity, Hannaford and Ryu 2002.

use nalgebra::Vector3;

use crate::quasi_statics::Metric;
use crate::spatial::{Pose, Vector6, pose_difference};

/// The next motion may be this much longer than the last before more than the reserve is given.
const MOTION_GROWTH: f64 = 1.25;
/// Most power that damping takes, in powers of the wrench: all of it, and as much again to take back what went over.
const MOST_TAKEN: f64 = 2.0;

/// A sum that keeps what rounding drops (Neumaier): the energy of hours at microjoules.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct CompensatedSum {
    sum: f64,
    lost: f64,
}

impl CompensatedSum {
    fn add(&mut self, term: f64) {
        let sum = self.sum + term;
        self.lost += if self.sum.abs() >= term.abs() {
            (self.sum - sum) + term
        } else {
            (term - sum) + self.sum
        };
        self.sum = sum;
    }

    fn value(&self) -> f64 {
        self.sum + self.lost
    }
}

/// Measures the energy that the hand receives over a run. Some nanoseconds for a sample; no allocation.
#[derive(Clone, Copy, Debug, Default)]
pub struct EnergyObserver {
    given: CompensatedSum,
    highest: f64,
    granted: f64,
    generated: f64,
    held: Option<(Pose, Vector6)>,
    moved: Vector6,
}

impl EnergyObserver {
    /// An observer at zero.
    pub fn new() -> Self {
        Self::default()
    }

    /// A new device sample: the wrench held since the last one has done its work. `device` is the pose of the reference
    /// point. Returns the energy given so far, J.
    pub fn arrive(&mut self, device: &Pose) -> f64 {
        if let Some((last, wrench)) = &mut self.held {
            self.moved = pose_difference(device, last, &Vector3::zeros());
            *last = *device;
            let work = wrench.dot(&self.moved);
            if work.is_finite() {
                self.given.add(work);
            }
            self.highest = self.highest.max(self.given.value());
            self.generated = self.generated.max(self.given.value() - self.granted);
        }
        self.given.value()
    }

    /// The wrench (N, N m) that is held from this sample on.
    pub fn hold(&mut self, device: &Pose, wrench: &Vector6) {
        self.held = Some((*device, *wrench));
    }

    /// No wrench is held: what the device does until the next one is no work.
    pub fn release(&mut self) {
        if let Some((_, wrench)) = &mut self.held {
            *wrench = Vector6::zeros();
        }
    }

    /// Nobody knows where the device is: its way to the next sample is no motion of one period.
    pub fn forget_pose(&mut self) {
        self.held = None;
        self.moved = Vector6::zeros();
    }

    /// The energy that the hand has received so far, J; negative: that it has put in.
    pub fn given(&self) -> f64 {
        self.given.value()
    }

    /// The most that [`Self::given`] has been: above zero the run was not passive, J.
    pub fn highest(&self) -> f64 {
        self.highest
    }

    /// Net work since the start that moving obstacles have done on the hand, J: it may be given beyond what the hand has put in.
    pub fn grant(&mut self, work: f64) {
        if work.is_finite() {
            self.granted = work;
        }
    }

    /// The most that was given beyond what hand and obstacles had put in, J: above zero the coupling made it.
    pub fn generated(&self) -> f64 {
        self.generated
    }

    /// What the device moved between the last two samples, m and rad.
    pub fn moved(&self) -> &Vector6 {
        &self.moved
    }

    /// The wrench within the reserve: `wrench` itself where the last motion, made a little longer, takes no more than hand and
    /// moving obstacles have put in.
    pub fn within_reserve(&self, metric: &Metric, wrench: &Vector6) -> Vector6 {
        let expected = wrench.dot(&self.moved);
        let allowed = (self.granted - self.given.value()) / MOTION_GROWTH;
        let gives = expected > 0.0 && expected > allowed; // false for NaN
        if !gives {
            return *wrench;
        }
        let momentum = metric.mass_matrix_times(&self.moved);
        let square = momentum.dot(&self.moved);
        let moves = square > 0.0; // false for NaN
        if !moves {
            return *wrench;
        }
        let taken = (expected - allowed).min(MOST_TAKEN * expected);
        wrench - momentum * (taken / square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn the_sum_keeps_small_terms_beside_large_ones() {
        let mut sum = CompensatedSum::default();
        sum.add(1e9);
        for _ in 0..1000 {
            sum.add(1e-9);
        }
        sum.add(-1e9);
        assert!((sum.value() - 1e-6).abs() < 1e-15, "{}", sum.value());
    }

    #[test]
    fn a_held_force_gives_force_times_way() {
        let mut observer = EnergyObserver::new();
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        observer.arrive(&at(0.0));
        observer.hold(&at(0.0), &Vector6::new(-3.0, 5.0, 0.0, 0.0, 0.0, 0.0));
        assert!((observer.arrive(&at(0.01)) + 0.03).abs() < 1e-15);
        observer.hold(&at(0.01), &Vector6::new(2.0, 0.0, 0.0, 0.0, 0.0, 0.0));
        assert!((observer.arrive(&at(0.04)) - 0.03).abs() < 1e-15);
        assert!((observer.highest() - 0.03).abs() < 1e-15);
    }

    #[test]
    fn the_wrench_is_changed_only_beyond_the_reserve_and_only_along_the_motion() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("an inertia");
        let mut observer = EnergyObserver::new();
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        observer.arrive(&at(0.0));
        observer.hold(&at(0.0), &Vector6::new(-1.0, 0.0, 0.0, 0.0, 0.0, 0.0));
        observer.arrive(&at(0.01)); // reserve 10 mJ, motion 10 mm
        let small = Vector6::new(0.7, 4.0, 0.0, 0.0, 0.0, 0.0);
        assert_eq!(observer.within_reserve(&metric, &small), small);
        let large = Vector6::new(3.0, 4.0, 0.0, 0.0, 0.0, 0.0);
        let bounded = observer.within_reserve(&metric, &large);
        assert!((bounded - Vector6::new(0.8, 4.0, 0.0, 0.0, 0.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn what_obstacles_put_in_may_be_given_and_is_not_generated() {
        let metric = Metric::new(1.0, &Matrix3::identity()).expect("an inertia");
        let mut observer = EnergyObserver::new();
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        let push = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        observer.arrive(&at(0.0));
        observer.grant(0.025);
        observer.hold(&at(0.0), &push);
        observer.arrive(&at(0.01));
        assert_eq!(observer.within_reserve(&metric, &push), push);
        observer.hold(&at(0.01), &push);
        observer.arrive(&at(0.02));
        assert_eq!(observer.generated(), 0.0);
        assert!(observer.within_reserve(&metric, &push).x < 0.5);
        observer.hold(&at(0.02), &push);
        observer.arrive(&at(0.03));
        assert!((observer.generated() - 0.005).abs() < 1e-15);
        assert!((observer.highest() - 0.03).abs() < 1e-15);
    }
}
