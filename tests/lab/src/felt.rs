//! What is felt of an error, millisecond by millisecond, in just-noticeable differences: J, second version.
//!
//! | term          | error                                                 | one just-noticeable difference                               |
//! |---------------|-------------------------------------------------------|--------------------------------------------------------------|
//! | direction     | angle to the right force, where both are above 0.1 N  | 18.4 degrees                                                 |
//! | magnitude     | difference of norms                                   | 7 % of the larger, at least 0.1 N                            |
//! | torque        | norm of the difference                                | 12.7 % of the larger, at least 0.1 N at the radius of the body |
//! | step          | change in 1 ms beyond the right answer's own          | 7 % of the larger of before and after, at least 0.1 N        |
//! | false, missing | the force where the right one is none, or the reverse | 0.1 N                                                        |
//! | ripple        | amplitude of the error between 30 and 500 Hz          | 30 mN                                                        |
//!
//! J of a millisecond is the largest of its terms. A felt step of the right answer may come up to 5 ms early or late: what the force changes
//! within that time is taken from the size of the step, and counts as a delay, not as a step. The other terms count for as long as they last.
//! Ripple is of windows of 100 ms in which the right answer makes no felt step and neither begins nor ends.

use std::f64::consts::TAU;

use god_object::Vector6;
use god_object::spatial::{angular, linear};
use nalgebra::Vector3;

use crate::clock::{TICK, Tick};
use crate::cpu_time::quantile;
use crate::measure::{FELT_FORCE, FIRST_FORCE, JND_DIRECTION, JND_MAGNITUDE, JND_TORQUE, largest};

/// How far a step may be from that of the right answer, ticks.
const MATCHED: usize = 5;
/// Window of the ripple and half of it, ticks.
const WINDOW: usize = 100;
const HOP: usize = 50;
/// Amplitude of a ripple that is just felt by a hand that holds 0.35 kg, N.
const RIPPLE: f64 = 0.03;
/// Frequencies below the band that are taken out, in periods a window: 10 and 20 Hz.
const BELOW: [f64; 2] = [1.0, 2.0];

/// J of every millisecond, and the delay of steps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Felt {
    /// Just-noticeable differences; empty where there is no right answer.
    pub(crate) each: Vec<f64>,
    /// Largest time between a step of the right answer and the change of force that was matched with it, s.
    pub(crate) step_delay: f64,
}

impl Felt {
    /// Of a run against the right answer. `arm`: radius of the body about its reference point, m.
    pub(crate) fn new(ticks: &[Tick], ideal: &[Vector6], arm: f64) -> Self {
        let forces: Vec<_> = ticks.iter().map(|tick| linear(&tick.wrench)).collect();
        let right: Vec<_> = ideal.iter().map(linear).collect();
        let (steps, step_delay) = steps(&forces, &right);
        let ripple = ripple(&forces, &right);
        let each = (0..right.len()).map(|i| {
            let torque = torque(&angular(&ticks[i].wrench), &angular(&ideal[i]), arm);
            let terms = [force(&forces[i], &right[i]), torque, steps[i], ripple[i]];
            largest(terms.into_iter())
        });
        Self {
            each: each.collect(),
            step_delay,
        }
    }

    /// 95th percentile; NaN where there is no right answer.
    pub(crate) fn p95(&self) -> f64 {
        quantile(&self.each, 0.95)
    }

    /// Its largest.
    pub(crate) fn most(&self) -> f64 {
        quantile(&self.each, 1.0)
    }

    /// Share of the time above one just-noticeable difference; NaN where there is no right answer.
    pub(crate) fn share_above_one(&self) -> f64 {
        let above = self.each.iter().filter(|j| **j > 1.0 || j.is_nan()).count();
        above as f64 / self.each.len() as f64
    }
}

/// What is just felt beside a force of this size, N.
fn just_felt(force: f64) -> f64 {
    (JND_MAGNITUDE * force).max(FELT_FORCE)
}

/// Direction, magnitude, false or missing force.
fn force(force: &Vector3<f64>, right: &Vector3<f64>) -> f64 {
    let (is, should) = (force.norm(), right.norm());
    if should <= FIRST_FORCE || is <= FIRST_FORCE {
        return (is - should).abs() / FELT_FORCE;
    }
    let magnitude = (is - should).abs() / just_felt(is.max(should));
    let direction = if is > FELT_FORCE && should > FELT_FORCE {
        force.angle(right).to_degrees() / JND_DIRECTION
    } else {
        0.0
    };
    if is.is_nan() {
        is
    } else {
        magnitude.max(direction)
    }
}

fn torque(torque: &Vector3<f64>, right: &Vector3<f64>, arm: f64) -> f64 {
    let larger = torque.norm().max(right.norm());
    (torque - right).norm() / (JND_TORQUE * larger).max(FELT_FORCE * arm)
}

/// Steps in just-noticeable differences, tick by tick, and the largest delay of one that was matched, s.
fn steps(forces: &[Vector3<f64>], right: &[Vector3<f64>]) -> (Vec<f64>, f64) {
    let change = |of: &[Vector3<f64>], i: usize| (of[i] - of[i - 1]).norm();
    let count = right.len();
    // A felt step of the right answer, or nothing: it is matched as a whole, below.
    let felt_step = |i: usize| {
        let size = change(right, i);
        (size > just_felt(right[i].norm().max(right[i - 1].norm()))).then_some(size)
    };
    // What is left of each change after the right answer's own smooth one then, or a millisecond beside.
    let mut left = vec![0.0; count];
    for (i, rest) in left.iter_mut().enumerate().skip(1) {
        let beside = i.saturating_sub(1).max(1)..(i + 2).min(count);
        let smooth = beside.filter(|j| felt_step(*j).is_none());
        let own = smooth.map(|j| change(right, j)).fold(0.0, f64::max);
        *rest = change(forces, i) - own;
        // Not clamped by max: NaN stays.
        if *rest < 0.0 {
            *rest = 0.0;
        }
    }
    // The nearest pairs first: a steady ramp matches itself.
    let mut budgets: Vec<(usize, f64)> = (1..count)
        .filter_map(|i| Some((i, felt_step(i)?)))
        .collect();
    let mut delay = 0_usize;
    for apart in 0..=MATCHED {
        for (i, budget) in &mut budgets {
            let places = [i.checked_sub(apart), Some(*i + apart)];
            for j in places.into_iter().flatten().filter(|j| *j < count) {
                let taken = left[j].min(*budget);
                if taken > FELT_FORCE {
                    delay = delay.max(apart);
                }
                left[j] -= taken;
                *budget -= taken;
            }
        }
    }
    for (i, step) in left.iter_mut().enumerate().skip(1) {
        *step /= just_felt(forces[i].norm().max(forces[i - 1].norm()));
    }
    (left, delay as f64 * TICK)
}

/// Ripple in just-noticeable differences; 0 in windows where the right answer is not smooth.
fn ripple(forces: &[Vector3<f64>], right: &[Vector3<f64>]) -> Vec<f64> {
    let mut felt = vec![0.0_f64; right.len()];
    let mut begin = 0;
    while begin + WINDOW <= right.len() {
        let near = begin.saturating_sub(MATCHED)..(begin + WINDOW + MATCHED).min(right.len());
        if is_smooth(&right[near]) {
            let error: Vec<_> = (begin..begin + WINDOW)
                .map(|i| forces[i] - right[i])
                .collect();
            let amplitude = amplitude_above(&error) / RIPPLE;
            for j in &mut felt[begin..begin + WINDOW] {
                if amplitude.is_nan() || amplitude > *j {
                    *j = amplitude;
                }
            }
        }
        begin += HOP;
    }
    felt
}

/// Whether there is a force all the time, or none, and no felt step of it.
fn is_smooth(right: &[Vector3<f64>]) -> bool {
    let touching = right[0].norm() > FIRST_FORCE;
    right
        .iter()
        .all(|force| (force.norm() > FIRST_FORCE) == touching)
        && right
            .windows(2)
            .all(|pair| (pair[1] - pair[0]).norm() <= just_felt(pair[0].norm().max(pair[1].norm())))
}

/// Amplitude of what is left of a window when its mean, its slope and what is slower than the band are taken out: of a tone, its own.
fn amplitude_above(error: &[Vector3<f64>]) -> f64 {
    let count = error.len() as f64;
    let middle = |i: usize| (i as f64 + 0.5) / count - 0.5;
    let slow = BELOW.iter().flat_map(|periods| {
        [0.0, 0.25].map(|quarter| {
            let wave = move |i: usize| (TAU * (periods * middle(i) + quarter)).sin();
            Box::new(wave) as Box<dyn Fn(usize) -> f64>
        })
    });
    // Each shape is freed of those before it, and then taken out.
    let mut shapes: Vec<Vec<f64>> = Vec::new();
    let mut rest = error.to_vec();
    let straight: [Box<dyn Fn(usize) -> f64>; 2] = [Box::new(|_| 1.0), Box::new(middle)];
    for shape in straight.into_iter().chain(slow) {
        let mut shape: Vec<f64> = (0..rest.len()).map(shape).collect();
        for earlier in &shapes {
            let part: f64 = shape.iter().zip(earlier).map(|(a, b)| a * b).sum();
            for (own, other) in shape.iter_mut().zip(earlier) {
                *own -= part * other;
            }
        }
        let norm = shape.iter().map(|a| a * a).sum::<f64>().sqrt();
        shape.iter_mut().for_each(|a| *a /= norm);
        let part = (rest.iter().zip(&shape)).fold(Vector3::zeros(), |sum, (e, a)| sum + e * *a);
        for (e, a) in rest.iter_mut().zip(&shape) {
            *e -= part * *a;
        }
        shapes.push(shape);
    }
    let power: f64 = rest.iter().map(Vector3::norm_squared).sum();
    (2.0 * power / count).sqrt()
}

#[cfg(test)]
mod tests {
    use god_object::Pose;

    use super::*;

    const COUNT: usize = 400;

    fn felt(force: impl Fn(f64) -> f64, right: impl Fn(f64) -> f64) -> Felt {
        let wrench = |z: f64| Vector6::new(0.0, 0.0, z, 0.0, 0.0, 0.0);
        let time = |i: usize| i as f64 * TICK;
        let ticks: Vec<Tick> = (0..COUNT)
            .map(|i| Tick {
                time: time(i),
                device: Pose::identity(),
                body: Pose::identity(),
                wrench: wrench(force(time(i))),
            })
            .collect();
        let right: Vec<Vector6> = (0..COUNT).map(|i| wrench(right(time(i)))).collect();
        Felt::new(&ticks, &right, 0.01)
    }

    fn step_at(begin: f64) -> impl Fn(f64) -> f64 {
        move |time| if time < begin { 0.0 } else { 5.0 }
    }

    #[test]
    fn a_step_that_is_late_is_a_delay_and_counts_while_it_lasts() {
        let late = felt(step_at(0.2035), step_at(0.1995));
        assert!((late.step_delay - 0.004).abs() < 1e-12);
        // 5 N are missing for 4 ms: nothing more.
        assert!((late.share_above_one() - 4.0 / COUNT as f64).abs() < 1e-12);
        assert!((late.most() - 50.0).abs() < 1e-9);
        let early = felt(step_at(0.1995), step_at(0.2035));
        assert_eq!(late.share_above_one(), early.share_above_one());
        // Later than may be matched, it is a step as well.
        let lost = felt(step_at(0.2095), step_at(0.1995));
        assert_eq!(lost.step_delay, 0.0);
        assert!(lost.each[210] > 10.0, "{}", lost.each[210]);
    }

    #[test]
    fn chatter_beside_a_step_is_not_matched_with_it() {
        let chatter = |time: f64| match (time / TICK).round() as u32 {
            200 | 202 | 204.. => 5.0,
            _ => 0.0,
        };
        let felt = felt(chatter, step_at(0.1995));
        assert!(felt.each[201..=204].iter().all(|j| *j > 10.0));
    }

    #[test]
    fn a_steep_ramp_is_no_error_of_the_force_that_follows_it() {
        let ramp = |time: f64| (1000.0 * (time - 0.2)).clamp(0.0, 15.0);
        let same = felt(ramp, ramp);
        assert_eq!((same.most(), same.step_delay), (0.0, 0.0));
    }

    #[test]
    fn a_tone_is_felt_by_its_amplitude_and_a_slow_error_is_not_a_ripple() {
        let right = |_: f64| 5.0;
        let tone = felt(|t| 5.0 + 0.06 * (TAU * 200.0 * t).sin(), right);
        assert!((tone.p95() - 2.0).abs() < 0.05, "{}", tone.p95());
        let slow = felt(|t| 5.0 + 0.06 * (TAU * 10.0 * t).sin(), right);
        assert!(slow.p95() < 0.3, "{}", slow.p95());
    }

    #[test]
    fn false_and_missing_force_are_the_same_error_and_nothing_divides_by_none() {
        let none = |_: f64| 0.0;
        let some = |_: f64| 0.05;
        assert_eq!(felt(none, some).p95(), felt(some, none).p95());
        assert!((felt(some, none).most() - 0.5).abs() < 1e-12);
        assert!(felt(|_| f64::NAN, none).share_above_one() == 1.0);
    }
}
