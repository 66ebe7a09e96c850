//! The viewer's head in the picture.

use rerun::{Ellipsoids3D, FillMode, RecordingStream, RecordingStreamResult};

use crate::picture::{REPEAT_NS, transform};
use crate::scene::{MonitorScene, Pose};
use crate::{colours, paths};

/// Half sizes of a head along its axes, metres: x to the right ear, y up, -z ahead.
const HALF_SIZES: [f32; 3] = [0.075, 0.115, 0.095];

/// Draws the head. It is sent again now and then although it may not move: an observer who joins
/// late gets the newest history first, the oldest is thrown away, and one who is slow is not sent all.
pub(crate) struct Head {
    /// [`MonitorScene::head_size`].
    size: f64,
    /// Where it was last sent, and at which session time, ns; `None` until its place is known.
    sent: Option<(Pose, u64)>,
}

impl Head {
    /// Sends the head where it starts, if the scene says where.
    pub(crate) fn draw(
        stream: &RecordingStream,
        scene: &MonitorScene,
    ) -> RecordingStreamResult<Head> {
        let mut head = Head {
            size: scene.head_size,
            sent: None,
        };
        if let Some(pose) = scene.head {
            head.send(stream, pose, 0)?;
        }
        Ok(head)
    }

    /// Moves it to where it was `seen`; else it stays. The stream's time must be set to `now_ns`.
    pub(crate) fn show(
        &mut self,
        stream: &RecordingStream,
        seen: Option<Pose>,
        now_ns: u64,
    ) -> RecordingStreamResult<()> {
        let Some(pose) = seen.or(self.sent.map(|(pose, _)| pose)) else {
            return Ok(());
        };
        let is_there = |(sent, sent_ns): (Pose, u64)| {
            sent == pose && now_ns.saturating_sub(sent_ns) < REPEAT_NS
        };
        if self.sent.is_some_and(is_there) {
            return Ok(());
        }
        self.send(stream, pose, now_ns)
    }

    fn send(
        &mut self,
        stream: &RecordingStream,
        pose: Pose,
        now_ns: u64,
    ) -> RecordingStreamResult<()> {
        if self.sent.is_none() {
            let shape = Ellipsoids3D::from_half_sizes([half_sizes(self.size)])
                .with_colors([colours::WORKBENCH])
                .with_fill_mode(FillMode::MajorWireframe);
            stream.log_static(paths::HEAD, &shape)?;
        }
        self.sent = Some((pose, now_ns));
        stream.log(paths::HEAD, &transform(&pose))
    }
}

/// Of a head that is drawn `size` times as large as it is.
fn half_sizes(size: f64) -> [f32; 3] {
    HALF_SIZES.map(|half| (f64::from(half) * size) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_is_higher_than_deep_and_as_large_as_the_scene_shows_it() {
        let [wide, high, deep] = half_sizes(1.0);
        assert!(wide < deep && deep < high, "{wide} {high} {deep}");
        let [_, shrunk, _] = half_sizes(0.2);
        assert!((5.0 * shrunk - high).abs() < 1e-6, "{shrunk}");
    }
}
