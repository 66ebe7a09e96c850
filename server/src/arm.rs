//! `taut arm`: asks the device port of a session for force, or for none, and says what it answered.

use std::time::{Duration, Instant};

use taut_bridge::EventKind;
use taut_link::{ClientOptions, Role, connect};
use taut_proto::HotState;
use taut_proto::state::{EventRecord, RunState, event_code};

use crate::cli::ArmArgs;
use crate::failure::Failure;
use crate::key;

/// Time for states to come, and for the port to answer: the server looks at its clients ten times a second.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at what has arrived.
const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Asks, and waits for the answer in the states; one sentence.
pub async fn run(args: &ArmArgs) -> Result<&'static str, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let any_name = || format!("arm-{}", std::process::id());
    let node = key.node_name().map_or_else(any_name, str::to_owned);
    let options = ClientOptions::new(&args.server, key, Role::Operator, node);
    let link = connect(options).await?;
    let mut answer = Answer::new(!args.off);
    let deadline = Instant::now() + PATIENCE;
    let (mut states, mut events) = (Vec::new(), Vec::new());
    let mut asked = false;
    let told = loop {
        link.drain_states(&mut states);
        if let Some(told) = states.drain(..).find_map(|state| answer.look(&state.state)) {
            break Some(told);
        }
        link.drain_events(&mut events);
        let told = events.drain(..).find_map(|event| answer.hear(&event));
        if let Some(told) = told.filter(|_| asked) {
            break Some(told);
        }
        if answer.knows() && !asked {
            asked = link.post_arm(!args.off);
        }
        if Instant::now() >= deadline || link.is_closed().is_some() {
            break None;
        }
        tokio::time::sleep(LOOK_PERIOD).await;
    };
    let is_lost = link.is_closed().is_some();
    link.close().await;
    match told {
        Some(Ok(sentence)) => Ok(sentence),
        Some(Err(sentence)) => Err(Failure::failed(sentence)),
        // Not asked again of the next session: who wants force looks at the device first.
        None if is_lost => Err(Failure::failed(format!(
            "the session with {} ended before it answered; look at the device, and ask again",
            args.server
        ))),
        None if asked => Err(Failure::failed(format!(
            "{} did not answer; look at its log",
            args.server
        ))),
        None => Err(Failure::failed(format!(
            "no device sample came from {}; check that the device runs",
            args.server
        ))),
    }
}

/// Waits for the event that answers the request.
struct Answer {
    arm: bool,
    /// Whether a state came: what the port does already is known then.
    knows: bool,
}

impl Answer {
    fn new(arm: bool) -> Self {
        Self { arm, knows: false }
    }

    fn knows(&self) -> bool {
        self.knows
    }

    /// What the first state says of the request, if anything.
    fn look(&mut self, state: &HotState) -> Option<Result<&'static str, &'static str>> {
        if std::mem::replace(&mut self.knows, true) {
            return None;
        }
        match (self.arm, state.run) {
            (true, RunState::Running) => Some(Ok("armed already")),
            (false, RunState::Paused) => Some(Ok("disarmed already")),
            _ => None,
        }
    }

    /// What an event says of the request, if anything.
    fn hear(&self, event: &EventRecord) -> Option<Result<&'static str, &'static str>> {
        let (kind, _) = event_code::safety_of(event.code)?;
        match EventKind::from_number(kind)? {
            EventKind::Arming if self.arm => Some(Ok("armed: the force ramps in")),
            EventKind::ArmRefused if self.arm => Some(Err(
                "not armed: the device or the forces are not in order; look at the server's log",
            )),
            EventKind::Disarmed if !self.arm => Some(Ok("disarmed: the force fades")),
            _ => None,
        }
    }
}
