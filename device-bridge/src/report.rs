//! What a bridge tells at its end.

use std::fmt;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::Serialize;

use crate::verdict::{said_of_kept, said_of_misses, said_of_safety_events, verdict};

/// A histogram of durations from 1 us to 60 s with three digits. Recording does not allocate.
pub(crate) struct Durations(Histogram<u64>);

impl Default for Durations {
    fn default() -> Self {
        // The bounds are constants that the crate accepts: 1 <= low, 2 low <= high, digits <= 5.
        Self(Histogram::new_with_bounds(1, 60_000_000, 3).expect("valid bounds"))
    }
}

impl Durations {
    pub(crate) fn record(&mut self, duration: Duration) {
        let us = u64::try_from(duration.as_micros()).unwrap_or(u64::MAX);
        self.0.saturating_record(us);
    }

    pub(crate) fn summary(&self) -> Option<Quantiles> {
        (!self.0.is_empty()).then(|| Quantiles {
            count: self.0.len(),
            mean: self.0.mean(),
            p50: self.0.value_at_quantile(0.5),
            p99: self.0.value_at_quantile(0.99),
            p999: self.0.value_at_quantile(0.999),
            max: self.0.max(),
        })
    }
}

/// How a duration was distributed, in us.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Quantiles {
    /// How often it was measured.
    pub count: u64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Median.
    pub p50: u64,
    /// 99th percentile.
    pub p99: u64,
    /// 99.9th percentile.
    pub p999: u64,
    /// Largest.
    pub max: u64,
}

/// The end report of `taut bridge`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BridgeReport {
    /// Name of the device.
    pub device: String,
    /// Degrees of freedom in which it measures a pose.
    pub sensed_degrees_of_freedom: u8,
    /// Degrees of freedom in which it renders: with 3, force alone; torques are dropped.
    pub actuated_degrees_of_freedom: u8,
    /// Server as given.
    pub server: String,
    /// Why the bridge ended: one sentence.
    pub ended: String,
    /// Seconds from the first tick to the last.
    pub duration_s: f64,
    /// Ticks of the device loop.
    pub ticks: u64,
    /// Whole periods that the loop missed and skipped.
    pub missed_periods: u64,
    /// From tick to tick; None before the second tick.
    pub period_us: Option<Quantiles>,
    /// Where the force was computed in the last session: edge or server.
    pub coupling: String,
    /// Constraint sets taken.
    pub sets: u64,
    /// Constraint sets that made no sense.
    pub broken_sets: u64,
    /// Session time from making a constraint set to its first use; None while the clocks were not locked.
    pub set_age_us: Option<Quantiles>,
    /// Commands received and taken.
    pub wrenches: u64,
    /// Session time from making a command to its use; None while the clocks were not locked.
    pub wrench_age_us: Option<Quantiles>,
    /// From reading the device to holding the wrench that answers it.
    pub round_trip_us: Option<Quantiles>,
    /// Datagrams sent.
    pub packets_sent: u64,
    /// Authentic datagrams received.
    pub packets_received: u64,
    /// Datagrams missing in the server's sequence.
    pub packets_lost: u64,
    /// Most energy that the force ever put into the hand beyond what the hand had put in, J: 0 for a passive coupling.
    pub energy_injected_j: f64,
    /// Net energy given to the hand, J.
    pub energy_delivered_j: f64,
    /// Largest age of the device's reading that a force came from, or the constraint set that it rested on, ms: the force is gone when that is
    /// 120 ms, as long as the loop itself is on time.
    pub max_force_age_ms: f64,
    /// Forces from outside that were taken.
    pub external_wrenches: u64,
    /// Largest age, since it was measured, of one of which anything was felt, ms.
    pub max_external_age_ms: f64,
    /// Largest force rendered, N.
    pub max_force_n: f64,
    /// Largest torque rendered, N m.
    pub max_torque_n_m: f64,
    /// Warnings of the safety stage and of the device.
    pub safety_events: u64,
    /// Ticks on which the device had no pose.
    pub faulty_ticks: u64,
    /// Sessions with the server, the first included.
    pub sessions: u32,
    /// What the operating system granted and what not.
    pub realtime: Vec<String>,
}

impl BridgeReport {
    /// In one line: whether the device was served as it should be, or what was not.
    #[must_use]
    pub fn verdict(&self) -> String {
        let said = |is_fault: bool, what: String| is_fault.then_some(what);
        let faults = [
            said(self.ticks == 0, "the device loop never ran".to_owned()),
            said_of_misses(
                ["the device loop", "periods"],
                self.ticks,
                self.missed_periods,
            ),
            said(
                self.faulty_ticks > 0,
                format!("the device had no pose on {} ticks", self.faulty_ticks),
            ),
            said(
                self.broken_sets > 0,
                format!("{} constraint sets made no sense", self.broken_sets),
            ),
            said(
                self.sessions > 1,
                format!(
                    "the server was lost or stopped {} times",
                    self.sessions.saturating_sub(1)
                ),
            ),
            said_of_safety_events(self.safety_events),
        ];
        let faults: Vec<String> = faults.into_iter().flatten().collect();
        let kept = said_of_kept("periods", self.ticks, self.missed_periods);
        let good = format!("good, {kept}, device and server always there, no safety event");
        format!("verdict: {}", verdict(&good, &faults))
    }
}

impl fmt::Display for BridgeReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}", self.verdict())?;
        writeln!(out, "{} at {}: {}", self.device, self.server, self.ended)?;
        writeln!(
            out,
            "{} ticks in {:.1} s, {} missed; force from the {}, {} wrenches, {} constraint sets; {} packets out, {} in, {} lost; {} session(s)",
            self.ticks,
            self.duration_s,
            self.missed_periods,
            self.coupling,
            self.wrenches,
            self.sets,
            self.packets_sent,
            self.packets_received,
            self.packets_lost,
            self.sessions,
        )?;
        if self.actuated_degrees_of_freedom == 3 {
            writeln!(
                out,
                "force alone was rendered, torque was dropped: {} degrees of freedom sensed, 3 actuated",
                self.sensed_degrees_of_freedom
            )?;
        }
        for (name, quantiles) in [
            ("period", &self.period_us),
            ("wrench age", &self.wrench_age_us),
            ("round trip", &self.round_trip_us),
            ("constraint set age", &self.set_age_us),
        ] {
            if let Some(q) = quantiles {
                writeln!(
                    out,
                    "{name}: p50 {} us, p99 {} us, p99.9 {} us, max {} us",
                    q.p50, q.p99, q.p999, q.max
                )?;
            }
        }
        writeln!(
            out,
            "largest force {:.2} N, torque {:.3} N m, from readings of at most {:.0} ms ago; energy injected {:.2e} J; {} safety event(s), {} faulty tick(s)",
            self.max_force_n,
            self.max_torque_n_m,
            self.max_force_age_ms,
            self.energy_injected_j,
            self.safety_events,
            self.faulty_ticks,
        )?;
        self.realtime
            .iter()
            .try_for_each(|grant| writeln!(out, "{grant}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_comes_first_and_names_what_was_wrong() {
        let mut report = BridgeReport {
            ticks: 10_000,
            missed_periods: 5,
            sessions: 1,
            ..BridgeReport::default()
        };
        let verdict = report.verdict();
        assert!(
            verdict.contains("good, all but 0.050 % of periods kept"),
            "{verdict}"
        );
        report.missed_periods = 0;
        assert!(report.verdict().contains("good, periods kept"));
        report.missed_periods = 200;
        report.sessions = 3;
        report.safety_events = 4;
        let text = report.to_string();
        let first = text.lines().next().unwrap_or_default();
        for part in [
            "2.0 % of its periods",
            "lost or stopped 2 times",
            "4 safety events",
        ] {
            assert!(first.contains(part), "{part}: {first}");
        }
    }
}
