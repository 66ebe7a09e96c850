//! R12: a small ball goes round a cylinder, pressed in by 3 mm. Planes that are some updates old point beside the radius.

use god_object::{Pose, Primitive, World};
use nalgebra::{Point3, Vector3};
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::{Axis, cylinder};

use super::Extent;
use super::bodies::{ball, force, ghost_time, smooth, sound};
use crate::clock::TICK;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Line, Recipe};

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
    let mut round = obstacle(
        "cylinder",
        mesh(cylinder(
            solid,
            HALF_LENGTH,
            sides.unwrap_or(FACETS),
            Axis::Y,
        )),
        Pose::identity(),
    );
    round.primitive = sides.is_none().then(|| Primitive::Cylinder {
        ends: [-HALF_LENGTH, HALF_LENGTH].map(|y| Point3::new(0.0, y, 0.0)),
        radius: solid,
    });
    let facet = sides.map_or(0.0, |sides| 180.0 / sides as f64);
    // The middle of a side is nearer to the axis than a corner.
    let sunk = solid * (1.0 - facet.to_radians().cos());
    let world = World {
        body: ball(TIP),
        obstacles: vec![round],
    };
    let arrived = (APPROACH + DEPTH) / APPROACH_SPEED;
    let begin = arrived + WAIT;
    // Depth, and angle from the z axis towards the x axis.
    let place = move |time: f64| {
        let depth = (time * APPROACH_SPEED).min(APPROACH + DEPTH) - APPROACH;
        let angle = (time - begin).max(0.0) * speed / radius;
        (depth, Vector3::new(angle.sin(), 0.0, angle.cos()))
    };
    let device = move |time: f64| {
        let (depth, out) = place(time);
        let at = out * (radius - depth);
        Pose::translation(at.x, at.y, at.z)
    };
    let scene = Scene::new(world, 2.0 * TIP, speed.max(APPROACH_SPEED), device(0.0));
    let (stiffness, k_s) = (scene.stiffness(), scene.settings.k_s);
    let prism = sides.map_or_else(String::new, |n| format!(", {n} sides"));
    let duration = begin + std::f64::consts::PI * radius / speed;
    Recipe {
        ideal: Ideal::closed(move |time| {
            let (depth, out) = place(time);
            let pushed = out * (stiffness * depth.max(0.0));
            force(pushed.x, pushed.y, pushed.z)
        }),
        depth: Box::new(move |body| {
            let place = body.translation;
            (radius - sunk - place.x.hypot(place.z)).max(0.0)
        }),
        astray: Box::new(|_, _| 0.0),
        phases: 1,
        lines: Box::new(move |rate| {
            // As far as the ball goes round while a set is made and used.
            let stale = speed / radius * (ghost_time(k_s, rate) + TICK);
            let mut lines = sound();
            if sides.is_none() {
                lines.push(smooth(stiffness, speed));
                lines.push(Line::at_most(Measure::DirectionMax, stale.to_degrees()));
            } else {
                // At a corner of the prism the ideal itself turns by a facet.
                let late = stale.to_degrees() + facet;
                lines.push(Line::at_most(Measure::DirectionMean, late));
            }
            lines
        }),
        ..Recipe::new(
            (
                "R12",
                format!("radius {} mm, {speed} m/s{prism}", radius * 1e3),
            ),
            "sliding on a cylinder: stale normals",
            scene,
            duration,
            device,
        )
    }
}
