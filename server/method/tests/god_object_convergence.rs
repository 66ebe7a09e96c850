//! With the device at rest the god-object comes to the constrained minimiser and stays there, bit for bit.
//!
//! Other presses: `PROPTEST_RNG_SEED=2 PROPTEST_CASES=20000 cargo test --release -p god-object --test all god_object_convergence::`.

use std::sync::Arc;

use crate::support::{box_body, box_obstacle, penetrates};
use god_object::constraint::contact_jacobian;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::quasi_statics::{HalfSpace, Projector, SolverKind, kkt_residual};
use god_object::spatial::{angular, linear, pose_difference};
use god_object::{GodObject, Obstacle, Pose, Settings, World};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Updates after which nothing may move any more. Most presses take a hundred; where the contacts are bent so that they nearly cancel the
/// metric, an update leaves 99 % of the way.
const UPDATES: u32 = 3000;
/// Updates without motion that are rest.
const AT_REST: u32 = 20;

fn tilted(center: [f64; 3], rotation: [f64; 3]) -> Obstacle {
    Obstacle {
        pose: Pose::from_parts(
            Vector3::from(center).into(),
            UnitQuaternion::from_scaled_axis(Vector3::from(rotation)),
        ),
        ..box_obstacle("stone", Vector3::new(0.02, 0.015, 0.01), Vector3::zeros())
    }
}

/// The same presses in every run, unless others are asked for.
fn config() -> ProptestConfig {
    let asked = ProptestConfig::default();
    let rng_seed = match asked.rng_seed {
        RngSeed::Random => RngSeed::Fixed(1),
        fixed => fixed,
    };
    ProptestConfig {
        failure_persistence: None,
        rng_seed,
        ..asked
    }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_pressing_hand_at_rest_leads_to_the_minimiser_and_no_further(
        stones in prop::collection::vec(
            (prop::array::uniform3(-0.03..0.03f64), prop::array::uniform3(-3.0..3.0f64)), 0..4),
        press in prop::array::uniform3(-0.02..0.02f64),
        turn in prop::array::uniform3(-0.7..0.7f64),
        rounds in prop::sample::select(vec![0, 1, 1, 3]),
    ) {
        let mut obstacles = vec![box_obstacle("table", Vector3::new(0.5, 0.5, 0.05), -0.05 * Vector3::z())];
        obstacles.extend(stones.iter().map(|(center, rotation)| tilted(*center, *rotation)));
        let world = Arc::new(World { body: box_body(Vector3::new(0.02, 0.02, 0.01)), obstacles });
        let settings = Settings { implicit_rounds: rounds, ..Settings::for_size(0.04) };
        let mut god_object =
            GodObject::new(world.clone(), settings, Pose::translation(0.0, 0.0, 0.1)).expect("a free start");
        let device = Pose::new(Vector3::from(press), Vector3::from(turn));
        let mut rest = *god_object.pose();
        let mut still = 0;
        for _ in 0..UPDATES {
            let report = god_object.step(&device, None);
            prop_assert!(report.gap_min >= settings.minimum_gap);
            prop_assert!(report.substeps <= settings.max_substeps);
            still = if *god_object.pose() == rest { still + 1 } else { 0 };
            rest = *god_object.pose();
            if still == AT_REST {
                break;
            }
        }
        prop_assert_eq!(still, AT_REST, "the body comes to rest");
        prop_assert!(!penetrates(&world, &rest));

        // Eq. (1) on a set collected anew, its answer held against the optimality conditions themselves: there is nowhere left to go. (An
        // interior point's answer would do in all but wedges, where rows met to 1e-9 leave a micrometre of room.)
        let fresh = GodObject::new(world.clone(), settings, rest).expect("a free pose");
        let center = Point3::from(rest.translation.vector);
        let rows: Vec<HalfSpace> = fresh
            .constraint_set()
            .constraints
            .iter()
            .map(|row| HalfSpace {
                jacobian: contact_jacobian(&row.normal, &row.point, &center),
                bound: settings.rest_distance - row.gap,
            })
            .collect();
        let wanted = pose_difference(&device, &rest, &Vector3::zeros()) * settings.k_s;
        let metric = world.body.metric(settings.rotation_metric, &rest).expect("a metric");
        let answer = Projector::new(SolverKind::ActiveSet, rows.len()).project(&metric, &wanted, &rows, &[]);
        let residual = kkt_residual(&metric, &wanted, &rows, &answer.acceleration, &answer.active);
        prop_assert!(residual.largest() <= 1e-12, "{residual:?}");
        let left = linear(&answer.acceleration).norm()
            + world.body.mesh.radius_about(&Point3::origin()) * angular(&answer.acceleration).norm();
        prop_assert!(left <= 2.0 * settings.motion_tolerance, "{left} m left to go, {:?}", answer.status);
    }
}
