//! What a node counts while it draws, and its report at the end.

use std::time::{Duration, Instant};

use hdrhistogram::Histogram;
use taut_link::{Distribution, MeshCounters};
use taut_proto::ClientStats;
use taut_proto::stats::DrawnState;

use crate::node_status::{FrameMode, LinkHealth, NodeStatus};
use crate::timeline::Latched;

/// Time between two reports to the server.
pub(crate) const REPORT_PERIOD: Duration = Duration::from_secs(1);

/// Longest age told apart, in microseconds; older counts as this.
const MAX_AGE_US: u64 = 60_000_000;

const MS_PER_US: f64 = 1e-3;

/// Most drawn states named in one report.
const MAX_DRAWN: usize = 64;

/// What a node without a window knows of the time at which its pictures light up.
pub(crate) const NO_WINDOW: &str =
    "not known, the times told are those of calls alone: no window lights up";

/// Why a node stopped drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ended {
    /// As many frames as were asked for are drawn.
    Frames,
    /// The time asked for is over.
    Duration,
    /// The server said that it stops.
    ServerStopped,
    /// A signal (Ctrl-C, SIGTERM).
    #[default]
    Interrupted,
    /// The user closed a window.
    Closed,
}

/// What a node did; by default it was asked to end before it did anything.
#[derive(Clone, Debug, Default)]
pub struct RenderReport {
    /// Its name.
    pub node: String,
    /// `udp` or `quic`.
    pub transport: String,
    /// The adapter that drew.
    pub adapter: String,
    /// What can be known of the time at which pictures are on the screen.
    pub present_timing: String,
    /// From handing a frame's first picture over to the light of its last; without a count where the window system does not tell.
    pub light_ms: Distribution,
    /// Frames of which a picture never lit up, or lit up at a time that cannot be, by the window system.
    pub unlit: u64,
    /// Frames drawn, each on all screens of the node.
    pub frames: u64,
    /// Of these, frames that the barrier released: shown when all nodes showed them.
    pub locked_frames: u64,
    /// Frames that showed a state so old that it was marked as stale.
    pub stale_frames: u64,
    /// Frames per second between the first and the last.
    pub fps: f64,
    /// Age of the drawn sample when it was taken to be drawn.
    pub pose_age_ms: Distribution,
    /// Age of the same sample when the frame was finished.
    pub drawn_age_ms: Distribution,
    /// States that were sent and did not arrive.
    pub packets_lost: u64,
    /// States that arrived.
    pub packets_received: u64,
    /// Sessions: one, and one more for each time that the node came back to its server.
    pub sessions: u64,
    /// Longest time between two frames, in milliseconds.
    pub longest_gap_ms: f64,
    /// From the beginning of the join to the end of the first frame, in milliseconds; `None` without a frame.
    pub to_first_frame_ms: Option<f64>,
    /// Where the meshes came from.
    pub meshes: MeshCounters,
    /// Why it ended.
    pub ended: Ended,
}

/// Ages of the drawn samples, in microseconds.
#[derive(Debug)]
struct Ages {
    /// When taken to be drawn.
    taken: Histogram<u64>,
    /// When the frame was finished.
    drawn: Histogram<u64>,
}

impl Ages {
    fn new() -> Self {
        Self {
            taken: histogram(),
            drawn: histogram(),
        }
    }

    /// Session times in nanoseconds.
    fn record(&mut self, sample_ns: u64, taken_ns: u64, drawn_ns: u64) {
        let age_us = |now: u64| (now.saturating_sub(sample_ns) / 1000).min(MAX_AGE_US);
        self.taken.saturating_record(age_us(taken_ns));
        self.drawn.saturating_record(age_us(drawn_ns));
    }

    fn reset(&mut self) {
        self.taken.reset();
        self.drawn.reset();
    }
}

/// Counts of a running node.
#[derive(Debug)]
pub(crate) struct Statistics {
    pub(crate) frames: u64,
    pub(crate) stale_frames: u64,
    /// Since the start.
    ages: Ages,
    since_report: Ages,
    /// How late after the planned moment frames were shown, in microseconds.
    swaps_since_report: Histogram<u64>,
    /// From handing a frame over to its light, in microseconds, since the start.
    lights: Histogram<u64>,
    pub(crate) unlit: u64,
    /// Frames that the barrier released.
    pub(crate) locked_frames: u64,
    frames_at_report: u64,
    drawn: Vec<DrawnState>,
    first_frame: Option<Instant>,
    last_frame: Option<Instant>,
    /// Frames per second over the last frames, and the age of the last one's state, in milliseconds.
    recent: (f64, f64),
    longest_gap: Duration,
    last_report: Instant,
}

impl Statistics {
    pub(crate) fn new() -> Self {
        Self {
            frames: 0,
            stale_frames: 0,
            ages: Ages::new(),
            since_report: Ages::new(),
            swaps_since_report: histogram(),
            lights: histogram(),
            unlit: 0,
            locked_frames: 0,
            frames_at_report: 0,
            drawn: Vec::with_capacity(MAX_DRAWN),
            first_frame: None,
            last_frame: None,
            recent: (0.0, 0.0),
            longest_gap: Duration::ZERO,
            last_report: Instant::now(),
        }
    }

    /// Counts a frame: what it showed, session time when that was taken and when the frame was finished.
    pub(crate) fn frame(&mut self, shown: &Latched, taken_ns: u64, drawn_ns: u64) {
        for ages in [&mut self.ages, &mut self.since_report] {
            ages.record(shown.sample_ns, taken_ns, drawn_ns);
        }
        self.frames += 1;
        self.stale_frames += u64::from(shown.stale);
        let (tick, state_hash) = shown.state.source;
        if self.drawn.len() < MAX_DRAWN {
            self.drawn.push(DrawnState { tick, state_hash });
        }
        let now = Instant::now();
        let age_ms = drawn_ns.saturating_sub(shown.sample_ns) as f64 * 1e-6;
        let fps = match self.last_frame {
            Some(last) => smoothed(self.recent.0, now.duration_since(last).as_secs_f64()),
            None => 0.0,
        };
        self.recent = (fps, age_ms);
        self.first_frame.get_or_insert(now);
        if let Some(last) = self.last_frame.replace(now) {
            self.longest_gap = self.longest_gap.max(now.saturating_duration_since(last));
        }
    }

    /// Counts that the barrier released the frame, and how late it was shown, where a moment was planned.
    pub(crate) fn swap(&mut self, late: Option<Duration>) {
        let Some(late) = late else {
            return;
        };
        self.locked_frames += 1;
        let late_us = u64::try_from(late.as_micros()).unwrap_or(u64::MAX);
        self.swaps_since_report.saturating_record(late_us);
    }

    /// Counts that a frame lit up so long after it was handed over.
    pub(crate) fn light(&mut self, after: Duration) {
        let after_us = u64::try_from(after.as_micros()).unwrap_or(u64::MAX);
        self.lights.saturating_record(after_us);
    }

    /// From handing over to light.
    pub(crate) fn lights(&self) -> Distribution {
        Distribution::of(&self.lights, MS_PER_US)
    }

    /// A new session: its server is told of its own states alone. Ticks begin again there, and those of the last session would be taken for its own.
    pub(crate) fn renewed(&mut self) {
        self.drawn.clear();
        self.since_report.reset();
        self.swaps_since_report.reset();
    }

    /// The report that is due, if one is, else (with `last`) the one at the end.
    pub(crate) fn report(&mut self, last: bool) -> Option<ClientStats> {
        let elapsed = self.last_report.elapsed();
        if elapsed < REPORT_PERIOD && !last {
            return None;
        }
        let ms = |us: u64| us as f32 / 1000.0;
        let Ages { taken, drawn } = &self.since_report;
        let frames = self.frames - self.frames_at_report;
        let stats = ClientStats {
            frames: self.frames,
            fps: frames as f32 / elapsed.as_secs_f32().max(1e-3),
            pose_age_ms_p50: ms(taken.value_at_quantile(0.5)),
            pose_age_ms_p99: ms(taken.value_at_quantile(0.99)),
            pose_age_ms_max: ms(taken.max()),
            drawn_age_ms_p50: ms(drawn.value_at_quantile(0.5)),
            drawn_age_ms_p99: ms(drawn.value_at_quantile(0.99)),
            drawn_age_ms_max: ms(drawn.max()),
            swap_skew_ms_p50: ms(self.swaps_since_report.value_at_quantile(0.5)),
            swap_skew_ms_max: ms(self.swaps_since_report.max()),
            drawn: std::mem::take(&mut self.drawn),
            ..Default::default()
        };
        self.since_report.reset();
        self.swaps_since_report.reset();
        self.frames_at_report = self.frames;
        self.last_report = Instant::now();
        Some(stats)
    }

    /// What the HUD says of the frames drawn so far, of a node that draws by itself.
    pub(crate) fn status(&self, node: &str, link: LinkHealth) -> NodeStatus {
        let (fps, pose_age_ms) = self.recent;
        NodeStatus {
            node: node.to_owned(),
            link,
            frames: FrameMode::Free,
            frame: self.frames,
            fps,
            pose_age_ms,
            swap_skew_us: None,
        }
    }

    /// Frames per second between the first and the last frame.
    pub(crate) fn fps(&self) -> f64 {
        match (self.first_frame, self.last_frame) {
            (Some(first), Some(last)) if last > first => {
                (self.frames - 1) as f64 / (last - first).as_secs_f64()
            }
            _ => 0.0,
        }
    }

    /// Longest time between two frames, in milliseconds.
    pub(crate) fn longest_gap_ms(&self) -> f64 {
        self.longest_gap.as_secs_f64() * 1e3
    }

    /// Time from `began` to the end of the first frame, in milliseconds.
    pub(crate) fn first_frame_after(&self, began: Instant) -> Option<f64> {
        let first = self.first_frame?;
        Some(first.saturating_duration_since(began).as_secs_f64() * 1e3)
    }

    /// Ages when taken and when drawn.
    pub(crate) fn ages(&self) -> (Distribution, Distribution) {
        (
            Distribution::of(&self.ages.taken, MS_PER_US),
            Distribution::of(&self.ages.drawn, MS_PER_US),
        )
    }
}

/// Frames per second of before and a frame that took `seconds`: a mean over about a second.
fn smoothed(fps: f64, seconds: f64) -> f64 {
    let seconds = seconds.max(1e-6);
    let share = seconds.min(1.0);
    fps + (1.0 / seconds - fps) * if fps > 0.0 { share } else { 1.0 }
}

fn histogram() -> Histogram<u64> {
    // Three significant figures over a fixed range: constants that hdrhistogram takes.
    Histogram::new_with_bounds(1, MAX_AGE_US, 3).unwrap_or_else(|_| unreachable!("constant bounds"))
}

impl std::fmt::Display for RenderReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            node,
            frames,
            fps,
            pose_age_ms: age,
            drawn_age_ms: drawn,
            packets_lost,
            packets_received,
            adapter,
            present_timing,
            light_ms: light,
            unlit,
            sessions,
            longest_gap_ms,
            to_first_frame_ms,
            meshes,
            ..
        } = self;
        write!(
            f,
            "{node}: {frames} frames, {fps:.1} per second; age of the pose {:.1} ms median, {:.1} ms at most, {:.1} ms median once drawn; {packets_received} states received, {packets_lost} lost; drawn with {adapter}; times of presentation: {present_timing}",
            age.p50, age.max, drawn.p50
        )?;
        if light.count > 0 {
            write!(
                f,
                "; light {:.1} ms after the call in the median, {:.1} ms at p99, {:.1} ms at most, of {} frames; {unlit} never lit up",
                light.p50, light.p99, light.max, light.count
            )?;
        }
        if let Some(first) = to_first_frame_ms {
            write!(
                f,
                "; first frame after {first:.0} ms, longest gap between two {longest_gap_ms:.0} ms"
            )?;
        }
        write!(
            f,
            "; meshes: {} bytes fetched, {} from the cache; sessions: {sessions}",
            meshes.fetched_bytes, meshes.cache_bytes
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    fn shown(sample_ns: u64) -> Latched {
        let mut shown = Latched::at_rest(Isometry3::identity());
        shown.sample_ns = sample_ns;
        shown.state.time_ns = sample_ns + 500_000;
        shown.state.source = (sample_ns, 7);
        shown
    }

    #[test]
    fn the_server_of_a_new_session_is_told_nothing_of_the_last_one() {
        let mut statistics = Statistics::new();
        statistics.frame(&shown(1_000_000), 4_000_000, 14_000_000);
        statistics.renewed();
        statistics.frame(&shown(2_000_000), 4_000_000, 14_000_000);
        let report = statistics.report(true).expect("asked for");
        let ticks: Vec<u64> = report.drawn.iter().map(|drawn| drawn.tick).collect();
        assert_eq!((ticks, report.frames), (vec![2_000_000], 2));
        assert!((report.pose_age_ms_max - 2.0).abs() < 0.01);
    }

    #[test]
    fn ages_are_told_from_the_moment_taken_and_the_moment_drawn() {
        let mut statistics = Statistics::new();
        statistics.frame(&shown(1_000_000), 4_000_000, 14_000_000);
        let (taken, drawn) = statistics.ages();
        assert!((taken.max - 3.0).abs() < 0.01 && (drawn.max - 13.0).abs() < 0.02);
        let report = statistics.report(true).expect("asked for");
        assert_eq!(report.frames, 1);
        assert_eq!(
            report.drawn,
            [DrawnState {
                tick: 1_000_000,
                state_hash: 7
            }]
        );
        assert!((report.pose_age_ms_max - 3.0).abs() < 0.01);
        assert!((report.drawn_age_ms_p50 - 13.0).abs() < 0.02);
        let after = statistics.report(true).expect("asked for");
        assert_eq!((after.pose_age_ms_max, after.drawn_age_ms_max), (0.0, 0.0));
    }

    #[test]
    fn a_state_from_the_future_has_no_age() {
        let mut statistics = Statistics::new();
        statistics.frame(&shown(9_000_000), 4_000_000, 5_000_000);
        assert_eq!(statistics.ages().0.max, 0.0);
    }

    #[test]
    fn frames_per_second_follow_a_change_within_seconds() {
        let mut fps = 0.0;
        for _ in 0..10 {
            fps = smoothed(fps, 1.0 / 60.0);
        }
        assert!((fps - 60.0).abs() < 1e-9);
        for _ in 0..90 {
            fps = smoothed(fps, 1.0 / 30.0);
        }
        assert!((30.0..32.0).contains(&fps), "{fps}");
        assert!(smoothed(fps, 0.0).is_finite());
    }

    #[test]
    fn no_report_is_due_right_after_one() {
        let mut statistics = Statistics::new();
        assert!(statistics.report(true).is_some());
        assert!(statistics.report(false).is_none());
    }
}
