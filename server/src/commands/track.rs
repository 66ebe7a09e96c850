//! `taut track`: says where the viewer's head is to a server whose workbench file has `remote_tracker = true` in `[viewer]`.

use std::future::ready;
use std::sync::Arc;
use std::time::{Duration, Instant};

use god_object::spatial::Pose;
use taut_bridge::service_manager::{ServiceNotifier, Turns};
use taut_bridge::{Trace, TrackerFeed, VrpnSettings, read_trace};
use taut_link::{ClientLink, ClientOptions, LinkError, Renewal, Role, SessionEnd, SupervisedLink};
use taut_proto::{HeadSample, PoseF64};

use crate::cli::TrackArgs;
use crate::commands::arguments::HeadFrom;
use crate::commands::key;
use crate::commands::signals::EndSignal;
use crate::shared::failure::Failure;

/// A tracker is asked this much more often than readings are wanted, so that they are told soon after they come.
const LOOKS_PER_READING: f64 = 4.0;

/// Tracks until the duration is over, the user ends it, or the server stops; a server that is lost is joined again. How many readings were
/// sent.
pub async fn run(args: &TrackArgs) -> Result<u64, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let mut signal = EndSignal::listen().map_err(Failure::failed)?;
    let mut source = match &args.source {
        HeadFrom::Still => Source::Still(None),
        HeadFrom::Trace(path) => {
            let trace = read_trace(path).map_err(Failure::bad_input)?;
            Source::Trace(TracePlayer::new(trace)?)
        }
        HeadFrom::Vrpn(settings) => Source::Tracker {
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
    let alive = Turns::default();
    let notifier = ServiceNotifier::start("the tracker runs", [alive.clone()], || false);
    let joining = SupervisedLink::join(options, args.membership.policy(), |_| {
        ready(Ok::<(), LinkError>(()))
    });
    let (supervised, mut link, ()) = tokio::select! {
        joined = alive.during(joining) => joined?,
        () = signal.given() => return Ok(0),
    };
    source.rest_as_in(&link);
    let sending = send_readings(
        &supervised,
        &mut link,
        &mut source,
        args,
        &mut signal,
        &alive,
    );
    let (sent, end) = sending.await;
    drop(notifier);
    // Nobody is to join again for the session that is left here.
    drop(supervised);
    link.leave().await;
    match end {
        Some(SessionEnd::Lost(reason)) => Err(Failure::Failed(format!(
            "the server at {} was lost: {reason}",
            args.server
        ))),
        Some(SessionEnd::ServerStopped) | None => Ok(sent),
    }
}

/// How many readings were sent, and what ended it if nobody here did.
async fn send_readings(
    supervised: &SupervisedLink<()>,
    link: &mut Arc<ClientLink>,
    source: &mut Source,
    args: &TrackArgs,
    signal: &mut EndSignal,
    alive: &Turns,
) -> (u64, Option<SessionEnd>) {
    let looks = match source {
        Source::Tracker { .. } => args.rate * LOOKS_PER_READING,
        Source::Still(_) | Source::Trace(_) => args.rate,
    };
    let mut period = tokio::time::interval(Duration::from_secs_f64(looks.recip()));
    period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let start = Instant::now();
    let mut index = 0;
    loop {
        tokio::select! {
            () = signal.given() => return (index, None),
            _ = period.tick() => {}
        }
        alive.count();
        let since_start = start.elapsed();
        let is_over = args
            .duration
            .is_some_and(|wanted| since_start.as_secs_f64() >= wanted);
        if is_over {
            return (index, None);
        }
        match supervised.take_renewal() {
            None => {}
            Some(Renewal::Session { link: next, .. }) => {
                source.rest_as_in(&next);
                *link = next;
            }
            Some(Renewal::Ended(end)) => return (index, Some(end)),
        }
        if let Some(pose) = source.newest(since_start) {
            index += 1;
            link.send_head(&HeadSample {
                sample_time_ns: link.session_now().map_or(0, |now| now.ns),
                index,
                pose: PoseF64::from_isometry(&pose),
            });
        }
    }
}

/// A source at work.
enum Source {
    Still(Option<Pose>),
    Trace(TracePlayer),
    Tracker {
        feed: TrackerFeed,
        settings: Box<VrpnSettings>,
        /// Tracker reports already taken.
        reported: u64,
    },
}

impl Source {
    /// A head that stays is where this session's workbench has it.
    fn rest_as_in(&mut self, link: &ClientLink) {
        if let Self::Still(pose) = self {
            *pose = link.description().viewer.to_isometry();
        }
    }

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
        let length = last.time_s - first.time_s;
        let time = if length > 0.0 {
            first.time_s + since_start.as_secs_f64() % length
        } else {
            first.time_s
        };
        let after = self.trace.partition_point(|row| row.time_s <= time);
        self.trace[after.saturating_sub(1)].pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_bridge::TraceRow;

    #[test]
    fn a_trace_begins_again_at_its_end() {
        let row = |time_s: f64| TraceRow {
            time_s,
            pose: Pose::translation(time_s, 0.0, 0.0),
            buttons: 0,
        };
        let Ok(player) = TracePlayer::new(vec![row(1.0), row(1.5), row(2.0)]) else {
            panic!("three rows");
        };
        for (since_s, x) in [(0.0, 1.0), (0.4, 1.0), (0.6, 1.5), (1.1, 1.0), (7.75, 1.5)] {
            let pose = player.pose(Duration::from_secs_f64(since_s));
            assert_eq!(pose.translation.x, x, "{since_s}");
        }
        assert!(TracePlayer::new(Vec::new()).is_err());
    }
}
