//! Which rows are contacts of the cone problem, and what each of them carries at first.

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::cone::MAX_CONE_CONTACTS;
use super::contact::{ConeContact, tangents_of};
use super::hold::{Friction, FrictionProblem};
use crate::constraint::{FeaturePair, NonPenetrationConstraint, contact_jacobian};
use crate::quasi_statics::Projection;
use crate::spatial::{Vector6, linear};

/// The row of a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactRow {
    pub(super) index: u32,
    features: FeaturePair,
    /// The contact's tangents, world.
    directions: [Vector3<f64>; 2],
}

/// What a contact carried in the last answer, N s^2; the grip in world directions, as tangents turn with their normal.
#[derive(Clone, Copy, Debug)]
struct Carrying {
    features: FeaturePair,
    load: f64,
    grip: Vector3<f64>,
}

impl Friction {
    /// Makes the row that the correction violates most a contact, if by more than what touching contacts may differ; whether there is one and room for it.
    pub(super) fn add_violated(
        &mut self,
        problem: &FrictionProblem<'_>,
        correction: &Vector6,
    ) -> bool {
        let acceleration = problem.unconstrained + problem.metric.unwhiten(correction);
        let slacks = problem.rows.iter().map(|row| row.slack(&acceleration));
        let rows = slacks
            .enumerate()
            .filter(|(_, slack)| *slack < -self.touching);
        let deepest = rows.min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((index, _)) = deepest.filter(|(k, _)| !self.is_contact(*k as u32)) else {
            return false;
        };
        if self.rows.is_full() {
            let Some(idle) = self.cone.contacts.iter().position(|c| c.load <= 0.0) else {
                return false;
            };
            self.rows.swap_remove(idle);
            self.cone.contacts.swap_remove(idle);
        }
        self.add(problem, index as u32, &[])
    }

    fn is_contact(&self, index: u32) -> bool {
        self.rows.iter().any(|row| row.index == index)
    }

    /// What the loaded contacts of the last answer carry.
    fn carrying(&self) -> ArrayVec<Carrying, MAX_CONE_CONTACTS> {
        let contacts = self.rows.iter().zip(&self.cone.contacts);
        let loaded = contacts.filter(|(_, contact)| contact.load > 0.0);
        let carrying = loaded.map(|(row, contact)| Carrying {
            features: row.features,
            load: contact.load,
            grip: row.directions[0] * contact.grip[0] + row.directions[1] * contact.grip[1],
        });
        carrying.collect()
    }

    /// Fills the cone problem with the contacts that touch at the frictionless answer. False when none of them is frictional.
    pub(super) fn gather(&mut self, problem: &FrictionProblem<'_>, now: &Projection) -> bool {
        let carrying = self.carrying();
        self.cone.contacts.clear();
        self.rows.clear();
        self.touched.clear();
        let mut frictional = false;
        // What touched with friction a moment ago most likely does so again.
        let before = problem.unconstrained + problem.metric.unwhiten(&self.last);
        let rows = problem.rows.iter().zip(problem.constraints);
        for (index, (row, constraint)) in rows.enumerate() {
            let slack = row.slack(&now.acceleration).min(row.slack(&before));
            let touches = slack <= self.touching;
            if touches && self.touched.len() < self.touched.capacity() {
                self.touched.push(index as u32);
                frictional |= self.coefficient_of(constraint) > 0.0;
            }
        }
        if !frictional {
            return false;
        }
        // Those that hold the body now; those that did so a moment ago, as they most likely do so again; and of the others, where they are more
        // than the cone problem takes, every n-th.
        for active in &now.active {
            self.add(problem, active.row, &carrying);
        }
        for before in &carrying {
            let found = problem
                .constraints
                .binary_search_by_key(&before.features, |row| row.features);
            if let Ok(index) = found {
                self.add(problem, index as u32, &carrying);
            }
        }
        let Self { touched, rows, .. } = self;
        touched.retain(|index| rows.iter().all(|row| row.index != *index));
        let room = MAX_CONE_CONTACTS - self.rows.len();
        let stride = self.touched.len().div_ceil(room.max(1)).max(1);
        for k in (0..self.touched.len()).step_by(stride) {
            self.add(problem, self.touched[k], &carrying);
        }
        !self.rows.is_empty()
    }

    fn coefficient_of(&self, constraint: &NonPenetrationConstraint) -> f64 {
        let obstacle = usize::from(constraint.features.obstacle);
        self.coefficients.get(obstacle).copied().unwrap_or(0.0)
    }

    /// Makes a row a contact that carries what it carried `before`, if there is room; whether it is a new one.
    fn add(&mut self, problem: &FrictionProblem<'_>, index: u32, before: &[Carrying]) -> bool {
        let at = index as usize;
        let (Some(row), Some(constraint)) = (problem.rows.get(at), problem.constraints.get(at))
        else {
            return false;
        };
        if self.is_contact(index) || self.rows.is_full() {
            return false;
        }
        let metric = problem.metric;
        let point = problem.point(constraint);
        let point_row = |direction| contact_jacobian(&direction, &point, problem.reference_point);
        let directions = tangents_of(&linear(&row.jacobian));
        let tangents = directions.map(point_row);
        let carried = problem.carried.of(constraint);
        let normal = metric.whiten_row(&row.jacobian);
        let wished = problem.unconstrained - problem.stuck_at;
        let contact = ConeContact::new(
            self.coefficient_of(constraint),
            normal,
            tangents.map(|j| metric.whiten_row(&j)),
            row.slack(problem.unconstrained),
            [0, 1].map(|i| tangents[i].dot(&wished) - directions[i].dot(&carried)),
            directions.map(|t| t.dot(&constraint.obstacle_displacement)),
        );
        let Some(mut contact) = contact else {
            return false;
        };
        let features = constraint.features;
        if let Some(carried) = before.iter().find(|before| before.features == features) {
            contact.load = carried.load;
            contact.grip = directions.map(|t| t.dot(&carried.grip));
        }
        self.cone.contacts.push(contact);
        self.rows.push(ContactRow {
            index,
            features,
            directions,
        });
        true
    }
}
