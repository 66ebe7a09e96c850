//! Time of impact: never late, hardly early, free where the motion is free.

use crate::geometry_shapes;

use crate::geometry_shapes::{cuboid, grid_box, hole, icosphere, mesh, peg, tetrahedron, torus};
use crate::mesh_distance::distance;
use crate::mesh_impact::{SETTINGS, search, straight, vector};
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, meshes_intersect,
    time_of_impact,
};
use god_object::geometry::Mesh;
use god_object::nalgebra::{Point3, UnitQuaternion, Vector3};
use god_object::spatial::{Pose, Vector6, from_reference_point, six};
use proptest::prelude::*;

fn translation(x: f64, y: f64, z: f64) -> Vector6 {
    six(&Vector3::new(x, y, z), &Vector3::zeros())
}

fn impact(found: TimeOfImpact) -> f64 {
    let TimeOfImpact::Impact { time } = found else {
        panic!("expected an impact, found {found:?}")
    };
    time
}

/// Body frame pose at `time`.
fn body_pose(motion: &Motion, time: f64) -> Pose {
    from_reference_point(&motion.pose_at(time), &motion.reference_point)
}

#[test]
fn a_box_that_falls_on_a_box_stops_at_the_minimum_gap() {
    let (body, floor) = (mesh(cuboid([0.1; 3])), mesh(cuboid([1.0, 1.0, 0.1])));
    let motion = straight(
        Pose::translation(0.03, 0.01, 0.5),
        translation(0.0, 0.0, -1.0),
    );
    let time = impact(search(&body, &motion, &floor, &Pose::identity()));
    let exact = 0.3 - SETTINGS.minimum_gap;
    assert!(
        time <= exact && exact - time <= SETTINGS.gap_tolerance,
        "{time} {exact}"
    );
}

#[test]
fn a_turning_bar_stops_where_its_corner_meets_the_floor() {
    // A bar along x, turning about y by 1 rad: its lowest corner (a, -b) comes to z = -(a sin t + b cos t).
    let (bar, floor) = (
        mesh(cuboid([0.1, 0.02, 0.01])),
        mesh(cuboid([1.0, 1.0, 0.1])),
    );
    let motion = straight(
        Pose::translation(0.0, 0.0, 0.15),
        six(&Vector3::zeros(), &Vector3::new(0.0, 1.0, 0.0)),
    );
    let time = impact(search(&bar, &motion, &floor, &Pose::identity()));
    let lowest = |t: f64| 0.05 - 0.1 * t.sin() - 0.01 * t.cos();
    assert!(
        lowest(time) >= SETTINGS.minimum_gap
            && lowest(time) <= SETTINGS.minimum_gap + SETTINGS.gap_tolerance,
        "{}",
        lowest(time)
    );
}

#[test]
fn nan_stops_the_motion() {
    let b = mesh(cuboid([0.1; 3]));
    let far = Pose::translation(0.0, 0.0, 5.0);
    let nan_pose = Pose::translation(0.0, f64::NAN, 5.0);
    let stopped = TimeOfImpact::Impact { time: 0.0 };
    assert_eq!(
        search(
            &b,
            &straight(far, translation(f64::NAN, 0.0, 0.0)),
            &b,
            &Pose::identity()
        ),
        stopped
    );
    assert_eq!(
        search(
            &b,
            &straight(nan_pose, translation(0.1, 0.0, 0.0)),
            &b,
            &Pose::identity()
        ),
        stopped
    );
    assert_eq!(
        search(
            &b,
            &straight(far, translation(0.1, 0.0, 0.0)),
            &b,
            &nan_pose
        ),
        stopped
    );
}

#[test]
fn crossing_surfaces_overlap() {
    let b = mesh(cuboid([0.1; 3]));
    let motion = straight(
        Pose::translation(0.15, 0.03, 0.01),
        translation(1.0, 0.0, 0.0),
    );
    assert_eq!(
        search(&b, &motion, &b, &Pose::identity()),
        TimeOfImpact::Overlapping
    );
}

#[test]
fn a_body_at_rest_distance_or_minimum_gap_slides_and_leaves_freely() {
    let (body, floor) = (
        mesh(grid_box([0.05; 3], [6, 6, 1])),
        mesh(grid_box([0.5, 0.5, 0.1], [40, 40, 1])),
    );
    for gap in [10e-6, SETTINGS.minimum_gap, 0.3 * SETTINGS.minimum_gap] {
        let start = Pose::translation(0.013, 0.007, 0.15 + gap);
        for d in [
            translation(0.02, 0.013, 0.0),
            translation(0.0, 0.0, 1e-3),
            translation(-0.01, 0.0, 1e-6),
        ] {
            assert_eq!(
                search(&body, &straight(start, d), &floor, &Pose::identity()),
                TimeOfImpact::Separated,
                "{gap} {d}"
            );
        }
        let spin = six(&Vector3::zeros(), &Vector3::new(0.0, 0.0, 0.7));
        assert_eq!(
            search(&body, &straight(start, spin), &floor, &Pose::identity()),
            TimeOfImpact::Separated,
            "{gap}"
        );
    }
}

/// Where it would be stopped if it came there it is not stopped if it starts there: a ball of facets on one of its corners rolls, and is as high or lower at
/// no other place.
#[test]
fn a_body_that_starts_where_a_search_ends_is_free_to_leave() {
    let radius = 0.05;
    let (ball, floor) = (
        mesh(icosphere(radius, 2)),
        mesh(grid_box([0.5, 0.5, 0.1], [9, 9, 1])),
    );
    let corner = ball.vertices()[0].coords;
    let down = UnitQuaternion::rotation_between(&corner, &-Vector3::z()).expect("not opposite");
    for k in 0..=20 {
        let gap = SETTINGS.minimum_gap + SETTINGS.gap_tolerance * f64::from(k) / 20.0;
        let start = Pose::from_parts(
            Vector3::new(0.013, 0.007, 0.1 + corner.norm() + gap).into(),
            down,
        );
        for (spin, up) in [(0.5, 0.0), (0.5, 1e-6), (0.1, 0.0), (-1.2, 1e-5)] {
            let roll = six(
                &Vector3::new(radius * spin, 0.0, up),
                &(Vector3::y() * spin),
            );
            assert_eq!(
                search(&ball, &straight(start, roll), &floor, &Pose::identity()),
                TimeOfImpact::Separated,
                "{gap:e} {spin} {up}"
            );
        }
    }
}

#[test]
fn a_body_that_is_pushed_for_ever_keeps_the_minimum_gap() {
    let (body, floor) = (
        mesh(icosphere(0.05, 2)),
        mesh(grid_box([0.5, 0.5, 0.1], [3, 3, 1])),
    );
    let mut workspace = CollisionWorkspace::new();
    let mut pose = Pose::translation(0.0, 0.0, 0.16);
    for k in 0..2000 {
        let u = f64::from(k) * 0.1;
        let displacement = six(
            &Vector3::new(1e-3 * u.cos(), 1e-3 * u.sin(), -2e-3),
            &Vector3::new(0.01 * u.sin(), 0.02, -0.01),
        );
        let motion = straight(pose, displacement);
        let found = time_of_impact(
            &body,
            &motion,
            &floor,
            &Pose::identity(),
            &SETTINGS,
            &mut workspace,
            &mut Work::default(),
        );
        let time = match found {
            TimeOfImpact::Separated => 1.0,
            TimeOfImpact::Impact { time } => time,
            other => panic!("{other:?}"),
        };
        pose = motion.pose_at(time);
        assert!(
            distance(&body, &pose, &floor, &Pose::identity()) >= SETTINGS.minimum_gap,
            "step {k}"
        );
    }
}

#[test]
fn a_peg_turns_and_slides_in_its_hole() {
    let (body, ring) = (
        mesh(peg(8e-3, 0.025, 72)),
        mesh(hole(8.06e-3, 0.025, 0.02, 72)),
    );
    // Clearance over the flats: 52 um.
    let slide = six(&Vector3::new(0.0, 0.0, 0.03), &Vector3::new(0.0, 0.0, 2.0));
    assert_eq!(
        search(
            &body,
            &straight(Pose::identity(), slide),
            &ring,
            &Pose::identity()
        ),
        TimeOfImpact::Separated
    );
    let tilt = six(&Vector3::zeros(), &Vector3::new(0.01, 0.0, 0.0));
    let time = impact(search(
        &body,
        &straight(Pose::identity(), tilt),
        &ring,
        &Pose::identity(),
    ));
    // The wall ends at 20 mm: 52..60 um of clearance allow 2.6..3 mrad of tilt.
    assert!((0.25..0.31).contains(&time), "{time}");
}

fn shapes() -> Vec<Mesh> {
    vec![
        mesh(cuboid([0.05, 0.03, 0.02])),
        mesh(tetrahedron(0.08)),
        mesh(icosphere(0.04, 1)),
        mesh(torus(0.05, 0.015, 12, 8)),
        mesh(peg(0.02, 0.05, 9)),
        mesh(hole(0.02, 0.06, 0.02, 10)),
    ]
}

fn parry_triangles(m: &Mesh, pose: &Pose) -> Vec<parry3d_f64::shape::Triangle> {
    let point = |p: &Point3<f64>| {
        let q = pose * p;
        parry3d_f64::math::Vector::new(q.x, q.y, q.z)
    };
    (0..m.triangles().len() as u32)
        .map(|t| m.corners(t))
        .map(|c| parry3d_f64::shape::Triangle::new(point(&c[0]), point(&c[1]), point(&c[2])))
        .collect()
}

/// An independent check: some pair of triangles intersects by parry.
fn parry_intersects(a: &Mesh, a_pose: &Pose, b: &Mesh, b_pose: &Pose) -> bool {
    let (a, b) = (parry_triangles(a, a_pose), parry_triangles(b, b_pose));
    let identity = parry3d_f64::math::Pose::identity();
    let bounds = |t: &parry3d_f64::shape::Triangle| t.local_aabb();
    let b: Vec<_> = b.iter().map(|t| (bounds(t), t)).collect();
    a.iter().any(|t| {
        let box_t = bounds(t);
        use parry3d_f64::bounding_volume::BoundingVolume;
        b.iter().any(|(box_s, s)| {
            box_t.intersects(box_s)
                && parry3d_f64::query::intersection_test(&identity, t, &identity, *s)
                    .expect("parry knows triangles")
                    .intersecting
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_pair_of_meshes_comes_near_before_the_time_and_some_is_near_at_it(
        which in (0..6_usize, 0..6_usize), from in vector(1.0), turn in vector(3.0), miss in vector(0.03), spin in vector(1.5),
        obstacle_turn in vector(3.0), reference in vector(0.05), world in vector(1.0),
    ) {
        let shapes = shapes();
        let (body, obstacle) = (&shapes[which.0], &shapes[which.1]);
        let obstacle_pose = Pose::new(world, obstacle_turn);
        let start = world + from.normalize() * 0.2;
        let displacement = six(&((world + miss - start) * 1.3), &spin);
        let motion = Motion { start: Pose::new(start, turn), displacement, reference_point: Point3::from(reference) };
        prop_assume!(!meshes_intersect(body, &body_pose(&motion, 0.0), obstacle, &obstacle_pose));
        prop_assume!(distance(body, &body_pose(&motion, 0.0), obstacle, &obstacle_pose) > 2e-6);

        let found = search(body, &motion, obstacle, &obstacle_pose);
        let end = match found {
            TimeOfImpact::Separated => 1.0,
            // Bodies that graze at nearly the minimum gap use up the iterations: early, and as safe.
            TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
            TimeOfImpact::Overlapping => return Err(TestCaseError::fail("they start apart")),
        };
        for k in 0..=60 {
            let pose = body_pose(&motion, end * f64::from(k) / 60.0);
            let gap = distance(body, &pose, obstacle, &obstacle_pose);
            prop_assert!(gap >= SETTINGS.minimum_gap, "{gap:e} at {k}");
            if k % 6 == 0 {
                prop_assert!(!parry_intersects(body, &pose, obstacle, &obstacle_pose), "parry, at {k}");
            }
        }
        if matches!(found, TimeOfImpact::Impact { .. }) {
            let gap = distance(body, &body_pose(&motion, end), obstacle, &obstacle_pose);
            prop_assert!(gap <= SETTINGS.minimum_gap + SETTINGS.gap_tolerance, "early: {gap:e}");
        }
    }

    #[test]
    fn the_answer_does_not_hang_on_hints_or_intervals(
        which in (0..6_usize, 0..6_usize), from in vector(1.0), turn in vector(3.0), spin in vector(1.0), edges in 0.05..5.0,
    ) {
        let shapes = shapes();
        let (body, obstacle) = (&shapes[which.0], &shapes[which.1]);
        let start = from.normalize() * 0.2;
        let motion = straight(Pose::new(start, turn), six(&(-start * 1.2), &spin));
        prop_assume!(!meshes_intersect(body, &motion.start, obstacle, &Pose::identity()));
        let mut workspace = CollisionWorkspace::new();
        let mut run = |interval_edges: f64| {
            let settings = AdvancementSettings { interval_edges, ..SETTINGS };
            match time_of_impact(body, &motion, obstacle, &Pose::identity(), &settings, &mut workspace, &mut Work::default()) {
                TimeOfImpact::Separated => (1.0, true),
                TimeOfImpact::Impact { time } => (time, true),
                TimeOfImpact::IterationLimit { time } => (time, false),
                TimeOfImpact::Overlapping => panic!("they start apart"),
            }
        };
        let answers = [run(0.5), run(0.5), run(edges)];
        let finished = |&&(_, finished): &&(f64, bool)| finished;
        for (time, _) in answers {
            prop_assert!(distance(body, &motion.pose_at(time), obstacle, &Pose::identity()) >= SETTINGS.minimum_gap);
        }
        let first = answers.iter().find(finished);
        for (time, _) in answers.iter().filter(finished) {
            // Slow grazing stretches the tolerance in time, not in distance.
            prop_assert!(first.is_some_and(|(first, _)| (time - first).abs() < 1e-2), "{answers:?}");
        }
    }
}

/// Columns of `bunny_contacts.csv`: mesh, kind, p, q (x y z w), v, w, first contact.
#[test]
#[allow(
    clippy::disallowed_methods,
    reason = "tests may read files; the method may not"
)]
fn no_contact_of_the_bunnies_is_late_or_far_early() {
    let Some(text) = geometry_shapes::data_dir()
        .and_then(|d| std::fs::read_to_string(d.join("bunny_contacts.csv")).ok())
    else {
        taut_test_kit::left_out("bunny_contacts.csv is not in the test data");
        return;
    };
    // The file's times are those of touching, to 2 nm.
    let settings = AdvancementSettings {
        minimum_gap: 2e-8,
        gap_tolerance: 2e-9,
        ..SETTINGS
    };
    let mut meshes = std::collections::HashMap::new();
    let (mut compared, mut worst_early): (u32, f64) = (0, 0.0);
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        // No time: no contact.
        let n: Vec<f64> = fields[2..16]
            .iter()
            .map(|f| {
                if f.is_empty() {
                    f64::INFINITY
                } else {
                    f.parse().expect("a number")
                }
            })
            .collect();
        let bunny = meshes.entry(fields[0].to_owned()).or_insert_with(|| {
            mesh(geometry_shapes::read_ply(fields[0]).expect("the mesh lies beside the queries"))
        });
        let rotation = god_object::nalgebra::UnitQuaternion::new_normalize(
            god_object::nalgebra::Quaternion::new(n[6], n[3], n[4], n[5]),
        );
        let start = Pose::from_parts(
            god_object::nalgebra::Translation3::new(n[0], n[1], n[2]),
            rotation,
        );
        let displacement = Vector6::new(n[7], n[8], n[9], n[10], n[11], n[12]);
        let expected = n[13];
        let motion = straight(start, displacement);
        let found = time_of_impact(
            &*bunny,
            &motion,
            &*bunny,
            &Pose::identity(),
            &settings,
            &mut CollisionWorkspace::new(),
            &mut Work::default(),
        );
        let contact = (0.0..=1.0).contains(&expected);
        match found {
            TimeOfImpact::Impact { time } if contact => {
                assert!(time <= expected, "late: {time} after {expected}: {line}");
                let gap = distance(bunny, &motion.pose_at(time), bunny, &Pose::identity());
                assert!(
                    gap >= settings.minimum_gap
                        && gap <= settings.minimum_gap + settings.gap_tolerance,
                    "{gap:e}: {line}"
                );
                worst_early = worst_early.max(expected - time);
            }
            TimeOfImpact::Separated if !contact => {}
            other => panic!("{other:?}, expected {expected}: {line}"),
        }
        compared += 1;
    }
    println!("{compared} motions, none late; earliest by {worst_early:e} of the motion");
    assert!(compared > 0);
}
