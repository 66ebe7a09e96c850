//! How far a published set looks ahead. What that costs is bounded by the work of a collection: late updates must not make later ones still later.

use nalgebra::{Point3, Vector3};

use super::GodObject;
use super::substep::Update;
use crate::collision::distance_at_least;
use crate::spatial::{Pose, pose_difference};

/// The paper's cone has touching contacts only: gaps up to this many rest distances touch.
pub(super) const TOUCHING_REST_DISTANCES: f64 = 2.0;

impl GodObject {
    /// The body's fastest point at the device may be up to `distance` (m) from where the device pose of the next updates puts it, by the
    /// time at which their sets are used: the pose came late, or the sets travel. They look ahead that much farther, as far as the work allows.
    ///
    /// What is not a positive finite number counts as zero.
    pub fn set_device_ahead(&mut self, distance: f64) {
        let ahead = distance.is_finite() && distance > 0.0;
        self.device_ahead = if ahead { distance } else { 0.0 };
    }

    /// The point G of the body, in its own frame, m.
    pub fn reference_point(&self) -> &Point3<f64> {
        &self.world.body.reference_point
    }

    /// Distance of the body's farthest point from the reference point, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// How far the set that an update publishes collects, m.
    pub(super) fn published_distance(&self, update: &Update) -> f64 {
        if self.settings.look_ahead {
            self.settings.activation_distance
                + update.look_ahead.min(self.settings.look_ahead_limit)
        } else {
            TOUCHING_REST_DISTANCES * self.settings.rest_distance
        }
    }

    /// Until the next set the felt body is between here and where the device goes, within `device_next` (m) of its pose, and obstacles go as far again:
    /// what is farther away changes nothing.
    pub(super) fn note_far(&mut self, device: &Pose, device_next: f64) {
        let here = self.pose_at_reference_point();
        let left = self.motion_length(&pose_difference(device, &here, &Vector3::zeros()));
        let reach = self.settings.activation_distance + device_next + left;
        let center = Point3::from(here.translation.vector);
        for (placed, obstacle) in self.obstacles.iter_mut().zip(&self.world.obstacles) {
            let body = &self.world.body;
            let off = distance_at_least(body, &center, obstacle, &placed.pose);
            placed.far = off > reach + placed.way(); // false for NaN
        }
    }
}
