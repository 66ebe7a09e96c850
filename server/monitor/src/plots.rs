//! The plots: many samples in one message, every sample a point.

use rerun::{
    RecordingStream, RecordingStreamError, RecordingStreamResult, Scalars, SeriesLines, TimeColumn,
};

use crate::sample::MonitorSample;
use crate::stream::{TIMELINE, timeline_ns};
use crate::{colours, paths};

/// Rates are counted over at least this long, seconds: shorter, and single datagrams show.
const RATE_WINDOW_S: f64 = 0.25;

/// One plot: where it is, what its lines are called, and their values in a sample.
struct Plot {
    path: &'static str,
    names: &'static [&'static str],
    colours: &'static [[u8; 3]],
    values: fn(&MonitorSample, &mut Vec<f64>),
}

const PLOTS: [Plot; 6] = [
    Plot {
        path: paths::FORCE,
        names: &["Fx", "Fy", "Fz", "|F|"],
        colours: &colours::AXES,
        values: |sample, out| push_with_norm(sample, 0, out),
    },
    Plot {
        path: paths::TORQUE,
        names: &["Tx", "Ty", "Tz", "|T|"],
        colours: &colours::AXES,
        values: |sample, out| push_with_norm(sample, 3, out),
    },
    Plot {
        path: paths::LOOPS,
        names: &[
            "haptics period",
            "haptics p99",
            "god-object",
            "god-object p99",
            "force",
            "force p99",
        ],
        colours: &colours::LOOPS,
        values: |sample, out| {
            for time in [
                sample.haptics_period,
                sample.god_object_update,
                sample.force_update,
            ] {
                out.extend([f64::from(time.last_us), f64::from(time.p99_us)]);
            }
        },
    },
    Plot {
        path: paths::CONTACT_COUNT,
        names: &["contacts", "penetrations"],
        colours: &[colours::NORMAL, colours::CONTACT],
        values: |sample, out| {
            out.extend([
                f64::from(sample.contacts.total()),
                sample.penetrations as f64,
            ]);
        },
    },
    Plot {
        path: paths::GAP,
        names: &["smallest gap"],
        colours: &[colours::OBSTACLE],
        values: |sample, out| out.push(1e3 * sample.gap_min),
    },
    Plot {
        path: paths::CONSTRAINT_AGE,
        names: &["constraint age"],
        colours: &[colours::GOD_OBJECT],
        values: |sample, out| out.push(f64::from(sample.constraint_age_us)),
    },
];

/// Sends the plots; remembers what the rates are counted from.
#[derive(Default)]
pub(crate) struct Plots {
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

    /// Adds these samples, in order of time, to all plots.
    pub(crate) fn show(
        &mut self,
        stream: &RecordingStream,
        samples: &[MonitorSample],
    ) -> RecordingStreamResult<()> {
        let times: Vec<i64> = samples
            .iter()
            .map(|sample| timeline_ns(sample.session_time_ns))
            .collect();
        for plot in &PLOTS {
            let mut values = Vec::with_capacity(samples.len() * plot.names.len());
            for sample in samples {
                (plot.values)(sample, &mut values);
            }
            send(stream, plot.path, &times, plot.names.len(), values)?;
        }
        self.show_rates(stream, samples)
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

/// Three components of the wrench from `first` on, then their norm.
fn push_with_norm(sample: &MonitorSample, first: usize, out: &mut Vec<f64>) {
    let vector = sample.wrench.fixed_rows::<3>(first);
    out.extend(vector.iter());
    out.push(vector.norm());
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
