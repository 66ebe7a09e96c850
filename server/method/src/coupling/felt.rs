//! From the held body to the hand: textures, limits, energy.

use nalgebra::{Point3, Vector3};

use super::Coupling;
use super::answer::Answer;
use crate::constraint::{ConstraintSet, Feature};
use crate::quasi_statics::{Metric, Projection};
use crate::spatial::{Pose, Vector6, angular, linear, six};
use crate::surface::{Friction, TOUCHING_MOTION_TOLERANCES};

/// A wrench on its way to the device.
#[derive(Clone, Copy, Debug)]
pub(super) struct Felt {
    /// N, N m, at the reference point.
    pub(super) wrench: Vector6,
    /// Whether a limit cut it.
    pub(super) saturated: bool,
    /// Share of the force that the limits left, in [0, 1].
    share: f64,
}

impl Coupling {
    /// The wrench of an answer, tilted by textures and within the limits. `moved`: the device was read anew.
    pub(super) fn felt(&mut self, answer: &Answer, set: &ConstraintSet, moved: bool) -> Felt {
        let mut wrench = answer.held * self.settings.k_h;
        if let Some(mut textures) = self.textures.take() {
            let felt_at = answer.projection.acceleration / self.settings.k_s;
            let touched = self.touched(set, &answer.projection, answer.reached.as_ref());
            let god_object = &self.present.god_object;
            wrench = textures.tilt(&wrench, god_object, &felt_at, moved, touched);
            self.textures = Some(textures);
        }
        let unlimited = linear(&wrench).norm();
        let (wrench, saturated) = self.limited(&wrench);
        let share = if unlimited > 0.0 {
            linear(&wrench).norm() / unlimited
        } else {
            1.0
        };
        Felt {
            wrench,
            saturated,
            share,
        }
    }

    /// What moving obstacles did on the hand with this force, by the ways that the set says they came.
    pub(super) fn note_obstacle_work(
        &mut self,
        projection: &Projection,
        set: &ConstraintSet,
        felt: &Felt,
    ) {
        let along = self.present.moving.then(|| {
            let rows = projection.active.iter();
            let done = rows.filter_map(|row| {
                let approach = set.constraints.get(row.row as usize)?.approach();
                Some(row.multiplier * approach)
            });
            let along_surfaces = self
                .friction
                .as_ref()
                .map_or(0.0, Friction::work_of_obstacles);
            (done.sum::<f64>() + along_surfaces) * self.settings.k_h * felt.share
        });
        self.obstacle_work.arrive(along);
    }

    /// The wrench, less what the energy at the device's port does not allow, where passivity is enforced.
    pub(super) fn within_energy(
        &mut self,
        metric: &Metric,
        device: &Pose,
        felt: Felt,
        moved: bool,
    ) -> Felt {
        let Some(mut energy) = self.energy else {
            return felt;
        };
        energy.grant(self.obstacle_work.work());
        if moved {
            energy.arrive(device);
        }
        let (wrench, clamped) = self.limited(&energy.within_reserve(metric, &felt.wrench));
        energy.hold(device, &wrench);
        self.energy = Some(energy);
        Felt {
            wrench,
            saturated: felt.saturated || clamped,
            ..felt
        }
    }

    /// Obstacle, its feature, point and normal of every contact that touches in the answer: whichever of them were found to hold the body. Where rounds
    /// of implicit constraints have `reached` a pose, the gaps are those there.
    fn touched<'a>(
        &'a self,
        set: &'a ConstraintSet,
        answer: &'a Projection,
        reached: Option<&'a Pose>,
    ) -> impl Iterator<Item = (u16, Feature, Point3<f64>, Vector3<f64>)> + 'a {
        let nothing_held = answer.active.is_empty();
        let center = Point3::from(self.present.god_object.translation.vector);
        let tolerance = TOUCHING_MOTION_TOLERANCES * self.settings.motion_tolerance;
        let rows = set.constraints.iter().zip(&self.bounds).enumerate();
        rows.filter(move |(row, (contact, bound))| {
            let slack = reached.map_or_else(
                || {
                    let row = self.basis.half_space(contact, &center);
                    row.jacobian.dot(&answer.acceleration) - **bound
                },
                |reached| {
                    let start = &self.present.god_object;
                    let moved = contact.moved(start, reached, self.present.shaded);
                    self.settings.k_s * (moved.gap - contact.gap) - **bound
                },
            );
            let holds = || answer.active.iter().any(|held| held.row as usize == *row);
            !nothing_held && (slack <= tolerance || holds())
        })
        .map(|(_, (contact, _))| {
            let features = &contact.features;
            let on_obstacle = features.on_obstacle;
            (
                features.obstacle,
                on_obstacle,
                contact.point,
                contact.normal,
            )
        })
    }

    /// Force and torque clamped by norm, each with its direction kept.
    fn limited(&self, wrench: &Vector6) -> (Vector6, bool) {
        let clamp = |v: Vector3<f64>, limit: f64| {
            let norm = v.norm();
            if norm <= limit {
                (v, false)
            } else {
                (v * (limit / norm), true)
            }
        };
        let (force, force_clamped) = clamp(linear(wrench), self.settings.force_limit);
        let (torque, torque_clamped) = clamp(angular(wrench), self.settings.torque_limit);
        (six(&force, &torque), force_clamped || torque_clamped)
    }
}
