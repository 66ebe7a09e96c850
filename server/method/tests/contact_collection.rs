//! Contacts: every one that there is, none that there is not.

use std::collections::BTreeSet;

use crate::geometry_shapes::{cuboid, grid_box, hole, icosphere, mesh, peg, tetrahedron, torus};
use crate::mesh_distance::distance;
use god_object::collision::{CollisionWorkspace, Work, meshes_intersect};
use god_object::constraint::{Collected, Contact, Feature, collect_contacts};
use god_object::geometry::Mesh;
use god_object::nalgebra::{DMatrix, DVector, Point3, Vector3};
use god_object::spatial::Pose;
use proptest::prelude::*;

fn collect(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
    activation: f64,
    capacity: usize,
) -> (Vec<Contact>, Collected) {
    let mut out = Vec::with_capacity(capacity);
    let collected = collect_contacts(
        body,
        body_pose,
        obstacle,
        obstacle_pose,
        3,
        activation,
        &mut CollisionWorkspace::new(),
        &mut out,
        &mut Work::default(),
    );
    (out, collected)
}

/// A flat support: one normal only, and a contact at each corner of the overlap.
fn assert_same_cone(contacts: &[Contact], normal: &Vector3<f64>, hull: &[Point3<f64>]) {
    for c in contacts {
        assert!((c.normal - normal).norm() < 1e-12, "{c:?}");
    }
    for corner in hull {
        let found = contacts
            .iter()
            .any(|c| (c.point_on_obstacle - corner).norm() < 1e-9);
        assert!(found, "no contact at {corner}: {contacts:#?}");
    }
}

#[test]
fn a_box_on_a_plane_of_ten_thousand_triangles_feels_like_one_on_two() {
    let body = mesh(cuboid([0.05, 0.04, 0.03]));
    let (fine, coarse) = (
        mesh(grid_box([0.5, 0.5, 0.1], [50, 50, 1])),
        mesh(cuboid([0.5, 0.5, 0.1])),
    );
    assert!(fine.triangles().len() > 10_000);
    let gap = 1e-5;
    // Positions on cell borders, on a diagonal and anywhere.
    for (x, y, angle) in [
        (0.0, 0.0, 0.0),
        (0.03, 0.02, 0.0),
        (0.011, -0.007, 0.3),
        (0.05, 0.05, std::f64::consts::FRAC_PI_4),
    ] {
        let pose = Pose::new(Vector3::new(x, y, 0.13 + gap), Vector3::z() * angle);
        let hull: Vec<Point3<f64>> = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .map(|(i, j)| pose * Point3::new(0.05 * i, 0.04 * j, -0.03 - gap))
            .to_vec();
        let (on_fine, _) = collect(&body, &pose, &fine, &Pose::identity(), 1e-3, 1024);
        let (on_coarse, _) = collect(&body, &pose, &coarse, &Pose::identity(), 1e-3, 1024);
        for contacts in [&on_fine, &on_coarse] {
            assert_same_cone(contacts, &Vector3::z(), &hull);
            assert!(
                contacts
                    .iter()
                    .all(|c| hull.iter().any(|h| (c.point_on_obstacle - h).norm() < 1e-9)),
                "only the corners"
            );
            assert!(contacts.iter().all(|c| (c.gap - gap).abs() < 1e-15));
        }
    }
}

#[test]
fn a_finely_cut_body_on_a_plane_has_its_corners_only() {
    let (body, floor) = (
        mesh(grid_box([0.05; 3], [20, 20, 3])),
        mesh(cuboid([0.5, 0.5, 0.1])),
    );
    let (contacts, _) = collect(
        &body,
        &Pose::translation(0.01, 0.02, 0.15 + 1e-5),
        &floor,
        &Pose::identity(),
        1e-3,
        1024,
    );
    let corners: BTreeSet<Feature> = contacts.iter().map(|c| c.features.on_body).collect();
    assert_eq!(corners.len(), 4);
}

/// Crowned by 22 um over 0.1 m, cut so finely that no two faces meet at more than 1e-5 rad; and the same of single-precision corners that are not crowned.
#[test]
fn bends_that_add_up_are_felt_and_those_of_rounding_are_not() {
    let (cells, half, gap) = (120, 0.05, 1e-6);
    let table = mesh(cuboid([0.5, 0.5, 0.1]));
    for crown in [22e-6, 0.0] {
        let (mut vertices, triangles) = grid_box([half, half, 0.005], [cells, cells, 1]);
        for v in vertices.iter_mut().filter(|v| v.z < 0.0) {
            v.z += crown * 0.5 * (v.x * v.x + v.y * v.y) / (half * half);
            // Not along the axes, as a file would have it.
            *v = v.map(|c| f64::from(c as f32));
        }
        let plate = mesh((vertices, triangles));
        let steepest = plate.edges().iter().map(|e| e.convexity.abs());
        let bends = steepest.filter(|bend| *bend < 0.1).fold(0.0, f64::max);
        assert!(bends < 2e-5, "{bends}");
        let pose = Pose::translation(0.0, 0.0, 0.1 + 0.005 + gap);
        let (contacts, _) = collect(&plate, &pose, &table, &Pose::identity(), 1e-4, 4096);
        let nearest = contacts.first().expect("a contact").gap;
        let error = (nearest - gap).abs();
        assert!(error < 1e-7, "crown {crown}: nearest at {nearest} m");
        if crown == 0.0 {
            assert!(contacts.len() < 400, "{} contacts", contacts.len());
        }
    }
}

#[test]
fn a_box_over_the_rim_of_a_table_is_held_by_the_overlap() {
    let (body, table) = (mesh(cuboid([0.05; 3])), mesh(cuboid([0.5, 0.5, 0.1])));
    let gap = 1e-5;
    let (contacts, _) = collect(
        &body,
        &Pose::translation(0.5, 0.0, 0.15 + gap),
        &table,
        &Pose::identity(),
        1e-4,
        1024,
    );
    let hull = [(0.45, 0.05), (0.45, -0.05), (0.5, 0.05), (0.5, -0.05)]
        .map(|(x, y)| Point3::new(x, y, 0.1));
    assert_same_cone(&contacts, &Vector3::z(), &hull);
}

#[test]
fn a_sphere_in_a_corner_touches_both_walls_and_no_concave_edge() {
    let (body, ring) = (mesh(icosphere(0.01, 3)), mesh(hole(0.03, 0.06, 0.02, 4)));
    // The square hole has its corners on the axes; flats at distance 0.03 / sqrt 2. The sphere rests in the corner at +x.
    let x = 0.03 - 0.01 * 2.0_f64.sqrt() - 2e-4;
    let (contacts, _) = collect(
        &body,
        &Pose::translation(x, 0.0, 0.0),
        &ring,
        &Pose::identity(),
        5e-4,
        1024,
    );
    assert!(!contacts.is_empty());
    for c in &contacts {
        let walls = [
            Vector3::new(-1.0, -1.0, 0.0).normalize(),
            Vector3::new(-1.0, 1.0, 0.0).normalize(),
        ];
        assert!(walls.iter().any(|w| (c.normal - w).norm() < 1e-12), "{c:?}");
        assert!(matches!(c.features.on_obstacle, Feature::Face(_)));
    }
    assert!(
        [-0.5, 0.5]
            .iter()
            .all(|s| contacts.iter().any(|c| c.normal.y * s > 0.0))
    );
}

#[test]
fn a_peg_in_its_hole_touches_all_around_and_nowhere_else() {
    let (body, ring) = (
        mesh(peg(8e-3, 0.025, 72)),
        mesh(hole(8.06e-3, 0.025, 0.02, 72)),
    );
    let (contacts, collected) = collect(
        &body,
        &Pose::identity(),
        &ring,
        &Pose::identity(),
        1e-4,
        4096,
    );
    assert!(!collected.truncated && !contacts.is_empty());
    for c in &contacts {
        assert!(
            c.normal.z.abs() < 1e-9 && c.normal.dot(&c.point_on_obstacle.coords) < 0.0,
            "{c:?}"
        );
    }
    let sectors: BTreeSet<i64> = contacts
        .iter()
        .map(|c| (c.normal.y.atan2(c.normal.x) * 12.0 / std::f64::consts::TAU).floor() as i64)
        .collect();
    assert!(sectors.len() >= 12);
}

#[test]
fn a_full_set_keeps_the_nearest_and_says_so() {
    let (body, ring) = (
        mesh(peg(8e-3, 0.025, 72)),
        mesh(hole(8.06e-3, 0.025, 0.02, 72)),
    );
    let pose = Pose::translation(2e-5, 1e-5, 0.0);
    let (all, whole) = collect(&body, &pose, &ring, &Pose::identity(), 2e-4, 4096);
    let (some, part) = collect(&body, &pose, &ring, &Pose::identity(), 2e-4, 10);
    assert!(!whole.truncated && part.truncated && some.len() >= 10 && some.len() < all.len());
    assert_eq!(some[..], all[..some.len()]);
    assert_eq!(whole.gap_min, part.gap_min);
}

#[test]
fn bodies_far_apart_have_no_contact_and_no_gap() {
    let b = mesh(cuboid([0.1; 3]));
    let (contacts, collected) = collect(
        &b,
        &Pose::translation(1.0, 0.0, 0.0),
        &b,
        &Pose::identity(),
        1e-2,
        16,
    );
    assert!(contacts.is_empty());
    assert_eq!(
        collected,
        Collected {
            truncated: false,
            complete_within: 1e-2,
            looked_at: 0,
            gap_min: f64::INFINITY
        }
    );
}

/// Does the distance between the surfaces grow in all directions from a contact? Checked by moving each point along its own
/// surface: none of the faces at the features comes nearer to the other plane of the contact than `slope` allows.
fn worst_slope(m: &Mesh, pose: &Pose, feature: Feature, outward: &Vector3<f64>) -> f64 {
    let direction = pose.rotation.inverse() * outward;
    let slope = |e: Vector3<f64>| direction.dot(&e) / e.norm();
    match feature {
        Feature::Face(t) => (1.0 - direction.dot(m.face_normal(t)).min(1.0)).sqrt(),
        Feature::Edge(e) => {
            let edge = &m.edges()[e as usize];
            let [a, b] = edge.vertices.map(|v| m.vertices()[v as usize]);
            let along = (b - a) / (b - a).norm();
            let into = edge.faces.map(|f| {
                let tip = m.triangles()[f as usize]
                    .iter()
                    .find(|v| !edge.vertices.contains(v))
                    .expect("an opposite corner");
                let e = m.vertices()[*tip as usize] - a;
                e - along * along.dot(&e)
            });
            into.map(slope)
                .into_iter()
                .fold(direction.dot(&along).abs(), f64::max)
        }
        Feature::Vertex(v) => {
            let around = m
                .neighbours(v)
                .iter()
                .map(|w| m.vertices()[*w as usize] - m.vertices()[v as usize]);
            around.map(slope).fold(f64::NEG_INFINITY, f64::max)
        }
        other => unreachable!("a mesh has no {other:?}"),
    }
}

/// All features of a mesh, each with its corners.
fn features_of(m: &Mesh, pose: &Pose) -> Vec<(Feature, Vec<Point3<f64>>)> {
    let at = |v: u32| pose * m.vertices()[v as usize];
    let vertices = (0..m.vertices().len() as u32).map(|v| (Feature::Vertex(v), vec![at(v)]));
    let edges = m
        .edges()
        .iter()
        .enumerate()
        .map(|(e, edge)| (Feature::Edge(e as u32), edge.vertices.map(at).to_vec()));
    let faces = m
        .triangles()
        .iter()
        .enumerate()
        .map(|(t, c)| (Feature::Face(t as u32), c.map(at).to_vec()));
    vertices.chain(edges).chain(faces).collect()
}

/// From the nearest point of one feature to that of the other, `a` less `b`, where both are inside by more than `margin`.
fn between(a: &[Point3<f64>], b: &[Point3<f64>], margin: f64) -> Option<Vector3<f64>> {
    // Closest points of the affine hulls by least squares: y0 + B u - x0 - A s.
    let columns: Vec<Vector3<f64>> = a[1..]
        .iter()
        .map(|p| p - a[0])
        .chain(b[1..].iter().map(|p| b[0] - p))
        .collect();
    let r = a[0] - b[0];
    let solution = match columns.len() {
        0 => vec![],
        n if n <= 2 => {
            let m = DMatrix::from_fn(n, n, |i, j| columns[i].dot(&columns[j]));
            let rhs = DVector::from_fn(n, |i, _| -columns[i].dot(&r));
            m.lu().solve(&rhs)?.iter().copied().collect()
        }
        _ => return None,
    };
    let (s, t) = solution.split_at(a.len() - 1);
    let inside = |w: &[f64]| w.iter().all(|c| *c > margin) && w.iter().sum::<f64>() < 1.0 - margin;
    let is_inside = (inside(s) || s.is_empty()) && (inside(t) || t.is_empty());
    let difference = columns
        .iter()
        .zip(&solution)
        .fold(r, |d, (c, s)| d + c * *s);
    is_inside.then_some(difference)
}

/// Every pair of features whose closest points are inside both and within the activation distance, with the least slope; no tree, no owner, no prune.
fn brute_force(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
    activation: f64,
    slope: f64,
    margin: f64,
) -> BTreeSet<(Feature, Feature)> {
    let mut found = BTreeSet::new();
    for (fa, pa) in &features_of(body, body_pose) {
        for (fb, pb) in &features_of(obstacle, obstacle_pose) {
            let Some(difference) = between(pa, pb, margin) else {
                continue;
            };
            let gap = difference.norm();
            if gap > activation {
                continue;
            }
            let n = difference / gap;
            if worst_slope(obstacle, obstacle_pose, *fb, &n) <= slope
                && worst_slope(body, body_pose, *fa, &-n) <= slope
            {
                found.insert((*fa, *fb));
            }
        }
    }
    found
}

fn vector(range: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-range..range, -range..range, -range..range].prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn contacts_are_the_local_minima_of_the_distance(which in (0..6_usize, 0..6_usize), from in vector(1.0), turn in vector(3.0), other in vector(3.0), near in 0.0..1.0) {
        let shapes = [
            mesh(cuboid([0.05, 0.03, 0.02])), mesh(tetrahedron(0.08)), mesh(icosphere(0.04, 1)),
            mesh(torus(0.05, 0.015, 12, 8)), mesh(peg(0.02, 0.05, 9)), mesh(hole(0.02, 0.06, 0.02, 10)),
        ];
        let (body, obstacle) = (&shapes[which.0], &shapes[which.1]);
        let obstacle_pose = Pose::new(Vector3::new(0.3, -0.2, 0.1), other);
        // Towards the obstacle until near.
        let direction = from.normalize();
        let at = |r: f64| Pose::new(obstacle_pose.translation.vector + direction * r, turn);
        let mut r = 0.3;
        for _ in 0..60 {
            r -= 0.9 * distance(body, &at(r), obstacle, &obstacle_pose);
        }
        r += 0.01 * near;
        let pose = at(r);
        prop_assume!(!meshes_intersect(body, &pose, obstacle, &obstacle_pose));
        let activation = 0.012;
        let (contacts, collected) = collect(body, &pose, obstacle, &obstacle_pose, activation, 4000);
        prop_assert!(!collected.truncated);
        let features: BTreeSet<(Feature, Feature)> = contacts.iter().map(|c| (c.features.on_body, c.features.on_obstacle)).collect();
        prop_assert_eq!(features.len(), contacts.len(), "a pair twice");

        // None missed: strict local minima. Flat features stand back for their corners.
        let strict = brute_force(body, &pose, obstacle, &obstacle_pose, activation, -1e-6, 1e-6);
        let strict_faces = brute_force(body, &pose, obstacle, &obstacle_pose, activation, 1e-7, 1e-6);
        let has_face = |p: &&(Feature, Feature)| matches!(p.0, Feature::Face(_)) || matches!(p.1, Feature::Face(_));
        for pair in strict.iter() {
            prop_assert!(features.contains(pair), "missed {pair:?}");
        }
        for pair in strict_faces.iter().filter(has_face) {
            let strict_vertex = match *pair {
                (Feature::Vertex(v), _) => corner_edges(body, v) >= 3,
                (_, Feature::Vertex(v)) => corner_edges(obstacle, v) >= 3,
                _ => false,
            };
            prop_assert!(!strict_vertex || features.contains(pair), "missed {pair:?}");
        }
        // None false, and each as it says.
        for c in &contacts {
            let pair = (c.features.on_body, c.features.on_obstacle);
            let edges = matches!(pair, (Feature::Edge(_), Feature::Edge(_)));
            let slope = if edges || has_face(&&pair) { 0.02 + 1e-6 } else { 1e-4 + 1e-6 };
            prop_assert!(worst_slope(obstacle, &obstacle_pose, c.features.on_obstacle, &c.normal) <= slope, "{c:?}");
            prop_assert!(worst_slope(body, &pose, c.features.on_body, &-c.normal) <= slope, "{c:?}");
            prop_assert!((c.point_on_body - c.point_on_obstacle - c.normal * c.gap).norm() < 1e-12, "{c:?}");
            let t = obstacle.corners(c.obstacle_triangle);
            let p = t.iter().zip(c.barycentric).fold(Vector3::zeros(), |p, (q, w)| p + q.coords * w);
            prop_assert!((obstacle_pose * Point3::from(p) - c.point_on_obstacle).norm() < 1e-10, "{c:?}");
        }
        // The nearest pair of points is a contact.
        let gap = distance(body, &pose, obstacle, &obstacle_pose);
        if gap < activation * 0.999 {
            prop_assert!((collected.gap_min - gap).abs() < 1e-9, "{} {gap}", collected.gap_min);
        }
    }
}

fn corner_edges(m: &Mesh, v: u32) -> usize {
    m.edges()
        .iter()
        .filter(|e| e.vertices.contains(&v) && e.is_convex())
        .count()
}

#[test]
fn collection_and_search_do_not_allocate() {
    use god_object::collision::{AdvancementSettings, Motion, time_of_impact};
    use god_object::spatial::six;
    let (body, ring) = (
        mesh(peg(8e-3, 0.025, 72)),
        mesh(hole(8.06e-3, 0.025, 0.02, 72)),
    );
    let mut workspace = CollisionWorkspace::new();
    let mut out = Vec::with_capacity(32);
    let mut work = Work::default();
    assert_no_alloc::assert_no_alloc(|| {
        for k in 0..20 {
            let u = f64::from(k);
            let pose = Pose::translation(1e-5 * u.cos(), 1e-5 * u.sin(), 1e-3 * u);
            out.clear();
            let collected = collect_contacts(
                &body,
                &pose,
                &ring,
                &Pose::identity(),
                0,
                5e-4,
                &mut workspace,
                &mut out,
                &mut work,
            );
            assert!(collected.truncated);
            let motion = Motion {
                start: pose,
                displacement: six(
                    &Vector3::new(1e-4, 0.0, 1e-3),
                    &Vector3::new(0.01, 0.0, 0.1),
                ),
                reference_point: Point3::origin(),
            };
            let found = time_of_impact(
                &body,
                &motion,
                &ring,
                &Pose::identity(),
                &AdvancementSettings::default(),
                &mut workspace,
                &mut work,
            );
            assert!(matches!(
                found,
                god_object::collision::TimeOfImpact::Impact { .. }
            ));
        }
    });
    assert!(work.node_pairs > 0 && work.feature_pairs > 0);
}
