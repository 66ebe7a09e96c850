//! `taut serve`: the haptic PC, until its time is over, the user ends it, or something breaks.

use std::time::{Duration, Instant};

use taut_bridge::signals::EndFlag;
use taut_scene::{Device, FidelityPlan, Log, LogLevel};

use crate::cli::ServeArgs;
use crate::commands::live_scene::{LiveScene, load_workbench};
use crate::commands::recording_size;
use crate::report::SessionReport;
use crate::report::metrics;
use crate::report::metrics_lines::MetricsLines;
use crate::session::Session;
use crate::session::admission::AdmissionWatch;
use crate::session::operator::Continuity;
use crate::session::setup::workbench::Overrides;
use crate::shared::failure::Failure;

/// Time between two looks at network, children and clock; also of the status line.
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// How force comes at a device that can push.
pub(super) const HELP_ARM: &str =
    "no force yet: type arm and Enter for force, off and Enter for none (docs/safety.md)";

/// Serves the workbench. The report comes with the failure, if the session broke down on the way.
pub(super) fn run(args: &ServeArgs) -> Result<(SessionReport, Option<Failure>), Failure> {
    let mut admission = AdmissionWatch::new(&args.config);
    let workbench = load_workbench(args)?;
    taut_log::use_directives(&directives(workbench.log));
    let mut metrics = MetricsOutlets::open(args)?;
    let mut kept = Continuity::default();
    let mut scene = LiveScene::new(args, overrides(args), kept.scenes.clone());
    let mut next = scene.first()?;
    let end = EndFlag::listen().map_err(Failure::failed)?;
    taut_bridge::listen_at_console(&kept.switch);
    let begun = Instant::now();
    loop {
        scene.begin(&mut next);
        admission.begin(&mut next.setup.link.policy);
        if !next.goes_on {
            kept.handover = None;
        }
        let mut session = Session::start_with(next.setup, &mut kept)?;
        session.end_with(&end);
        scene.began(&session);
        announce(&session);
        if let Some(sentence) = session.beginning().sentence() {
            taut_log::say(&sentence);
        }
        if matches!(&workbench.device, Device::Driver(chosen) if chosen.kind.has_motors) {
            // Somebody holds it: a person arms.
            taut_log::say(HELP_ARM);
        }
        if let Some(directory) = &args.recording {
            taut_log::say(&recording_size::sentence(directory));
        }
        let left = args
            .duration
            .map(|s| (s - begun.elapsed().as_secs_f64()).max(0.0));
        let mut other = None;
        watch(&mut session, left, |session| {
            admission.follow(session);
            metrics.follow(session);
            other = scene.follow(session.age());
            other.is_none()
        });
        taut_log::end_status();
        match other {
            Some(changed) => {
                let (report, failure) = session.make_way(&mut kept);
                if let Some(failure) = failure {
                    return Ok((report, Some(failure)));
                }
                taut_log::say(&report.verdict());
                metrics.begin_again();
                next = changed;
            }
            None => {
                let ended = session.stop();
                end.let_signals_kill();
                return Ok(ended);
            }
        }
    }
}

fn overrides(args: &ServeArgs) -> Overrides {
    Overrides {
        scene: args.scene.clone(),
        allow_unstable: args.allow_unstable,
        quic: args.quic,
        udp: args.udp,
        no_monitor: args.no_monitor,
        record: args.record.clone(),
        recording: args.recording.clone(),
        ..Overrides::default()
    }
}

/// What is logged, as `tracing` takes it.
fn directives(log: Log) -> String {
    let word = |level| match level {
        LogLevel::Off => "off",
        LogLevel::Error => "error",
        LogLevel::Warn => "warn",
        LogLevel::Info => "info",
        LogLevel::Debug => "debug",
        LogLevel::Trace => "trace",
    };
    format!(
        "{},{}={}",
        word(log.level),
        taut_log::AUDIT_TARGET,
        word(log.audit)
    )
}

/// Where metrics go while the session runs.
struct MetricsOutlets {
    lines: Option<MetricsLines>,
    line_period: Duration,
    /// Ages of the session when the next are due.
    next: Duration,
    next_line: Duration,
}

impl MetricsOutlets {
    fn open(args: &ServeArgs) -> Result<Self, Failure> {
        let lines = args.metrics_json.as_deref().map(MetricsLines::start);
        Ok(Self {
            lines: lines.transpose()?,
            line_period: Duration::from_secs_f64(args.metrics_period),
            next: Duration::ZERO,
            next_line: Duration::ZERO,
        })
    }

    /// For a session whose age begins at zero.
    fn begin_again(&mut self) {
        (self.next, self.next_line) = (Duration::ZERO, Duration::ZERO);
    }

    fn follow(&mut self, session: &mut Session) {
        let age = session.age();
        let (page, line) = (age >= self.next, age >= self.next_line);
        let (page, line) = (
            page && session.shows_metrics(),
            line && self.lines.is_some(),
        );
        if !page && !line {
            return;
        }
        let metrics = session.metrics();
        if page {
            self.next = age + metrics::PERIOD;
            session.show_metrics(&metrics);
        }
        if let Some(lines) = self.lines.as_ref().filter(|_| line) {
            self.next_line = age + self.line_period;
            lines.write(&metrics);
        }
    }
}

/// Says where the session can be reached, and what of real time is not in force.
pub(super) fn announce(session: &Session) {
    if let (Some(quic), Some(udp)) = (session.quic_address(), session.udp_address()) {
        taut_log::say(&format!("serving on {quic} (control) and {udp} (poses)"));
    }
    if let Some(fingerprint) = session.fingerprint() {
        taut_log::say(&format!("its fingerprint is {fingerprint}"));
    }
    if let Some(monitor) = session.monitor() {
        if let Some(page) = monitor.address() {
            taut_log::say(&format!("watch it in a browser: {page}"));
        }
        if let Some(stream) = monitor.stream_address() {
            taut_log::say(&format!("or in the rerun viewer: rerun {stream}"));
        }
        if let Some(file) = monitor.recording() {
            taut_log::say(&format!("what it shows is written to {}", file.display()));
        }
    }
    for line in session.fidelity().into_iter().flat_map(FidelityPlan::lines) {
        taut_log::say(&line);
    }
    for line in session.observers().lines() {
        taut_log::say(&line);
    }
    if let Some(page) = session.operator() {
        taut_log::say(page.line());
    }
    for line in &session.realtime().waived {
        taut_log::say(&format!("not in force: {line}"));
    }
}

/// Lets the session run until `duration` is over, its end is asked for, or `each`, which is called at every look, says that it does not go on.
pub(super) fn watch(
    session: &mut Session,
    duration: Option<f64>,
    mut each: impl FnMut(&mut Session) -> bool,
) {
    let end = duration.map(Duration::from_secs_f64);
    loop {
        let left = end.map_or(LOOK_PERIOD, |end| {
            end.saturating_sub(session.age()).min(LOOK_PERIOD)
        });
        std::thread::sleep(left);
        if session.is_ending() {
            return;
        }
        session.follow_network();
        session.follow_operator();
        taut_log::status(session.status_line());
        let goes_on = each(session);
        if !goes_on || end.is_some_and(|end| session.age() >= end) {
            return;
        }
    }
}
