//! Time of impact of spiky, hollow, thin and far meshes: what does not face is left out, and nothing is missed by it.

use crate::geometry_shapes::{cuboid, grid_box, icosphere, mesh, peg, torus};
use crate::mesh_distance::distance;
use crate::mesh_impact::{SETTINGS, search, straight, vector};
use god_object::collision::{
    CollisionWorkspace, Motion, TimeOfImpact, Work, meshes_intersect, time_of_impact,
};
use god_object::geometry::Mesh;
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, from_reference_point, six};
use proptest::prelude::*;

/// A sphere whose vertices stand out or in by up to `spikes` of the radius: saddles, hollows and needles.
fn spiky(radius: f64, spikes: f64, seed: u64) -> Mesh {
    let (vertices, triangles) = icosphere(radius, 2);
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let vertices = vertices
        .iter()
        .map(|v| v * (1.0 + spikes * (2.0 * random() - 1.0)))
        .collect();
    Mesh::new(vertices, triangles).expect("a star-shaped surface is closed")
}

/// No distance below the gap before the time found, and that gap at it: by a distance that knows no cones.
fn check(body: &Mesh, motion: &Motion, obstacle: &Mesh, pose: &Pose) -> Result<(), TestCaseError> {
    let at = |time: f64| from_reference_point(&motion.pose_at(time), &motion.reference_point);
    let gap = |time: f64| distance(body, &at(time), obstacle, pose);
    let found = search(body, motion, obstacle, pose);
    let end = match found {
        TimeOfImpact::Separated => 1.0,
        TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
        TimeOfImpact::Overlapping => return Err(TestCaseError::fail("they start apart")),
    };
    for k in 0..=80 {
        let time = end * f64::from(k) / 80.0;
        let least = gap(time);
        prop_assert!(
            least >= SETTINGS.minimum_gap,
            "{least:e} at {time} of {end}"
        );
    }
    if matches!(found, TimeOfImpact::Impact { .. }) {
        let reached = gap(end);
        prop_assert!(
            reached <= SETTINGS.minimum_gap + SETTINGS.gap_tolerance,
            "early: {reached:e}"
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn spiky_bodies_meet_where_their_distance_says(
        seeds in (1..1000_u64, 1..1000_u64), spikes in (0.0..0.6_f64, 0.0..0.6_f64), from in vector(1.0), turn in vector(3.0),
        miss in vector(0.03), spin in vector(2.0), reference in vector(0.05),
    ) {
        let (body, obstacle) = (spiky(0.05, spikes.0, seeds.0), spiky(0.04, spikes.1, seeds.1));
        let start = from.normalize() * 0.2;
        let motion = Motion {
            start: Pose::new(start, turn),
            displacement: six(&((miss - start) * 1.4), &spin),
            reference_point: Point3::from(reference),
        };
        let first = from_reference_point(&motion.start, &motion.reference_point);
        prop_assume!(!meshes_intersect(&body, &first, &obstacle, &Pose::identity()));
        prop_assume!(distance(&body, &first, &obstacle, &Pose::identity()) > 2e-6);
        check(&body, &motion, &obstacle, &Pose::identity())?;
    }

    #[test]
    fn a_body_inside_a_hollow_meets_its_wall(seed in 1..1000_u64, along in vector(1.0), turn in vector(3.0), spin in vector(1.0)) {
        // Inside the hole of a torus: all its wall there is saddle-shaped.
        let (body, ring) = (spiky(0.01, 0.4, seed), mesh(torus(0.04, 0.02, 40, 24)));
        let motion = straight(Pose::rotation(turn), six(&(along * 0.02), &spin));
        prop_assume!(!meshes_intersect(&body, &motion.start, &ring, &Pose::identity()));
        check(&body, &motion, &ring, &Pose::identity())?;
    }

    #[test]
    fn meshes_a_kilometre_from_their_own_origin_meet_as_near_it(
        seed in 1..1000_u64, from in vector(1.0), turn in vector(3.0), spin in vector(1.0), far in vector(1000.0),
    ) {
        let (body, obstacle) = (spiky(0.05, 0.3, seed), spiky(0.04, 0.3, seed + 1));
        let moved = |m: &Mesh| {
            let vertices = m.vertices().iter().map(|v| v + far).collect();
            Mesh::new(vertices, m.triangles().to_vec()).expect("the same surface elsewhere")
        };
        // The reference point is the body's middle; the obstacle's middle is the world's origin.
        let start = from.normalize() * 0.2;
        let motion = Motion {
            start: Pose::new(start, turn),
            displacement: six(&(-start), &spin),
            reference_point: Point3::from(far),
        };
        let obstacle_pose = Pose::translation(-far.x, -far.y, -far.z);
        check(&moved(&body), &motion, &moved(&obstacle), &obstacle_pose)?;
    }

    #[test]
    fn slivers_and_fans_are_met_like_any_triangle(sides in 3..40_u32, from in vector(1.0), turn in vector(3.0), spin in vector(1.0)) {
        // Needles as long as the peg, and caps whose middle has more sides than anyone looks at.
        let (body, obstacle) = (mesh(peg(0.02, 0.05, sides)), mesh(peg(0.03, 1e-3, 2 * sides)));
        let start = from.normalize() * 0.2;
        let motion = straight(Pose::new(start, turn), six(&(-start * 1.2), &spin));
        check(&body, &motion, &obstacle, &Pose::identity())?;
    }
}

#[test]
fn a_sliver_a_billionth_as_high_as_long_is_met() {
    // The top of a box in two slivers and a triangle on either side.
    let (a, height) = (0.05, 1e-10);
    let top = [[-a, -a], [a, -a], [a, a], [-a, a], [0.0, height]].map(|p| [p[0], p[1], a]);
    let bottom = [[-a, -a], [a, -a], [a, a], [-a, a]].map(|p| [p[0], p[1], -a]);
    let vertices: Vec<Point3<f64>> = top
        .iter()
        .chain(&bottom)
        .chain(&[[-a, 0.0, a], [a, 0.0, a]])
        .map(|p| Point3::from(*p))
        .collect();
    let triangles = vec![
        [9, 10, 4],
        [10, 2, 4],
        [2, 3, 4],
        [3, 9, 4],
        [9, 0, 10],
        [0, 1, 10],
        [0, 5, 1],
        [1, 5, 6],
        [1, 6, 10],
        [10, 6, 7],
        [10, 7, 2],
        [2, 7, 8],
        [2, 8, 3],
        [3, 8, 9],
        [9, 8, 5],
        [9, 5, 0],
        [5, 8, 6],
        [6, 8, 7],
    ];
    let obstacle = Mesh::new(vertices, triangles).expect("a closed box");
    let body = mesh(cuboid([0.01; 3]));
    for x in [0.0, 0.02, -0.03] {
        let motion = straight(
            Pose::new(Vector3::new(x, 0.0, 0.1), Vector3::new(0.6, 0.615, 0.1)),
            six(&Vector3::new(0.0, 0.0, -0.1), &Vector3::zeros()),
        );
        check(&body, &motion, &obstacle, &Pose::identity()).expect("met at the gap");
        assert!(matches!(
            search(&body, &motion, &obstacle, &Pose::identity()),
            TimeOfImpact::Impact { .. }
        ));
    }
}

#[test]
fn surfaces_that_cross_are_told_whatever_was_searched_before() {
    let (body, obstacle) = (
        mesh(grid_box([0.05; 3], [8; 3])),
        mesh(grid_box([0.1; 3], [5; 3])),
    );
    let mut workspace = CollisionWorkspace::new();
    let mut find = |x: f64, step: f64| {
        let motion = straight(
            Pose::translation(x, 0.013, 0.008),
            six(&Vector3::new(step, 0.0, 0.0), &Vector3::zeros()),
        );
        let (settings, work) = (&SETTINGS, &mut Work::default());
        time_of_impact(
            &body,
            &motion,
            &obstacle,
            &Pose::identity(),
            settings,
            &mut workspace,
            work,
        )
    };
    assert!(matches!(find(0.2, -0.1), TimeOfImpact::Impact { .. }));
    // Beyond what was found free, and beside it.
    assert_eq!(find(0.14, 0.1), TimeOfImpact::Overlapping);
    assert_eq!(find(0.1499, -0.1), TimeOfImpact::Overlapping);
    assert!(matches!(find(0.151, -0.1), TimeOfImpact::Impact { .. }));
    assert_eq!(find(0.151, 0.1), TimeOfImpact::Separated);
}

#[test]
fn a_body_within_the_gap_at_the_start_keeps_what_there_is_and_slides() {
    let (body, obstacle) = (spiky(0.05, 0.2, 3), spiky(0.2, 0.02, 4));
    let above = |gap: f64| {
        // Down to a given distance, by bisection.
        let (mut low, mut high) = (0.1, 0.5);
        for _ in 0..60 {
            let z = 0.5 * (low + high);
            let pose = Pose::translation(0.0, 0.0, z);
            if distance(&body, &pose, &obstacle, &Pose::identity()) > gap {
                high = z;
            } else {
                low = z;
            }
        }
        Pose::translation(0.0, 0.0, high)
    };
    for gap in [3e-7, 1e-7, 1e-8] {
        let start = above(gap);
        let at_start = distance(&body, &start, &obstacle, &Pose::identity());
        let up = straight(start, six(&Vector3::z(), &Vector3::new(0.1, 0.0, 0.0)));
        let leaves = search(&body, &up, &obstacle, &Pose::identity());
        assert_eq!(leaves, TimeOfImpact::Separated, "{gap:e}");
        let down = straight(
            start,
            six(&Vector3::new(0.001, 0.0, -0.01), &Vector3::zeros()),
        );
        let time = match search(&body, &down, &obstacle, &Pose::identity()) {
            TimeOfImpact::Impact { time } => time,
            other => panic!("{other:?}"),
        };
        let kept = distance(&body, &down.pose_at(time), &obstacle, &Pose::identity());
        assert!(kept >= 0.89 * at_start, "{kept:e} of {at_start:e}");
    }
}

#[test]
fn plates_of_a_metre_that_slide_three_micrometres_apart_are_told_apart_by_their_volumes() {
    let plate = mesh(grid_box([0.5, 0.5, 0.01], [100, 100, 1]));
    let frame = Pose::new(Vector3::new(0.3, -0.2, 0.7), Vector3::new(0.4, 1.1, -0.6));
    let above = frame * Pose::translation(1.7e-3, 0.9e-3, 0.02 + 3e-6);
    let along = frame.rotation * Vector3::new(2e-3, 1e-3, 0.0);
    let mut work = Work::default();
    let found = time_of_impact(
        &plate,
        &straight(above, six(&along, &Vector3::zeros())),
        &plate,
        &frame,
        &SETTINGS,
        &mut CollisionWorkspace::new(),
        &mut work,
    );
    assert_eq!(found, TimeOfImpact::Separated);
    // Of the forty thousand triangles that lie on each other none is looked at.
    assert!(work.triangle_pairs < 100, "{work:?}");
}
