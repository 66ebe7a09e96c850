//! The rows of a constraint set made ready for the coupling: once, by who publishes the set, and not in the microsecond of each reader.
//!
//! | symbol | name in code                  | meaning                                                          |
//! |--------|-------------------------------|------------------------------------------------------------------|
//! | x_s    | `god_object`                  | pose of the reference point at which the rows hold                |
//! | M      | `metric`                      | mass matrix there                                                |
//! | J, b   | `rows`                        | rows and bounds of the coupling, unit in the metric              |
//! |        | `names`                       | the features of every row as a number that sorts as they do      |
//! |        | `likely`                      | rows that hold the body at the device pose that the publisher knew |
//!
//! They say for which set, body and settings they were made; a coupling with others makes its own.
//! Source: beyond Ortega et al. 2007, who collect and project on one machine.

use arrayvec::ArrayVec;
use nalgebra::{Matrix3, Point3, Vector3};

use crate::constraint::{
    ConstraintSet, Feature, FeaturePair, NonPenetrationConstraint, contact_jacobian,
};
use crate::quasi_statics::{HalfSpace, MAX_ACTIVE, Metric, Projector, SolverKind};
use crate::settings::{RotationMetric, Settings};
use crate::spatial::{Pose, at_reference_point, pose_difference, pose_is_finite};
use crate::world::{Body, metric_at};

/// What rows depend on beside the set: the body and the settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RowBasis {
    mass: f64,
    inertia: Matrix3<f64>,
    /// Body frame, m.
    pub(crate) reference_point: Point3<f64>,
    rotation_metric: RotationMetric,
    k_s: f64,
    rest_distance: f64,
    look_ahead: bool,
    max_constraints: usize,
}

impl RowBasis {
    pub(crate) fn of(body: &Body, settings: &Settings) -> Self {
        Self {
            mass: body.mass,
            inertia: body.inertia,
            reference_point: body.reference_point,
            rotation_metric: settings.rotation_metric,
            k_s: settings.k_s,
            rest_distance: settings.rest_distance,
            look_ahead: settings.look_ahead,
            max_constraints: settings.max_constraints,
        }
    }

    /// M with the reference point at `pose`; `None` where it is not positive definite.
    pub(crate) fn metric(&self, pose: &Pose) -> Option<Metric> {
        metric_at(self.mass, &self.inertia, self.rotation_metric, pose)
    }

    /// Bound of a row in the coupling, m: a_u is only the fraction k_s of the difference, and a body nearer than the rest distance is
    /// not pushed: there is no force at a distance. Without look-ahead: the paper's cone.
    #[inline]
    pub(crate) fn bound(&self, gap: f64) -> f64 {
        if self.look_ahead {
            (self.k_s * (self.rest_distance - gap)).min(0.0)
        } else {
            0.0
        }
    }

    /// A row at the reference point `center`, m.
    #[inline]
    pub(crate) fn half_space(
        &self,
        constraint: &NonPenetrationConstraint,
        center: &Point3<f64>,
    ) -> HalfSpace {
        let normal = constraint.shading_normal.unwrap_or(constraint.normal);
        HalfSpace {
            jacobian: contact_jacobian(&normal, &constraint.point, center),
            bound: self.bound(constraint.gap),
        }
    }
}

impl ConstraintSet {
    /// Makes the rows ready for couplings of this body with these settings, so that each of them need not, and finds out which of
    /// them hold the body at `device_pose`: where the device is by then, it is not far from there. The god-object's own sets are ready.
    ///
    /// No allocation up to the set's capacity. Rows that are changed afterwards need it again. The force does not depend on it but for its
    /// last digits.
    pub fn prepare(&mut self, body: &Body, settings: &Settings, device_pose: Option<&Pose>) {
        let mut prepared = std::mem::take(&mut self.prepared);
        prepared.prepare(self, &RowBasis::of(body, settings));
        if let Some(device_pose) = device_pose {
            prepared.foresee(device_pose);
        }
        self.prepared = prepared;
    }
}

/// Which set rows were made of: its sequence, pose and number of rows.
type SetId = (u64, Pose, usize);

fn id_of(set: &ConstraintSet) -> SetId {
    (set.sequence, set.god_object_pose, set.constraints.len())
}

/// See the file head. No allocation after `with_capacity`.
#[derive(Debug)]
pub(crate) struct PreparedRows {
    /// What they were made of and for; `None` before the first.
    of: Option<(SetId, RowBasis)>,
    /// Pose of the reference point.
    pub(crate) god_object: Pose,
    /// `None` where it is not positive definite, or the pose is not finite.
    pub(crate) metric: Option<Metric>,
    /// Some row has a shading normal.
    pub(crate) shaded: bool,
    /// Some obstacle came nearer or went away in the update that made the set.
    pub(crate) moving: bool,
    /// Has the rows.
    pub(crate) projector: Projector,
    /// Rows of the last answer of `projector`; none where nothing was foreseen.
    pub(crate) likely: ArrayVec<u32, MAX_ACTIVE>,
    /// Ascending.
    pub(crate) names: Vec<RowName>,
    pub(crate) bounds: Vec<f64>,
    /// Where the rows lie until they are made unit.
    given: Vec<HalfSpace>,
}

impl PreparedRows {
    pub(crate) fn with_capacity(capacity: usize) -> Self {
        Self {
            of: None,
            god_object: Pose::identity(),
            metric: None,
            shaded: false,
            moving: false,
            projector: Projector::new(SolverKind::ActiveSet, capacity),
            likely: ArrayVec::new(),
            names: Vec::with_capacity(capacity),
            bounds: Vec::with_capacity(capacity),
            given: Vec::with_capacity(capacity),
        }
    }

    /// Whether these are the rows of `set`, for this body and these settings.
    #[inline]
    pub(crate) fn serve(&self, set: &ConstraintSet, basis: &RowBasis) -> bool {
        self.of
            .as_ref()
            .is_some_and(|(of, by)| *of == id_of(set) && by == basis) // false for a pose that is not finite
    }

    /// Everything that the set decides, whatever the device does. At most as many rows as the settings allow.
    pub(crate) fn prepare(&mut self, set: &ConstraintSet, basis: &RowBasis) {
        let rows = &set.constraints[..set.constraints.len().min(basis.max_constraints)];
        self.god_object = at_reference_point(&set.god_object_pose, &basis.reference_point);
        let center = Point3::from(self.god_object.translation.vector);
        self.given.clear();
        self.given
            .extend(rows.iter().map(|row| basis.half_space(row, &center)));
        self.bounds.clear();
        self.bounds.extend(self.given.iter().map(|row| row.bound));
        self.names.clear();
        self.names
            .extend(rows.iter().map(|row| RowName::of(&row.features)));
        self.shaded = rows.iter().any(|row| row.shading_normal.is_some());
        self.moving = rows
            .iter()
            .any(|row| row.obstacle_displacement != Vector3::zeros());
        self.metric = basis.metric(&self.god_object);
        if let Some(metric) = &self.metric {
            self.projector.prepare(metric, &self.given);
        }
        self.likely.clear();
        self.of = Some((id_of(set), *basis));
    }

    /// Projects for one device pose: the rows that hold the body there are the first guess for others.
    fn foresee(&mut self, device_pose: &Pose) {
        let Some((_, basis)) = &self.of else {
            return;
        };
        let usable = pose_is_finite(device_pose) && self.metric.is_some();
        if !usable {
            return;
        }
        let device = at_reference_point(device_pose, &basis.reference_point);
        let difference = pose_difference(&device, &self.god_object, &Vector3::zeros());
        let answer = self
            .projector
            .project_prepared(&(difference * basis.k_s), &[]);
        self.likely
            .extend(answer.active.iter().map(|active| active.row));
    }

    /// Whether the rows of `set` are those that were made ready, by their names and bounds.
    pub(crate) fn hold(&self, set: &ConstraintSet) -> bool {
        let Some((_, basis)) = &self.of else {
            return false;
        };
        let held = self.names.iter().zip(&self.bounds);
        set.constraints
            .iter()
            .zip(held)
            .all(|(row, (name, bound))| {
                let same_bound = basis.bound(row.gap).to_bits() == bound.to_bits();
                RowName::of(&row.features) == *name && same_bound
            })
    }

    /// Takes over what a coupling reads; the memory of the rows as they were given stays as it is.
    pub(crate) fn copy_from(&mut self, source: &Self) {
        self.of = source.of;
        self.god_object = source.god_object;
        self.metric = source.metric;
        self.shaded = source.shaded;
        self.moving = source.moving;
        self.projector.copy_from(&source.projector);
        self.likely.clone_from(&source.likely);
        self.names.clone_from(&source.names);
        self.bounds.clone_from(&source.bounds);
    }
}

impl Default for PreparedRows {
    fn default() -> Self {
        Self::with_capacity(0)
    }
}

/// A pair of features as a number that sorts as the pair does: one comparison for each row of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RowName(u128);

/// Bits of one feature: 3 for its kind, 32 for its index.
const FEATURE_BITS: u32 = 35;

impl RowName {
    pub(crate) fn of(features: &FeaturePair) -> Self {
        let number = |feature: &Feature| -> u128 {
            let (kind, index) = match *feature {
                Feature::Vertex(index) => (0, index),
                Feature::Edge(index) => (1, index),
                Feature::Face(index) => (2, index),
                Feature::Whole => (3, 0),
                Feature::Side => (4, 0),
                Feature::Cap(end) => (5, u32::from(end)),
                Feature::Rim(rim, place) => (6, u32::from(rim) << 8 | u32::from(place)),
            };
            kind << 32 | u128::from(index)
        };
        let pair = number(&features.on_body) << FEATURE_BITS | number(&features.on_obstacle);
        Self(u128::from(features.obstacle) << (2 * FEATURE_BITS) | pair)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn feature() -> impl Strategy<Value = Feature> {
        prop_oneof![
            any::<u32>().prop_map(Feature::Vertex),
            any::<u32>().prop_map(Feature::Edge),
            any::<u32>().prop_map(Feature::Face),
            Just(Feature::Whole),
            Just(Feature::Side),
            any::<u8>().prop_map(Feature::Cap),
            any::<(u8, u8)>().prop_map(|(rim, place)| Feature::Rim(rim, place)),
        ]
    }

    fn pair() -> impl Strategy<Value = FeaturePair> {
        (0..3_u16, feature(), feature()).prop_map(|(obstacle, on_body, on_obstacle)| FeaturePair {
            obstacle,
            on_body,
            on_obstacle,
        })
    }

    proptest! {
        #[test]
        fn names_sort_as_features_do(a in pair(), b in pair()) {
            prop_assert_eq!(RowName::of(&a).cmp(&RowName::of(&b)), a.cmp(&b));
        }
    }
}
