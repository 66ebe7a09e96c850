//! The end report of `taut demo` and `taut serve`.

use std::fmt;

use serde::{Deserialize, Serialize};
use taut_bridge::verdict::{said_of_kept, said_of_misses, said_of_safety_events, verdict};
use taut_link::Distribution;

use crate::loops::fidelity::FidelityReport;
use crate::loops::realtime::RealtimeReport;
use crate::report::client::ClientReport;
use crate::report::external::ExternalWrenchReport;
use crate::report::frames::FramesReport;
use crate::report::replay::{said_of_stops, write_obstacles};
use crate::shared::timing::Bin;

/// What `taut demo` and `taut serve` measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SessionReport {
    /// How long the loops ran, s.
    pub duration_s: f64,
    /// Ticks of the haptics loop per second.
    pub haptics_hz: f64,
    /// Time between two ticks of the haptics loop.
    pub haptics_period_us: Distribution,
    /// The same as a histogram: what jitter looks like.
    pub haptics_period_bins_us: Vec<Bin>,
    /// Deadlines of the haptics loop that passed without a tick in their period.
    pub deadline_misses: u64,
    /// Thread CPU time of one god-object update.
    pub god_object_update_us: Distribution,
    /// God-object updates per second.
    pub god_object_hz: f64,
    /// Thread CPU time of one force.
    pub force_us: Distribution,
    /// Thread CPU time of pose and tensions of one tick of a string-driven device; `null` without one.
    pub tension_us: Option<Distribution>,
    /// The same and the coupling together, in one cycle of the haptics loop: thread CPU time of every force since the cycle before, and of
    /// this cycle's pose and tensions; `null` without strings. Not the sum of two quantiles: each value is one cycle's.
    pub coupling_and_tension_us: Option<Distribution>,
    /// Time from the reading of a device sample to the start of the force that answers it, on the clock, whoever else ran meanwhile.
    pub answer_wait_us: Distribution,
    /// Time from the reading of a device sample to the rendering of the force that answers it, on the clock: a period, as the loop never waits
    /// for the coupling, or more where the coupling came late.
    pub force_latency_us: Distribution,
    /// Time from a device sample to the rendering of a force whose constraint set answers it: how late the god-object is felt.
    pub constraint_latency_us: Distribution,
    /// Age of the constraint set that a force rests on.
    pub constraint_age_us: Distribution,
    /// Rows in the constraint set, over the updates.
    pub contacts: Distribution,
    /// Published poses at which the bodies intersect, by a check that shares no code with the method.
    pub penetrations: u64,
    /// Published poses that were checked.
    pub penetration_checks: u64,
    /// What real-time measures are in force.
    pub realtime: RealtimeReport,
    /// Datagrams sent to all clients together.
    pub packets_sent: u64,
    /// Datagrams that were refused: broken, foreign, replayed.
    pub packets_refused: u64,
    /// Warnings of the safety stage and of the device.
    pub safety_events: u64,
    /// Largest norm of a force that the hand felt, N.
    #[serde(default)]
    pub largest_force_n: f64,
    /// Energy given to the hand beyond what it had put in, J; obstacles that move may truly give some.
    pub energy_injected_j: f64,
    /// Net work that obstacles that move did on the hand, J; negative where they gave way under it.
    pub energy_from_obstacles_j: f64,
    /// Energy given to the hand beyond what it and the obstacles had put in, J: the coupling made it.
    pub energy_generated_j: f64,
    /// Updates in which an obstacle did not get to where its trace is, because the body was squeezed or the budget spent.
    pub obstacle_blocked_updates: u64,
    /// Updates in which something stopped the body that gives no force: a surface that is inside out.
    #[serde(default)]
    pub stops_without_force: u64,
    /// Projections that the chosen solver did not certify and another one answered.
    pub solver_fallbacks: u64,
    /// Samples that the monitor had no room for.
    pub monitor_dropped: u64,
    /// How the frames of the render nodes went; `null` where each node draws by itself.
    pub frames: Option<FramesReport>,
    /// One entry per client that was there, render nodes and bridges.
    pub clients: Vec<ClientReport>,
    /// Clients that looked on as observers.
    pub observers: u64,
    /// A force from outside; `null` where the workbench takes none.
    #[serde(default)]
    pub external_wrench: Option<ExternalWrenchReport>,
    /// The fidelity that the scene chose for itself, and how it held; `null` where it does not choose.
    pub fidelity: Option<FidelityReport>,
}

impl SessionReport {
    /// In one line: whether the session was as it should be, or what was not.
    pub fn verdict(&self) -> String {
        let mut faults = Vec::new();
        if self.penetrations > 0 {
            faults.push(format!(
                "the bodies intersected in {} of {} poses",
                self.penetrations, self.penetration_checks
            ));
        }
        faults.extend(said_of_stops(self.stops_without_force));
        faults.extend(said_of_misses(
            ["the haptics loop", "deadlines"],
            self.haptics_period_us.count,
            self.deadline_misses,
        ));
        for client in &self.clients {
            if client.free_running {
                faults.push(format!("{} draws fewer frames than it should", client.node));
            }
            if client.state_hash_mismatches > 0 {
                faults.push(format!(
                    "{} drew {} frames of another state",
                    client.node, client.state_hash_mismatches
                ));
            }
        }
        faults.extend(said_of_safety_events(self.safety_events));
        let ticks = self.haptics_period_us.count;
        let kept = said_of_kept("deadlines", ticks, self.deadline_misses);
        let good = format!("good: {kept}, no penetration, no safety event");
        format!("verdict             {}", verdict(&good, &faults))
    }

    /// The periods of the haptics loop as a histogram, one line per bin that is not empty.
    pub fn histogram(&self) -> String {
        let ticks = self.haptics_period_us.count.max(1) as f64;
        let bins = self.haptics_period_bins_us.iter();
        bins.filter(|bin| bin.count > 0)
            .map(|bin| {
                let share = 100.0 * bin.count as f64 / ticks;
                let range = match bin.to {
                    Some(to) => format!("{:.0} to {to:.0} us", bin.from),
                    None => format!("from {:.0} us", bin.from),
                };
                format!("\n  period {range:<16} {share:7.3} %")
            })
            .collect()
    }
}

impl fmt::Display for SessionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.verdict())?;
        self.write_loops(f)?;
        writeln!(
            f,
            "contacts            p50 {:.0}, max {:.0}",
            self.contacts.p50, self.contacts.max
        )?;
        writeln!(
            f,
            "penetrations        {} in {} poses checked",
            self.penetrations, self.penetration_checks
        )?;
        writeln!(
            f,
            "safety events       {}, energy injected {:.2e} J",
            self.safety_events, self.energy_injected_j
        )?;
        if let Some(external) = &self.external_wrench {
            let refused: u64 = external.refused.values().sum();
            writeln!(
                f,
                "force from outside  {} values felt, {} lost, {} dropped, {refused} refused, at most {:.0} ms old",
                external.taken, external.lost, external.dropped, external.largest_age_ms
            )?;
        }
        if let Some(fidelity) = &self.fidelity {
            writeln!(f, "fidelity            {fidelity}")?;
        }
        if let Some(frames) = &self.frames {
            writeln!(f, "frames              {frames}")?;
        }
        write_obstacles(
            f,
            self.energy_from_obstacles_j,
            self.energy_generated_j,
            self.obstacle_blocked_updates,
        )?;
        write!(
            f,
            "datagrams           {} sent, {} refused",
            self.packets_sent, self.packets_refused
        )?;
        self.clients
            .iter()
            .try_for_each(|client| write_client(f, client))
    }
}

impl SessionReport {
    /// Rates and times of the loops.
    fn write_loops(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (period, update, force, age) = (
            &self.haptics_period_us,
            &self.god_object_update_us,
            &self.force_us,
            &self.constraint_age_us,
        );
        writeln!(f, "ran for             {:.1} s", self.duration_s)?;
        writeln!(
            f,
            "haptics             {:.1} Hz, period p50 {:.0} us, p99 {:.0} us, p99.9 {:.0} us, max {:.0} us, {} deadlines missed",
            self.haptics_hz, period.p50, period.p99, period.p999, period.max, self.deadline_misses
        )?;
        writeln!(
            f,
            "god-object          {:.0} Hz, update p50 {:.0} us, p99 {:.0} us, max {:.0} us",
            self.god_object_hz, update.p50, update.p99, update.max
        )?;
        writeln!(
            f,
            "force               p50 {:.1} us, p99 {:.1} us, p99.9 {:.1} us, max {:.1} us; constraints {:.0} us old at p99",
            force.p50, force.p99, force.p999, force.max, age.p99
        )?;
        let (wait, latency) = (&self.answer_wait_us, &self.force_latency_us);
        writeln!(
            f,
            "  after its sample  begun p50 {:.0} us, p99 {:.0} us; rendered p50 {:.0} us, p99 {:.0} us, p99.9 {:.0} us",
            wait.p50, wait.p99, latency.p50, latency.p99, latency.p999
        )?;
        for (what, times) in [
            ("pose and tensions", &self.tension_us),
            ("  with coupling", &self.coupling_and_tension_us),
        ] {
            let Some(times) = times else { continue };
            writeln!(
                f,
                "{what:<19} p50 {:.1} us, p99 {:.1} us, p99.9 {:.1} us, max {:.1} us",
                times.p50, times.p99, times.p999, times.max
            )?;
        }
        Ok(())
    }
}

/// What a client drew, or that it drew nothing, in a line of its own.
fn write_client(f: &mut fmt::Formatter<'_>, client: &ClientReport) -> fmt::Result {
    if client.frames == 0 {
        // A node may be gone before its first frame.
        let what = if client.draws {
            "drew nothing"
        } else {
            "bridge"
        };
        return write!(
            f,
            "\n{:<19} {what}, {} lost, by {}",
            client.node, client.packets_lost, client.transport
        );
    }
    write!(
        f,
        "\n{:<19} {} frames, {:.0} fps, poses {:.1} ms old when taken, {:.1} ms when drawn (p99 {:.1} ms), {} lost, by {}",
        client.node,
        client.frames,
        client.fps,
        client.pose_age_ms.p50,
        client.drawn_age_ms.p50,
        client.drawn_age_ms.p99,
        client.packets_lost,
        client.transport
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_names_what_was_wrong_and_comes_first() {
        let mut report = SessionReport {
            haptics_period_us: Distribution {
                count: 10_000,
                ..Distribution::default()
            },
            deadline_misses: 5,
            ..SessionReport::default()
        };
        let verdict = report.verdict();
        let good = "good: all but 0.050 % of deadlines kept";
        assert!(verdict.contains(good), "{verdict}");
        report.stops_without_force = 7;
        report.deadline_misses = 200;
        report.penetrations = 1;
        report.clients = vec![ClientReport {
            node: "table".into(),
            free_running: true,
            ..ClientReport::default()
        }];
        let text = report.to_string();
        let first = text.lines().next().unwrap_or_default();
        for part in [
            "intersected in 1",
            "in 7 updates",
            "2.0 % of its deadlines",
            "table draws fewer",
        ] {
            assert!(first.contains(part), "{first}");
        }
    }

    #[test]
    fn the_histogram_is_apart_from_the_report() {
        let report = SessionReport {
            haptics_period_bins_us: vec![Bin {
                from: 0.0,
                to: Some(500.0),
                count: 3,
            }],
            ..SessionReport::default()
        };
        assert!(!report.to_string().contains("0 to 500 us"));
        assert!(report.histogram().contains("0 to 500 us"));
    }
}
