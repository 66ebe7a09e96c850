//! What the baselines share: contacts near a pose, as rows, and limits of the force.

use god_object::collision::{CollisionWorkspace, Work, shapes_intersect, surfaces_intersect};
use god_object::constraint::{Contact, Separation, collect_contacts};
use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector};
use god_object::spatial::{angular, linear, six};
use god_object::{ConstraintSet, NonPenetrationConstraint, Pose, Settings, Vector6, World};
use nalgebra::Point3;

/// What an update finds is used from one period after its device pose to two: the device goes on as it came.
pub(super) const PERIODS_AHEAD: f64 = 2.0;
/// Bisections of a step that ends in an obstacle: a millimetre is cut down to a nanometre.
const BISECTIONS: u32 = 20;

/// Finds contacts.
#[derive(Debug)]
pub(super) struct ContactFinder {
    workspace: CollisionWorkspace,
    found: Vec<Contact>,
}

impl ContactFinder {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            workspace: CollisionWorkspace::new(),
            found: Vec::with_capacity(settings.max_constraints),
        }
    }

    /// Every contact of the body at `pose` nearer than `distance`, m.
    pub(super) fn find(&mut self, world: &World, pose: &Pose, distance: f64) -> &[Contact] {
        self.found.clear();
        for (index, obstacle) in (0..).zip(&world.obstacles) {
            let _ = collect_contacts(
                &world.body,
                pose,
                obstacle,
                &obstacle.pose,
                index,
                distance,
                &mut self.workspace,
                &mut self.found,
                &mut Work::default(),
            );
        }
        &self.found
    }
}

/// Most that a point of a body moves which reaches `radius`, m, from its reference point, m.
pub(super) fn longest_way(motion: &Vector6, radius: f64) -> f64 {
    linear(motion).norm() + radius * angular(motion).norm()
}

/// Share of a motion of the body, m long at its farthest point, that ends free of the obstacles: all of it, or as much as bisection finds. What lies on the
/// way is not looked at; nor whether a mesh is wholly inside another, where the motion is shorter than the body is thick.
pub(super) fn free_share(world: &World, length: f64, at: impl Fn(f64) -> Pose) -> f64 {
    let [low, high] = world.body.mesh.bounding_box();
    let short = length < (high - low).amin();
    let body = &world.body;
    let intersects = |share: f64| {
        let pose = at(share);
        world.obstacles.iter().any(|o| {
            if short {
                surfaces_intersect(body, &pose, o, &o.pose)
            } else {
                shapes_intersect(body, &pose, o, &o.pose)
            }
        })
    };
    if !intersects(1.0) {
        return 1.0;
    }
    let (mut free, mut blocked) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (free + blocked);
        if intersects(middle) {
            blocked = middle;
        } else {
            free = middle;
        }
    }
    free
}

/// The motion of the reference point at `centre` nearest to a wish that ends at the rest distance from every contact or farther, so that a body which
/// has come nearer is eased out; where there is none, one that comes no nearer. `None` where neither can be found.
pub(super) fn project(
    (projector, rows): (&mut Projector, &mut Vec<HalfSpace>),
    metric: &Metric,
    wish: &Vector6,
    (contacts, centre): (&[Contact], &Point3<f64>),
    rest_distance: f64,
) -> Option<Vector6> {
    for most in [f64::INFINITY, 0.0] {
        rows.clear();
        rows.extend(contacts.iter().map(|contact| {
            let arm = contact.point_on_obstacle - centre;
            HalfSpace {
                jacobian: six(&contact.normal, &arm.cross(&contact.normal)),
                bound: (rest_distance - contact.gap).min(most),
            }
        }));
        let answer = projector.project(metric, wish, rows, &[]);
        if answer.status == ProjectionStatus::Solved {
            return Some(answer.acceleration);
        }
    }
    None
}

/// A constraint set of these contacts, for the coupling.
pub(super) fn constraint_set(
    sequence: u64,
    pose: &Pose,
    contacts: &[Contact],
    capacity: usize,
) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(capacity);
    set.sequence = sequence;
    set.god_object_pose = *pose;
    for contact in contacts.iter().take(capacity) {
        set.constraints.push(NonPenetrationConstraint {
            features: contact.features,
            point: contact.point_on_obstacle,
            normal: contact.normal,
            gap: contact.gap,
            separation: Separation::default(),
            obstacle_displacement: nalgebra::Vector3::zeros(),
            shading_normal: None,
        });
        set.gap_min = set.gap_min.min(contact.gap);
    }
    set.constraints.sort_by_key(|row| row.features);
    set
}

/// Force and torque clamped by norm, as the coupling does.
pub(super) fn limited(wrench: &Vector6, settings: &Settings) -> Vector6 {
    let clamp = |v: nalgebra::Vector3<f64>, limit: f64| v * (limit / v.norm().max(limit));
    six(
        &clamp(linear(wrench), settings.force_limit),
        &clamp(angular(wrench), settings.torque_limit),
    )
}
