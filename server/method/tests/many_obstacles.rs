//! Many meshes about a body: what a search costs is what is near, whatever the order of the obstacles and whatever is far away.

use std::sync::Arc;

use crate::geometry_shapes::{cuboid, icosphere, mesh};
use crate::support::box_on_table;
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::nalgebra::{Matrix3, Point3, Vector3};
use god_object::spatial::six;
use god_object::{
    Body, Coupling, GodObject, Mesh, Obstacle, Pose, Settings, Surface, Vector6, World,
};

const PEBBLES: usize = 40;
const UPDATES: u32 = 120;
/// Between a leaf and the next, rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

fn ball() -> Mesh {
    mesh(icosphere(0.02, 2))
}

/// Small balls, evenly spread over a sphere of this radius, m, about the origin.
fn pebbles(radius: f64) -> Vec<Obstacle> {
    let pebble = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / PEBBLES as f64;
        let angle = GOLDEN_ANGLE * (k as f64 + 0.5);
        let across = (1.0 - z * z).sqrt();
        let out = Vector3::new(across * angle.cos(), across * angle.sin(), z);
        Obstacle {
            name: format!("pebble {k}"),
            mesh: mesh(icosphere(6e-3, 2)),
            primitive: None,
            pose: Pose::new(out * radius, out * 3.0),
            surface: Surface::default(),
        }
    };
    (0..PEBBLES).map(pebble).collect()
}

/// What a ball that is pulled about among obstacles does.
struct Course {
    wrenches: Vec<Vector6>,
    work: Work,
    substeps: u32,
}

impl Course {
    /// Where the hand goes up to so far from the middle, m; the body is free for 4 mm.
    fn among(obstacles: Vec<Obstacle>, far: f64) -> Self {
        let body = Body {
            mesh: ball(),
            primitive: None,
            mass: 0.2,
            inertia: Matrix3::identity() * 4e-5,
            reference_point: Point3::origin(),
        };
        let world = Arc::new(World { body, obstacles });
        let settings = Settings::for_size(0.04);
        let start = Pose::identity();
        let mut god_object = GodObject::new(world.clone(), settings, start).expect("a free start");
        let mut coupling = Coupling::new(&world, &settings);
        let mut course = Self {
            wrenches: Vec::new(),
            work: Work::default(),
            substeps: 0,
        };
        for update in 0..UPDATES {
            let u = 0.05 * f64::from(update);
            let place = Vector3::new(u.cos(), u.sin(), 0.6 * (0.7 * u).sin()) * far;
            let device = Pose::new(place, Vector3::new(0.1 * u, -0.05 * u, 0.0));
            let report = god_object.step(&device, None);
            course.work += report.work;
            course.substeps += report.substeps;
            let set = god_object.constraint_set();
            let felt = coupling.step(1e-3 * f64::from(update), &device, set);
            course.wrenches.push(felt.wrench);
        }
        course
    }

    /// The largest difference of wrenches, N and N m: after the first update, and after all others.
    fn off(&self, other: &Self) -> [f64; 2] {
        let both = self.wrenches.iter().zip(&other.wrenches);
        let mut off = both.map(|(a, b)| (a - b).norm());
        [off.next().unwrap_or(0.0), off.fold(0.0, f64::max)]
    }

    /// Pairs of triangles and of features, and steps with them: what two surfaces cost that are near each other.
    fn near_work(&self) -> [u64; 3] {
        let work = &self.work;
        [
            work.triangle_pairs,
            work.feature_pairs,
            work.advancement_steps,
        ]
    }
}

/// Whether counts are the same to some percent, for hints of where the first impact may be.
fn alike(a: u64, b: u64) -> bool {
    a.abs_diff(b) <= a / 20
}

/// Pressed in by no more than a pebble's radius: deeper, a ball on a ball tips over to either side, and rounding says to which.
#[test]
fn forces_and_work_do_not_depend_on_the_order_of_the_obstacles() {
    let near = pebbles(0.03);
    for (far, at_least) in [(0.006, 0.5), (0.008, 0.9), (0.010, 1.4)] {
        let course = Course::among(near.clone(), far);
        let largest = course
            .wrenches
            .iter()
            .map(Vector6::norm)
            .fold(0.0, f64::max);
        assert!(largest > at_least, "{largest} N");
        for places in [1, 7, 13, PEBBLES / 2] {
            let mut other = near.clone();
            other.rotate_left(places);
            if places < PEBBLES / 2 {
                other.reverse();
            }
            let other = Course::among(other, far);
            // A row that an answer violates by less than the tolerance of rows may be known or not. The first update jumps by millimetres: where the
            // body grazes it stops within the gap tolerance, at one place or another.
            let [first, others] = course.off(&other);
            assert!(first < 1e-3 && others < 2e-5, "{first:e} {others:e} N");
            assert_eq!(course.substeps, other.substeps);
            let (work, others) = (course.near_work(), other.near_work());
            for (a, b) in work.into_iter().zip(others) {
                assert!(alike(a, b), "{work:?} {others:?}");
            }
            let [a, b] = [course.work, other.work].map(|work| work.node_pairs);
            assert!(alike(a, b), "{a} {b}");
        }
    }
}

#[test]
fn obstacles_far_away_change_no_force_and_cost_nothing() {
    let near = pebbles(0.03);
    let course = Course::among(near.clone(), 0.02);
    let far = pebbles(10.0);
    for first in [false, true] {
        let more = if first {
            [far.clone(), near.clone()].concat()
        } else {
            [near.clone(), far.clone()].concat()
        };
        let other = Course::among(more, 0.02);
        assert_eq!(course.off(&other), [0.0; 2]);
        assert_eq!(course.work, other.work);
    }
}

/// A ball that is swept about and turned far away, by 0.2 m in each update: the sets near by look no farther ahead for it, and what sticks stays.
#[test]
fn an_obstacle_that_moves_far_away_changes_nothing_near_by() {
    for friction in [0.0, 0.5] {
        let mut near = World::clone(&box_on_table());
        near.obstacles[0].surface.friction = friction;
        let mut both = near.clone();
        both.obstacles.extend(pebbles(10.0).into_iter().take(1));
        let settings = Settings::for_size(0.04);
        let start = Pose::translation(0.0, 0.0, 0.03);
        let mut led = [near, both]
            .map(|world| GodObject::new(Arc::new(world), settings, start).expect("a free start"));
        let far = led[1].obstacle_poses().last().copied().expect("a ball");
        for update in 0..300 {
            let u = f64::from(update);
            let (aside, down) = ((u - 100.0).clamp(0.0, 100.0), u.min(100.0));
            let device = Pose::translation(2e-6 * aside, 0.0, 0.03 - 2.2e-4 * down);
            let swept = Vector3::new(0.2 * u.sin(), 0.0, 0.2 * u.cos());
            led[1].move_obstacle(1, &(far * Pose::new(swept, Vector3::y() * u)));
            for god_object in &mut led {
                let report = god_object.step(&device, None);
                assert_eq!(report.obstacles_blocked, 0);
                let within = god_object.constraint_set().complete_within;
                assert!(update < 250 || within < 1e-3, "{friction}: {within} m");
            }
        }
        let [alone, beside] = led.map(|god_object| god_object.pose().translation.vector);
        let off = (alone - beside).norm();
        assert!(off < 0.1 * settings.rest_distance, "{friction}: {off} m");
    }
}

/// The twin is out of reach, but the box about both pebbles holds the body: it is searched in full.
#[test]
fn what_a_motion_cannot_reach_is_free_to_a_full_search_and_costs_nothing() {
    let bar = mesh(cuboid([0.05, 0.004, 0.003]));
    let (vertices, triangles) = icosphere(6e-3, 1);
    let twin = vertices.iter().map(|v| v - Vector3::repeat(10.0));
    let after = vertices.len() as u32;
    let of_twin = triangles.iter().map(|t| t.map(|v| v + after));
    let both = mesh((
        vertices.iter().copied().chain(twin).collect(),
        triangles.iter().copied().chain(of_twin).collect(),
    ));
    let pebble = mesh((vertices, triangles));
    let settings = AdvancementSettings::default();
    let (mut left_alone, mut stopped) = (0, 0);
    for k in 0..600 {
        let u = f64::from(k);
        let aside = Vector3::new(u.sin(), (1.7 * u).sin(), (2.3 * u).sin());
        let out = aside.map(|x| 0.2 + x.abs()).normalize();
        let distance = 0.02 + 0.1 * (0.37 * u).sin().abs();
        let at = Pose::new(out * distance, Vector3::zeros());
        let motion = Motion {
            start: Pose::rotation(aside * 2.0),
            displacement: six(&(out * 0.02), &(aside.yzx() * 3.0)),
            reference_point: Point3::new(0.01, 0.0, 0.0),
        };
        let [(found, work), (expected, full)] = [&pebble, &both].map(|obstacle| {
            let (mut workspace, mut work) = (CollisionWorkspace::new(), Work::default());
            let found = time_of_impact(
                &bar,
                &motion,
                obstacle,
                &at,
                &settings,
                &mut workspace,
                &mut work,
            );
            (found, work)
        });
        assert!(full.node_pairs > 0);
        if work == Work::default() {
            assert_eq!([found, expected], [TimeOfImpact::Separated; 2], "{k}");
            left_alone += 1;
        }
        stopped += u32::from(matches!(expected, TimeOfImpact::Impact { .. }));
    }
    assert!(left_alone > 200 && stopped > 40, "{left_alone} {stopped}");
}

#[test]
fn searches_of_many_obstacles_cost_what_each_one_costs_alone() {
    let (body, obstacles) = (ball(), pebbles(0.03));
    let mut shared = CollisionWorkspace::for_obstacles(PEBBLES);
    let mut alone = vec![CollisionWorkspace::new(); PEBBLES];
    let settings = AdvancementSettings::default();
    for update in 0..3 {
        let motion = Motion {
            start: Pose::translation(1e-4 * f64::from(update), 0.0, 0.0),
            displacement: six(&(Vector3::x() * 1e-4), &Vector3::zeros()),
            reference_point: Point3::origin(),
        };
        for (index, (obstacle, own)) in obstacles.iter().zip(&mut alone).enumerate() {
            let [(found, work), (expected, least)] =
                [shared.of_obstacle(index), own].map(|workspace| {
                    let mut work = Work::default();
                    let (other, at) = (&obstacle.mesh, &obstacle.pose);
                    let found =
                        time_of_impact(&body, &motion, other, at, &settings, workspace, &mut work);
                    (found, work)
                });
            assert_eq!(found, expected);
            assert_eq!(work, least, "{index} in update {update}");
        }
    }
}
