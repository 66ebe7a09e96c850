//! Right answers for recipes without a formula, by a way that shares no line with the method.
//!
//! The quasi-static place of rest of a frictionless rigid body on the scene's spring is followed at 20 kHz: feature pairs by brute force
//! over what is near, each row only as far as a step of 10 um, the quadratic programme by non-negative least squares, 0.1 um from the
//! surface. Nothing of the method's collision detection, constraints, projection or coupling is used; shared are the scene (mesh, mass,
//! limits, the law of the spring) and poses.
//!
//! - `solid`: a shape's vertices, edges and faces; `nearest`: the nearest points of two; `near`: which are near.
//! - `least_norm`: the quadratic programme; `rest`: the place of rest.
//! - `error`: how far an answer is from its own limit; `table`: answers as files, since they take minutes; `command`: makes these.

mod command;
mod error;
mod least_norm;
mod near;
mod nearest;
mod rest;
mod solid;
mod table;

pub use command::run as command;
pub(crate) use error::apart;
pub use rest::{Account, Fineness, Rest};
pub use table::{POSE_EVERY, Table, of};

use god_object::{Pose, Vector6};

use crate::clock::TICK;
use crate::recipe::Recipe;

/// The answer at every millisecond of a run.
#[derive(Clone, Debug, Default)]
pub struct Followed {
    /// On the hand, N and N m.
    pub wrenches: Vec<Vector6>,
    /// World from body.
    pub poses: Vec<Pose>,
    /// What is known of it.
    pub account: Account,
}

/// Follows a recipe from its start.
pub fn follow(recipe: &Recipe, fineness: Fineness) -> Followed {
    let start = &recipe.scene.start;
    follow_from(recipe, fineness, 0, start, recipe.ticks())
}

/// Follows a recipe over `ticks` milliseconds from that of number `first`, at which the body is at `start`.
pub fn follow_from(
    recipe: &Recipe,
    fineness: Fineness,
    first: u32,
    start: &Pose,
    ticks: u32,
) -> Followed {
    assert!(
        recipe.moving.is_none(),
        "{recipe:?}: no obstacle moves here"
    );
    let mut rest = Rest::new(&recipe.scene, start, fineness);
    let mut followed = Followed::default();
    for tick in first..first + ticks {
        let samples = if tick == first { 1 } else { fineness.samples };
        for sample in 1..=samples {
            let before = 1.0 - f64::from(sample) / f64::from(samples);
            rest.follow(&(recipe.device)((f64::from(tick) - before) * TICK));
        }
        followed.wrenches.push(rest.wrench());
        followed.poses.push(rest.pose());
    }
    followed.account = rest.account;
    followed
}
