//! What of a force reaches the hand: the last stages of the device port, clamp and slew limit, are between a method and the device.
//!
//! They are those of the bridge itself. A hand in a recipe goes where its script says, whatever it feels, so they may act after a run. No force of this
//! device jumps, whoever computes it: methods are judged by the right answer that comes through the same port.

use std::time::Duration;

use taut_bridge::{ContactBound, Motion, SafetySettings, SlewLimit, within_limits};

use god_object::spatial::six;
use god_object::{Pose, Vector6};

use crate::clock::{TICK, Tick};
use crate::felt::Felt;
use crate::method::Scene;
use crate::recipe::Recipe;

/// The torque that the limits of a scene which is not scaled allow for each newton, m.
const ARM: f64 = 0.5 / 20.0;

/// Replaces the wrench of each tick by what the port of this scene's device gives to the hand.
pub(crate) fn limit(scene: &Scene, ticks: &mut [Tick]) {
    let settings = settings(scene);
    let gyration = settings.contact.radius_of_gyration;
    let (mut slew, mut motion) = (SlewLimit::new(&settings), Motion::default());
    let mut before = None;
    for tick in ticks {
        let now = Duration::from_secs_f64(tick.time);
        let travel = before.map_or_else(Vector6::zeros, |before| travel(&before, &tick.device));
        motion.fade(settings.period);
        motion.follow(now, &travel, settings.period, gyration);
        before = Some(tick.device);
        let clamped = within_limits(&tick.wrench, settings.max_force, settings.max_torque);
        tick.wrench = slew.step(now, &clamped, motion.speed()).wrench;
    }
}

/// The right answer of a recipe as it reaches the hand, at every tick; empty where there is none.
pub(crate) fn right_answer(recipe: &Recipe) -> Vec<Vector6> {
    let mut ticks = perfect(recipe);
    limit(&recipe.scene, &mut ticks);
    ticks.iter().map(|tick| tick.wrench).collect()
}

/// A run whose force is right at every tick.
fn perfect(recipe: &Recipe) -> Vec<Tick> {
    let right = recipe.answer().wrenches.iter().enumerate();
    right
        .map(|(index, wrench)| {
            let time = index as f64 * TICK;
            let device = (recipe.device)(time);
            Tick {
                time,
                device,
                body: device,
                wrench: *wrench,
            }
        })
        .collect()
}

/// What the port itself takes from a force that is right: 95th percentile of J, and the share of the time above 1; NaN where there is no right answer.
pub(crate) fn own_error(recipe: &Recipe) -> [f64; 2] {
    let mut ticks = perfect(recipe);
    limit(&recipe.scene, &mut ticks);
    let felt = Felt::new(&ticks, &recipe.answer().wrenches, recipe.scene.arm());
    [felt.p95(), felt.share_above_one()]
}

fn travel(from: &Pose, to: &Pose) -> Vector6 {
    let way = to.translation.vector - from.translation.vector;
    six(&way, &(to.rotation * from.rotation.inverse()).scaled_axis())
}

/// The port's own, with the limits and the stiffness of the scene. A scaled scene has other torques, and rates in proportion.
fn settings(scene: &Scene) -> SafetySettings {
    let (given, body) = (&scene.settings, &scene.world.body);
    let inertia = body.inertia.symmetric_eigenvalues().max();
    let scale = given.torque_limit / given.force_limit / ARM;
    SafetySettings {
        max_force: given.force_limit,
        max_torque: given.torque_limit,
        torque_rate: SafetySettings::TORQUE_RATE * scale,
        contact: ContactBound {
            stiffness: scene.stiffness(),
            radius_of_gyration: (inertia / body.mass).sqrt(),
        },
        period: Duration::from_secs_f64(TICK),
        ..SafetySettings::default()
    }
}

#[cfg(test)]
mod tests {
    use god_object::spatial::linear;

    use super::*;
    use crate::recipes::{Extent, all, named};

    #[test]
    fn a_wall_that_is_met_at_a_metre_a_second_is_felt_as_it_is() {
        for case in ["0.05 m/s", "0.3 m/s", "1 m/s"] {
            let recipe = named(all(Extent::Quick), "R11", case);
            let right = &recipe.answer().wrenches;
            let felt = right_answer(&recipe);
            let off = right.iter().zip(&felt).map(|(a, b)| (a - b).norm());
            let most = off.fold(0.0, f64::max);
            assert!(most < 1e-9, "{case}: {most} N");
        }
    }

    #[test]
    fn a_force_that_ends_at_once_is_let_down_by_the_slew_limit() {
        let recipe = named(all(Extent::Quick), "R13", "end of a plate");
        let change = |forces: &[Vector6]| {
            let changes = forces
                .windows(2)
                .map(|p| (linear(&p[1]) - linear(&p[0])).norm());
            changes.fold(0.0, f64::max)
        };
        let jump = change(&recipe.answer().wrenches);
        assert!(jump > 4.0, "the right answer jumps by {jump} N");
        // Half a newton, and half as much again as the spring changes on the device's way in a millisecond.
        let most = 0.5 + 1.5e-3 * recipe.scene.stiffness() * recipe.scene.speed;
        let felt = change(&right_answer(&recipe));
        assert!(
            felt > 0.4 && felt <= most * 1.01,
            "{felt} N in a millisecond, of {most}"
        );
    }
}
