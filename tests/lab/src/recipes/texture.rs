//! R29: a ball is moved over a sine of 1 mm at 0.2 m/s: a tone of 200 Hz. Contacts that come more slowly must not make another tone of it.

use std::f64::consts::TAU;

use god_object::spatial::linear;
use god_object::{SineTexture, Texture};
use nalgebra::Vector3;

use super::Extent;
use super::bodies::{Path, along, ball, ground, ours_alone, sound};
use crate::clock::{TICK, Tick};
use crate::method::{Method, Scene};
use crate::recipe::{Probe, Recipe};

const RADIUS: f64 = 5e-3;
const DEPTH: f64 = 3e-3;
const SPEED: f64 = 0.2;
const WAVELENGTH: f64 = 1e-3;
/// Hz.
const TONE: f64 = SPEED / WAVELENGTH;
/// The tone must be so much stronger than any other, dB.
const CLEAN: f64 = 20.0;
/// Other tones nearer than this to it are its own spread, Hz.
const SPREAD: f64 = 20.0;
/// Below this the force's slow change is no tone, Hz.
const SLOW: f64 = 20.0;

pub(super) fn recipes(_extent: Extent) -> Vec<Recipe> {
    let mut table = ground();
    table.surface.texture = Some(Texture::Sine(SineTexture {
        axis: Vector3::x(),
        wavelength: WAVELENGTH,
        amplitude: 0.2,
    }));
    let at = |x: f64, z: f64| Vector3::new(x, 0.0, RADIUS + z);
    let path = Path::from(at(-0.05, 1e-3))
        .to(at(-0.05, -DEPTH), 0.05)
        .hold(0.05)
        .to(at(0.05, -DEPTH), SPEED);
    let (from, to) = (path.duration() - 0.4, path.duration());
    let scene = Scene::new(ball(RADIUS), [table], 2.0 * RADIUS, SPEED, path.pose(0.0));
    let case = ("R29", "sine of 1 mm at 0.2 m/s".to_owned());
    let about = "texture: one tone and no alias";
    vec![Recipe {
        lines: Box::new(|_| sound()),
        probes: vec![Probe::at_most(
            "strongest_alias",
            "dB",
            -CLEAN,
            move |ticks: &[Tick]| alias(ticks, from, to),
        )],
        out_of_scope: |method| match method {
            Method::Paper | Method::PaperAdapted => None,
            _ => ours_alone(method, "it has no textures"),
        },
        ..along(case, about, scene, path)
    }]
}

/// The strongest other tone of the force along x over the right one, dB; of nothing at all, nothing.
fn alias(ticks: &[Tick], from: f64, to: f64) -> f64 {
    let felt: Vec<f64> = ticks
        .iter()
        .filter(|tick| (from..to).contains(&tick.time))
        .map(|tick| linear(&tick.wrench).x)
        .collect();
    let count = felt.len() as f64;
    let mean = felt.iter().sum::<f64>() / count;
    let strength = |frequency: f64| {
        let (mut real, mut imaginary) = (0.0, 0.0);
        for (k, force) in felt.iter().enumerate() {
            // Hann's window keeps a tone from spreading.
            let window = 0.5 - 0.5 * (TAU * k as f64 / count).cos();
            let (sine, cosine) = (TAU * frequency * TICK * k as f64).sin_cos();
            real += window * (force - mean) * cosine;
            imaginary += window * (force - mean) * sine;
        }
        real.hypot(imaginary)
    };
    let others = (0..200).map(|k| 2.5 * f64::from(k));
    let strongest = others
        .filter(|f| *f > SLOW && (f - TONE).abs() > SPREAD)
        .map(strength)
        .fold(0.0, f64::max);
    20.0 * (strongest / strength(TONE)).log10()
}
