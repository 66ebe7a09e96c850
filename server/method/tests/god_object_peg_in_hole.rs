//! A peg in a hole, anywhere in the world: it slides without friction, and the wall pushes back straight.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::geometry_shapes::{hole, mesh, peg};
use crate::support::penetrates;
use god_object::geometry::mass_properties;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::{angular, linear};
use god_object::{Body, Coupling, GodObject, Obstacle, Pose, Settings, Surface, World};
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

const SIDES: u32 = 72;
const RADIUS: f64 = 0.01;
const HALF_LENGTH: f64 = 0.03;
/// How far the peg is out of the hole, m: 50 of its 60 mm are in.
const OUT: f64 = 0.01;

/// A peg of 72 sides and 1 kg, and a ring with a hole of the given clearance (m) about the obstacle's z axis, placed in the world.
fn peg_in_hole(clearance: f64, placed: &Pose) -> Arc<World> {
    let body = mesh(peg(RADIUS, HALF_LENGTH, SIDES));
    let properties = mass_properties(&body);
    let inertia = properties.inertia_per_density / properties.volume;
    let inner = (RADIUS + clearance) / (PI / f64::from(SIDES)).cos();
    Arc::new(World {
        body: Body {
            primitive: None,
            mesh: body,
            mass: 1.0,
            inertia,
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "hole".into(),
            mesh: mesh(hole(inner, 0.03, HALF_LENGTH, SIDES)),
            pose: *placed,
            surface: Surface::default(),
        }],
    })
}

/// One draw: where the ring is, where the hand pulls, and how tight the hole is.
#[derive(Clone, Copy, Debug)]
struct Draw {
    rotation: [f64; 3],
    position: [f64; 3],
    half_sides: u32,
    pull: f64,
    clearance: f64,
}

/// Pulls the inserted peg sideways and along, and checks what is felt where it comes to rest.
fn check(draw: &Draw) -> Result<(), TestCaseError> {
    let Draw {
        clearance, pull, ..
    } = *draw;
    let placed = Pose::from_parts(
        Vector3::from(draw.position).into(),
        UnitQuaternion::from_scaled_axis(Vector3::from(draw.rotation)),
    );
    let world = peg_in_hole(clearance, &placed);
    let settings = Settings {
        force_limit: 1e3,
        torque_limit: 1e3,
        ..Settings::for_size(2.0 * HALF_LENGTH)
    };
    let start = placed * Pose::translation(0.0, 0.0, OUT);
    let mut god_object = GodObject::new(world.clone(), settings, start).expect("the peg fits");
    let mut coupling = Coupling::new(&world, &settings);
    let angle = PI * f64::from(draw.half_sides) / f64::from(SIDES);
    let offset = 3e-3;
    let device = placed * Pose::translation(offset * angle.cos(), offset * angle.sin(), OUT + pull);
    for update in 0..80 {
        let report = god_object.step(&device, None);
        prop_assert!(report.gap_min >= settings.minimum_gap);
        prop_assert_eq!(report.solver_failures, 0);
        if update % 20 == 0 {
            prop_assert!(!penetrates(&world, god_object.pose()));
        }
    }
    let felt = coupling
        .step(0.0, &device, god_object.constraint_set())
        .wrench;
    let (force, torque) = (
        placed.rotation.inverse() * linear(&felt),
        placed.rotation.inverse() * angular(&felt),
    );
    let expected = settings.stiffness(1.0) * (offset - clearance + settings.rest_distance);
    // A facet is up to 2.5 degrees off the radius, and a corner of the hole a little deeper than a side.
    prop_assert!(
        (force.norm() - expected).abs() < 0.03 * expected,
        "{force} {expected}"
    );
    prop_assert!(force.z.abs() <= 1e-6 * expected, "axial {force}");
    prop_assert!(
        torque.z.abs() <= 1e-6 * expected * RADIUS,
        "torque {torque}"
    );
    let outward = Vector3::new(angle.cos(), angle.sin(), 0.0);
    prop_assert!(force.dot(&outward) < 0.0);
    prop_assert!(
        force.cross(&outward).norm() <= 1e-6 * expected,
        "sideways {force}"
    );
    // It slides to where the hand pulls it.
    let slid = (placed.inverse() * god_object.pose()).translation.vector.z;
    prop_assert!((slid - OUT - pull).abs() < 1e-6, "{slid} {pull}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn an_inserted_peg_feels_the_wall_and_neither_axial_force_nor_torque_about_the_axis(
        rotation in prop::array::uniform3(-3.0..3.0f64),
        position in prop::array::uniform3(-0.2..0.2f64),
        // Towards a corner of the hole or the middle of a side: the peg's polygon is symmetric about both.
        half_sides in 0..144u32,
        // The hand pulls the peg along the hole, too.
        pull in -0.02..0.02f64,
        clearance in prop::sample::select(vec![5e-4, 1e-4, 5e-5]),
    ) {
        check(&Draw { rotation, position, half_sides, pull, clearance })?;
    }
}

/// Its ends 2.5 um inside those of the ring, the peg turned about its axis by 6.8 urad, where two rows were violated by 6 nm and none was chosen.
#[test]
fn a_peg_whose_ends_are_at_the_rims_is_not_left_turned() {
    let draw = Draw {
        rotation: [0.0, -1.593_016_305_952_149_2, 0.170_162_794_363_538_07],
        position: [0.122_164_350_451_533_48, 0.0, 0.041_524_422_425_535_23],
        half_sides: 62,
        pull: -0.010_002_549_746_233_13,
        clearance: 5e-5,
    };
    check(&draw).expect("neither axial force nor torque");
}

/// Pegs that turned to and fro for ever between two sides of the rim, because in each position the rows of one side alone were known: those of the other
/// were lost one rounding error over the ring's upper face, or as soon as the peg turned out of their normal cones.
#[test]
fn a_peg_that_leaves_over_the_rim_comes_to_rest() {
    let found = [
        (
            [-1.819913129074184, -1.2677684921864545, 1.2588662691153256],
            -0.007595071290302717,
            38,
            0.010631651329998618,
        ),
        (
            [2.6282602178475063, 1.9081642850004998, 1.1880683521534925],
            0.031198161287099013,
            18,
            0.010953732387328871,
        ),
        (
            [2.855501149195563, 2.1354052163485555, 1.415309283501549],
            0.0463475567103028,
            86,
            0.01144608773858299,
        ),
    ];
    for (rotation, x, half_sides, pull) in found {
        let draw = Draw {
            rotation,
            position: [x, 0.0, 0.0],
            half_sides,
            pull,
            clearance: 1e-4,
        };
        check(&draw).unwrap();
    }
}
