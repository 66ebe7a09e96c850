//! The motion along which two bodies are known to be apart, from one search to the next.
//!
//! A search that begins where the last one ended need not look again whether the surfaces cross, whichever of the two moved then, about whatever
//! point.

use super::motion::{Placement, RelativeMotion};

/// A body that is off a known place by less than this share of the gap there is apart, too.
const SHARE_OF_GAP: f64 = 0.5;

/// The latest motion of two bodies, if there was one.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownApart(Option<Known>);

#[derive(Clone, Copy, Debug)]
struct Known {
    /// Identities of body and obstacle.
    key: [u64; 2],
    motion: RelativeMotion,
    /// Up to here the bodies are apart by `gap`, m.
    until: f64,
    gap: f64,
}

impl KnownApart {
    /// Remembers that two meshes stay apart by `gap`, m, up to the time `until` of a motion, in place of the motion before.
    pub(super) fn remember(
        &mut self,
        key: [u64; 2],
        motion: &RelativeMotion,
        until: f64,
        gap: f64,
    ) {
        self.0 = Some(Known {
            key,
            motion: *motion,
            until,
            gap,
        });
    }

    /// Whether the meshes are known to be apart with the body there; the radii bound the distance of the body's points from G, and of the obstacle's
    /// from its origin, m.
    pub(super) fn knows(&self, key: [u64; 2], body: &Placement, radii: [f64; 2]) -> bool {
        self.0.as_ref().is_some_and(|known| {
            known.key == key && known.holds(body, radii[0])
                || known.key == [key[1], key[0]] && known.holds(&body.inverse(), radii[1])
        })
    }
}

impl Known {
    fn holds(&self, body: &Placement, radius: f64) -> bool {
        let about = self.motion.about_reference(body);
        let radius = radius + (about.center - body.center).norm();
        let body = &about;
        [self.until, self.motion.time_nearest(body), 0.0]
            .iter()
            .any(|time| {
                let place = self.motion.at(time.clamp(0.0, self.until));
                place.distance_to(body, radius) < SHARE_OF_GAP * self.gap // false for NaN
            })
    }
}

#[cfg(test)]
mod tests {
    use super::super::motion::Motion;
    use super::*;
    use crate::spatial::{Pose, at_reference_point, from_reference_point, six};
    use nalgebra::{Point3, Vector3};

    const KEY: [u64; 2] = [1, 2];
    const RADII: [f64; 2] = [0.1, 0.3];

    #[test]
    fn where_a_motion_ends_and_on_its_way_bodies_are_known_apart_and_nowhere_else() {
        let obstacle = Pose::new(Vector3::new(0.3, -2.0, 0.1), Vector3::new(0.4, 0.2, -1.0));
        let point = Point3::new(0.01, -0.02, 0.005);
        let mut known = KnownApart::default();
        let mut start = Pose::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 0.3, 0.2));
        for k in 0..200 {
            let u = f64::from(k);
            let turn = Vector3::new(0.003 * u.sin(), 0.005, 0.002 * u.cos());
            let path = if k % 5 == 0 {
                Vector3::zeros()
            } else {
                Vector3::new(1e-3 * u.cos(), 2e-3, 1e-4)
            };
            let motion = Motion {
                start,
                displacement: six(&path, &turn),
                reference_point: point,
            };
            let relative = RelativeMotion::new(&motion, &obstacle);
            let first = relative.at(0.0);
            assert_eq!(known.knows(KEY, &first, RADII), k > 0, "{k}");
            assert!(!known.knows([1, 3], &first, RADII));
            let until = 0.3 + 0.7 * u.sin().abs();
            assert_eq!(known.knows(KEY, &first, RADII), k > 0);
            known.remember(KEY, &relative, until, 1e-6);
            assert!(!known.knows(KEY, &relative.at(until + 0.01), RADII));
            // To the end, or part of the way, as when another obstacle is met first; through the body's own pose.
            let made = if k % 3 == 0 { 0.6 * until } else { until };
            let own = from_reference_point(&motion.pose_at(made), &point);
            start = at_reference_point(&own, &point);
        }
    }

    #[test]
    fn what_one_mesh_has_shown_by_its_motion_the_other_knows_about_whatever_point() {
        let mut known = KnownApart::default();
        let mut poses = [
            Pose::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 0.3, 0.2)),
            Pose::new(Vector3::new(0.3, -2.0, 0.1), Vector3::new(0.4, 0.2, -1.0)),
        ];
        for k in 0..200_usize {
            let (u, moving) = (k as f64, k % 2);
            let (still, key) = (1 - moving, [moving as u64, 1 - moving as u64]);
            let point = Point3::new(0.01 * u.sin(), -0.02, 0.03 * u.cos());
            let motion = Motion {
                start: at_reference_point(&poses[moving], &point),
                displacement: six(
                    &Vector3::new(1e-3 * u.cos(), 2e-3, 1e-4),
                    &Vector3::new(0.003 * u.sin(), 0.005, 0.002 * u.cos()),
                ),
                reference_point: point,
            };
            let relative = RelativeMotion::new(&motion, &poses[still]);
            let first = relative.at(0.0);
            assert_eq!(known.knows(key, &first, RADII), k > 0, "{k}");
            known.remember(key, &relative, 0.8, 1e-6);
            let beyond = relative.at(0.81);
            assert!(!known.knows(key, &beyond, RADII));
            assert!(!known.knows([key[1], key[0]], &beyond.inverse(), RADII));
            // To the end, or part of the way.
            let made = if k % 3 == 0 { 0.6 } else { 0.8 };
            poses[moving] = from_reference_point(&motion.pose_at(made), &point);
        }
    }
}
