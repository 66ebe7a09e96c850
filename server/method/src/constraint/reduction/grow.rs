//! Which rows a motion needs: those that its answer violates, what they turn into, and what stopped it.

use arrayvec::ArrayVec;

use super::at::{At, Purpose, Surfaces};
use super::neighbours::{Arrival, Sides, for_neighbours};
use super::row::{Known, face, jacobian};
use super::{
    MAX_ROUNDS, MAX_ROWS, MAX_STALE, NEAR_REST_DISTANCES, RowReduction, TOUCHING_REST_DISTANCES,
    WITNESS_REST_DISTANCES,
};
use crate::collision::{Placement, Work};
use crate::constraint::collect::{for_contacts, in_world};
use crate::constraint::facing::Facing;
use crate::constraint::{Contact, FeaturePair};
use crate::geometry::Mesh;
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, Projection};
use crate::spatial::Vector6;

impl RowReduction {
    /// Adds rows until the projection of `unconstrained` violates none by more than the tolerance; the projection.
    pub(crate) fn complete(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        unconstrained: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> Projection {
        let least_gap = purpose.least_gap(at);
        self.warm_start.clear();
        let mut rounds = 0;
        loop {
            self.rows.clear();
            let known = self.known.iter().map(|row| {
                let (jacobian, nearer) = row.for_purpose(purpose);
                (jacobian, row.contact.gap, nearer)
            });
            let given = self
                .given
                .iter()
                .map(|(jacobian, gap)| (*jacobian, *gap, 0.0));
            let all = known.chain(given);
            self.rows
                .extend(all.map(|(jacobian, gap, nearer)| HalfSpace {
                    jacobian,
                    bound: at.rest_distance - gap.max(least_gap) + nearer,
                }));
            work.projections += 1;
            let projection =
                self.projector
                    .project(&at.metric, unconstrained, &self.rows, &self.warm_start);
            self.warm_start.clear();
            self.warm_start
                .extend(projection.active.iter().map(|row| row.row));
            for row in &projection.active {
                if let Some(row) = self.known.get_mut(row.row as usize) {
                    row.idle = 0;
                }
            }
            rounds += 1;
            let answer = &projection.acceleration;
            let violation = self.add_most_violated((at, surfaces), answer, purpose, work);
            let finished = violation <= at.tolerance || rounds == MAX_ROUNDS; // false for NaN
            if finished || !violation.is_finite() {
                let turns_a_corner = purpose == Purpose::Motion
                    && rounds < MAX_ROUNDS
                    && self.add_neighbours((at, surfaces), answer, work);
                if turns_a_corner {
                    continue;
                }
                let is_known = violation.is_finite() && projection.kkt_residual <= KKT_TOLERANCE;
                let error = if is_known { violation } else { f64::INFINITY };
                self.error = self.error.max(error);
                return projection;
            }
        }
    }

    /// Adds the pairs that those of rows which touch turn into, where the motion violates them by more than the tolerance; whether there are any. Also of
    /// rows that the motion leaves: what lies in a groove leaves one of its sides for the other.
    fn add_neighbours(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        motion: &Vector6,
        work: &mut Work,
    ) -> bool {
        let before = self.known.len();
        for k in 0..before {
            let Contact {
                features: pair,
                gap,
                ..
            } = self.known[k].contact;
            if gap > TOUCHING_REST_DISTANCES * at.rest_distance {
                continue;
            }
            let obstacle = &at.world.obstacles[usize::from(pair.obstacle)].mesh;
            let body = &at.world.body.mesh;
            let arrival = Arrival::of(at, &pair, motion);
            for_neighbours(body, obstacle, &pair, Sides::Reentrant, |features| {
                let clear = arrival
                    .over(body, obstacle, &features)
                    .is_some_and(|clearance| clearance >= at.rest_distance - at.tolerance);
                if clear || self.known.len() == MAX_ROWS || self.knows(&features) {
                    return;
                }
                let Some(contact) = face(at, &features, true, work) else {
                    return;
                };
                let row = jacobian(&contact, &at.center());
                let violation = at.rest_distance - contact.gap - row.dot(motion);
                if violation > at.tolerance {
                    self.add((at, surfaces), &contact);
                    if let Some(row) = self.known.last_mut() {
                        // It does not face yet.
                        row.implied = true;
                    }
                }
            });
        }
        self.known.len() > before
    }

    /// Adds the pairs that one turned into which has slid off its features.
    pub(super) fn follow(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        pair: &FeaturePair,
        work: &mut Work,
    ) {
        let obstacle = &at.world.obstacles[usize::from(pair.obstacle)];
        let near = NEAR_REST_DISTANCES * at.rest_distance;
        let body = &at.world.body.mesh;
        for_neighbours(body, &obstacle.mesh, pair, Sides::All, |features| {
            if self.known.len() == MAX_ROWS || self.knows(&features) {
                return;
            }
            if let Some(contact) = face(at, &features, false, work)
                && contact.gap <= near
            {
                self.add((at, surfaces), &contact);
            }
        });
    }

    /// Adds the candidate that `motion` violates most, if by more than the tolerance; by how much it is violated, m.
    pub(super) fn add_most_violated(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        motion: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> f64 {
        let least_gap = purpose.least_gap(at);
        for _ in 0..MAX_STALE {
            let least = self.candidates.least_clearance(motion, purpose, least_gap);
            let Some((k, clearance)) = least else {
                return 0.0;
            };
            let violation = at.rest_distance - clearance;
            if violation <= at.tolerance {
                return violation.max(0.0);
            }
            let features = self.candidates.contacts[k].features;
            // Known rows are satisfied; one that was carried here to first order is looked at as it is.
            self.candidates.gap[k] = f64::INFINITY;
            if self.knows(&features) {
                continue;
            }
            let contact = if self.candidates.moved == Vector6::zeros() {
                Some(self.candidates.contacts[k])
            } else {
                face(at, &features, false, work)
            };
            self.outdated |= contact.is_none();
            if let Some(contact) = contact {
                let row = Known::of(&contact, surfaces, &at.center());
                let (jacobian, nearer) = row.for_purpose(purpose);
                let gap = contact.gap.max(least_gap) - nearer;
                let violation = at.rest_distance - gap - jacobian.dot(motion);
                if violation > at.tolerance {
                    self.add((at, surfaces), &contact);
                    return violation;
                }
            }
        }
        // Enough of this round: by how much the next one is violated says what is left to look at.
        let left = self.candidates.least_clearance(motion, purpose, least_gap);
        left.map_or(0.0, |(_, clearance)| {
            (at.rest_distance - clearance).max(0.0)
        })
    }

    /// Adds what faces between two triangles that stopped a motion.
    pub(super) fn take_witness(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        (a, b): (u32, u32),
        work: &mut Work,
    ) {
        // A witness does not say which obstacle it is of; a pair of another does not face, or is a pair like any.
        for index in 0..at.places.len() {
            let (mesh, pose) = at.obstacle(index);
            let body = &at.world.body.mesh;
            let there =
                (a as usize) < body.triangles().len() && (b as usize) < mesh.triangles().len();
            if !there || !at.places[index].chosen {
                continue;
            }
            let placement = Placement::of(&at.pose, pose);
            let facing = Facing {
                body,
                obstacle: mesh,
                placement: &placement,
                obstacle_index: u16::try_from(index).unwrap_or(u16::MAX),
                activation_distance: WITNESS_REST_DISTANCES * at.rest_distance,
                past_reentrant_edges: false,
            };
            // The features that touch may be other triangles' to look at.
            for a in owners(body, a) {
                for b in owners(mesh, b) {
                    for_contacts(&facing, &facing.pair(a, b), work, |contact| {
                        if !self.knows(&contact.features) {
                            self.add((at, surfaces), &in_world(&contact, pose));
                        }
                    });
                }
            }
        }
    }
}

/// A triangle, and those that own its corners and sides; each once.
fn owners(mesh: &Mesh, t: u32) -> ArrayVec<u32, 7> {
    let mut owners = ArrayVec::from_iter([t]);
    let corners = mesh.triangles()[t as usize].map(|v| mesh.vertex_owner(v).unwrap_or(t));
    let sides = mesh
        .triangle_edges(t)
        .map(|e| mesh.edges()[e as usize].faces[0]);
    for owner in corners.into_iter().chain(sides) {
        if !owners.contains(&owner) {
            owners.push(owner);
        }
    }
    owners
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

    use super::super::at::Place;
    use super::*;
    use crate::constraint::reentrant::tests::notched;
    use crate::constraint::{Collected, Feature};
    use crate::settings::RotationMetric;
    use crate::spatial::Pose;
    use crate::world::{Body, Obstacle, Surface, World};

    const GAP: f64 = 1e-3;
    const REST: f64 = 1e-5;

    struct Plain;

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
            places: Arc::new([Place {
                pose: Pose::from_parts(Vector3::zeros().into(), over),
                chosen: true,
            }]),
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
        let mut reduction = RowReduction::with_capacity(contacts.len(), &at.world);
        let collected = Collected {
            truncated: false,
            complete_within: 1.0,
            looked_at: 0,
            gap_min: 0.0,
        };
        reduction.begin(&at, 1.0);
        reduction.offer(&at, 0, &contacts, &collected);

        let here = block_on_block(0.0);
        reduction.move_to((&here, &Plain), None, work);
        let wish = Vector6::new(0.0, 0.0, -5.0 * GAP, 0.0, 0.0, 0.0);
        let answer = reduction.complete((&here, &Plain), &wish, Purpose::Motion, work);
        let down = -answer.acceleration[2];
        assert!((down - (GAP - REST)).abs() < 1e-8, "{down}");
        assert!(reduction.error() <= here.tolerance, "{}", reduction.error());
    }
}
