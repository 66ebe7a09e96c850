//! Which rows are contacts of the cone problem, and what each of them carries at first.

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::cone::MAX_CONE_CONTACTS;
use super::contact::{ConeContact, tangents_of};
use super::hold::{Friction, FrictionProblem};
use crate::constraint::{FeaturePair, NonPenetrationConstraint, contact_jacobian};
use crate::quasi_statics::{ActiveRow, Projection, Rows};
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

/// Multipliers from which the cone problem starts.
struct Likely<'a> {
    /// The rows that hold the body in the predicted answer; `None` where contacts bear what they bore.
    pressing: Option<&'a [ActiveRow]>,
    carrying: &'a [Carrying],
}

impl Friction {
    /// Makes the row that the correction violates most a contact, if by more than what touching contacts may differ; whether there is one and room for it.
    pub(super) fn add_violated(
        &mut self,
        problem: &FrictionProblem<'_>,
        rows: &Rows,
        correction: &Vector6,
    ) -> bool {
        let acceleration = problem.unconstrained + problem.metric.unwhiten(correction);
        let violated = rows.violated(&acceleration, self.touching);
        let Some(index) = violated.filter(|row| !self.is_contact(*row)) else {
            return false;
        };
        if self.rows.is_full() {
            let Some(idle) = self.cone.contacts.iter().position(|c| c.load <= 0.0) else {
                return false;
            };
            self.rows.swap_remove(idle);
            self.cone.contacts.swap_remove(idle);
        }
        let new = Likely {
            pressing: None,
            carrying: &[],
        };
        self.add(problem, rows, index, &new)
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

    /// Fills the cone problem with the contacts that touch at the `frictionless` answer or at the `predicted` one, which loads them unless the body has
    /// `stuck`: there the share of each contact must not change. False when none of them is frictional.
    pub(super) fn gather(
        &mut self,
        problem: &FrictionProblem<'_>,
        rows: &Rows,
        frictionless: &Projection,
        predicted: &Projection,
        stuck: bool,
    ) -> bool {
        let carrying = self.carrying();
        self.forget();
        self.touched.clear();
        let at = [&frictionless.acceleration, &predicted.acceleration];
        rows.near(at, self.touching, &mut self.touched);
        let frictional = self.touched.iter().any(|row| {
            let constraint = problem.constraints.get(*row as usize);
            constraint.is_some_and(|row| self.coefficient_of(row) > 0.0)
        });
        if !frictional {
            return false;
        }
        // Those that are likely to hold the body; those that did so a moment ago, as they most likely do so again; and of the others, where they are more
        // than the cone problem takes, every n-th.
        let likely = Likely {
            pressing: (!stuck).then_some(&predicted.active[..]),
            carrying: &carrying,
        };
        for active in &predicted.active {
            self.add(problem, rows, active.row, &likely);
        }
        for before in &carrying {
            let found = problem
                .constraints
                .binary_search_by_key(&before.features, |row| row.features);
            if let Ok(index) = found {
                self.add(problem, rows, index as u32, &likely);
            }
        }
        let Self {
            touched,
            rows: contacts,
            ..
        } = self;
        touched.retain(|index| contacts.iter().all(|row| row.index != *index));
        let room = MAX_CONE_CONTACTS - self.rows.len();
        let stride = self.touched.len().div_ceil(room.max(1)).max(1);
        for k in (0..self.touched.len()).step_by(stride) {
            self.add(problem, rows, self.touched[k], &likely);
        }
        !self.rows.is_empty()
    }

    fn coefficient_of(&self, constraint: &NonPenetrationConstraint) -> f64 {
        let obstacle = usize::from(constraint.features.obstacle);
        self.coefficients.get(obstacle).copied().unwrap_or(0.0)
    }

    /// Makes a row a contact that carries what is likely, if there is room; whether it is a new one.
    fn add(
        &mut self,
        problem: &FrictionProblem<'_>,
        rows: &Rows,
        index: u32,
        likely: &Likely<'_>,
    ) -> bool {
        let at = index as usize;
        let (Some(row), Some(constraint)) = (rows.get(at), problem.constraints.get(at)) else {
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
        let mut carrying = likely.carrying.iter();
        let before = carrying.find(|before| before.features == features);
        if let Some(before) = before {
            contact.load = before.load;
            contact.grip = directions.map(|t| t.dot(&before.grip));
        }
        if let Some(pressing) = likely.pressing {
            let active = pressing.iter().find(|active| active.row == index);
            contact.load = active.map_or(0.0, |active| active.multiplier);
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
