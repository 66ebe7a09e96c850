//! Time of impact of primitives with each other and with meshes, against parry's distances.

use crate::geometry_shapes::{icosphere, mesh};
use crate::shape_support;

use crate::shape_support::{Form, forms, obstacles, oracle_distance, vectors};
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, shapes_intersect,
    time_of_impact,
};
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::six;
use god_object::{Pose, Vector6};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const SETTINGS: AdvancementSettings = AdvancementSettings {
    minimum_gap: 1e-5,
    gap_tolerance: 1e-6,
    max_iterations: 200,
    interval_edges: 0.5,
    max_intervals: 64,
};
/// parry's own error at these sizes, m.
const ORACLE_ERROR: f64 = 2e-7;
const SAMPLES: u32 = 200;

fn search(
    form: Form,
    start: &Pose,
    displacement: &Vector6,
    obstacle: Form,
    pose: &Pose,
) -> TimeOfImpact {
    let motion = Motion {
        start: *start,
        displacement: *displacement,
        reference_point: Point3::origin(),
    };
    time_of_impact(
        &form.body(),
        &motion,
        &obstacle.obstacle("obstacle", *pose),
        pose,
        &SETTINGS,
        &mut CollisionWorkspace::new(),
        &mut Work::default(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(12), failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_search_is_never_late_and_hardly_early(
        form in forms(),
        obstacle in obstacles(),
        offset in vectors(0.08),
        turn in vectors(3.0),
        obstacle_turn in vectors(3.0),
        path in vectors(0.15),
        spin in vectors(2.0),
    ) {
        prop_assume!(form.primitive().is_some() || obstacle.primitive().is_some());
        let pose = Pose::new(Vector3::new(0.3, -0.2, 0.1), obstacle_turn);
        let start = pose * Pose::new(offset, turn);
        let (a, b) = (form.oracle(), obstacle.oracle());
        let distance = |pose_a: &Pose| oracle_distance(&a, pose_a, &b, &pose);
        prop_assume!(distance(&start) > 2e-4);
        // The surface of a mesh has no inside for the oracle.
        prop_assume!(!shapes_intersect(&form.body(), &start, &obstacle.obstacle("o", pose), &pose));
        let displacement = six(&path, &spin);
        let motion = Motion { start, displacement, reference_point: Point3::origin() };
        let found = search(form, &start, &displacement, obstacle, &pose);
        let until = match found {
            TimeOfImpact::Separated => 1.0,
            TimeOfImpact::Impact { time } => time,
            other => return Err(TestCaseError::fail(format!("{other:?}"))),
        };
        for k in 0..=SAMPLES {
            let t = until * f64::from(k) / f64::from(SAMPLES);
            let gap = distance(&motion.pose_at(t));
            prop_assert!(gap >= SETTINGS.minimum_gap - ORACLE_ERROR, "{gap} at {t} of {until}");
        }
        if until < 1.0 {
            let gap = distance(&motion.pose_at(until));
            prop_assert!(gap <= SETTINGS.minimum_gap + SETTINGS.gap_tolerance + 1e-8 + ORACLE_ERROR, "{gap} at {until}");
        }
    }
}

#[test]
fn what_is_out_of_reach_costs_nothing() {
    let pairs = [
        (Form::Cube(0.02), Form::Sphere(0.01)),
        (Form::Sphere(0.01), Form::Cube(0.02)),
        (Form::Capsule(0.01, 0.02), Form::Cylinder(0.01, 0.02)),
        (Form::Cube(0.02), Form::Plane),
    ];
    let motion = Motion {
        start: Pose::translation(0.0, 0.0, 0.2),
        displacement: six(
            &Vector3::new(0.05, 0.02, -0.03),
            &Vector3::new(1.0, -2.0, 3.0),
        ),
        reference_point: Point3::origin(),
    };
    for (form, obstacle) in pairs {
        let mut work = Work::default();
        let found = time_of_impact(
            &form.body(),
            &motion,
            &obstacle.obstacle("obstacle", Pose::identity()),
            &Pose::identity(),
            &SETTINGS,
            &mut CollisionWorkspace::new(),
            &mut work,
        );
        let expected = (TimeOfImpact::Separated, Work::default());
        assert_eq!((found, work), expected, "{form:?} and {obstacle:?}");
    }
}

#[test]
fn a_fine_mesh_on_a_large_ball_is_searched_near_the_contact_alone() {
    let body = mesh(icosphere(0.05, 5));
    // Aslant to all axes, where the box around the ball says nothing.
    let up = Vector3::new(1.0, 1.0, 1.0).normalize();
    let start = Pose::from_parts((up * 1.05002).into(), UnitQuaternion::identity());
    let along = up.cross(&Vector3::z()) * 1e-4;
    let ball = Form::Sphere(1.0).obstacle("ball", Pose::identity());
    let (body, still) = (&body, &Pose::identity());
    for (path, lands) in [(along, false), (along - up * 1e-4, true)] {
        let motion = Motion {
            start,
            displacement: six(&path, &Vector3::new(1e-3, 0.0, 1e-3)),
            reference_point: Point3::origin(),
        };
        let (workspace, mut work) = (&mut CollisionWorkspace::new(), Work::default());
        let found = time_of_impact(body, &motion, &ball, still, &SETTINGS, workspace, &mut work);
        assert_eq!(
            matches!(found, TimeOfImpact::Impact { .. }),
            lands,
            "{found:?}"
        );
        // The cap of the mesh within the path and its turn, 0.2 mm, is 0.4 % of it: several times that, for volumes and whole triangles.
        let most = body.triangles().len() as u64 / 50;
        assert!(
            work.triangle_pairs < most && work.node_pairs < most,
            "{work:?}"
        );
    }
}

#[test]
fn a_sphere_stops_at_the_closed_form_over_a_plane() {
    let pose = Pose::identity();
    let start = Pose::translation(0.1, -0.3, 0.05);
    let down = six(
        &Vector3::new(0.02, 0.01, -0.1),
        &Vector3::new(1.0, 2.0, 0.3),
    );
    let TimeOfImpact::Impact { time } =
        search(Form::Sphere(0.02), &start, &down, Form::Plane, &pose)
    else {
        panic!("it lands");
    };
    let gap = 0.05 - 0.1 * time - 0.02;
    assert!((1e-5..=1.1e-5).contains(&gap), "{gap}");
}

/// Name, form, whether it stands, height of its middle, displacement and turn.
type Case = (&'static str, Form, bool, f64, [f64; 3], [f64; 3]);

const AT_THE_GAP: [Case; 7] = [
    (
        "sphere slides",
        Form::Sphere(0.01),
        false,
        0.01,
        [0.1, 0.05, 0.0],
        [0.0, 0.0, 0.0],
    ),
    (
        "sphere rolls",
        Form::Sphere(0.01),
        false,
        0.01,
        [0.01, 0.0, 0.0],
        [0.0, 1.0, 0.0],
    ),
    (
        "cylinder lies and rolls",
        Form::Cylinder(0.01, 0.03),
        false,
        0.01,
        [0.01, 0.0, 0.0],
        [0.0, 1.0, 0.0],
    ),
    (
        "cylinder lies and yaws",
        Form::Cylinder(0.01, 0.03),
        false,
        0.01,
        [0.01, 0.02, 0.0],
        [0.0, 0.0, 1.0],
    ),
    (
        "cylinder stands and yaws",
        Form::Cylinder(0.01, 0.03),
        true,
        0.03,
        [0.01, 0.02, 0.0],
        [0.0, 0.0, 2.0],
    ),
    (
        "capsule lies and yaws",
        Form::Capsule(0.01, 0.03),
        false,
        0.01,
        [0.01, 0.02, 0.0],
        [0.0, 0.0, 1.0],
    ),
    (
        "cube yaws and leaves",
        Form::Cube(0.01),
        false,
        0.01,
        [0.0, 0.0, 0.01],
        [0.0, 0.0, 1.0],
    ),
];

#[test]
fn bodies_at_the_minimum_gap_may_slide_roll_yaw_and_leave() {
    let gap = SETTINGS.minimum_gap;
    let lying = UnitQuaternion::identity();
    let standing = shape_support::turned(Vector3::x(), std::f64::consts::FRAC_PI_2);
    for (name, form, stands, height, path, spin) in AT_THE_GAP {
        let rotation = if stands { standing } else { lying };
        let start = Pose::from_parts(Vector3::new(0.0, 0.0, height + gap).into(), rotation);
        let displacement = six(&Vector3::from(path), &Vector3::from(spin));
        let found = search(form, &start, &displacement, Form::Plane, &Pose::identity());
        assert_eq!(found, TimeOfImpact::Separated, "{name} over a plane");
        // The same on the upper face of a cube of 2 m.
        let cube = Pose::translation(0.0, 0.0, -1.0);
        if form.primitive().is_some() {
            let found = search(form, &start, &displacement, Form::Cube(1.0), &cube);
            assert_eq!(found, TimeOfImpact::Separated, "{name} over a cube");
        }
    }
}

#[test]
fn a_body_inside_a_primitive_overlaps_and_nan_stops() {
    let at = Pose::translation(0.0, 0.01, 0.0);
    for (form, obstacle) in [
        (Form::Sphere(0.01), Form::Sphere(0.02)),
        (Form::Sphere(0.01), Form::Cylinder(0.02, 0.03)),
        (Form::Cylinder(0.01, 0.01), Form::Plane),
        (Form::Cube(0.01), Form::Capsule(0.02, 0.03)),
        (Form::Capsule(0.01, 0.01), Form::Cube(0.015)),
    ] {
        let found = search(form, &at, &Vector6::zeros(), obstacle, &Pose::identity());
        assert!(
            matches!(
                found,
                TimeOfImpact::Overlapping | TimeOfImpact::Impact { time: 0.0 }
            ),
            "{form:?} in {obstacle:?}: {found:?}"
        );
    }
    let mut broken = Vector6::zeros();
    broken[1] = f64::NAN;
    let found = search(
        Form::Cylinder(0.01, 0.01),
        &Pose::translation(0.0, 0.0, 0.5),
        &broken,
        Form::Plane,
        &Pose::identity(),
    );
    assert_eq!(found, TimeOfImpact::Impact { time: 0.0 });
}
