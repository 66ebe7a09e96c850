//! R34: recipes a thousand times smaller and larger.
//!
//! Lengths and speeds grow by the factor and masses shrink by it, so that stiffness times length, and with it every force, stays. Torques grow
//! by the factor. What is measured in metres is given as if nothing had been scaled.

use std::sync::Arc;

use god_object::spatial::{angular, linear, six};
use god_object::{Body, Mesh, Obstacle, Pose, Primitive, World};
use nalgebra::{Point3, Translation3};

use super::Extent;
use crate::measure::Measure;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};

const FACTORS: [f64; 2] = [1e-3, 1e3];

/// Those that are run at other scales.
pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    let originals = |factor: f64| {
        let mut originals = super::push_slide_lift::recipes(extent);
        if extent == Extent::Full {
            originals.extend(super::thin_plate::recipes(extent));
            originals.extend(super::fast_impact::recipes(extent));
            originals.extend(super::late_contact::recipes(extent));
            originals.extend(super::cylinder::recipes(extent));
        }
        originals.into_iter().map(move |r| scaled(r, factor))
    };
    FACTORS.into_iter().flat_map(originals).collect()
}

fn point(point: &Point3<f64>, factor: f64) -> Point3<f64> {
    Point3::from(point.coords * factor)
}

fn pose(pose: &Pose, factor: f64) -> Pose {
    Pose::from_parts(
        Translation3::from(pose.translation.vector * factor),
        pose.rotation,
    )
}

fn mesh(mesh: &Mesh, factor: f64) -> Mesh {
    let vertices = mesh.vertices().iter().map(|v| point(v, factor)).collect();
    let triangles = mesh.triangles().to_vec();
    Mesh::new(vertices, triangles).unwrap_or_else(|error| panic!("{error}"))
}

fn primitive(primitive: &Primitive, factor: f64) -> Primitive {
    match primitive {
        Primitive::Sphere { center, radius } => Primitive::Sphere {
            center: point(center, factor),
            radius: radius * factor,
        },
        Primitive::Cylinder { ends, radius } => Primitive::Cylinder {
            ends: ends.map(|end| point(&end, factor)),
            radius: radius * factor,
        },
        other => panic!("no recipe to be scaled has {other:?}"),
    }
}

fn body(body: &Body, factor: f64) -> Body {
    Body {
        mesh: mesh(&body.mesh, factor),
        primitive: body.primitive.as_ref().map(|p| primitive(p, factor)),
        mass: body.mass / factor,
        inertia: body.inertia * factor,
        reference_point: point(&body.reference_point, factor),
    }
}

fn obstacle(obstacle: &Obstacle, factor: f64) -> Obstacle {
    Obstacle {
        name: obstacle.name.clone(),
        mesh: mesh(&obstacle.mesh, factor),
        primitive: obstacle.primitive.as_ref().map(|p| primitive(p, factor)),
        pose: pose(&obstacle.pose, factor),
        surface: obstacle.surface.clone(),
    }
}

fn scene(scene: &Scene, factor: f64) -> Scene {
    // Everything in the settings that is a length derives from the body's.
    let mut settings = scene.settings;
    for length in [
        &mut settings.rest_distance,
        &mut settings.minimum_gap,
        &mut settings.gap_tolerance,
        &mut settings.activation_distance,
        &mut settings.look_ahead_limit,
        &mut settings.motion_tolerance,
    ] {
        *length *= factor;
    }
    if let Some(adaptation) = &mut settings.adaptation {
        adaptation.threshold *= factor;
    }
    settings.torque_limit *= factor;
    let World {
        body: held,
        obstacles,
    } = &*scene.world;
    Scene {
        world: Arc::new(World {
            body: body(held, factor),
            obstacles: obstacles.iter().map(|o| obstacle(o, factor)).collect(),
        }),
        start: pose(&scene.start, factor),
        settings,
        speed: scene.speed * factor,
    }
}

fn scaled(recipe: Recipe, factor: f64) -> Recipe {
    let scene = scene(&recipe.scene, factor);
    let Recipe {
        name,
        case,
        about,
        duration,
        device,
        ideal,
        depth,
        astray,
        phases,
        lines,
        out_of_scope,
        ..
    } = recipe;
    let original = (name, case.clone());
    let case = ("R34", format!("{name} {case}, times {factor:e}"));
    Recipe {
        ideal: match ideal {
            Ideal::Closed(formula) => Ideal::closed(move |time| {
                let wrench = formula(time);
                six(&linear(&wrench), &(angular(&wrench) * factor))
            }),
            other => other,
        },
        depth: Box::new(move |body| depth(&pose(body, 1.0 / factor))),
        astray: Box::new(move |time, body| astray(time, &pose(body, 1.0 / factor))),
        phases: phases.min(4),
        lines: Box::new(move |rate| {
            let mut lines = lines(rate);
            for line in &mut lines {
                if line.measure == Measure::FirstForceDepth {
                    line.limit *= factor;
                }
            }
            lines
        }),
        out_of_scope,
        costs_as: Some(original),
        ..Recipe::new(case, about, scene, duration, move |time| {
            pose(&device(time), factor)
        })
    }
}
