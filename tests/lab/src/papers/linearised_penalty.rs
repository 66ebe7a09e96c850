//! Otaduy and Lin 2006: the simulation of the tool is passive and bears small masses, and it moves at the rate of the forces, however seldom contacts
//! are looked for.

use god_object::spatial::linear;

use super::{Figure, HALF, at, damping, driven, figure};
use crate::clock::TICK;
use crate::method::{Method, Scene};
use crate::recipes::{cube, ground};
use crate::tuning::{LinearContacts, Tuning};

/// Ticks of a swing.
const SWINGS: [u32; 6] = [2, 4, 8, 16, 32, 64];
/// A tool of a millionth of the body's mass: 1 mg.
const LIGHT: f64 = 1e-6;
/// Of a contact over that of the coupling.
const RATIO: f64 = 1e3;
/// Ticks between updates while the device slides: far fewer updates than forces.
const SELDOM: u32 = 33;
/// m/s, and m.
const SPEED: f64 = 0.1;
const DEEP: f64 = 2e-3;
const TICKS: u32 = 600;

pub(super) fn figures() -> Vec<Figure> {
    let tool = |share, damping_ratio, contacts| Tuning::Tool {
        share,
        damping_ratio,
        stiffness: RATIO,
        contacts,
    };
    let most = |depth| damping::most_over_bound(Method::LinearisedPenalty, depth, &SWINGS);
    let light = tool(LIGHT, 1.0, LinearContacts::Whole);
    let (along, across) = slid(light);
    let source = (Method::LinearisedPenalty, "Otaduy and Lin 2006");
    let passive = |of, here| {
        let within = [f64::NEG_INFINITY, 1.0 + 1e-6];
        figure(source, of, "passive: at most 1", here, within, "")
    };
    vec![
        passive(
            "damping of a device that its wall is passive on, over K T / 2 + B, every tuning, swings of 2 to 64 ms",
            most(HALF),
        ),
        passive("the same where nothing is touched", most(-0.02)),
        figure(
            source,
            "error of the force across a plane, a tool of 1 mg that slides on it, contacts every 33 ms",
            "a small mass is stable: at most the offset of the contacts",
            across,
            [0.0, offset() / DEEP],
            "",
        ),
        figure(
            source,
            "force along it over that across it: the tool moves between updates",
            "0 but for the damper's lag",
            along,
            [0.0, 1e-2],
            "",
        ),
    ]
}

/// Gap at which a contact begins to push, m.
fn offset() -> f64 {
    let scene = damping::wall();
    scene.settings.force_limit / (RATIO * scene.stiffness())
}

/// A cube slides on a plane: the largest force along it over that across it, and the largest error of that
/// across it, from half of the way on.
fn slid(tuning: Tuning) -> (f64, f64) {
    let scene = Scene::new(cube(HALF), [ground()], 2.0 * HALF, SPEED, at(HALF + 1e-4));
    let period = f64::from(SELDOM) * TICK;
    let mut method = Method::LinearisedPenalty.start(&scene, period, tuning);
    let run = driven(method.as_mut(), (TICKS, SELDOM), |tick| {
        let down = (2.0 * f64::from(tick) / f64::from(TICKS)).min(1.0);
        let mut device = at(HALF + 1e-4 - down * (DEEP + 1e-4));
        device.translation.x = SPEED * (f64::from(tick) * TICK);
        device
    });
    let (mut along, mut error) = (0.0_f64, 0.0_f64);
    for (_, wrench) in &run[(TICKS / 2 + SELDOM) as usize..] {
        let force = linear(wrench);
        along = along.max(force.xy().norm() / force.z);
        error = error.max((force.z / (DEEP * scene.stiffness()) - 1.0).abs());
    }
    (along, error)
}
