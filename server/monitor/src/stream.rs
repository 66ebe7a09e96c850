//! Everything that goes into rerun, in order: scene, layout, then pictures, plots and lines.

use rerun::{RecordingStream, RecordingStreamResult, TextLog, TimeCell};

use crate::log::LogLevel;
use crate::picture::Picture;
use crate::plots::Plots;
use crate::sample::MonitorSample;
use crate::scene::MonitorScene;
use crate::{layout, paths};

/// The only timeline: seconds since the server started.
pub(crate) const TIMELINE: &str = "session_time";

/// Session time as rerun wants it; beyond 292 years it stands still.
pub(crate) fn timeline_ns(session_time_ns: u64) -> i64 {
    i64::try_from(session_time_ns).unwrap_or(i64::MAX)
}

/// A rerun stream of one session.
pub(crate) struct Stream {
    rerun: RecordingStream,
    picture: Picture,
    plots: Plots,
    newest_ns: u64,
}

impl Stream {
    /// Sends the layout and the scene.
    pub(crate) fn open(
        rerun: RecordingStream,
        scene: &MonitorScene,
    ) -> RecordingStreamResult<Stream> {
        rerun.set_log_time_enabled(false);
        rerun.set_log_tick_enabled(false);
        layout::send(&rerun, scene)?;
        rerun.set_time(TIMELINE, TimeCell::from_duration_nanos(0));
        let picture = Picture::draw_scene(&rerun, scene)?;
        Plots::draw_styles(&rerun)?;
        let mut stream = Stream {
            rerun,
            picture,
            plots: Plots::default(),
            newest_ns: 0,
        };
        let bodies = scene.bodies.len();
        let newtons = 0.01 / stream.picture.metres_per_newton();
        for text in [
            format!("{bodies} bodies: {}", scene.name),
            format!("force arrow: 1 cm is {newtons:.2} N"),
        ] {
            stream.line(0, LogLevel::Info, &text)?;
        }
        Ok(stream)
    }

    /// Shows this sample in the picture. `false`: it holds a number that is not finite, and the picture stays.
    pub(crate) fn show_picture(&mut self, sample: &MonitorSample) -> RecordingStreamResult<bool> {
        self.newest_ns = sample.session_time_ns;
        self.set_time(sample.session_time_ns);
        self.picture.show(&self.rerun, sample)
    }

    /// Adds these samples, in order of time, to the plots.
    pub(crate) fn show_plots(&mut self, samples: &[MonitorSample]) -> RecordingStreamResult<()> {
        if samples.is_empty() {
            return Ok(());
        }
        self.plots.show(&self.rerun, samples)
    }

    /// Shows a line at this session time.
    pub(crate) fn line(
        &mut self,
        session_time_ns: u64,
        level: LogLevel,
        text: &str,
    ) -> RecordingStreamResult<()> {
        let level = match level {
            LogLevel::Info => rerun::TextLogLevel::INFO,
            LogLevel::Warn => rerun::TextLogLevel::WARN,
            LogLevel::Error => rerun::TextLogLevel::ERROR,
        };
        self.set_time(session_time_ns);
        self.rerun
            .log(paths::LOG, &TextLog::new(text).with_level(level))
    }

    /// Session time of the newest sample shown.
    pub(crate) fn newest_ns(&self) -> u64 {
        self.newest_ns
    }

    /// Writes out everything and closes files and ports; what went wrong, if the recording is not whole.
    pub(crate) fn close(mut self) -> Result<(), String> {
        if let Err(error) = self.plots.finish(&self.rerun) {
            tracing::warn!("rerun refused a message: {error}");
        }
        // Only the recording can fail here: the served end never waits.
        let flushed = self.rerun.flush_blocking();
        self.rerun.disconnect();
        flushed.map_err(|error| error.to_string())
    }

    /// rerun keeps the time per thread, so it is set anew for every message.
    fn set_time(&self, session_time_ns: u64) {
        let time = TimeCell::from_duration_nanos(timeline_ns(session_time_ns));
        self.rerun.set_time(TIMELINE, time);
    }
}
