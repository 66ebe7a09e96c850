//! The plots: every window of samples a point, with the newest value, the least and the largest; several points in one message.

use rerun::{
    RecordingStream, RecordingStreamError, RecordingStreamResult, Scalars, SeriesLines, TimeColumn,
};

use crate::sample::MonitorSample;
use crate::stream::{TIMELINE, timeline_ns};
use crate::window::{Window, Windows, loop_times};
use crate::{colours, paths};

/// Rates are counted over at least this long, seconds: shorter, and single datagrams show.
const RATE_WINDOW_S: f64 = 0.25;

/// One plot: where it is, what its lines are called, and their values in a window.
struct Plot {
    path: &'static str,
    names: &'static [&'static str],
    colours: &'static [[u8; 3]],
    values: fn(&Window, &mut Vec<f64>),
}

const PLOTS: [Plot; 6] = [
    Plot {
        path: paths::FORCE,
        names: &[
            "Fx", "Fy", "Fz", "|F|", "Fx min", "Fy min", "Fz min", "|F| min", "Fx max", "Fy max",
            "Fz max", "|F| max",
        ],
        colours: &colours::AXES_WITH_ENVELOPE,
        values: |window, out| out.extend(window.felt(0)),
    },
    Plot {
        path: paths::TORQUE,
        names: &[
            "Tx", "Ty", "Tz", "|T|", "Tx min", "Ty min", "Tz min", "|T| min", "Tx max", "Ty max",
            "Tz max", "|T| max",
        ],
        colours: &colours::AXES_WITH_ENVELOPE,
        values: |window, out| out.extend(window.felt(1)),
    },
    Plot {
        path: paths::LOOPS,
        names: &[
            "haptics period",
            "haptics p99",
            "haptics max",
            "god-object",
            "god-object p99",
            "god-object max",
            "force",
            "force p99",
            "force max",
        ],
        colours: &colours::LOOPS,
        values: |window, out| {
            for (time, longest) in loop_times(&window.last).iter().zip(window.longest_us) {
                out.extend([time.last_us, time.p99_us, longest].map(f64::from));
            }
        },
    },
    Plot {
        path: paths::CONTACT_COUNT,
        names: &["contacts", "penetrations", "contacts max"],
        colours: &[colours::NORMAL, colours::CONTACT, colours::WORKBENCH],
        values: |window, out| {
            out.extend([
                f64::from(window.last.contacts.total()),
                window.last.penetrations as f64,
                f64::from(window.contacts),
            ]);
        },
    },
    Plot {
        path: paths::GAP,
        names: &["smallest gap", "smallest gap min"],
        colours: &[colours::OBSTACLE, colours::WORKBENCH],
        values: |window, out| out.extend([1e3 * window.last.gap_min, 1e3 * window.gap]),
    },
    Plot {
        path: paths::CONSTRAINT_AGE,
        names: &["constraint age", "constraint age max"],
        colours: &[colours::GOD_OBJECT, colours::WORKBENCH],
        values: |window, out| {
            out.extend([
                f64::from(window.last.constraint_age_us),
                f64::from(window.envelope.oldest_constraints_us()),
            ]);
        },
    },
];

/// Sends the plots; remembers what the rates are counted from.
#[derive(Default)]
pub(crate) struct Plots {
    windows: Windows,
    rates_from: Option<CountersAt>,
}

#[derive(Clone, Copy)]
struct CountersAt {
    time_ns: u64,
    sent: u64,
    received: u64,
}

impl Plots {
    /// Sends the lines' names and colours.
    pub(crate) fn draw_styles(stream: &RecordingStream) -> RecordingStreamResult<()> {
        for plot in &PLOTS {
            let style = SeriesLines::new()
                .with_names(plot.names.iter().copied())
                .with_colors(plot.colours.iter().copied());
            stream.log_static(plot.path, &style)?;
        }
        let style = SeriesLines::new()
            .with_names(["sent / s", "received / s", "clients"])
            .with_colors([colours::GOD_OBJECT, [64, 214, 230], colours::WORKBENCH]);
        stream.log_static(paths::NETWORK, &style)
    }

    /// Adds these samples, in order of time: every window that they end is a point in all plots.
    pub(crate) fn show(
        &mut self,
        stream: &RecordingStream,
        samples: &[MonitorSample],
    ) -> RecordingStreamResult<()> {
        let windows = &mut self.windows;
        let ended: Vec<Window> = samples.iter().filter_map(|s| windows.add(s)).collect();
        show_windows(stream, &ended)?;
        self.show_rates(stream, samples)
    }

    /// Shows the window that is not full yet.
    pub(crate) fn finish(&mut self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let last: Vec<Window> = self.windows.finish().into_iter().collect();
        show_windows(stream, &last)
    }

    fn show_rates(
        &mut self,
        stream: &RecordingStream,
        samples: &[MonitorSample],
    ) -> RecordingStreamResult<()> {
        let mut times = Vec::new();
        let mut values = Vec::new();
        for sample in samples {
            let now = CountersAt {
                time_ns: sample.session_time_ns,
                sent: sample.packets_sent,
                received: sample.packets_received,
            };
            let from = *self.rates_from.get_or_insert(now);
            let seconds = now.time_ns.saturating_sub(from.time_ns) as f64 * 1e-9;
            if seconds >= RATE_WINDOW_S {
                times.push(timeline_ns(now.time_ns));
                values.extend([
                    now.sent.saturating_sub(from.sent) as f64 / seconds,
                    now.received.saturating_sub(from.received) as f64 / seconds,
                    f64::from(sample.clients),
                ]);
                self.rates_from = Some(now);
            }
        }
        if times.is_empty() {
            return Ok(());
        }
        send(stream, paths::NETWORK, &times, 3, values)
    }
}

fn show_windows(stream: &RecordingStream, windows: &[Window]) -> RecordingStreamResult<()> {
    if windows.is_empty() {
        return Ok(());
    }
    let time = |window: &Window| timeline_ns(window.last.session_time_ns);
    let times: Vec<i64> = windows.iter().map(time).collect();
    for plot in &PLOTS {
        let mut values = Vec::with_capacity(windows.len() * plot.names.len());
        for window in windows {
            (plot.values)(window, &mut values);
        }
        send(stream, plot.path, &times, plot.names.len(), values)?;
    }
    Ok(())
}

/// One message with `width` values per time.
fn send(
    stream: &RecordingStream,
    path: &str,
    times: &[i64],
    width: usize,
    values: Vec<f64>,
) -> RecordingStreamResult<()> {
    let time_column = TimeColumn::new_duration_nanos(TIMELINE, times.iter().copied());
    let columns = Scalars::new(values)
        .columns(std::iter::repeat_n(width, times.len()))
        .map_err(RecordingStreamError::from)?;
    stream.send_columns(path, [time_column], columns)
}
