//! Both loops' steps allocate nothing after start.

use crate::support;

use assert_no_alloc::assert_no_alloc;
use god_object::nalgebra::Vector3;
use god_object::{
    Coupling, ForceShading, GodObject, Pose, Settings, SineTexture, Surface, Texture, World,
};
use std::sync::Arc;

#[test]
fn god_object_and_coupling_steps_allocate_nothing() {
    let mut world = World::clone(&support::box_on_table());
    world.obstacles[0].surface = Surface {
        shading: Some(ForceShading { crease_angle: 0.6 }),
        texture: Some(Texture::Sine(SineTexture {
            axis: Vector3::x(),
            wavelength: 2e-3,
            amplitude: 0.2,
        })),
        friction: 0.4,
    };
    let world = Arc::new(world);
    let settings = Settings::for_size(0.04);
    let start = Pose::translation(0.0, 0.0, 0.03);
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, start).expect("a free start");
    let mut published = god_object.constraint_set().clone();

    let mut touched = 0;
    for i in 0..600 {
        let t = f64::from(i) * 1e-3;
        // Lands on a corner, presses, rolls over edges, jumps away and through.
        let z = if i % 200 == 199 {
            -0.3
        } else {
            0.02 - 0.03 * (9.0 * t).sin()
        };
        let device = Pose::new(
            Vector3::new(0.1 * t, 0.02 * (5.0 * t).sin(), z),
            Vector3::new(3.0 * t, 0.4, 2.0 * t),
        );
        assert_no_alloc(|| {
            let shaded = coupling.step(t, &device, &published).shaded;
            touched += god_object.step(&device, shaded.as_ref()).contacts;
            published.clone_from(god_object.constraint_set());
        });
    }
    assert!(touched > 100, "the path touches the table");
}

#[test]
fn steps_among_moving_obstacles_with_implicit_rounds_allocate_nothing() {
    let world = support::box_on_table();
    let settings = Settings {
        implicit_rounds: 3,
        ..Settings::for_size(0.04)
    };
    let start = Pose::translation(0.0, 0.0, 0.03);
    let table = world.obstacles[0].pose;
    let mut coupling = Coupling::new(&world, &settings);
    let mut god_object = GodObject::new(world, settings, start).expect("a free start");
    let mut touched = 0;
    for i in 0..600 {
        let t = f64::from(i) * 1e-3;
        let device = Pose::new(
            Vector3::new(0.1 * t, 0.0, 0.015),
            Vector3::new(2.0 * t, 0.4, t),
        );
        let rocking = Pose::new(
            Vector3::new(0.0, 0.0, 0.02 * (20.0 * t).sin()),
            Vector3::new(0.2 * (15.0 * t).sin(), 0.0, 0.0),
        ) * table;
        assert_no_alloc(|| {
            god_object.move_obstacle(0, &rocking);
            touched += god_object.step(&device, None).contacts;
            coupling.step(t, &device, god_object.constraint_set());
        });
    }
    assert!(touched > 100, "the table touches the body");
}
