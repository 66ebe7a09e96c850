//! What happens in a session: network, safety events and fidelity, to the log, the recording and the monitor.

use std::sync::atomic::Ordering;
use std::time::Duration;

use taut_bridge::EventKind;
use taut_link::{LinkEvent, ServerLink, proto};
use taut_recording::EventRecord;

use crate::loops::incidents::{self};
use crate::report::external::ExternalWrenchReport;
use crate::report::frames::FramesReport;
use crate::report::metrics::{self, ClientLink, Metrics};
use crate::report::{SessionReport, said_of_stops};
use crate::session::monitor::Severity;

use super::Session;

/// Time until stops without a force are told of again.
const STOPS_PERIOD: Duration = Duration::from_secs(10);

impl Session {
    /// Reports what happened on the network since the last call: errors here, everything to monitor and log. Call it a few times a
    /// second.
    pub fn follow_network(&mut self) {
        self.log_incidents();
        self.log_stops();
        if let Some(fidelity) = &mut self.fidelity {
            for line in fidelity.watch.notices(&mut fidelity.reported) {
                taut_log::say(&line);
            }
        }
        let Some(link) = &self.link else {
            return;
        };
        let mut lines = Vec::new();
        let now = self.clock.now();
        while let Some(event) = link.try_event() {
            let to_be_logged = self.audit.follow(&event, now);
            let line = self.clients.follow(&event);
            if to_be_logged {
                lines.extend(line.map(|line| (severity(&event), concerns_presence(&event), line)));
            }
        }
        for (severity, concerns_presence, line) in lines {
            if severity == Severity::Error {
                taut_log::say(&format!("taut: {line}"));
            } else if concerns_presence {
                taut_log::say(&line);
            } else {
                tracing::info!("{line}"); // what was said above is not said twice
            }
            if let Some(page) = &mut self.operator {
                page.note_line(now, severity, &line);
            }
            self.record(self.clock.now(), "network", &line);
            if let Some(monitor) = &self.monitor {
                monitor.log(severity, &line);
            }
        }
        let clients = link.clients();
        self.clients.look_at(&clients);
        if let Some(statistics) = &self.statistics.external {
            for what in self.external.look(statistics, now) {
                self.audit.follow_external(&what);
            }
        }
        let counters = link.counters();
        self.audit.look(&counters, now);
        self.network
            .packets_sent
            .store(counters.packets_sent, Ordering::Relaxed);
        self.network
            .packets_received
            .store(counters.packets_received, Ordering::Relaxed);
        self.network.clients.store(
            u32::try_from(clients.len()).unwrap_or(u32::MAX),
            Ordering::Relaxed,
        );
    }

    /// Writes the device port's events to the log and the recording; the monitor reads them itself.
    pub(super) fn log_incidents(&mut self) {
        let counts = &self.statistics.haptics.incidents;
        for (event, times) in self.incidents.since_last(counts) {
            if let Some(page) = &mut self.operator {
                page.note_event(&event, times);
            }
            let text = incidents::line(&event, times);
            if event.kind.is_fault() || is_about_arming(event.kind) {
                self.audit.follow_port(&text, event.kind.is_fault());
            }
            if event.kind.is_warning() {
                tracing::warn!("{text}");
            } else {
                tracing::info!("{text}");
            }
            self.record(event.time, "safety", &text);
        }
    }

    /// Tells of updates in which something stopped the body that gives no force; of more of them every ten seconds.
    fn log_stops(&mut self) {
        let stops = &self.statistics.god_object.stops_without_row;
        let (stops, now) = (stops.load(Ordering::Relaxed), self.clock.now());
        let (told, again) = self.stops_told;
        if now < again {
            return;
        }
        let Some(text) = said_of_stops(stops - told) else {
            return;
        };
        self.stops_told = (stops, now + STOPS_PERIOD);
        tracing::error!("{text}");
        if let Some(page) = &mut self.operator {
            page.note_line(now, Severity::Error, &text);
        }
        self.record(now, "method", &text);
    }

    /// Writes an event to the recording, if there is one.
    fn record(&self, time: Duration, kind: &str, text: &str) {
        if let Some(recorder) = &self.recorder {
            recorder.tell(EventRecord {
                time,
                kind: kind.to_owned(),
                text: text.to_owned(),
            });
        }
    }

    /// The end report as it would be now, but for what the end itself tells.
    pub(super) fn report(&self) -> SessionReport {
        let mut report = self.statistics.report(self.age());
        report.realtime = self.ledger.report();
        (report.clients, report.observers) = self.clients.reports();
        if let Some(link) = &self.link {
            let counters = link.counters();
            report.packets_sent = counters.packets_sent;
            report.packets_refused = counters.garbage
                + counters.wrong_version
                + counters.forged
                + counters.replayed
                + counters.inputs_refused;
            report.external_wrench = self.statistics.external.as_ref().map(|external| {
                ExternalWrenchReport::of(external, counters.forces_lost, counters.forces_refused)
            });
            let frames = link.frame_report();
            report.frames =
                frames.map(|measured| FramesReport::new(&measured, &mut report.clients));
        }
        report
    }

    /// Everything measured so far.
    pub fn metrics(&self) -> Metrics {
        let counters = self.link.as_ref().map(ServerLink::counters);
        let clients = self.link.as_ref().map(ServerLink::clients);
        let now = self.clock.now();
        let client_links: Vec<ClientLink> = clients
            .iter()
            .flatten()
            .map(|status| ClientLink::of(status, now))
            .collect();
        let session = self.report();
        let (memory_bytes, open_files) = metrics::process();
        Metrics {
            time_s: metrics::wall_clock_s(),
            session,
            network: counters.iter().flat_map(|c| c.named()).collect(),
            clients_present: client_links.len() as u64,
            client_links,
            stream_observers: self.observers.stream_observers(),
            stream_observers_dropped: self.observers.stream_observers_dropped(),
            log_lines_lost: taut_log::lost_lines(),
            memory_bytes,
            open_files,
        }
    }

    /// One line of what goes on.
    pub fn status_line(&self) -> String {
        let statistics = &self.statistics;
        let seconds = self.age().as_secs_f64();
        let period = statistics.haptics.period.distribution_us();
        let update = statistics.god_object.update.distribution_us();
        let [force, _] = statistics.haptics.felt();
        let checks = &statistics.checks;
        format!(
            "{seconds:5.0} s  haptics {:.0} Hz, p99 {:.2} ms  god-object p99 {:.2} ms  contacts {}  force {force:.2} N  clients {}  penetrations {} of {}",
            period.count as f64 / seconds.max(f64::MIN_POSITIVE),
            period.p99 * 1e-3,
            update.p99 * 1e-3,
            statistics.god_object.contacts.newest(),
            self.network.clients.load(Ordering::Relaxed),
            checks.penetrations.load(Ordering::Relaxed),
            checks.checks.load(Ordering::Relaxed),
        )
    }
}

/// Whether somebody let force in, or kept it out.
fn is_about_arming(kind: EventKind) -> bool {
    matches!(
        kind,
        EventKind::Armed
            | EventKind::Disarmed
            | EventKind::DeadManReleased
            | EventKind::ArmRefused
            | EventKind::RearmNeeded
    )
}

/// Whether a node came, went, or may be going: whoever stands at the haptic PC is told.
fn concerns_presence(event: &LinkEvent) -> bool {
    matches!(
        event,
        LinkEvent::Joined(_) | LinkEvent::Left { .. } | LinkEvent::Silent { .. }
    )
}

fn severity(event: &LinkEvent) -> Severity {
    use proto::control::LogLevel;
    match event {
        LinkEvent::Joined(_)
        | LinkEvent::Left { .. }
        | LinkEvent::Stats { .. }
        | LinkEvent::Arm { .. } => Severity::Info,
        LinkEvent::Silent { .. } => Severity::Warning,
        // The wall is not what it was, and somebody should know.
        LinkEvent::FreeRunning { free, .. } => match free {
            true => Severity::Error,
            false => Severity::Info,
        },
        LinkEvent::NoPlace { .. } | LinkEvent::StatesForged { .. } => Severity::Error,
        // Whoever stands at the haptic PC should know that somebody knocked.
        LinkEvent::Refused { .. } => Severity::Error,
        LinkEvent::Forbidden { .. } => Severity::Warning,
        LinkEvent::Log { event, .. } => match event.level {
            LogLevel::Info => Severity::Info,
            LogLevel::Warning => Severity::Warning,
            LogLevel::Error => Severity::Error,
        },
    }
}
