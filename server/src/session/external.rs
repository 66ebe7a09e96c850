//! A force from outside between its receiver and the haptics loop, and what the audit trail says of it.

use std::time::Duration;

use taut_link::ServerLink;
use taut_scene::WrenchSource;

use crate::loops::external_wrench::{ExternalWrench, ExternalWrenchStatistics, WrenchReader};
use crate::session::setup::{DeviceSource, ExternalSetup};
use crate::shared::failure::Failure;

/// Refusals of values are told as a sum, at most this often.
const SUM_PERIOD: Duration = Duration::from_secs(60);

/// The haptics loop's end of the force source that the workbench names, if it names one.
pub(super) fn connect(
    wanted: Option<ExternalSetup>,
    device: &DeviceSource,
    link: &ServerLink,
) -> Result<Option<ExternalWrench>, Failure> {
    let Some(wanted) = wanted else {
        return Ok(None);
    };
    if matches!(device, DeviceSource::Remote { .. }) {
        return Err(Failure::bad_input(
            "[wrench_in] does not go with a device behind a bridge; give the server its device (`taut serve --device`), or set wrench_in.enabled = false",
        ));
    }
    let reader = match wanted.source {
        WrenchSource::Taut => WrenchReader::Link(link.force_input().ok_or_else(|| {
            Failure::failed(
                "forces from outside are read by somebody else: this is a fault of the program",
            )
        })?),
        WrenchSource::Ros { .. } => {
            return Err(Failure::bad_input(
                "source = \"ros\" in [wrench_in] needs a program built with the feature zenoh",
            ));
        }
    };
    Ok(Some(ExternalWrench::new(reader, wanted.settings)))
}

/// What was told of a force source.
#[derive(Debug, Default)]
pub(super) struct ExternalTrail {
    felt: bool,
    refused: u64,
    told: Option<Duration>,
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
        let is_due = self.told.is_none_or(|told| now >= told + SUM_PERIOD);
        if refused > self.refused && is_due {
            let reasons = counts.iter().filter(|(_, count)| *count > 0);
            let reasons: Vec<String> = reasons
                .map(|(why, count)| format!("{why} {count}"))
                .collect();
            lines.push(format!("refused in all: {}", reasons.join(", ")));
            (self.refused, self.told) = (refused, Some(now));
        }
        lines
    }
}
