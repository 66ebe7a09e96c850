//! A force from outside between its receiver and the haptics loop, and what the audit trail says of it.

use std::time::Duration;

#[cfg(feature = "zenoh")]
use taut_bridge::NewestWrench;
use taut_bridge::{ExternalWrench, ExternalWrenchStatistics, WrenchReader};
use taut_link::ServerLink;
use taut_scene::{WrenchSource, Zenoh};

#[cfg(feature = "zenoh")]
use crate::session::ros_order::RosOrder;
use crate::session::setup::ExternalSetup;
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;

/// Refusals of values are told as a sum, at most this often.
const SUM_PERIOD: Duration = Duration::from_secs(60);

/// Who hears values that do not come by the link; it ends when it is dropped.
#[cfg(feature = "zenoh")]
pub(super) type Receiver = taut_zenoh::RosWrenchSubscriber;
#[cfg(not(feature = "zenoh"))]
pub(super) type Receiver = std::convert::Infallible;

/// The haptics loop's end of the force source that the workbench names, and its receiver if that is none of the link's; if it names one.
pub(super) fn connect(
    wanted: Option<ExternalSetup>,
    link: &ServerLink,
    zenoh: &Zenoh,
    clock: SessionClock,
) -> Result<Option<(ExternalWrench, Option<Receiver>)>, Failure> {
    let Some(wanted) = wanted else {
        return Ok(None);
    };
    match &wanted.source {
        WrenchSource::Taut => {
            let output = link.force_input().ok_or_else(|| {
                Failure::failed(
                    "forces from outside are read by somebody else: this is a fault of the program",
                )
            })?;
            let external = ExternalWrench::new(WrenchReader::Link(output), wanted.settings);
            Ok(Some((external, None)))
        }
        WrenchSource::Ros {
            topic,
            allow_unproven,
        } => subscribe(&wanted, (topic, *allow_unproven), zenoh, clock).map(Some),
    }
}

#[cfg(not(feature = "zenoh"))]
fn subscribe(
    _wanted: &ExternalSetup,
    (topic, _allow_unproven): (&str, bool),
    _zenoh: &Zenoh,
    _clock: SessionClock,
) -> Result<(ExternalWrench, Option<Receiver>), Failure> {
    Err(Failure::BadInput(format!(
        "the topic {topic} of [wrench_in] needs a program built with --features zenoh; build it so, or set source = \"taut\""
    )))
}

#[cfg(feature = "zenoh")]
fn subscribe(
    wanted: &ExternalSetup,
    (topic, allow_unproven): (&str, bool),
    zenoh: &Zenoh,
    clock: SessionClock,
) -> Result<(ExternalWrench, Option<Receiver>), Failure> {
    use std::sync::Arc;
    let (input, output) = triple_buffer::triple_buffer(&NewestWrench::default());
    let statistics = Arc::<ExternalWrenchStatistics>::default();
    let mut order = RosOrder::new(input, statistics.clone());
    let settings = taut_zenoh::RosWrenchSettings {
        name: zenoh.name.clone(),
        connect: zenoh.connect.clone(),
        config: zenoh.config.clone(),
        domain: taut_zenoh::Domain(zenoh.ros_domain),
        topic: topic.to_owned(),
        allow_unproven,
    };
    let subscriber = taut_zenoh::RosWrenchSubscriber::start(settings, move |came| {
        order.take(&came, clock.now());
    });
    let subscriber = subscriber.map_err(Failure::bad_input)?;
    let external = ExternalWrench::new(WrenchReader::Local(output), wanted.settings)
        .with_statistics(statistics);
    Ok((external, Some(subscriber)))
}

/// What was told of a force source.
#[derive(Debug, Default)]
pub(super) struct ExternalTrail {
    felt: bool,
    refused: u64,
    summed_at: Option<Duration>,
}

impl ExternalTrail {
    /// Lines for the audit trail: that a force from outside began or ended to be felt, and how many values were refused for what.
    pub(super) fn look(
        &mut self,
        statistics: &ExternalWrenchStatistics,
        now: Duration,
    ) -> Vec<String> {
        let mut lines = Vec::new();
        let felt = statistics.is_felt();
        if felt != self.felt {
            self.felt = felt;
            lines.push(if felt { "felt" } else { "ended" }.to_owned());
        }
        let counts = statistics.refused();
        let refused = counts.iter().map(|(_, count)| count).sum();
        let is_due = self
            .summed_at
            .is_none_or(|summed_at| now >= summed_at + SUM_PERIOD);
        if refused > self.refused && is_due {
            let reasons = counts.iter().filter(|(_, count)| *count > 0);
            let reasons: Vec<String> = reasons
                .map(|(why, count)| format!("{why} {count}"))
                .collect();
            lines.push(format!("refused in all: {}", reasons.join(", ")));
            (self.refused, self.summed_at) = (refused, Some(now));
        }
        lines
    }
}
