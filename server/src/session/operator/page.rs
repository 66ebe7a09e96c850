//! What the operator's page shows: one line of JSON, five times a second. What the metrics have is taken from there and not measured again.

use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use taut_bridge::{Rearm, SafetyEvent, SafetySettings};
use taut_link::{JoinPolicy, PictureAsker};
use taut_observers::StateFeed;
use taut_observers::lines::run_name;
use taut_proto::HotState;
use taut_proto::state::{RunState, TOOL_DEVICE_SILENT, TOOL_FORCE_LIMITED};

use super::door::{Continuity, OperatorDoor};
use super::recent::Recent;
use super::settings::OperatorSetup;
use crate::loops::statistics::Statistics;
use crate::report::metrics::Metrics;
use crate::session::monitor::Severity;
use crate::session::setup::{DeviceSource, SessionSetup};
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;
use crate::shared::wrench_command::WrenchCommand;

/// Shortest time between two lines.
const PERIOD: Duration = Duration::from_millis(150);

/// What a session is: told again in every line, so that each stands for itself.
#[derive(Debug, Serialize)]
pub(crate) struct Facts {
    program: &'static str,
    workbench: String,
    scene: String,
    /// Another one at each start of the server.
    instance: String,
    /// Which scene of this server it is: `/scene` has it.
    scene_revision: u64,
    /// Whether a device behind a bridge is commanded, which is armed at the bridge as well.
    device_behind_bridge: bool,
    /// Whether a person arms.
    manual: bool,
    force_limit_n: f64,
    torque_limit_n: f64,
    ramp_in_s: f64,
}

/// What the thread that looks after the session knows at a moment.
#[derive(Debug)]
pub(crate) struct Moment<'m> {
    /// Session time.
    pub(crate) now: Duration,
    /// The newest force of the coupling.
    pub(crate) computed: &'m WrenchCommand,
    /// Rows in the newest constraint set.
    pub(crate) contacts: u64,
    /// Force, N, and torque, N m, that the hand feels: what the device port lets through.
    pub(crate) felt: [f64; 2],
    /// Largest force that was felt, N.
    pub(crate) largest_force: f64,
    /// Whether the session is being recorded.
    pub(crate) is_recorded: bool,
}

/// How it stands now.
#[derive(Debug, Default, Serialize)]
struct Now {
    t: f64,
    run: &'static str,
    /// `null` before the first.
    sample_age_s: Option<f64>,
    force_age_s: Option<f64>,
    force_n: f64,
    torque_nm: f64,
    force_limited: bool,
    device_silent: bool,
    largest_force_n: f64,
    contacts: u64,
    recorded: bool,
    /// Why arming would not even be asked for; `null` where it would.
    why_not_armed: Option<String>,
}

/// A running page. Dropped, it ends.
#[derive(Debug)]
pub(crate) struct OperatorPage {
    door: Arc<OperatorDoor>,
    /// Where it is, and what opens it.
    line: String,
    feed: StateFeed,
    facts: String,
    state: Now,
    sampled: Option<Duration>,
    recent: Recent,
    /// The newest metrics as JSON.
    metrics: String,
    next: Duration,
}

impl Facts {
    /// Of a session that is about to start.
    pub(crate) fn of(setup: &SessionSetup, wanted: &OperatorSetup) -> Self {
        let safety: &SafetySettings = &setup.safety;
        Self {
            program: concat!("taut ", env!("CARGO_PKG_VERSION")),
            workbench: wanted.workbench.clone(),
            scene: setup.content.description.name.to_string(),
            instance: String::new(),
            scene_revision: 0,
            device_behind_bridge: matches!(setup.device, DeviceSource::Remote { .. }),
            manual: safety.rearm == Rearm::Manual,
            force_limit_n: safety.max_force,
            torque_limit_n: safety.max_torque,
            ramp_in_s: safety.ramp_in.as_secs_f64(),
        }
    }
}

impl OperatorPage {
    /// Opens the page, or lets the one that is open show this session.
    ///
    /// # Errors
    /// The port cannot be had.
    pub(crate) fn start(
        wanted: &OperatorSetup,
        facts: Facts,
        feed: StateFeed,
        kept: &mut Continuity,
        statistics: &Statistics,
        clock: SessionClock,
        policy: &JoinPolicy,
    ) -> Result<Self, Failure> {
        let door = kept.door(wanted)?;
        let desk = &door.desk;
        desk.begin(statistics.haptics.clone(), clock, policy);
        let facts = json(&Facts {
            instance: door.instance.clone(),
            scene_revision: desk.scenes().revision(),
            ..facts
        });
        let (address, token) = (door.server.address(), &wanted.server.token);
        let line = match &wanted.token_file {
            None => format!(
                "operator's page: http://{address}/#token={token} (who has this address can arm)"
            ),
            Some(file) => format!(
                "operator's page: http://{address}/#token= and the line in {}",
                file.display()
            ),
        };
        Ok(Self {
            door,
            line,
            feed,
            facts,
            state: Now {
                run: run_name(RunState::Waiting),
                ..Now::default()
            },
            sampled: None,
            recent: Recent::default(),
            metrics: "null".to_owned(),
            next: Duration::ZERO,
        })
    }

    /// Asks the render nodes of this session for pictures from now on.
    pub(crate) fn with_pictures(self, nodes: PictureAsker) -> Self {
        self.door.desk.show_nodes(nodes);
        self
    }

    /// Where it is, and what opens it, for the person who started the server.
    pub(crate) fn line(&self) -> &str {
        &self.line
    }

    pub(crate) fn follow_policy(&self, policy: &JoinPolicy) {
        self.door.desk.follow_policy(policy);
    }

    /// Takes an event of the device port.
    pub(crate) fn note_event(&mut self, event: &SafetyEvent, times: u64) {
        self.recent.event(event, times);
    }

    /// Takes a line about the network.
    pub(crate) fn note_line(&mut self, now: Duration, severity: Severity, line: &str) {
        self.recent.line(now, severity, line);
    }

    pub(crate) fn show_metrics(&mut self, metrics: &Metrics) {
        self.metrics = json(metrics);
    }

    /// Takes the newest state, and tells how things stand if it is time.
    pub(crate) fn follow(&mut self, moment: &Moment<'_>) {
        if let Some(fresh) = self.feed.fresh() {
            self.state.follow(fresh.state);
            self.sampled = Some(Duration::from_nanos(fresh.state.sample_time_ns));
            self.door.desk.follow_state(fresh.state.run, moment.now);
        }
        self.door.desk.look();
        if moment.now < self.next {
            return;
        }
        self.next = moment.now + PERIOD;
        let (state, computed) = (&mut self.state, moment.computed);
        let age = |then: Duration| moment.now.saturating_sub(then).as_secs_f64();
        state.t = moment.now.as_secs_f64();
        state.sample_age_s = self.sampled.map(age);
        state.force_age_s = (computed.sequence > 0).then(|| age(computed.time));
        state.contacts = moment.contacts;
        [state.force_n, state.torque_nm] = moment.felt;
        state.largest_force_n = moment.largest_force;
        state.recorded = moment.is_recorded;
        state.why_not_armed = self.door.desk.why_not();
        self.door.server.publish(format!(
            r#"{{"type":"status","session":{},"now":{},"recent":{},"metrics":{}}}"#,
            self.facts,
            json(&self.state),
            json(&self.recent.newest_first()),
            self.metrics
        ));
    }

    /// The session is over.
    pub(crate) fn end(&self) {
        self.door.desk.end();
    }
}

impl Now {
    fn follow(&mut self, state: &HotState) {
        self.run = run_name(state.run);
        let Some(tool) = state.tools.first() else {
            return;
        };
        self.force_limited = tool.flags & TOOL_FORCE_LIMITED != 0;
        self.device_silent = tool.flags & TOOL_DEVICE_SILENT != 0;
    }
}

/// As JSON: numbers, texts and lists always have a form.
fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).unwrap_or_else(|_| "null".to_owned())
}
