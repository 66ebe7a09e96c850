//! What a set looks ahead costs no more than the settings allow, beside a primitive, whose pairs are collected without a bound.

use std::sync::Arc;

use crate::geometry_shapes::{fine_hole, fine_peg, mesh};
use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, Vector3};
use god_object::{Body, GodObject, Obstacle, Pose, Primitive, Settings, Surface, World};

fn world() -> Arc<World> {
    let body = mesh(fine_peg(8e-3, 25e-3, 120, 60));
    let solid = mass_properties(&body);
    Arc::new(World {
        body: Body {
            primitive: None,
            mesh: body,
            mass: 1.0,
            inertia: solid.inertia_per_density / solid.volume,
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            primitive: Some(Primitive::Plane {
                normal: -Vector3::x(),
                point: Point3::new(9e-3, 0.0, 0.0),
            }),
            name: "wall".into(),
            mesh: mesh(fine_hole(9e-3, 25e-3, 20e-3, 120, 60)),
            pose: Pose::identity(),
            surface: Surface::default(),
        }],
    })
}

#[test]
fn a_hand_that_is_fast_makes_no_update_late_for_long() {
    let settings = Settings::for_size(0.05);
    let mut god_object = GodObject::new(world(), settings, Pose::identity()).expect("a free start");
    // To and fro along the wall at 2 m/s, pressed to it.
    let mut late = 0;
    for k in 0..60_u32 {
        let z = 2e-3 * f64::from(if k / 5 % 2 == 0 { k % 5 } else { 5 - k % 5 });
        let device = Pose::new(Vector3::new(3e-3, 0.0, z), Vector3::zeros());
        let report = god_object.step(&device, None);
        let pairs = report.work.triangle_pairs + report.work.feature_pairs;
        late += u32::from(pairs > 4 * settings.look_ahead_pairs);
    }
    // The first finds out what it costs.
    assert!(late <= 1, "{late}");
}
