//! `taut serve`: the haptic PC, until its time is over, the user ends it, or something breaks.

use std::path::Path;
use std::time::Duration;

use taut_bridge::signals::EndFlag;
use taut_link::ClusterKey;
use taut_scene::{FidelityPlan, Log, LogLevel, Workbench};

use crate::cli::ServeArgs;
use crate::commands::{key, recording_size};
use crate::report::SessionReport;
use crate::report::metrics::{self, MetricsLines};
use crate::report::terminal::Terminal;
use crate::session::Session;
use crate::session::admission::AdmissionWatch;
use crate::session::setup::workbench::{Overrides, session_setup};
use crate::shared::failure::Failure;

/// Time between two looks at network, children and clock; also of the status line.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// Serves the workbench. The report comes with the failure, if the session broke down on the way.
pub(super) fn run(
    args: &ServeArgs,
    terminal: &Terminal,
) -> Result<(SessionReport, Option<Failure>), Failure> {
    let workbench = Workbench::load(&args.config)?;
    taut_log::use_directives(&directives(workbench.log));
    let mut metrics = MetricsOutlets::open(args)?;
    let key = workbench_key(args.key.as_deref(), &workbench)?;
    let overrides = Overrides {
        scene: args.scene.clone(),
        allow_unstable: args.allow_unstable,
        quic: args.quic,
        udp: args.udp,
        no_monitor: args.no_monitor,
        record: args.record.clone(),
        input: None,
        recording: args.recording.clone(),
    };
    let setup = session_setup(&workbench, key, &overrides)?;
    let end = EndFlag::listen().map_err(Failure::failed)?;
    let mut session = Session::start(setup)?;
    session.end_with(&end);
    taut_bridge::listen_at_console(session.arm_switch());
    announce(&session, terminal);
    if let Some(directory) = &args.recording {
        terminal.say(&recording_size::sentence(directory));
    }
    let mut admission = AdmissionWatch::new(&args.config);
    watch(&mut session, args.duration, terminal, |session| {
        admission.follow(session, terminal);
        metrics.follow(session);
    });
    terminal.end_status();
    let ended = session.stop(terminal);
    end.let_signals_kill();
    Ok(ended)
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

/// The key of the command line, else of the workbench file, else of the environment.
fn workbench_key(named: Option<&Path>, workbench: &Workbench) -> Result<ClusterKey, Failure> {
    key::read(named.or(workbench.network.key_file.as_deref()))
}

/// Says where the session can be reached, and what of real time is not in force.
pub(super) fn announce(session: &Session, terminal: &Terminal) {
    if let (Some(quic), Some(udp)) = (session.quic_address(), session.udp_address()) {
        terminal.say(&format!("serving on {quic} (control) and {udp} (poses)"));
    }
    if let Some(fingerprint) = session.fingerprint() {
        terminal.say(&format!("its fingerprint is {fingerprint}"));
    }
    if let Some(monitor) = session.monitor() {
        if let Some(page) = monitor.address() {
            terminal.say(&format!("watch it in a browser: {page}"));
        }
        if let Some(stream) = monitor.stream_address() {
            terminal.say(&format!("or in the rerun viewer: rerun {stream}"));
        }
    }
    for line in session.fidelity().into_iter().flat_map(FidelityPlan::lines) {
        terminal.say(&line);
    }
    for line in session.observers().lines() {
        terminal.say(&line);
    }
    if let Some(page) = session.operator() {
        terminal.say(&page.line());
    }
    for line in &session.realtime().waived {
        terminal.say(&format!("not in force: {line}"));
    }
}

/// Lets the session run until `duration` is over or its end is asked for; `each` is called at every look.
pub(super) fn watch(
    session: &mut Session,
    duration: Option<f64>,
    terminal: &Terminal,
    mut each: impl FnMut(&mut Session),
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
        session.follow_network(terminal);
        session.follow_operator();
        terminal.status(session.status_line());
        each(session);
        if end.is_some_and(|end| session.age() >= end) {
            return;
        }
    }
}
