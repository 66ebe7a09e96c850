//! Of all planes that part two corners, a motion meets the one that is named last.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Vector3};

use super::RowReduction;
use super::at::{At, Purpose};
use super::grow::Wished;
use super::grow_tests::{Plain, reduction_of};
use super::met::{are_corners, met};
use super::row::{face, jacobian};
use crate::collision::{Work, bumpy_ball};
use crate::constraint::{Contact, Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::settings::RotationMetric;
use crate::spatial::{Pose, advance_pose, six};
use crate::world::{Body, Obstacle, Surface, World};

const REST: f64 = 1e-5;
/// By how much a normal may leave a cone, as a sine, and how much earlier a plane may be crossed than one of the samples, as a share of the way.
const TILT: f64 = 0.0201;
const EARLIER: f64 = 1e-3;
/// Directions tried between the ends of the cones.
const SAMPLES: u32 = 400;

/// Two bumpy balls that are nearly in touch, turned by what `u` says.
fn balls(u: f64, [rings, sides]: [u32; 2]) -> At {
    let turn = |k: f64| Vector3::new((k * u).sin(), (1.3 * k * u).cos(), (0.7 * k * u + k).sin());
    let world = World {
        body: Body {
            mesh: bumpy_ball(rings, sides),
            primitive: None,
            mass: 1.0,
            inertia: Matrix3::identity(),
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            name: "ball".into(),
            mesh: bumpy_ball(rings, sides + 1),
            primitive: None,
            pose: Pose::new(Vector3::zeros(), turn(1.0) * 2.0),
            surface: Surface::default(),
        }],
    };
    let pose = Pose::new(turn(2.0).normalize() * 0.24, turn(3.0) * 2.0);
    let metric = world.body.metric(RotationMetric::Inertia, &pose);
    At {
        places: Arc::new([world.obstacles[0].pose]),
        world: Arc::new(world),
        pose,
        reference: pose,
        metric: metric.expect("positive definite"),
        rest_distance: REST,
        tolerance: 1e-9,
    }
}

fn corners(at: &At) -> Vec<Contact> {
    let features = |mesh: &Mesh| {
        let vertices = (0..mesh.vertices().len() as u32).map(Feature::Vertex);
        let edges = (0..mesh.edges().len() as u32).map(Feature::Edge);
        vertices.chain(edges).collect::<Vec<_>>()
    };
    let (of_body, of_obstacle) = (
        features(&at.world.body.mesh),
        features(&at.world.obstacles[0].mesh),
    );
    let pairs = of_body.iter().flat_map(|on_body| {
        of_obstacle.iter().map(|on_obstacle| FeaturePair {
            obstacle: 0,
            on_body: *on_body,
            on_obstacle: *on_obstacle,
        })
    });
    pairs
        .filter(are_corners)
        .filter_map(|pair| face(at, &pair, false, &mut Work::default()))
        .collect()
}

/// The most by which a direction of the mesh's frame leaves the normal cone of a feature, as a sine.
fn outside(mesh: &Mesh, feature: Feature, direction: &Vector3<f64>) -> f64 {
    let rise = |from: u32, to: u32| {
        let side = mesh.vertices()[to as usize] - mesh.vertices()[from as usize];
        direction.dot(&side) / side.norm()
    };
    match feature {
        Feature::Vertex(v) => {
            let neighbours = mesh.neighbours(v).iter();
            neighbours.map(|w| rise(v, *w)).fold(-1.0, f64::max)
        }
        Feature::Edge(e) => {
            let edge = &mesh.edges()[e as usize];
            let [p, q] = edge.vertices;
            let beside = edge
                .faces
                .iter()
                .flat_map(|t| mesh.triangles()[*t as usize]);
            let beside = beside.filter(|v| *v != p && *v != q);
            // Beside the edge, across it.
            let along = (mesh.vertices()[q as usize] - mesh.vertices()[p as usize]).normalize();
            let across = beside.map(|v| {
                let side = mesh.vertices()[v as usize] - mesh.vertices()[p as usize];
                let side = side - along * along.dot(&side);
                direction.dot(&side) / side.norm()
            });
            across.fold(direction.dot(&along).abs(), f64::max)
        }
        _ => f64::INFINITY,
    }
}

/// The share of a straight way after which a plane through the points is crossed.
fn crossed(normal: &Vector3<f64>, difference: &Vector3<f64>, way: &Vector3<f64>) -> f64 {
    let closing = -normal.dot(way);
    if closing > 0.0 {
        (normal.dot(difference) - REST).max(0.0) / closing
    } else {
        f64::INFINITY
    }
}

/// Whether a turn of the body changes the gap that the row foretells as it does that of a face's plane or of one along two edges.
fn turns_as_a_plane(at: &At, contact: &Contact, plane: &Contact) -> bool {
    let turn = Vector3::new(0.5, -0.7, 0.4) * 1e-6;
    let step = six(&Vector3::zeros(), &turn);
    let foretold = jacobian(plane, &at.center()).dot(&step);
    let turned = advance_pose(&at.pose, &step, 1.0) * at.pose.inverse();
    let (on_body, on_obstacle) = (contact.point_on_body, contact.point_on_obstacle);
    let changes = |normal: &Vector3<f64>| {
        let gap = normal.dot(&(turned * on_body - on_obstacle));
        (gap - plane.gap - foretold).abs() < 1e-3 * turn.norm() * at.pose.translation.vector.norm()
    };
    let sides = |mesh: &Mesh, feature: Feature, pose: &Pose| {
        let ends: Vec<[u32; 2]> = match feature {
            Feature::Edge(e) => vec![mesh.edges()[e as usize].vertices],
            Feature::Vertex(v) => mesh.neighbours(v).iter().map(|w| [v, *w]).collect(),
            _ => Vec::new(),
        };
        let along = ends.into_iter().map(|[p, q]| {
            pose.rotation * (mesh.vertices()[q as usize] - mesh.vertices()[p as usize])
        });
        let across = along.filter(|side| side.dot(&plane.normal).abs() < 1e-12);
        across.collect::<Vec<_>>()
    };
    let of_body = sides(&at.world.body.mesh, plane.features.on_body, &at.pose);
    let of_obstacle = sides(
        &at.world.obstacles[0].mesh,
        plane.features.on_obstacle,
        &at.places[0],
    );
    let along_edges = of_body.iter().any(|a| {
        of_obstacle.iter().any(|b| {
            let normal = (turned.rotation * a).cross(b).normalize();
            changes(&(normal * normal.dot(&plane.normal).signum()))
        })
    });
    let is_of = |mesh: &Mesh, direction: Vector3<f64>| {
        let mut faces = 0..mesh.triangles().len() as u32;
        faces.any(|t| (mesh.face_normal(t) - direction).norm() < 1e-12)
    };
    let (body, obstacle) = (&at.world.body.mesh, &at.world.obstacles[0].mesh);
    let of_faces = is_of(obstacle, at.places[0].rotation.inverse() * plane.normal)
        && changes(&plane.normal)
        || is_of(body, -(at.pose.rotation.inverse() * plane.normal))
            && changes(&(turned.rotation * plane.normal));
    along_edges || of_faces
}

#[test]
fn the_plane_that_is_named_parts_the_corners_and_is_crossed_last() {
    let (mut named, mut of_edges) = (0, 0);
    for k in 0..300 {
        let at = balls(f64::from(k), [5, 6]);
        let (body, obstacle) = (&at.world.body.mesh, &at.world.obstacles[0].mesh);
        let leaves = |pair: &FeaturePair, normal: &Vector3<f64>| {
            let on_obstacle = at.places[0].rotation.inverse() * normal;
            let on_body = -(at.pose.rotation.inverse() * normal);
            let of_obstacle = outside(obstacle, pair.on_obstacle, &on_obstacle);
            of_obstacle.max(outside(body, pair.on_body, &on_body))
        };
        for (place, contact) in corners(&at).iter().enumerate() {
            let u = place as f64;
            let aside = Vector3::new((1.1 * u).sin(), (1.7 * u).cos(), (0.6 * u).sin());
            let way = (aside - contact.normal) * (3.0 * contact.gap);
            let difference = contact.point_on_body - contact.point_on_obstacle;
            let found = met((&at, &Plain), contact, &six(&way, &Vector3::zeros()));
            let own = crossed(&contact.normal, &difference, &way);
            let mut last = own;
            if let Some(plane) = found {
                named += 1;
                let pair = &plane.features;
                assert!(leaves(pair, &plane.normal) < TILT, "{k} {pair:?}");
                let off = plane.gap - plane.normal.dot(&difference);
                assert!(
                    off.abs() < 1e-15 && plane.gap >= 0.0,
                    "{k} {pair:?} {off:e}"
                );
                last = crossed(&plane.normal, &difference, &way);
                assert!(last >= own, "{k} {pair:?} {last} {own}");
                assert!(turns_as_a_plane(&at, contact, &plane), "{k} {pair:?}");
            }
            for sample in 0..SAMPLES {
                let v = f64::from(sample);
                let off = Vector3::new((2.3 * v).sin(), (3.1 * v).cos(), (4.7 * v).sin());
                let share = f64::from(sample + 1) / f64::from(SAMPLES);
                let mut normal = contact.normal + off * share;
                // Across the edge, where one is.
                for (feature, mesh, pose) in [
                    (contact.features.on_body, body, &at.pose),
                    (contact.features.on_obstacle, obstacle, &at.places[0]),
                ] {
                    if let Feature::Edge(e) = feature {
                        let [p, q] = mesh.edges()[e as usize].vertices;
                        let along = mesh.vertices()[q as usize] - mesh.vertices()[p as usize];
                        let along = pose.rotation * along.normalize();
                        normal -= along * along.dot(&normal);
                    }
                }
                let normal = normal.normalize();
                if leaves(&contact.features, &normal) > 1e-9 {
                    continue;
                }
                let sampled = crossed(&normal, &difference, &way);
                of_edges += usize::from(sampled > own + EARLIER);
                assert!(sampled <= last + EARLIER, "{k} {place} {sampled} {last}");
            }
        }
    }
    assert!(named > 100 && of_edges > 5000, "{named} {of_edges}");
}

#[test]
fn a_motion_that_a_pair_of_corners_holds_goes_on_by_the_plane_that_it_meets_last() {
    let (mut met, mut farther) = (0, 0);
    for k in 0..60 {
        let at = balls(f64::from(k), [12, 14]);
        let contacts = corners(&at);
        let Some(first) = contacts.first() else {
            continue;
        };
        let u = f64::from(k);
        let aside = Vector3::new((1.1 * u).sin(), (1.7 * u).cos(), (0.6 * u).sin());
        let way = six(
            &((aside * 2.0 - first.normal) * (4.0 * first.gap)),
            &Vector3::zeros(),
        );
        let mut reduction = reduction_of(&at, &contacts);
        let work = &mut Work::default();
        let wished = Wished {
            motions: &[way],
            turning: 0,
            purpose: Purpose::Force,
        };
        let short_of = |reduction: &mut RowReduction, work: &mut Work| {
            let answers = reduction.complete((&at, &Plain), &wished, work);
            at.metric.norm(&(answers[0].acceleration - way))
        };
        let held = short_of(&mut reduction, work);
        reduction.meet_corners((&at, &Plain), &way, |way| *way, work);
        let rows = reduction.contacts();
        let all: Vec<_> = rows.chain(&reduction.candidates.contacts).collect();
        let is_other = |c: &&Contact| {
            let mut collected = contacts.iter();
            collected.any(|other| other.features == c.features && other.normal != c.normal)
        };
        if !all.iter().any(is_other) {
            continue;
        }
        met += 1;
        let left = short_of(&mut reduction, work);
        farther += usize::from(left < 0.99 * held);
        assert!(left <= held, "{k} {left:e} {held:e}");
        // At the next pose the pairs are again what they are.
        reduction.move_to((&at, &Plain), None, work);
        for (candidate, contact) in reduction.candidates.contacts.iter().zip(&contacts) {
            assert_eq!(candidate.normal, contact.normal, "{k}");
        }
        let again = short_of(&mut reduction, work);
        assert!((again - held).abs() < 1e-9 * held, "{k} {again:e} {held:e}");
    }
    assert!(met > 25 && 2 * farther > met, "{met} {farther}");
}
