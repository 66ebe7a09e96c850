//! The projection on every facing pair within reach, as the answer that a choice of rows is held against.

use god_object::collision::{CollisionWorkspace, Work};
use god_object::constraint::{Contact, Feature, Separation, collect_contacts, contact_jacobian};
use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector, SolverKind};
use god_object::spatial::{angular, at_reference_point, linear, pose_difference};
use god_object::{
    ConstraintSet, Coupling, GodObject, Mesh, NonPenetrationConstraint, Pose, Settings, Surface,
    Vector6, World,
};
use nalgebra::{Point3, Vector3};

/// Most facing pairs within reach.
const MOST_PAIRS: usize = 1 << 18;
/// Forces below this are not compared relatively, N.
const LEAST_FORCE: f64 = 0.5;
/// A plane in the normal cones of two corners may leave them by as much as a row of edges may, as a sine, and pass their points at this distance, m.
const TILT: f64 = 0.02 + 1e-6;
const GAP_TOLERANCE: f64 = 1e-9;

/// How far a published set is from what every pair says.
#[derive(Clone, Copy, Debug, Default)]
pub struct Difference {
    /// Of the constrained accelerations in the metric, in shares of the constraint's, or of that of half a newton: force and torque together.
    pub relative: f64,
    /// Facing pairs within reach.
    pub pairs: usize,
}

/// Memory for the oracle.
#[derive(Debug)]
pub struct Oracle {
    workspace: CollisionWorkspace,
    contacts: Vec<Contact>,
    rows: Vec<HalfSpace>,
    projector: Projector,
}

impl Default for Oracle {
    fn default() -> Self {
        Self {
            workspace: CollisionWorkspace::with_candidates(2 * MOST_PAIRS),
            contacts: Vec::with_capacity(MOST_PAIRS),
            rows: Vec::with_capacity(MOST_PAIRS),
            projector: Projector::new(SolverKind::ActiveSet, MOST_PAIRS),
        }
    }
}

impl Oracle {
    /// Compares the rows that were published with all, for a device at `device`: without friction and shading, which act on either alike.
    pub fn compare(&mut self, world: &World, god_object: &GodObject, device: &Pose) -> Difference {
        let settings = god_object.settings();
        let body = &world.body;
        let at = at_reference_point(god_object.pose(), &body.reference_point);
        let difference = self.collect(world, god_object, device);
        let center = Point3::from(at.translation.vector);
        let wanted = difference * settings.k_s;
        let metric = body
            .metric(settings.rotation_metric, god_object.pose())
            .expect("a metric");
        let set = god_object.constraint_set();
        let others = self
            .contacts
            .iter()
            .filter(|c| !is_parted(world, god_object, c))
            .map(|c| Row {
                normal: c.normal,
                point: c.point_on_obstacle,
                gap: c.gap,
            });
        // Of the rows that were published some hold though their features face no more: they slid into a hollow.
        let published = || {
            set.constraints.iter().map(|c| Row {
                normal: c.normal,
                point: c.point,
                gap: c.gap,
            })
        };
        let full = project(
            &mut self.projector,
            &mut self.rows,
            others.chain(published()),
            &metric,
            &wanted,
            &center,
            settings,
        );
        let chosen = project(
            &mut self.projector,
            &mut self.rows,
            published(),
            &metric,
            &wanted,
            &center,
            settings,
        );
        let least = LEAST_FORCE / (settings.k_h * body.mass.sqrt());
        let error = metric.norm(&(chosen - full));
        Difference {
            relative: error / metric.norm(&(full - wanted)).max(least),
            pairs: self.contacts.len(),
        }
    }

    /// The same for the wrench of a coupling that has no history, with rows that are linearised anew where the settings say so. Obstacles stand still.
    pub fn compare_wrenches(
        &mut self,
        world: &World,
        god_object: &GodObject,
        device: &Pose,
    ) -> Difference {
        self.collect(world, god_object, device);
        let placed: Vec<&Pose> = god_object.obstacle_poses().collect();
        let row = |contact: &Contact| {
            let index = usize::from(contact.features.obstacle);
            NonPenetrationConstraint {
                features: contact.features,
                point: contact.point_on_obstacle,
                normal: contact.normal,
                gap: contact.gap,
                separation: Separation::of(
                    &contact.features,
                    (&world.body, god_object.pose()),
                    (&world.obstacles[index], placed[index]),
                ),
                obstacle_displacement: Vector3::zeros(),
                shading_normal: None,
            }
        };
        let published = || {
            let rows = god_object.constraint_set().constraints.iter();
            rows.map(|row| NonPenetrationConstraint {
                obstacle_displacement: Vector3::zeros(),
                shading_normal: None,
                ..*row
            })
        };
        let is_new = |contact: &&Contact| {
            let mut rows = god_object.constraint_set().constraints.iter();
            !rows.any(|row| row.features == contact.features)
                && !is_parted(world, god_object, contact)
        };
        let all = self.contacts.iter().filter(is_new).map(row);
        let mut plain = world.clone();
        (plain.obstacles.iter_mut()).for_each(|obstacle| obstacle.surface = Surface::default());
        let full = wrench(&plain, god_object, device, published().chain(all).collect());
        let chosen = wrench(&plain, god_object, device, published().collect());
        let size =
            |wrench: &Vector6| linear(wrench).norm() + angular(wrench).norm() / god_object.radius();
        Difference {
            relative: size(&(chosen - full)) / size(&full).max(LEAST_FORCE),
            pairs: self.contacts.len(),
        }
    }

    /// Finds every pair that can hold the body on its way to the device; that way.
    fn collect(&mut self, world: &World, god_object: &GodObject, device: &Pose) -> Vector6 {
        let reference_point = &world.body.reference_point;
        let difference = pose_difference(
            &at_reference_point(device, reference_point),
            &at_reference_point(god_object.pose(), reference_point),
            &Vector3::zeros(),
        );
        // No point moves farther than this: a pair farther apart cannot hold anything.
        let reach = linear(&difference).norm()
            + god_object.radius() * angular(&difference).norm()
            + 2.0 * god_object.settings().rest_distance;
        self.contacts.clear();
        let placed = world.obstacles.iter().zip(god_object.obstacle_poses());
        for (index, (obstacle, pose)) in placed.enumerate() {
            let collected = collect_contacts(
                &world.body,
                god_object.pose(),
                obstacle,
                pose,
                index as u16,
                reach,
                &mut self.workspace,
                &mut self.contacts,
                &mut Work::default(),
            );
            assert!(!collected.truncated, "the oracle holds every pair");
        }
        difference
    }
}

/// Whether the set has this pair of corners by a plane that parts them: through the points, in both normal cones. Any such plane does, so the oracle holds
/// the set to the one that it names.
fn is_parted(world: &World, god_object: &GodObject, contact: &Contact) -> bool {
    let pair = &contact.features;
    let is_face = |feature| matches!(feature, Feature::Face(_));
    let is_edge = |feature| matches!(feature, Feature::Edge(_));
    let (a, b) = (pair.on_body, pair.on_obstacle);
    if is_face(a) || is_face(b) || is_edge(a) && is_edge(b) {
        return false;
    }
    let index = usize::from(pair.obstacle);
    let (Some(pose), Some(obstacle)) = (
        god_object.obstacle_poses().nth(index),
        world.obstacles.get(index),
    ) else {
        return false;
    };
    let apart = contact.point_on_body - contact.point_on_obstacle;
    let mut rows = god_object.constraint_set().constraints.iter();
    rows.any(|row| {
        row.features == *pair
            && (row.gap - row.normal.dot(&apart)).abs() < GAP_TOLERANCE
            && is_in_cone(&obstacle.mesh, pose, b, &row.normal)
            && is_in_cone(&world.body.mesh, god_object.pose(), a, &-row.normal)
    })
}

/// Whether nothing of the mesh beside a vertex or an edge rises in a direction of the world.
fn is_in_cone(mesh: &Mesh, pose: &Pose, feature: Feature, direction: &Vector3<f64>) -> bool {
    let direction = pose.rotation.inverse() * direction;
    let beside = |from: u32, to: &[u32]| {
        to.iter().filter(|v| **v != from).all(|v| {
            let side = mesh.vertices()[*v as usize] - mesh.vertices()[from as usize];
            direction.dot(&side) <= TILT * side.norm() // false for NaN
        })
    };
    match feature {
        Feature::Vertex(v) => beside(v, mesh.neighbours(v)),
        Feature::Edge(e) => {
            let edge = &mesh.edges()[e as usize];
            let corners = edge.faces.map(|t| mesh.triangles()[t as usize]);
            let [p, q] = edge.vertices;
            [p, q].map(|end| corners.iter().all(|of| beside(end, of))) == [true; 2]
        }
        _ => false,
    }
}

/// What a coupling without a history makes of these rows.
fn wrench(
    world: &World,
    god_object: &GodObject,
    device: &Pose,
    mut rows: Vec<NonPenetrationConstraint>,
) -> Vector6 {
    rows.sort_unstable_by_key(|row| row.features);
    let settings = Settings {
        max_constraints: rows.len(),
        ..*god_object.settings()
    };
    let mut set = ConstraintSet::with_capacity(rows.len());
    set.sequence = 1;
    set.god_object_pose = *god_object.pose();
    set.constraints = rows;
    let output = Coupling::new(world, &settings).step(0.0, device, &set);
    assert_eq!(output.status, ProjectionStatus::Solved);
    output.wrench
}

struct Row {
    normal: Vector3<f64>,
    point: Point3<f64>,
    gap: f64,
}

fn project(
    projector: &mut Projector,
    rows: &mut Vec<HalfSpace>,
    given: impl Iterator<Item = Row>,
    metric: &Metric,
    wanted: &Vector6,
    center: &Point3<f64>,
    settings: &Settings,
) -> Vector6 {
    rows.clear();
    rows.extend(given.map(|row| HalfSpace {
        jacobian: contact_jacobian(&row.normal, &row.point, center),
        bound: (settings.k_s * (settings.rest_distance - row.gap)).min(0.0),
    }));
    projector.project(metric, wanted, rows, &[]).acceleration
}
