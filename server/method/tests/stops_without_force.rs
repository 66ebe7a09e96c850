//! A surface that runs through itself has a side that looks inward: it stops the body and gives no force. The report of the update says so.

use std::sync::Arc;

use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::linear;
use god_object::{Coupling, GodObject, Mesh, Pose, Settings, World};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::support::{box_body, box_obstacle};

/// Half of the body's side, m.
const HALF: f64 = 5e-3;
/// Cross-section of a prism along y, m: its upper lobe, between heights of 5 and 20 mm, is run through the other way.
const EIGHT: [[f64; 2]; 6] = [
    [-0.03, -0.03],
    [0.03, -0.03],
    [0.03, -0.01],
    [-0.015, 0.02],
    [0.015, 0.02],
    [-0.03, -0.01],
];
const TOP: f64 = 0.02;
const BOTTOM: f64 = -0.03;

fn prism() -> Mesh {
    let layer = |y: f64| EIGHT.map(|[x, z]| Point3::new(x, y, z));
    let vertices = [layer(-0.03), layer(0.03)].concat();
    let n = EIGHT.len() as u32;
    let sides = (0..n).flat_map(|i| {
        let j = (i + 1) % n;
        [[i, j, n + j], [i, n + j, n + i]]
    });
    let caps = [[0, 1, 2], [0, 2, 5], [2, 3, 4], [2, 4, 5]];
    let caps = caps
        .into_iter()
        .flat_map(|[a, b, c]| [[a, c, b], [n + a, n + b, n + c]]);
    let triangles: Vec<[u32; 3]> = sides.chain(caps).map(|[a, b, c]| [a, c, b]).collect();
    Mesh::new(vertices, triangles).expect("closed, and of positive volume")
}

/// Force at the end, N, and in how many updates the body was stopped without a row, where it is led from one height to another beside the axis of the prism.
fn led(heights: [f64; 2], aside: [f64; 2], turn: f64) -> (Vector3<f64>, u32) {
    let place = Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.7, -0.4, 1.1));
    let mut eight = box_obstacle("eight", Vector3::repeat(HALF), Vector3::zeros());
    (eight.mesh, eight.pose) = (prism(), place);
    let world = Arc::new(World {
        body: box_body(Vector3::repeat(HALF)),
        obstacles: vec![eight],
    });
    let settings = Settings {
        adaptation: None,
        ..world.settings_for(Settings::for_size(2.0 * HALF))
    };
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
    let at =
        |height| place * Pose::from_parts(Vector3::new(aside[0], aside[1], height).into(), turned);
    let mut god_object =
        GodObject::new(world.clone(), settings, at(heights[0])).expect("a free start");
    let mut coupling = Coupling::new(&world, &settings);
    let (mut force, mut stops) = (Vector3::zeros(), 0);
    for tick in 0..200 {
        let share = (f64::from(tick) / 100.0).min(1.0);
        let device = at(heights[0] + share * (heights[1] - heights[0]));
        let report = god_object.step(&device, None);
        stops += u32::from(report.stopped_without_row);
        let set = god_object.constraint_set();
        force = linear(&coupling.step(1e-3 * f64::from(tick), &device, set).wrench);
    }
    (place.rotation.inverse() * force, stops)
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 24,
        rng_seed: RngSeed::Fixed(11),
        ..ProptestConfig::default()
    })]

    #[test]
    fn what_stops_the_body_without_a_force_is_reported(
        x in -5e-3..5e-3, y in -0.02..0.02, turn in 0.0..std::f64::consts::TAU,
    ) {
        // Onto the side that looks inward: held, and nothing is felt.
        let (force, stops) = led([TOP + 4.0 * HALF, TOP], [x, y], turn);
        prop_assert!(force.norm() == 0.0, "{force}");
        prop_assert!(stops > 100, "told in {stops} updates");
        // From below, against a side that looks outward: felt, and nothing is told.
        let (force, stops) = led([BOTTOM - 4.0 * HALF, BOTTOM], [x, y], turn);
        prop_assert!(force.z < -1.0, "{force}");
        prop_assert_eq!(stops, 0);
    }
}
