//! The way of an obstacle to a pose, and how far it is free of the body that stands.

use nalgebra::{Point3, Vector3};

use super::impact::{AdvancementSettings, TimeOfImpact};
use super::motion::Motion;
use super::time_of_impact::time_of_impact;
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::geometry::Primitive;
use crate::spatial::{Pose, Vector6, advance_pose, at_reference_point, pose_difference};
use crate::world::{Body, Obstacle};

/// The way of an obstacle to a pose while the body stands.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ObstacleWay {
    /// The obstacle's origin in a straight line, with a constant axis of rotation.
    Straight(Motion),
    /// Seen from the obstacle, the body's reference point in a straight line, with a constant axis of rotation: for a half-space, which has
    /// no farthest point. The search that follows a bounded body past a half-space at rest then covers it.
    AsSeenFromObstacle {
        /// The body's motion in the obstacle's frame.
        body: Motion,
        /// World from the body's reference point, all the while.
        stands_at: Pose,
        /// World from obstacle at the end.
        end: Pose,
    },
}

impl ObstacleWay {
    /// The way from `start` over `displacement` (of the obstacle's origin: m, rad).
    pub(crate) fn new(
        obstacle: &Obstacle,
        start: &Pose,
        displacement: &Vector6,
        body: &Body,
        body_pose: &Pose,
    ) -> Self {
        if !matches!(obstacle.primitive, Some(Primitive::Plane { .. })) {
            return Self::Straight(Motion {
                start: *start,
                displacement: *displacement,
                reference_point: Point3::origin(),
            });
        }
        let end = advance_pose(start, displacement, 1.0);
        let stands_at = at_reference_point(body_pose, &body.reference_point);
        let [first, last] = [start, &end].map(|pose| pose.inverse() * stands_at);
        Self::AsSeenFromObstacle {
            body: Motion {
                start: first,
                displacement: pose_difference(&last, &first, &Vector3::zeros()),
                reference_point: body.reference_point,
            },
            stands_at,
            end,
        }
    }

    /// World from obstacle at `time` in [0, 1].
    pub(crate) fn pose_at(&self, time: f64) -> Pose {
        match self {
            Self::Straight(motion) => advance_pose(&motion.start, &motion.displacement, time),
            Self::AsSeenFromObstacle { end, .. } if time >= 1.0 => *end,
            Self::AsSeenFromObstacle {
                body, stands_at, ..
            } => {
                let mut pose = stands_at * body.pose_at(time).inverse();
                pose.rotation.renormalize();
                pose
            }
        }
    }
}

/// [`time_of_impact`] with the roles exchanged: the obstacle moves, the body stands.
pub(crate) fn time_of_impact_of_obstacle(
    obstacle: &Obstacle,
    way: &ObstacleWay,
    body: &Body,
    body_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    match way {
        ObstacleWay::Straight(motion) => {
            time_of_impact(obstacle, motion, body, body_pose, settings, workspace, work)
        }
        ObstacleWay::AsSeenFromObstacle { body: motion, .. } => {
            let stands = Pose::identity();
            time_of_impact(body, motion, obstacle, &stands, settings, workspace, work)
        }
    }
}
