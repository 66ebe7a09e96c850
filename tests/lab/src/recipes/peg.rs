//! R18 and R19: a peg of 72 sides in a hole of 72: pushed about in it, pulled out of it askew, and brought into it.
//!
//! The peg's corners face the middles of the hole's sides. The places that an upright peg can be at are those within a polygon of 72 sides whose
//! apothem is the clearance, so the ideal force is the way from the device to that polygon, exactly.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use god_object::Pose;
use god_object::spatial::{angular, linear};
use nalgebra::{Vector2, Vector3};
use taut_method_tests::solids::{body, mesh, obstacle};
use taut_scene::shapes::{Axis, box_with_hole, cylinder};

use super::Extent;
use super::bodies::{Path, along, force, ghost_time, largest_from, smooth, sound_and, turns};
use crate::clock::{RATES, TICK};
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, OURS, Probe, Recipe, open_for};

const SIDES: usize = 72;
const RADIUS: f64 = 0.01;
/// Of peg and box along the hole, m.
const HALF: f64 = 0.03;
/// Clearances, m.
const CLEARANCES: [f64; 3] = [0.5e-3, 0.1e-3, 0.05e-3];
/// How far the peg is out of the hole, m.
const OUT: f64 = 0.01;
const OFFSET: f64 = 3e-3;
const SPEED: f64 = 0.05;
/// How far the peg that is brought in stays beside the plane that mirrors both parts, m. On it rounding
/// decides to which side the peg tips at the rim, and there is no one right answer; at 0.1 mm half the
/// clearance of the oracle still decides, at 0.3 mm no more.
const BESIDE: f64 = 3e-4;
/// Time for a quarter turn of the offset, s.
const TURNING: f64 = 0.5;
/// Most that may act along the hole, N, and about it, N m.
const AXIAL_FORCE: f64 = 1e-6;
const AXIAL_TORQUE: f64 = 1e-8;
/// Half a side, degrees.
const FACET: f64 = 2.5;
/// %, of the force in the hole.
const MAGNITUDE: f64 = 1.0;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let clearances = extent.choose(&CLEARANCES[..], &CLEARANCES[..2]);
    let mut recipes: Vec<Recipe> = clearances.iter().map(|c| pushed(extent, *c)).collect();
    recipes.push(tilted(extent));
    if extent == Extent::Full {
        recipes.push(inserted());
    }
    recipes
}

fn scene(clearance: f64, start: Pose) -> Scene {
    let peg = body(mesh(cylinder(RADIUS, HALF, SIDES, Axis::Y)));
    let hole = box_with_hole([HALF; 3], RADIUS + clearance, SIDES, Axis::Y);
    let hole = obstacle("box", mesh(hole), Pose::identity());
    Scene::new(peg, [hole], 2.0 * HALF, SPEED, start)
}

/// The place nearest to `place` in a regular polygon about the origin, one side towards the first axis.
fn into_polygon(place: Vector2<f64>, apothem: f64) -> Vector2<f64> {
    let side = TAU / SIDES as f64;
    let angle = place.y.atan2(place.x);
    let middle = (angle / side).round() * side;
    let (out, along) = (
        Vector2::new(middle.cos(), middle.sin()),
        Vector2::new(-middle.sin(), middle.cos()),
    );
    if out.dot(&place) <= apothem {
        return place;
    }
    let half = apothem * (PI / SIDES as f64).tan();
    out * apothem + along * along.dot(&place).clamp(-half, half)
}

/// R18: pushed to the side, round by a quarter turn, and along.
fn pushed(extent: Extent, clearance: f64) -> Recipe {
    let reached = OFFSET / SPEED;
    let turned = reached + extent.choose(TURNING, 0.5 * TURNING);
    let end = turned + extent.choose(0.2, 0.1);
    let place = move |time: f64| {
        let out = (time * SPEED).min(OFFSET);
        let angle =
            FRAC_PI_2 * ((time - reached) / TURNING).clamp(0.0, (turned - reached) / TURNING);
        let along = OUT + SPEED * (time - turned).max(0.0);
        (Vector2::new(out * angle.cos(), out * angle.sin()), along)
    };
    let device = move |time: f64| {
        let (across, along) = place(time);
        Pose::translation(across.x, along, across.y)
    };
    let scene = scene(clearance, device(0.0));
    let (stiffness, k_s) = (scene.stiffness(), scene.settings.k_s);
    let case = (
        "R18",
        format!("in the hole, clearance {} mm", clearance * 1e3),
    );
    let about = "peg in hole: straight guidance, nothing along the hole";
    Recipe {
        ideal: Ideal::closed(move |time| {
            let (across, _) = place(time);
            let push = (into_polygon(across, clearance) - across) * stiffness;
            force(push.x, 0.0, push.y)
        }),
        phases: extent.choose(5, 1),
        lines: sound_and(move |rate| {
            let stale = FRAC_PI_2 / TURNING * (ghost_time(k_s, rate) + TICK);
            let direction = FACET + stale.to_degrees();
            [
                smooth(stiffness, SPEED.max(OFFSET * FRAC_PI_2 / TURNING)),
                Measure::DirectionMax.at_most(direction),
                Measure::MagnitudeP95.at_most(MAGNITUDE),
            ]
        }),
        probes: vec![
            Probe::at_most(
                "force_along_hole",
                "N",
                AXIAL_FORCE,
                largest_from(0.0, |tick| linear(&tick.wrench).y.abs()),
            ),
            Probe::at_most(
                "torque_about_hole",
                "N m",
                AXIAL_TORQUE,
                largest_from(0.0, |tick| angular(&tick.wrench).y.abs()),
            ),
        ],
        ..Recipe::new(case, about, scene, end, device)
    }
}

/// R19: inserted by 20 mm, tilted by half as much again as two contacts allow, pulled out.
fn tilted(extent: Extent) -> Recipe {
    const INSERTED: f64 = 0.02;
    const CLEARANCE: f64 = 0.1e-3;
    let tilt = 1.5 * (2.0 * CLEARANCE / INSERTED);
    let tilted = 0.1;
    let pull = extent.choose(0.03, 0.01);
    let begin = tilted + 0.1;
    // The peg's lower end is INSERTED below the upper face.
    let start = 2.0 * HALF - INSERTED;
    let along = move |time: f64| start + (SPEED * (time - begin)).clamp(0.0, pull);
    let device = move |time: f64| {
        let turned = tilt * (time / tilted).min(1.0);
        Pose::new(Vector3::new(0.0, along(time), 0.0), Vector3::z() * turned)
    };
    let scene = scene(CLEARANCE, device(0.0));
    let k_s = scene.settings.k_s;
    let case = ("R19", "pulled out askew".to_owned());
    let about = "tilt jam: without friction it slides out";
    let duration = begin + pull / SPEED + 0.1;
    Recipe {
        ideal: Ideal::Oracle,
        phases: extent.choose(5, 1),
        lines: sound_and(|_| [Measure::ForceP95.at_most(0.05)]),
        probes: vec![Probe {
            key: "lag_along_hole",
            unit: "m",
            value: Box::new(largest_from(begin, move |tick| {
                (tick.device.translation.y - tick.body.translation.y).abs()
            })),
            // What the hand goes while an update is made and used, and the peg's turn about its middle.
            limit: Box::new(move |rate| {
                SPEED * (ghost_time(k_s, rate) + 2.0 / f64::from(rate) + TICK) + 1e-4
            }),
        }],
        out_of_scope: turns,
        ..Recipe::new(case, about, scene, duration, device)
    }
}

/// Why the peg that is brought in misses what is felt.
const AT_THE_RIM: &str = "between two places where the rim holds the peg it falls, and a sub-step of the fall goes past the next one: the peg is in the hole about 100 ms early, at any rest distance";

/// R18: the tip on the upper face, slid over the hole, and in, a millimetre off the middle.
fn inserted() -> Recipe {
    let top = 2.0 * HALF;
    let at = |x: f64, y: f64| Vector3::new(x, y, BESIDE);
    let path = Path::from(at(0.02, top + 2e-3))
        .to(at(0.02, top - 1e-3), SPEED)
        .to(at(1e-3, top - 1e-3), SPEED)
        .hold(0.2)
        .to(at(1e-3, top - 0.05), SPEED)
        .hold(0.2)
        .to(at(-1e-3, top - 0.05), SPEED)
        .hold(0.1);
    let scene = scene(CLEARANCES[0], path.pose(0.0));
    let case = ("R18", "onto the face and in".to_owned());
    let about = "peg in hole: slid over the face, inserted, pushed to the other side";
    let missed = [Measure::JndP95, Measure::JndShare, Measure::ForceP95];
    Recipe {
        ideal: Ideal::Oracle,
        lines: sound_and(|_| [Measure::ForceP95.at_most(0.1)]),
        check_every: 5,
        out_of_scope: turns,
        open: open_for(OURS, &RATES, &missed, AT_THE_RIM),
        ..along(case, about, scene, path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_polygon_is_as_far_as_its_apothem_and_its_corners_are_farther() {
        let far = Vector2::new(3e-3, 0.0);
        assert!((into_polygon(far, 1e-4) - Vector2::new(1e-4, 0.0)).norm() < 1e-18);
        let half = PI / SIDES as f64;
        let corner = Vector2::new(half.cos(), half.sin()) * 3e-3;
        let expected = corner / 3e-3 * (1e-4 / half.cos());
        assert!((into_polygon(corner, 1e-4) - expected).norm() < 1e-15);
        let within = Vector2::new(2e-5, -3e-5);
        assert_eq!(into_polygon(within, 1e-4), within);
    }
}
