//! R12: a small ball goes round a cylinder, pressed in by 3 mm. Planes that are some updates old point beside the radius.
//!
//! The right answer for a prism is that of the prism, not of the cylinder it stands for: what facets add is no error of a method. The line is
//! what is felt, half of 18.4 degrees.

use god_object::{Pose, Primitive};
use nalgebra::Point3;

use super::Extent;
use super::bodies::{ball, force, smooth, sound_and};
use super::prism::{Prism, out};
use crate::measure::{JND_DIRECTION, Measure};
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

/// Of the ball, m: the point that it stands for goes round at the cylinder's radius and this.
const TIP: f64 = 1e-3;
const DEPTH: f64 = 3e-3;
/// Half the length of the cylinder, m.
const HALF_LENGTH: f64 = 0.05;
const FACETS: usize = 256;
/// Way in from above the surface, m, long enough for the slowest updates to follow, and its speed, m/s.
const APPROACH: f64 = 5e-3;
const APPROACH_SPEED: f64 = 0.05;
/// How long the device waits before it goes round, s.
const WAIT: f64 = 0.2;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let mut recipes: Vec<Recipe> = [(0.02, 0.05), (0.02, 0.2), (0.05, 0.05), (0.05, 0.2)]
        .map(|(radius, speed)| recipe(radius, speed, None))
        .into();
    let facets = extent.choose(&[16, 64, 256][..], &[64][..]);
    recipes.extend(facets.iter().map(|n| recipe(0.02, 0.2, Some(*n))));
    recipes
}

/// `radius`: of the way of the ball's centre on the cylinder, m; `sides`: of the prism that stands for it, `None` for the true one.
fn recipe(radius: f64, speed: f64, sides: Option<usize>) -> Recipe {
    let solid = radius - TIP;
    let prism = Prism {
        sides: sides.unwrap_or(FACETS),
        radius: solid,
        tip: TIP,
    };
    let mut round = prism.obstacle(HALF_LENGTH);
    round.primitive = sides.is_none().then(|| Primitive::Cylinder {
        ends: [-HALF_LENGTH, HALF_LENGTH].map(|y| Point3::new(0.0, y, 0.0)),
        radius: solid,
    });
    // The middle of a side is nearer to the axis than a corner.
    let sunk = sides.map_or(0.0, |_| solid - prism.apothem());
    let arrived = (APPROACH + DEPTH) / APPROACH_SPEED;
    let begin = arrived + WAIT;
    // Depth, and angle from the z axis towards the x axis.
    let place = move |time: f64| {
        let depth = (time * APPROACH_SPEED).min(APPROACH + DEPTH) - APPROACH;
        let angle = (time - begin).max(0.0) * speed / radius;
        (depth, angle)
    };
    let device = move |time: f64| {
        let (depth, angle) = place(time);
        Pose::from(out(angle) * (radius - depth))
    };
    let scene = Scene::new(
        ball(TIP),
        [round],
        2.0 * TIP,
        speed.max(APPROACH_SPEED),
        device(0.0),
    );
    let stiffness = scene.stiffness();
    let name = sides.map_or_else(String::new, |n| format!(", {n} sides"));
    let duration = begin + std::f64::consts::PI * radius / speed;
    Recipe {
        ideal: Ideal::closed(move |time| {
            let (depth, angle) = place(time);
            let (deep, normal) = match sides {
                None => (depth.max(0.0), angle),
                Some(_) => prism.depth(angle, angle, radius - depth),
            };
            let pushed = out(normal) * (stiffness * deep);
            force(pushed.x, pushed.y, pushed.z)
        }),
        depth: Box::new(move |body| {
            let place = body.translation;
            (radius - sunk - place.x.hypot(place.z)).max(0.0)
        }),
        lines: sound_and(move |_| {
            let smooth = sides.is_none().then(|| smooth(stiffness, speed));
            let direction = Measure::DirectionP95.at_most(0.5 * JND_DIRECTION);
            smooth.into_iter().chain([direction])
        }),
        ..Recipe::new(
            (
                "R12",
                format!("radius {} mm, {speed} m/s{name}", radius * 1e3),
            ),
            "sliding on a cylinder: stale normals",
            scene,
            duration,
            device,
        )
    }
}
