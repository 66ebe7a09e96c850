//! How far a motion is free of every obstacle: continuous collision detection, obstacle by obstacle.

use super::placed_obstacle::PlacedObstacle;
use super::{GodObject, StepReport};
use crate::collision::{AdvancementSettings, Motion, TimeOfImpact, time_of_impact};
use crate::settings::Settings;

impl GodObject {
    /// The fraction of the motion that is free of every obstacle but those that go along, in [0, 1], and which obstacle stops it there.
    pub(super) fn free_time(
        &mut self,
        mut motion: Motion,
        goes_along: impl Fn(&PlacedObstacle) -> bool,
        report: &mut StepReport,
    ) -> (f64, Option<usize>) {
        let settings = Self::advancement(&self.settings);
        let (mut free, mut stopped) = (1.0, None);
        // What is near comes first: the others need to be searched only up to where it stops the body.
        for index in self.order.iter().copied() {
            let (obstacle, placed) = (&self.world.obstacles[index], &self.obstacles[index]);
            if goes_along(placed) {
                continue;
            }
            let found = time_of_impact(
                &self.world.body,
                &motion,
                obstacle,
                &placed.pose,
                &settings,
                self.collision.of_obstacle(index),
                &mut report.work,
            );
            let time = match found {
                TimeOfImpact::Separated => continue,
                TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
                TimeOfImpact::Overlapping => 0.0,
            };
            let shortened = time.clamp(0.0, 1.0);
            free *= shortened;
            motion.displacement *= shortened;
            if shortened < 1.0 {
                stopped = Some(index);
            }
            if shortened == 0.0 {
                break;
            }
        }
        (free, stopped)
    }

    /// Tolerances and limits of the collision searches.
    pub(super) fn advancement(settings: &Settings) -> AdvancementSettings {
        AdvancementSettings {
            minimum_gap: settings.minimum_gap,
            gap_tolerance: settings.gap_tolerance,
            max_iterations: settings.max_advancement_steps,
            ..AdvancementSettings::default()
        }
    }
}
