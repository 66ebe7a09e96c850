//! `taut track`: says where the viewer's head is to a server whose workbench file has `remote_tracker = true` in `[viewer]`.

use std::time::Duration;

use god_object::spatial::Pose;
use taut_bridge::{Trace, TrackerFeed, VrpnSettings, read_trace};
use taut_link::{ClientLink, ClientOptions, Role};
use taut_proto::{HeadSample, PoseF64};

use crate::cli::TrackArgs;
use crate::commands::arguments::HeadFrom;
use crate::commands::key;
use crate::commands::sending::{self, Sending, Sent, Source};
use crate::commands::signals::EndSignal;
use crate::shared::failure::Failure;

/// A tracker is asked this much more often than readings are wanted, so that they are told soon after they come.
const LOOKS_PER_READING: f64 = 4.0;

/// Tracks until the duration is over, the user ends it, or the server stops; a server that is lost is joined again. How many readings were
/// sent.
pub async fn run(args: &TrackArgs) -> Result<u64, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let signal = EndSignal::listen().map_err(Failure::failed)?;
    let source = match &args.source {
        HeadFrom::Still => Head::Still(None),
        HeadFrom::Trace(path) => {
            let trace = read_trace(path).map_err(Failure::bad_input)?;
            Head::Trace(TracePlayer::new(trace)?)
        }
        HeadFrom::Vrpn(settings) => Head::Tracker {
            feed: TrackerFeed::start(settings.source.clone()).map_err(|error| {
                Failure::failed(format!("the head tracker cannot be listened to ({error})"))
            })?,
            settings: settings.clone(),
            reported: 0,
        },
    };
    let options = ClientOptions {
        transport: args.transport.into(),
        ..ClientOptions::new(&args.server, key, Role::Tracker, &args.node)
    };
    let looks = match source {
        Head::Tracker { .. } => args.rate * LOOKS_PER_READING,
        Head::Still(_) | Head::Trace(_) => args.rate,
    };
    let sending = Sending {
        what: "the tracker runs",
        rate: looks,
        duration: args.duration,
        policy: args.membership.policy(),
    };
    sending::run(sending, options, signal, source).await
}

enum Head {
    Still(Option<Pose>),
    Trace(TracePlayer),
    Tracker {
        feed: TrackerFeed,
        settings: Box<VrpnSettings>,
        /// Tracker reports already taken.
        reported: u64,
    },
}

impl Source for Head {
    /// A head that stays is where this session's workbench has it.
    fn begin(&mut self, link: &ClientLink) {
        if let Self::Still(pose) = self {
            *pose = link.description().viewer.to_isometry();
        }
    }

    fn send(&mut self, link: &ClientLink, index: u64, since_start: Duration) -> Sent {
        let Some(pose) = self.newest(since_start) else {
            return Sent::Nothing;
        };
        link.send_head(&HeadSample {
            sample_time_ns: link.session_now().map_or(0, |now| now.ns),
            index,
            pose: PoseF64::from_isometry(&pose),
        });
        Sent::One
    }
}

impl Head {
    /// The head, workbench frame, if there is anything new.
    fn newest(&mut self, since_start: Duration) -> Option<Pose> {
        match self {
            Self::Still(pose) => *pose,
            Self::Trace(player) => Some(player.pose(since_start)),
            Self::Tracker {
                feed,
                settings,
                reported,
            } => {
                let state = feed.newest();
                if state.reports == *reported {
                    return None;
                }
                *reported = state.reports;
                settings.mapping.pose(&state.pose?)
            }
        }
    }
}

/// Plays a trace in its own time, from its first row to its last and again.
struct TracePlayer {
    trace: Trace,
}

impl TracePlayer {
    fn new(trace: Trace) -> Result<Self, Failure> {
        if trace.is_empty() {
            return Err(Failure::bad_input(
                "the trace of the head has no row; record one or write one",
            ));
        }
        Ok(Self { trace })
    }

    /// The row that is due, without anything between rows.
    fn pose(&self, since_start: Duration) -> Pose {
        let (first, last) = (&self.trace[0], &self.trace[self.trace.len() - 1]);
        let length = last.time - first.time;
        let time = if length > 0.0 {
            first.time + since_start.as_secs_f64() % length
        } else {
            first.time
        };
        let after = self.trace.partition_point(|row| row.time <= time);
        self.trace[after.saturating_sub(1)].pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_bridge::TraceSample;

    #[test]
    fn a_trace_begins_again_at_its_end() {
        let row = |time: f64| TraceSample {
            time,
            pose: Pose::translation(time, 0.0, 0.0),
            buttons: 0,
        };
        let player = TracePlayer::new(vec![row(1.0), row(1.5), row(2.0)]).expect("three rows");
        for (since_s, x) in [(0.0, 1.0), (0.4, 1.0), (0.6, 1.5), (1.1, 1.0), (7.75, 1.5)] {
            let pose = player.pose(Duration::from_secs_f64(since_s));
            assert_eq!(pose.translation.x, x, "{since_s}");
        }
        assert!(TracePlayer::new(Vec::new()).is_err());
    }
}
