//! Stability maps: the stiffest contact that each method renders to a simulated device, against delay, rate, damping and quantisation.
//!
//! A ball of 1 kg in the hand is pressed on a wall, into a corner or a hollow, or a peg against the side of its hole, through a device that nobody holds, and
//! disturbed. Above the critical stiffness that grows, below it dies away. What a map does not sweep is a device of 0.2 kg and 1 N s/m, forces and updates
//! at 1 kHz, a tick of delay, no quantisation.
//!
//! | symbol | name in code | unit  | meaning                                    |
//! |--------|--------------|-------|--------------------------------------------|
//! | t_d    | `delay`      | s     | of the force                               |
//! | f      | `updates`    | Hz    | updates of the method; forces stay at 1 kHz |
//! | k_s    | `k_s`        | –     | share of the way to the device that an update covers |
//! | b      | `damping`    | N s/m | of the device                              |
//! | Delta  | `resolution` | m     | one count of its encoder                   |
//!
//! Theory, in the same picture: eigenvalues of the sampled loop of device and spring (exact where the method is that spring), the rule
//! `b / (T/2 + t_d)`, and for quantisation the bound of passivity `min(2 b / T, 2 f_c / Delta)`
//! (Abbott and Okamura 2005).

mod axes;
mod contact;
mod files;

use god_object::spatial::{linear, six};
use god_object::{Pose, Vector6};
use nalgebra::Vector3;
use taut_control_tests::closed_loop::{PERIOD, critical_stiffness, grip, held};
use taut_plant::stability::{SampledLoop, linear_limit, passive_limit_quantised};
use taut_plant::{Encoder, Grip, Hand, Plant};

use axes::{Conditions, MAPS, Map};
pub(crate) use files::{COLOURS, panels, write};

use crate::crew;
use crate::method::{Method, Tuning};
use crate::recipes::Extent;
use contact::Pressed;

/// Who is mapped: what differs from them by adaptation or look-ahead differs before a contact, not in it.
pub(crate) const METHODS: [Method; 6] = [
    Method::Ours,
    Method::Paper,
    Method::VirtualCoupling,
    Method::Discrete,
    Method::Penalty,
    Method::Point,
];
/// Updates before the device is let go: the method has settled.
const SETTLING: u32 = 100;
/// Ticks of a run, s / ms, and which of them are early and late.
const TICKS: u32 = 1500;
const EARLY: std::ops::Range<u32> = 100..500;
const LATE: std::ops::Range<u32> = 1100..1500;
/// A disturbance that has grown this much need not be followed further.
const GROWN: f64 = 100.0;
/// One that stays larger by this has grown, too: bounces and cycles have a largest size.
const GROWN_AND_BOUNDED: f64 = 2.0;
/// Softest and stiffest wall of the search, N/m, and the relative width at which it ends.
const SEARCH: [f64; 2] = [20.0, 100_000.0];
const SEARCH_WIDTH: f64 = 0.02;

/// One point of a map: a row of its CSV.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    /// Of the map.
    pub(crate) map: &'static str,
    /// Where on its axis.
    pub(crate) at: f64,
    /// Who.
    pub(crate) method: Method,
    /// K_crit by simulation, N/m; an end of the search where nothing within it changes.
    pub(crate) critical: f64,
    /// By the eigenvalues of device and spring, N/m.
    pub(crate) by_eigenvalues: f64,
    /// `b / (T/2 + t_d)`, N/m.
    pub(crate) by_rule: f64,
    /// The bound of passivity with a count and friction, N/m; NaN where nothing is counted.
    pub(crate) passive: f64,
}

impl Conditions {
    fn device(&self) -> Grip {
        Grip {
            coulomb_force: Vector3::repeat(self.coulomb),
            ..grip(self.damping)
        }
    }

    /// Of the sampled loop of device and spring, N/m.
    pub(crate) fn by_eigenvalues(&self) -> f64 {
        let loop_of_it = SampledLoop {
            mass: self.device().mass,
            damping: self.damping,
            delay: self.delay,
            ..SampledLoop::at_period(PERIOD.as_secs_f64())
        };
        loop_of_it.critical_stiffness()
    }

    /// `b / (T/2 + t_d)`, N/m.
    pub(crate) fn by_rule(&self) -> f64 {
        linear_limit(self.damping, 0.0, PERIOD.as_secs_f64(), self.delay)
    }

    fn passive(&self) -> f64 {
        if self.resolution > 0.0 {
            let period = PERIOD.as_secs_f64();
            passive_limit_quantised(self.damping, self.coulomb, period, self.resolution)
        } else {
            f64::NAN
        }
    }

    /// K_crit of a method, N/m.
    pub(crate) fn critical(&self, method: Method) -> f64 {
        critical_stiffness(SEARCH, SEARCH_WIDTH, |k| self.grows(method, k))
    }

    /// Whether the disturbance of a contact of this stiffness, N/m, grows.
    fn grows(&self, method: Method, stiffness: f64) -> bool {
        let pressed = self.contact.pressed(stiffness);
        let period = 1.0 / f64::from(self.updates);
        let tuning = self.k_s.map_or(method.tunings()[0], Tuning::Way);
        let mut method = method.start(&pressed.scene, period, tuning);
        let start = pressed.scene.start.translation.vector;
        let at_rest = Pose::from(pressed.at_rest);
        let mut updates = f64::from(SETTLING);
        for update in 0..SETTLING {
            // There in steps, so that every method has the contact before the device is past it.
            let share = f64::from(update + 1) / f64::from(SETTLING / 2);
            let time = f64::from(update) * period;
            method.update(
                time,
                &Pose::from(start.lerp(&pressed.at_rest, share.min(1.0))),
            );
            method.publish(time);
            let _ = method.force(time, &at_rest);
        }
        let before = updates * period;
        let mut plant = self.plant(&pressed);
        let frequency = (stiffness / self.device().mass).sqrt();
        let (mut early, mut late) = (0.0_f64, 0.0_f64);
        for tick in 0..TICKS {
            let now = PERIOD * tick;
            plant.advance(now);
            let time = before + now.as_secs_f64();
            let measured = plant.measured_pose();
            // Half a tick late: no update begins at the instant of a force.
            while (updates + 0.5) * period <= time {
                method.publish(time);
                method.update(time, &measured);
                updates += 1.0;
            }
            let force = linear(&method.force(time, &measured)) + pressed.push;
            plant.command(&six(&force.component_mul(&pressed.free), &Vector3::zeros()));
            let place = plant.pose().translation.vector - pressed.at_rest;
            let velocity = linear(plant.velocity()).component_mul(&pressed.free);
            let size = place.norm().hypot(velocity.norm() / frequency);
            if size.is_nan() || size > GROWN * pressed.disturbance.norm() {
                return true;
            }
            if EARLY.contains(&tick) {
                early = early.max(size);
            } else if LATE.contains(&tick) {
                late = late.max(size);
            }
        }
        // A hollow bounds what grows. A count of the encoder is never at rest: what stays as large as a count has not grown.
        let before = early.min(GROWN_AND_BOUNDED * pressed.disturbance.norm());
        late > before.max(2.0 * self.resolution)
    }

    fn plant(&self, pressed: &Pressed) -> Plant {
        let at_rest = Pose::from(pressed.at_rest);
        let mut plant = held(self.device(), Hand::RELEASED, at_rest, self.delay);
        if self.resolution > 0.0 {
            plant = plant.with_encoder(Encoder {
                length: self.resolution,
                angle: 0.0,
            });
        }
        let disturbed = Pose::from(pressed.at_rest + pressed.disturbance);
        plant.place(disturbed, Vector6::zeros());
        plant
    }
}

/// All points of all maps, on so many threads; the quick extent has the ends of each axis alone. Calls `done` after each.
pub(crate) fn run(extent: Extent, threads: usize, done: impl Fn() + Sync) -> Vec<Point> {
    crew::map(threads, &tasks(extent), |(map, at, method)| {
        let conditions = (map.at)(*at);
        let point = Point {
            map: map.name,
            at: *at,
            method: *method,
            critical: conditions.critical(*method),
            by_eigenvalues: conditions.by_eigenvalues(),
            by_rule: conditions.by_rule(),
            passive: conditions.passive(),
        };
        done();
        point
    })
}

/// Map, place, method.
pub(crate) fn tasks(extent: Extent) -> Vec<(Map, f64, Method)> {
    let places = |map: &Map| -> Vec<f64> {
        let last = map.values.len() - 1;
        match extent {
            Extent::Full => map.values.to_vec(),
            Extent::Quick => vec![map.values[0], map.values[last]],
        }
    };
    let points = MAPS.iter().flat_map(|map| {
        let places = places(map).into_iter();
        places.flat_map(|at| METHODS.map(|method| (*map, at, method)))
    });
    points.collect()
}

#[cfg(test)]
mod tests {
    use super::axes::updated;
    use super::contact::Contact;
    use super::*;

    /// The method of this project is a spring to the wall: its limit is that of the eigenvalues.
    #[test]
    fn a_wall_of_ours_is_as_stable_as_its_spring() {
        let of_a_wall = |map: &&Map| (map.at)(map.values[0]).contact == Contact::Wall;
        let maps = MAPS.iter().filter(of_a_wall);
        for map in maps.filter(|map| map.name != "quantisation") {
            for at in [map.values[0], map.values[map.values.len() - 1]] {
                let conditions = (map.at)(at);
                let (found, exact) = (
                    conditions.critical(Method::Ours),
                    conditions.by_eigenvalues(),
                );
                let ratio = found / exact;
                assert!(
                    (0.95..1.05).contains(&ratio),
                    "{} {at}: {found} of {exact}",
                    map.name
                );
            }
        }
    }

    #[test]
    fn a_corner_is_as_stable_as_a_wall() {
        let at = |contact| updated(contact, 70.0).critical(Method::Ours);
        let ratio = at(Contact::Corner) / at(Contact::Wall);
        assert!((0.95..1.05).contains(&ratio), "{ratio}");
    }

    /// In a hole the normal turns about the hole's axis, and the deepest point alone goes to and fro.
    #[test]
    fn a_peg_in_its_hole_bears_what_a_wall_does() {
        let hole = updated(Contact::PegInHole, 300.0);
        let spring = hole.by_eigenvalues();
        let [ours, penalty] = [Method::Ours, Method::Penalty].map(|method| hole.critical(method));
        assert!(ours > 0.95 * spring, "{ours} of {spring}");
        assert!(penalty < 0.5 * spring, "{penalty} of {spring}");
    }

    /// Normals of a hollow are as old as the body is behind: what goes all the way to the device bears more, and not what a wall does.
    #[test]
    fn a_contact_that_turns_bears_more_the_farther_an_update_goes() {
        let at = |k_s| Conditions {
            k_s: Some(k_s),
            ..updated(Contact::Hollow, 300.0)
        };
        let [half, whole] = [0.5, 1.0].map(|k_s| at(k_s).critical(Method::Paper));
        let spring = at(1.0).by_eigenvalues();
        assert!(1.4 * half < whole && whole < 0.7 * spring, "{half} {whole}");
    }

    /// Where the facets that a ball comes to are known before, no normal is old.
    #[test]
    fn a_contact_that_turns_bears_what_a_wall_does_however_slow_the_updates() {
        for k_s in [0.25, 1.0] {
            let slow = Conditions {
                k_s: Some(k_s),
                ..updated(Contact::Hollow, 70.0)
            };
            let (found, spring) = (slow.critical(Method::Ours), slow.by_eigenvalues());
            assert!((0.95..1.05).contains(&(found / spring)), "{k_s}: {found}");
        }
    }

    /// Of a ball of facets the rows are those of what its corners slide over, too: without them it bears less than half of that.
    #[test]
    fn a_mesh_that_turns_bears_what_a_wall_does_at_slow_updates() {
        let slow = updated(Contact::MeshInHollow, 140.0);
        let [ours, without] = [Method::Ours, Method::Discrete].map(|method| slow.critical(method));
        let spring = slow.by_eigenvalues();
        assert!(ours > 0.9 * spring, "{ours} of {spring}");
        assert!(2.0 * without < ours, "{ours} {without}");
    }

    /// A mass and a damper between hand and wall bear more than the device does, but not what turns at slow updates.
    #[test]
    fn slow_updates_cost_virtual_coupling_its_stability() {
        let [slow, fast] =
            [70.0, 1000.0].map(|hz| updated(Contact::Hollow, hz).critical(Method::VirtualCoupling));
        assert!(slow < fast, "{slow} {fast}");
    }
}
