//! The end of a session, and what was measured.

use std::sync::atomic::Ordering;

use crate::report::SessionReport;
use crate::session::monitor::{MonitorFeed, Severity};
use crate::session::observers::ObserverServices;
use crate::session::operator::Continuity;
use crate::shared::failure::Failure;

use super::Session;

impl Session {
    /// Ends everything and says what was measured; the failure, if something broke. The force is led down first.
    pub fn stop(mut self) -> (SessionReport, Option<Failure>) {
        self.follow_network();
        self.audit.end();
        let mut report = self.report();
        report.fidelity = self.fidelity.as_ref().map(|f| f.watch.report(&f.plan));
        if let Some(monitor) = &self.monitor {
            monitor.log(
                Severity::Info,
                &format!("the session ends after {:.1} s", report.duration_s),
            );
        }
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
                let sentence = format!("the recording is not whole: {error}");
                if self.makes_way.load(Ordering::Relaxed) {
                    taut_log::say(&format!("taut: {sentence}")); // the next session is none of its matter
                } else {
                    failure = failure.or(Some(Failure::Failed(sentence)));
                }
            } else if !summary.lost.is_none() {
                taut_log::say(&format!(
                    "taut: the recording is not whole: the disk was too slow, and records were lost ({})",
                    summary.lost
                ));
            }
        }
        report.realtime = self.ledger.report();
        (report, failure)
    }

    /// The same where another session begins at once: nodes, bridge and observers join that one, and it gets what is left in `kept`.
    pub(crate) fn make_way(self, kept: &mut Continuity) -> (SessionReport, Option<Failure>) {
        self.makes_way.store(true, Ordering::Relaxed);
        let handover = self.handover.clone();
        let ended = self.stop();
        kept.handover = Some(handover);
        ended
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
        if let Some(page) = self.operator.take() {
            page.end();
        }
        if let Some(link) = self.link.take() {
            if self.makes_way.load(Ordering::Relaxed) {
                self.runtime.block_on(link.make_way());
            } else {
                self.runtime.block_on(link.shutdown());
            }
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
