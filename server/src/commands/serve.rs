//! `taut serve`: the haptic PC, until its time is over, the user ends it, or something breaks.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use taut_bridge::ArmSwitch;
use taut_bridge::signals::EndFlag;
use taut_link::ClusterKey;
use taut_scene::{Device, FidelityPlan, Log, LogLevel, Workbench};

use crate::cli::ServeArgs;
use crate::commands::scene_watch::SceneWatch;
use crate::commands::{key, recording_size};
use crate::report::SessionReport;
use crate::report::metrics::{self, MetricsLines};
use crate::report::terminal::Terminal;
use crate::session::Session;
use crate::session::admission::AdmissionWatch;
use crate::session::setup::SessionSetup;
use crate::session::setup::workbench::{Overrides, session_setup};
use crate::shared::failure::Failure;

/// Time between two looks at network, children and clock; also of the status line.
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// How force comes at a device that can push.
pub(super) const HELP_ARM: &str =
    "no force yet: type arm and Enter for force, off and Enter for none (docs/safety.md)";

/// Serves the workbench. The report comes with the failure, if the session broke down on the way.
pub(super) fn run(
    args: &ServeArgs,
    terminal: &Terminal,
) -> Result<(SessionReport, Option<Failure>), Failure> {
    let workbench = load_workbench(args)?;
    taut_log::use_directives(&directives(workbench.log));
    let mut metrics = MetricsOutlets::open(args)?;
    let mut overrides = Overrides {
        scene: args.scene.clone(),
        allow_unstable: args.allow_unstable,
        quic: args.quic,
        udp: args.udp,
        no_monitor: args.no_monitor,
        record: args.record.clone(),
        input: None,
        recording: args.recording.clone(),
    };
    let setup = load_session(args, &workbench, &overrides)?;
    let end = EndFlag::listen().map_err(Failure::failed)?;
    let arm_switch = Arc::<ArmSwitch>::default();
    taut_bridge::listen_at_console(&arm_switch);
    let mut next = (workbench, setup);
    let begun = Instant::now();
    loop {
        let (workbench, setup) = next;
        let token = setup
            .operator
            .as_ref()
            .map(|page| page.server.token.clone());
        let scene = args
            .follow_scene
            .then(|| SceneWatch::new(&args.config, &workbench));
        let mut scene = scene.transpose()?;
        let mut session = Session::start_with(setup, arm_switch.clone())?;
        session.end_with(&end);
        // Whoever comes again comes to where he was.
        (overrides.quic, overrides.udp) = (session.quic_address(), session.udp_address());
        announce(&session, terminal);
        if matches!(&workbench.device, Device::Driver(chosen) if chosen.kind.has_motors) {
            // Somebody holds it: a person arms.
            terminal.say(HELP_ARM);
        }
        if let Some(directory) = &args.recording {
            terminal.say(&recording_size::sentence(directory));
        }
        let mut admission = AdmissionWatch::new(&args.config);
        let left = args
            .duration
            .map(|s| (s - begun.elapsed().as_secs_f64()).max(0.0));
        let mut other = None;
        watch(&mut session, left, terminal, |session| {
            admission.follow(session, terminal);
            metrics.follow(session);
            let load = || {
                let workbench = load_workbench(args)?;
                let mut setup = load_session(args, &workbench, &overrides)?;
                keep_token(&mut setup, token.as_deref());
                Ok((workbench, setup))
            };
            other = scene
                .as_mut()
                .and_then(|scene| scene.follow(terminal, load));
            other.is_none()
        });
        terminal.end_status();
        match other {
            Some(changed) => {
                let (report, failure) = session.make_way(terminal);
                if let Some(failure) = failure {
                    return Ok((report, Some(failure)));
                }
                terminal.say(&report.verdict());
                metrics.begin_again();
                next = changed;
            }
            None => {
                let ended = session.stop(terminal);
                end.let_signals_kill();
                return Ok(ended);
            }
        }
    }
}

/// The workbench file, with the scene of the command line.
fn load_workbench(args: &ServeArgs) -> Result<Workbench, Failure> {
    let mut workbench = Workbench::load(&args.config)?;
    if let Some(scene) = &args.scene {
        workbench.scene.clone_from(scene);
    }
    refuse_to_follow(args, &workbench)?;
    Ok(workbench)
}

/// Another scene's session is made before this one ends, and a force device can be opened once.
fn refuse_to_follow(args: &ServeArgs, workbench: &Workbench) -> Result<(), Failure> {
    match &workbench.device {
        Device::Driver(chosen) if args.follow_scene && chosen.kind.has_motors => {
            Err(Failure::BadInput(format!(
                "--follow-scene needs a device that stays while sessions change, but [device] is of kind \"{0}\"; write kind = \"remote\" there and run `taut bridge --device {0}` beside the server",
                chosen.kind.name
            )))
        }
        _ => Ok(()),
    }
}

/// What a session of this workbench is made of.
fn load_session(
    args: &ServeArgs,
    workbench: &Workbench,
    overrides: &Overrides,
) -> Result<SessionSetup, Failure> {
    let key = workbench_key(args.key.as_deref(), workbench)?;
    session_setup(workbench, key, overrides)
}

/// A page that was opened by a token that was made for this start goes on with it.
fn keep_token(setup: &mut SessionSetup, token: Option<&str>) {
    if let (Some(page), Some(token)) = (&mut setup.operator, token)
        && page.token_file.is_none()
    {
        token.clone_into(&mut page.server.token);
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

/// Lets the session run until `duration` is over, its end is asked for, or `each`, which is called at every look, says that it does not go on.
pub(super) fn watch(
    session: &mut Session,
    duration: Option<f64>,
    terminal: &Terminal,
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
        session.follow_network(terminal);
        session.follow_operator();
        terminal.status(session.status_line());
        let goes_on = each(session);
        if !goes_on || end.is_some_and(|end| session.age() >= end) {
            return;
        }
    }
}
