//! What each surface property costs in the coupling loop: time of one step, as a ratio to a plain surface, in one run.
//!
//! `cargo run --release -p god-object --example surface_cost`
#![allow(
    clippy::disallowed_types,
    clippy::disallowed_methods,
    reason = "an example may read the clock"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/box_shape.rs"]
mod box_shape;

use std::sync::Arc;
use std::time::Instant;

use box_shape::box_mesh;
use god_object::nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};
use god_object::{
    Body, Coupling, ForceShading, GodObject, HeightMap, HeightMapTexture, Obstacle, Pose, Settings,
    SineTexture, Surface, Texture, World,
};

/// Device samples in one pass, and passes of which the fastest counts.
const SAMPLES: u32 = 4000;
const PASSES: u32 = 15;

/// Fastest pass over a slide of a box on a table, ns for one coupling step.
fn cost(surface: Surface, passive: bool) -> Result<f64, Box<dyn std::error::Error>> {
    let half = Vector3::new(0.02, 0.02, 0.01);
    let world = Arc::new(World {
        body: Body {
            primitive: None,
            mesh: box_mesh(half),
            mass: 1.0,
            inertia: Matrix3::from_diagonal(&Vector3::new(1.7e-4, 1.7e-4, 2.7e-4)),
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "table".into(),
            mesh: box_mesh(Vector3::new(0.5, 0.5, 0.05)),
            pose: Pose::translation(0.0, 0.0, -0.05),
            surface,
        }],
    });
    let settings = Settings {
        passive,
        ..Settings::for_size(0.04)
    };
    let at = |x: f64, z: f64| {
        Pose::from_parts(
            Vector3::new(x, 0.3 * x, z).into(),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.0 * x),
        )
    };
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, at(0.0, 0.011))?;
    let mut best = f64::INFINITY;
    let mut time = 0.0;
    for _ in 0..PASSES {
        let mut spent = 0;
        for i in 0..SAMPLES {
            time += 1e-3;
            let x = 0.05 * (f64::from(i) * std::f64::consts::TAU / f64::from(SAMPLES)).sin();
            let device = at(x, 0.007);
            if i % 3 == 0 {
                god_object.step(&device, None);
            }
            let before = Instant::now();
            std::hint::black_box(coupling.step(time, &device, god_object.constraint_set()));
            spent += before.elapsed().as_nanos();
        }
        best = best.min(spent as f64 / f64::from(SAMPLES));
    }
    Ok(best)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let heights: Vec<f64> = (0..512 * 512)
        .map(|i| 0.5 + 0.5 * (f64::from(i % 512) * 0.2).sin())
        .collect();
    let map = Texture::HeightMap(HeightMapTexture {
        map: Arc::new(HeightMap::new(512, &heights)?),
        tile: 0.05,
        amplitude: 2e-4,
    });
    let sine = Texture::Sine(SineTexture {
        axis: Vector3::x(),
        wavelength: 2e-3,
        amplitude: 0.2,
    });
    let plain = Surface::default();
    let with = |texture| Surface {
        texture: Some(texture),
        ..Surface::default()
    };
    let shaded = Surface {
        shading: Some(ForceShading { crease_angle: 0.6 }),
        ..Surface::default()
    };
    let rough = Surface {
        friction: 0.3,
        ..Surface::default()
    };
    let none = cost(plain.clone(), false)?;
    println!("plain: {none:.0} ns a step");
    for (name, surface, passive) in [
        ("shading", shaded, false),
        ("sine", with(sine), false),
        ("height map", with(map), false),
        ("friction", rough, false),
        ("passivity", plain, true),
    ] {
        println!("{name}: {:.2} times", cost(surface, passive)? / none);
    }
    Ok(())
}
