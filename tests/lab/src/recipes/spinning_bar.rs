//! R10b: a thin bar spins past a pin, a third of a radian between updates at 70 Hz. It stops at first contact.

use god_object::{Pose, Primitive};
use nalgebra::{Point3, Vector2, Vector3};
use taut_method_tests::solids::{body, mesh, obstacle};
use taut_scene::shapes::{Axis, cuboid, cylinder};

use super::Extent;
use super::bodies::{sound_and, turns};
use crate::clock::RATES;
use crate::measure::Measure;
use crate::method::{Method, Scene};
use crate::recipe::{Ideal, Recipe, open_for};

/// Of the bar, m.
const HALF: [f64; 3] = [0.1, 1e-3, 1e-3];
const PIN: f64 = 1e-3;
/// Where the pin stands, m from the axis and rad from the bar.
const PLACE: f64 = 0.09;
const ANGLE: f64 = 1.0;
/// rad/s.
const SPIN: f64 = 25.0;
/// How far the device turns on behind the pin, rad.
const BEYOND: f64 = 0.2;
/// Farthest from first contact that the bar may come to rest, before the pin or behind it, m along the way of the pin's place.
const ASTRAY: f64 = 1e-5;
/// How long before the end the bar is at rest, s.
const AT_REST: f64 = 0.1;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let at = Point3::new(PLACE * ANGLE.cos(), PLACE * ANGLE.sin(), 0.0);
    let mut pin = obstacle(
        "pin",
        mesh(cylinder(PIN, 0.02, 32, Axis::Z)),
        Pose::translation(at.x, at.y, 0.0),
    );
    pin.primitive = Some(Primitive::Cylinder {
        ends: [-0.02, 0.02].map(|z| Point3::new(0.0, 0.0, z)),
        radius: PIN,
    });
    let device = |time: f64| {
        let turned = (SPIN * time).min(ANGLE + BEYOND);
        Pose::new(Vector3::zeros(), Vector3::z() * turned)
    };
    let bar = body(mesh(cuboid(HALF)));
    let scene = Scene::new(bar, [pin], 2.0 * HALF[0], SPIN * HALF[0], device(0.0));
    // The pin in the bar's frame.
    let seen = move |bar: &Pose| {
        let pin = bar.inverse_transform_point(&at);
        Vector2::new(pin.x, pin.y)
    };
    let case = ("R10b", "bar past a pin".to_owned());
    let about = "fast spin: stops at first contact";
    let duration = (ANGLE + BEYOND) / SPIN + extent.choose(0.5, 0.25);
    vec![Recipe {
        ideal: Ideal::Oracle,
        depth: Box::new(move |bar| {
            let pin = seen(bar);
            let nearest = Vector2::new(
                pin.x.clamp(-HALF[0], HALF[0]),
                pin.y.clamp(-HALF[1], HALF[1]),
            );
            (PIN - (pin - nearest).norm()).max(0.0)
        }),
        astray: Box::new(move |time, bar| {
            // It belongs before the bar's leading face, and in the end at it.
            let pin = seen(bar);
            let over_it = pin.x.abs() < HALF[0];
            let beyond = HALF[1] + PIN - pin.y;
            if time > duration - AT_REST {
                beyond.abs()
            } else if over_it {
                beyond.max(0.0)
            } else {
                0.0
            }
        }),
        phases: extent.choose(20, 4),
        lines: sound_and(|_| [Measure::Astray.at_most(ASTRAY)]),
        open: open_for(
            &[Method::OursByDefault],
            &RATES,
            &[Measure::Astray],
            "by default it comes to rest at a distance that grows with the body: 20 um for one of 0.2 m",
        ),
        out_of_scope: turns,
        ..Recipe::new(case, about, scene, duration, device)
    }]
}
