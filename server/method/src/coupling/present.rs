//! What a new constraint set changes, once for all device samples until the next.

use nalgebra::Point3;

use super::Coupling;
use crate::constraint::ConstraintSet;
use crate::quasi_statics::Metric;
use crate::spatial::{Pose, Vector6};
use crate::surface::Friction;

/// What depends on the constraint set alone: taken from it when it arrives, used for every device sample until the next one.
/// The rows themselves are in the projector.
#[derive(Debug)]
pub(super) struct PresentSet {
    /// Sequence and pose of the set; `None` before the first.
    of: Option<(u64, Pose, usize)>,
    /// Pose of the reference point.
    pub(super) god_object: Pose,
    /// `None` where it is not positive definite, or the pose is not finite.
    pub(super) metric: Option<Metric>,
    pub(super) shaded: bool,
    /// Some obstacle came nearer or went away in the update that made the set.
    pub(super) moving: bool,
}

impl PresentSet {
    pub(super) fn none() -> Self {
        Self {
            of: None,
            god_object: Pose::identity(),
            metric: None,
            shaded: false,
            moving: false,
        }
    }

    #[inline]
    fn is(&self, set: &ConstraintSet) -> bool {
        let of = (set.sequence, set.god_object_pose, set.constraints.len());
        self.of == Some(of) // false for a pose that is not finite
    }
}

impl Coupling {
    /// Takes the set in where it is new, which it returns, and carries rows of obstacles that move to this time, s.
    pub(super) fn receive(&mut self, time: f64, set: &ConstraintSet) -> bool {
        let arrived = !self.present.is(set);
        if arrived {
            self.take(set);
            self.arrival.observe(set.published.unwrap_or(time));
            self.anchor.arrive(set);
        }
        let ahead = if self.present.moving {
            self.arrival.share_of_an_update(time)
        } else {
            0.0
        };
        if self.present.moving {
            self.carry_rows(ahead, set);
        }
        self.anchor.advance(ahead, self.present.moving);
        arrived
    }

    /// New rows on their way in: each gets the bound that constraint adaptation gives it at this time, s.
    pub(super) fn adapt(&mut self, time: f64, unconstrained: &Vector6, set: &ConstraintSet) {
        // Where the last force would leave the body: a new constraint jumps only as far as this violates it.
        let reached = unconstrained + self.correction;
        self.correction = Vector6::zeros();
        let Some(adaptation) = self.adaptation.as_mut().filter(|state| !state.is_idle()) else {
            return;
        };
        let center = Point3::from(self.present.god_object.translation.vector);
        let jacobian = |row: usize| {
            let row = self.basis.half_space(&set.constraints[row], &center);
            row.jacobian
        };
        adaptation.step(
            time,
            |row| self.targets[row],
            |row| jacobian(row).dot(&reached),
            |row, bound| {
                self.projector.set_bound(row, bound);
                self.bounds[row] = bound;
            },
        );
    }

    /// Takes a new set in: its rows, which its publisher has made ready or which are made ready here, and which of them are new.
    fn take(&mut self, set: &ConstraintSet) {
        let prepared = if set.prepared.serve(set, &self.basis) {
            debug_assert!(
                set.prepared.hold(set),
                "rows were changed after they were made ready"
            );
            &set.prepared
        } else {
            self.own.prepare(set, &self.basis);
            &self.own
        };
        self.projector.copy_from(&prepared.projector);
        self.targets.clone_from(&prepared.bounds);
        self.bounds.clone_from(&prepared.bounds);
        if let Some(visits) = self.most_row_visits {
            let rough = if self.friction.is_some() {
                Friction::MAX_PROJECTIONS
            } else {
                0
            };
            let projections = (1 + self.settings.implicit_rounds) * (1 + rough);
            let rows = self.bounds.len().max(1) as u32; // a set's capacity
            let most = visits / rows.saturating_mul(projections);
            self.projector.limit_iterations(most);
            self.implicit.limit_iterations(most);
        }

        // Rows are known by their features. Those that held the body last time are looked for where they are now, unless the publisher has
        // done it, for a device pose of a moment ago.
        self.known.replace(&prepared.names);
        if let Some(adaptation) = &mut self.adaptation {
            adaptation.observe(&self.known);
        }
        if prepared.likely.is_empty() {
            let known = &self.known;
            self.warm_start.retain_mut(|row| {
                let place = known.place_of(*row);
                *row = place.unwrap_or(*row);
                place.is_some()
            });
        } else {
            self.warm_start.clear();
            self.warm_start.extend(&prepared.likely);
        }
        self.present = PresentSet {
            of: Some((set.sequence, set.god_object_pose, set.constraints.len())),
            god_object: prepared.god_object,
            metric: prepared.metric,
            shaded: prepared.shaded,
            moving: prepared.moving,
        };
    }

    /// Rows of obstacles that move, where those will be by now: `ahead` of the set by this share of its update's way.
    fn carry_rows(&mut self, ahead: f64, set: &ConstraintSet) {
        for (row, constraint) in set.constraints.iter().take(self.bounds.len()).enumerate() {
            let approach = constraint.approach();
            if approach != 0.0 {
                let bound = self.basis.bound(constraint.gap) + self.settings.k_s * approach * ahead;
                self.targets[row] = bound;
                self.bounds[row] = bound;
                self.projector.set_bound(row, bound);
            }
        }
    }
}
