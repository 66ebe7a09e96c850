//! The viewer's head: still, swaying as people do who stand and look, or where a tracker sees it: a VRPN tracker that the server listens to,
//! or `taut track` on another PC (`session::remote_head`).
//!
//! | symbol | name in code | unit | meaning                                              |
//! |--------|--------------|------|------------------------------------------------------|
//! | A      | `amplitude`  | m    | largest displacement to either side                  |
//! | T      | `period`     | s    | time of one sway from side to side and back          |
//!
//! A swaying head is a pure function of session time, so that every reader at the same time sees the same head. A tracked
//! head is at rest until the first report; when the tracker falls silent or loses the sensor, the head stays where it was
//! seen last: a picture that jumps is worse than one that is a little off.

use std::f64::consts::TAU;
use std::time::Duration;

use god_object::nalgebra::Vector3;
use god_object::spatial::Pose;
use taut_bridge::{TrackerFeed, TrackerState, VrpnSettings, vrpn_settings};
use taut_link::HeadOutput;
use taut_scene::{HeadTracking, Viewer};
use taut_vrpn::SensorMapping;

use crate::session::remote_head::RemoteHead;

/// Sway fore and aft takes this much longer than from side to side: the path does not repeat at once.
const FORE_AFT_PERIODS: f64 = 1.618;
/// Sway fore and aft is this share of that from side to side.
const FORE_AFT_SHARE: f64 = 0.5;

/// One reader's view of where the viewer's head is.
#[derive(Debug)]
pub struct Head {
    /// The head at rest, workbench frame.
    pub rest: Pose,
    /// Distance between the pupils, m.
    pub eye_separation: f64,
    motion: Motion,
}

/// Simulated movement of a head.
#[derive(Clone, Copy, Debug)]
struct Sway {
    /// Largest displacement to either side, m.
    amplitude: f64,
    /// Time of one sway, s.
    period: f64,
}

#[derive(Debug)]
enum Motion {
    Still,
    Sway(Sway),
    Tracker(Box<Tracked>),
    Remote(Box<RemoteHead>),
}

#[derive(Debug)]
struct Tracked {
    feed: TrackerFeed,
    seen: Seen,
}

/// What a tracker has said of a head.
#[derive(Debug)]
struct Seen {
    mapping: SensorMapping,
    /// Where it was seen last; at rest before.
    last: Pose,
    /// Reports taken in so far, by the tracker's count.
    reports: u64,
    /// When that of `last` was first seen, session time.
    came: Option<Duration>,
}

/// Starts to listen to the viewer's tracker, if there is one: a head for each reader. `remote` are the link's ends for a tracker on the network;
/// without them such a head stays at rest.
///
/// # Errors
/// No thread or no socket can be had. A tracker that is not there yet is waited for.
pub fn heads<const READERS: usize>(
    viewer: &Viewer,
    remote: Option<[HeadOutput; READERS]>,
) -> std::io::Result<[Head; READERS]> {
    let rest = viewer.head;
    let head = |motion| Head {
        rest,
        eye_separation: viewer.eye_separation,
        motion,
    };
    let still = || std::array::from_fn(|_| head(Motion::Still));
    Ok(match &viewer.tracking {
        HeadTracking::Fixed => still(),
        &HeadTracking::Sway { amplitude, period } => {
            let sway = Sway { amplitude, period };
            std::array::from_fn(|_| head(Motion::Sway(sway)))
        }
        HeadTracking::Remote => match remote {
            Some(outputs) => {
                outputs.map(|output| head(Motion::Remote(Box::new(RemoteHead::new(output, rest)))))
            }
            None => still(),
        },
        HeadTracking::Vrpn(chosen) => match vrpn_settings(chosen) {
            Some(VrpnSettings {
                source, mapping, ..
            }) => TrackerFeed::start_for::<READERS>(source)?.map(|feed| {
                head(Motion::Tracker(Box::new(Tracked {
                    feed,
                    seen: Seen::new(mapping, rest),
                })))
            }),
            None => still(), // the file's reader demands an address
        },
    })
}

impl Head {
    /// The head at session time `now`, workbench frame. Neither waits nor allocates.
    pub fn pose(&mut self, now: Duration) -> Pose {
        match &mut self.motion {
            Motion::Still => self.rest,
            Motion::Sway(sway) => self.rest * sway.displacement(now),
            Motion::Tracker(tracked) => {
                tracked.seen.take(tracked.feed.newest(), now);
                tracked.seen.last
            }
            Motion::Remote(remote) => remote.look().pose(now),
        }
    }

    /// When the pose that [`Self::pose`] gave at `now` was read, session time; `now` where nothing tells.
    pub fn read_at(&mut self, now: Duration) -> Duration {
        match &mut self.motion {
            Motion::Remote(remote) => remote.look().read_at(now),
            Motion::Tracker(tracked) => tracked.seen.read_at(now),
            Motion::Still | Motion::Sway(_) => now,
        }
    }

    /// Whether its pose changes.
    pub fn moves(&self) -> bool {
        !matches!(self.motion, Motion::Still)
    }
}

impl Seen {
    fn new(mapping: SensorMapping, rest: Pose) -> Self {
        Self {
            mapping,
            last: rest,
            reports: 0,
            came: None,
        }
    }

    /// Takes in what the tracker said last, looked at at session time `now`.
    fn take(&mut self, newest: &TrackerState, now: Duration) {
        if newest.reports == self.reports {
            return;
        }
        self.reports = newest.reports;
        if let Some(pose) = newest.pose.and_then(|report| self.mapping.pose(&report)) {
            (self.last, self.came) = (pose, Some(now));
        }
    }

    /// When the head was where it was seen last, session time. After the silence by which a tracked device counts as lost it is said to be
    /// there `now`: whoever predicts it sees that it rests.
    fn read_at(&self, now: Duration) -> Duration {
        let heard = |came: &Duration| now.saturating_sub(*came) <= VrpnSettings::DEFAULT_MAX_AGE;
        self.came.filter(heard).unwrap_or(now)
    }
}

impl Sway {
    /// At session time `now`, in the frame of the head at rest.
    fn displacement(&self, now: Duration) -> Pose {
        let turn = TAU * now.as_secs_f64() / self.period;
        let fore_aft = self.amplitude * FORE_AFT_SHARE * (turn / FORE_AFT_PERIODS).sin();
        let in_head = Vector3::new(self.amplitude * turn.sin(), 0.0, fore_aft);
        Pose::translation(in_head.x, in_head.y, in_head.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::Workbench;

    fn viewer(head: Pose, tracking: HeadTracking) -> Viewer {
        let shipped = Workbench::shipped().unwrap_or_else(|error| panic!("{error}"));
        Viewer {
            head,
            tracking,
            ..shipped.viewer
        }
    }

    fn head(rest: Pose, tracking: HeadTracking) -> Head {
        let [head] = heads(&viewer(rest, tracking), None).expect("nothing to start");
        head
    }

    #[test]
    fn a_swaying_head_starts_at_rest_and_stays_within_its_amplitude() {
        let rest = Pose::new(Vector3::new(0.0, -0.6, 0.7), Vector3::x() * 0.8);
        let mut head = head(
            rest,
            HeadTracking::Sway {
                amplitude: 0.05,
                period: 6.0,
            },
        );
        assert_eq!(head.pose(Duration::ZERO), rest);
        let mut farthest: f64 = 0.0;
        for tick in 0..10_000 {
            let pose = head.pose(Duration::from_millis(tick));
            assert_eq!(pose.rotation, rest.rotation);
            let offset =
                rest.inverse_transform_vector(&(pose.translation.vector - rest.translation.vector));
            assert!(offset.y.abs() < 1e-12);
            farthest = farthest.max(offset.x.abs());
        }
        assert!((farthest - 0.05).abs() < 1e-4);
    }

    #[test]
    fn a_still_head_stays() {
        let mut head = head(Pose::identity(), HeadTracking::Fixed);
        assert_eq!(head.pose(Duration::from_secs(3)), Pose::identity());
        assert!(!head.moves());
    }

    /// 0.5 m/s, a report each 10 ms; then silence.
    #[test]
    fn a_tracked_head_has_the_time_of_its_report_until_silence() {
        let ms = Duration::from_millis;
        let mut seen = Seen::new(SensorMapping::identity(), Pose::identity());
        let mut state = TrackerState::default();
        seen.take(&state, ms(40));
        assert_eq!(seen.read_at(ms(40)), ms(40), "nothing was reported");
        for time in 50..500_u64 {
            if time % 10 == 0 && time <= 200 {
                state.reports += 1;
                state.pose = Some(taut_vrpn::PoseReport {
                    sensor: 0,
                    position: [time as f64 * 0.5e-3, 0.0, 0.0],
                    rotation: [0.0, 0.0, 0.0, 1.0],
                });
            }
            seen.take(&state, ms(time));
            let reported = (time / 10 * 10).min(200);
            let place = reported as f64 * 0.5e-3;
            assert!((seen.last.translation.x - place).abs() < 1e-12, "{time}");
            let expected = if time <= 300 { reported } else { time };
            assert_eq!(seen.read_at(ms(time)), ms(expected), "at {time} ms");
        }
    }

    /// Nobody listens on port 1 of this machine: the head rests, for both readers, and dropping them ends the thread.
    #[test]
    fn a_head_whose_tracker_is_not_there_is_at_rest() {
        let rest = Pose::translation(0.0, -1.0, 1.2);
        let chosen = taut_kinds::read_choice("vrpn:Head@127.0.0.1:1").expect("valid");
        let viewer = viewer(rest, HeadTracking::Vrpn(Box::new(chosen)));
        let mut heads = heads::<2>(&viewer, None).expect("a thread");
        for head in &mut heads {
            assert!(head.moves());
            assert_eq!(head.pose(Duration::from_secs(1)), rest);
        }
    }
}
