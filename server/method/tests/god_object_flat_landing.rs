//! Flat faces as computer-aided design exports them, fans of long triangles that lie over each other in their thousands: a body
//! lands flat on them foreseen and at the cost of its rim, not of every pair of triangles.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::support::penetrates;
use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::{Body, GodObject, Mesh, Obstacle, Pose, Settings, Surface, World};

/// Corners of a drum's rim: each cap has two triangles less.
const CORNERS: u32 = 500;
const HALF: f64 = 0.01;
/// m: of the body, and of what it lands on.
const RADII: [f64; 2] = [0.02, 0.03];

/// A drum along z whose caps are fans about one corner of their rim.
fn drum(radius: f64) -> Mesh {
    let mut vertices = Vec::new();
    for k in 0..CORNERS {
        let (sin, cos) = (TAU * f64::from(k) / f64::from(CORNERS)).sin_cos();
        let corner = |z| Point3::new(radius * cos, radius * sin, z);
        vertices.extend([corner(-HALF), corner(HALF)]);
    }
    let mut triangles = Vec::new();
    for k in 0..CORNERS {
        let [a, b] = [2 * k, 2 * ((k + 1) % CORNERS)];
        triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        if k > 0 && k + 1 < CORNERS {
            triangles.extend([[0, b, a], [1, a + 1, b + 1]]);
        }
    }
    Mesh::new(vertices, triangles).expect("a drum is closed")
}

/// One drum over another, aside and turned so that no two triangles share an edge's direction.
fn world() -> Arc<World> {
    let mesh = drum(RADII[0]);
    let solid = mass_properties(&mesh);
    Arc::new(World {
        body: Body {
            primitive: None,
            mass: 1.0,
            inertia: solid.inertia_per_density / solid.volume,
            reference_point: solid.centroid,
            mesh,
        },
        obstacles: vec![Obstacle {
            name: "drum".into(),
            mesh: drum(RADII[1]),
            primitive: None,
            pose: Pose::from_parts(
                Vector3::new(0.004, -0.003, -HALF).into(),
                UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.7)),
            ),
            surface: Surface::default(),
        }],
    })
}

fn over(gap: f64) -> Pose {
    Pose::translation(0.0, 0.0, HALF + gap)
}

/// Gap after the updates of a descent by `step` (m) an update, and the most pairs of triangles that one looked at.
fn land(step: f64, mut each: impl FnMut(&GodObject)) -> (f64, u64) {
    let (start, depth) = (20.0 * step.max(1e-5), 1e-4);
    let settings = Settings::for_size(2.0 * RADII[0]);
    let mut god_object = GodObject::new(world(), settings, over(start)).expect("a free start");
    let (mut gap, mut most) = (start, 0);
    for _ in 0..120 {
        gap = (gap - step).max(-depth);
        let report = god_object.step(&over(gap), None);
        assert!(!report.unfinished);
        most = most.max(report.work.triangle_pairs);
        each(&god_object);
    }
    (god_object.pose().translation.vector.z - HALF, most)
}

/// Every pair of triangles of the two caps that lie over each other.
fn all_pairs() -> u64 {
    u64::from(CORNERS - 2).pow(2)
}

#[test]
fn a_slow_landing_is_foreseen_and_costs_as_much_as_the_rim() {
    let rest = Settings::for_size(2.0 * RADII[0]).rest_distance;
    let mut lowest = f64::INFINITY;
    let (gap, most) = land(7e-6, |god_object| {
        let gap = god_object.pose().translation.vector.z - HALF;
        lowest = lowest.min(gap);
        let rows = god_object.constraint_set().constraints.len();
        assert!(
            rows >= 3 || gap > 2.0 * rest,
            "{rows} rows at a gap of {gap}"
        );
    });
    assert!((gap - rest).abs() < 0.01 * rest, "rests at {gap}");
    assert!(lowest > 0.99 * rest, "was stopped at {lowest}");
    assert!(most < all_pairs() / 5, "{most} of {}", all_pairs());
}

#[test]
fn a_fast_landing_comes_to_the_same_rest() {
    let rest = Settings::for_size(2.0 * RADII[0]).rest_distance;
    let (gap, _) = land(1e-3, |god_object| {
        let gap = god_object.pose().translation.vector.z - HALF;
        assert!(gap > 0.0, "{gap}");
    });
    assert!((gap - rest).abs() < 0.01 * rest, "rests at {gap}");
    assert!(!penetrates(&world(), &over(gap)));
}
