//! Rows behind candidates that face no more.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use super::at::{At, Purpose, Surfaces};
use super::grow::Wished;
use super::row::face;
use super::{MAX_STALE, RowReduction};
use crate::collision::Work;
use crate::constraint::reentrant::tests::notched;
use crate::constraint::{Collected, Contact, Feature, FeaturePair};
use crate::geometry::Mesh;
use crate::settings::RotationMetric;
use crate::spatial::{Pose, Vector6};
use crate::world::{Body, Obstacle, Surface, World};

const GAP: f64 = 1e-3;
const REST: f64 = 1e-5;

pub(super) struct Plain;

impl Surfaces for Plain {
    fn shade(&self) -> bool {
        false
    }
    fn move_on(&self) -> bool {
        false
    }
    fn shading_normal(&self, _: &Contact) -> Option<Vector3<f64>> {
        None
    }
    fn nearer(&self, _: &Contact) -> f64 {
        0.0
    }
}

/// A block whose flat side is `GAP` and `higher` above that of another.
fn block_on_block(higher: f64) -> At {
    let world = World {
        body: Body {
            mesh: notched(0.1),
            primitive: None,
            mass: 1.0,
            inertia: Matrix3::identity(),
            reference_point: Point3::origin(),
        },
        obstacles: vec![Obstacle {
            name: "block".into(),
            mesh: notched(0.1),
            primitive: None,
            pose: Pose::identity(),
            surface: Surface::default(),
        }],
    };
    let over = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
    let pose = Pose::translation(0.0, 0.0, 2.0 + GAP + higher);
    let metric = world.body.metric(RotationMetric::Inertia, &pose);
    At {
        world: Arc::new(world),
        places: Arc::new([Pose::from_parts(Vector3::zeros().into(), over)]),
        pose,
        reference: pose,
        metric: metric.expect("positive definite"),
        rest_distance: REST,
        tolerance: 1e-9,
    }
}

fn pairs(mesh: &Mesh) -> Vec<FeaturePair> {
    let faces = (0..mesh.triangles().len() as u32).map(Feature::Face);
    let vertices = (0..mesh.vertices().len() as u32).map(Feature::Vertex);
    let edges = (0..mesh.edges().len() as u32).map(Feature::Edge);
    let all: Vec<Feature> = faces.chain(vertices).chain(edges).collect();
    let is_pair = |a: &Feature, b: &Feature| {
        matches!(
            (a, b),
            (Feature::Face(_), Feature::Vertex(_))
                | (Feature::Vertex(_), Feature::Face(_))
                | (Feature::Edge(_), Feature::Edge(_))
        )
    };
    let pair = |on_body: &Feature, on_obstacle: &Feature| FeaturePair {
        obstacle: 0,
        on_body: *on_body,
        on_obstacle: *on_obstacle,
    };
    let both = all.iter().flat_map(|a| all.iter().map(move |b| (a, b)));
    both.filter(|(a, b)| is_pair(a, b))
        .map(|(a, b)| pair(a, b))
        .collect()
}

/// With these candidates, and no row yet.
pub(super) fn reduction_of(at: &At, contacts: &[Contact]) -> RowReduction {
    let mut reduction = RowReduction::with_capacity(contacts.len(), 1);
    let collected = Collected {
        truncated: false,
        complete_within: 1.0,
        looked_at: 0,
        gap_min: 0.0,
    };
    reduction.begin(at, 1.0);
    reduction.offer(at, 0, contacts, &collected);
    reduction
}

#[test]
fn a_row_behind_many_candidates_that_face_no_more_is_found() {
    let at = block_on_block(1e-7);
    let work = &mut Work::default();
    // What faces, and what does not but is carried as if it touched.
    let carried = |pair: &FeaturePair, work: &mut Work| {
        face(&at, pair, false, work).unwrap_or(Contact {
            features: *pair,
            point_on_body: Point3::new(0.0, 0.0, 1.0),
            point_on_obstacle: Point3::new(0.0, 0.0, 1.0),
            normal: Vector3::z(),
            gap: 0.0,
            obstacle_triangle: 0,
            barycentric: [1.0, 0.0, 0.0],
        })
    };
    let all = pairs(&at.world.body.mesh);
    let mut contacts: Vec<Contact> = all.iter().map(|pair| carried(pair, work)).collect();
    contacts.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    let stale = contacts.iter().filter(|c| c.gap == 0.0).count();
    assert!(stale > 2 * MAX_STALE as usize && stale < contacts.len());
    let mut reduction = reduction_of(&at, &contacts);

    let here = block_on_block(0.0);
    reduction.move_to((&here, &Plain), None, work);
    let wish = Vector6::new(0.0, 0.0, -5.0 * GAP, 0.0, 0.0, 0.0);
    let wished = Wished {
        motions: &[wish],
        turning: 1,
        purpose: Purpose::Motion,
    };
    let answers = reduction.complete((&here, &Plain), &wished, work);
    let answer = answers.first().expect("one");
    let down = -answer.acceleration[2];
    assert!((down - (GAP - REST)).abs() < 1e-8, "{down}");
    assert!(reduction.error() <= here.tolerance, "{}", reduction.error());
}
