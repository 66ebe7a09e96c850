//! The end of a session, and what was measured.

use taut_link::ServerLink;

use crate::report::SessionReport;
use crate::report::frames::FramesReport;
use crate::report::terminal::Terminal;
use crate::session::monitor::{MonitorFeed, Severity};
use crate::session::observers::ObserverServices;
use crate::shared::failure::Failure;

use super::Session;

impl Session {
    /// Ends everything and says what was measured; the failure, if something broke.
    pub fn stop(mut self, terminal: &Terminal) -> (SessionReport, Option<Failure>) {
        self.follow_network(terminal);
        self.audit.end();
        let duration = self.age();
        let mut report = self.statistics.report(duration);
        report.fidelity = self.fidelity.as_ref().map(|f| f.watch.report(&f.plan));
        if let Some(monitor) = &self.monitor {
            monitor.log(
                Severity::Info,
                &format!("the session ends after {:.1} s", report.duration_s),
            );
        }
        if let Some(link) = &self.link {
            let counters = link.counters();
            report.packets_sent = counters.packets_sent;
            report.packets_refused = counters.garbage
                + counters.wrong_version
                + counters.forged
                + counters.replayed
                + counters.inputs_refused;
        }
        let frames = self.link.as_ref().and_then(ServerLink::frame_report);
        let mut failure = self
            .shutdown
            .failure()
            .map(|sentence| Failure::Failed(sentence.to_owned()));
        match self.end() {
            Ok(dropped) => report.monitor_dropped = dropped,
            Err(error) => failure = failure.or(Some(error)),
        }
        if let Some(recorder) = self.recorder.take() {
            let summary = recorder.finish();
            if let Some(error) = summary.failure {
                terminal.say(&format!("taut: the recording is not whole: {error}"));
            } else if !summary.lost.is_none() {
                terminal.say(&format!(
                    "taut: the recording is not whole: the disk was too slow, and records were lost ({})",
                    summary.lost
                ));
            }
        }
        report.realtime = self.ledger.report();
        (report.clients, report.observers) = self.clients.reports();
        report.frames = frames.map(|measured| FramesReport::new(&measured, &mut report.clients));
        (report, failure)
    }

    /// Ends what runs; how many samples the monitor dropped. A second time it does nothing.
    pub(super) fn end(&mut self) -> Result<u64, Failure> {
        self.shutdown.ask();
        for thread in self.threads.drain(..).rev() {
            // A thread that panicked has said so by `Shutdown::fail`.
            let _ = thread.join();
        }
        let monitor = self.monitor.take().map(MonitorFeed::stop);
        self.observers = ObserverServices::default();
        if let Some(link) = self.link.take() {
            self.runtime.block_on(link.shutdown());
        }
        monitor.unwrap_or(Ok(0))
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if let Err(error) = self.end() {
            tracing::warn!("{error}");
        }
    }
}
