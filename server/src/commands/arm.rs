//! `taut arm`: asks the device port of a session for force, or for none, and says what it answered.

use std::time::{Duration, Instant};

use taut_bridge::EventKind;
use taut_link::{ClientOptions, ReceivedState, Role, ServerState, connect};
use taut_proto::state::{EventRecord, RunState, event_code};

use crate::cli::ArmArgs;
use crate::commands::key;
use crate::shared::failure::Failure;

/// Time for states to come, and for the port to answer: the server looks at its clients ten times a second.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at what has arrived.
const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// States per second that are asked for: by itself, so that none of the group's comes here, and as many as a person can tell apart.
const STATES_HZ: u32 = 50;

/// Asks, and waits for the answer in the states and events that came under the keys of this session; one sentence.
pub async fn run(args: &ArmArgs) -> Result<&'static str, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let any_name = || format!("arm-{}", std::process::id());
    let node = key.node_name().map_or_else(any_name, str::to_owned);
    let link = connect(ClientOptions {
        rate_hz: STATES_HZ,
        ..ClientOptions::new(&args.server, key, Role::Operator, node)
    })
    .await?;
    let mut answer = Answer::new(!args.off);
    let deadline = Instant::now() + PATIENCE;
    let (mut states, mut events) = (Vec::new(), Vec::new());
    let reply = loop {
        // Who wants no force asks at once, whatever anybody says of the device; who wants force looks at it first.
        if answer.is_to_ask() && link.post_arm(!args.off) {
            answer.asked = true;
        }
        link.drain_events(&mut events);
        if let Some(reply) = events.drain(..).find_map(|event| answer.hear(&event)) {
            break Some(reply);
        }
        link.drain_states(&mut states);
        let own = states.iter().filter_map(ReceivedState::of_server);
        let reply = own.fold(None, |reply, state| reply.or_else(|| answer.look(state)));
        states.clear();
        if reply.is_some() || Instant::now() >= deadline || link.is_closed().is_some() {
            break reply;
        }
        tokio::time::sleep(LOOK_PERIOD).await;
    };
    let is_lost = link.is_closed().is_some();
    link.close().await;
    match reply {
        Some(Ok(sentence)) => Ok(sentence),
        Some(Err(sentence)) => Err(Failure::failed(sentence)),
        // Not asked again of the next session: who wants force looks at the device first.
        None if is_lost => Err(Failure::failed(format!(
            "the session with {} ended before it answered; look at the device, and ask again",
            args.server
        ))),
        None if answer.knows => Err(Failure::failed(format!(
            "{} did not answer; look at its log",
            args.server
        ))),
        None => Err(Failure::failed(format!(
            "no device sample came from {}; check that the device runs",
            args.server
        ))),
    }
}

/// Waits for what answers the request.
struct Answer {
    arm: bool,
    /// Whether a state came: what the port does already is known then.
    knows: bool,
    asked: bool,
}

impl Answer {
    fn new(arm: bool) -> Self {
        Self {
            arm,
            knows: false,
            asked: false,
        }
    }

    /// Whether it is time to ask.
    fn is_to_ask(&self) -> bool {
        !self.asked && (self.knows || !self.arm)
    }

    /// What a state says of the request, if anything: of one for force the first, which came before it; of one for none any that came after it.
    fn look(&mut self, state: ServerState<'_>) -> Option<Result<&'static str, &'static str>> {
        let first = !std::mem::replace(&mut self.knows, true);
        match (self.arm, state.run()) {
            (true, RunState::Running) if first => Some(Ok("armed already")),
            (false, RunState::Paused) if self.asked => Some(Ok("disarmed already")),
            _ => None,
        }
    }

    /// What an event says of the request, if anything.
    fn hear(&self, event: &EventRecord) -> Option<Result<&'static str, &'static str>> {
        let (kind, _) = event_code::safety_of(event.code)?;
        match EventKind::from_number(kind)? {
            _ if !self.asked => None,
            EventKind::Arming if self.arm => Some(Ok("armed: the force ramps in")),
            EventKind::ArmRefused if self.arm => Some(Err(
                "not armed: the device or the forces are not in order; look at the server's log",
            )),
            EventKind::Disarmed if !self.arm => Some(Ok("disarmed: the force fades")),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_link::Provenance;
    use taut_proto::HotState;

    fn received(run: RunState, provenance: Provenance) -> ReceivedState {
        ReceivedState {
            state: HotState {
                run,
                ..HotState::empty()
            },
            sequence: 1,
            received: Instant::now(),
            state_hash: 1,
            provenance,
        }
    }

    fn looked(
        answer: &mut Answer,
        run: RunState,
        provenance: Provenance,
    ) -> Option<Result<&'static str, &'static str>> {
        let state = received(run, provenance);
        state.of_server().and_then(|state| answer.look(state))
    }

    #[test]
    fn no_force_is_asked_for_before_anything_is_believed() {
        let mut answer = Answer::new(false);
        assert!(answer.is_to_ask(), "before any state");
        assert_eq!(
            looked(&mut answer, RunState::Paused, Provenance::Session),
            None,
            "what the device does before it was asked is no answer"
        );
        assert!(answer.is_to_ask());
        answer.asked = true;
        for _ in 0..100 {
            let forged = looked(&mut answer, RunState::Paused, Provenance::Group);
            assert_eq!(forged, None, "a member's word");
        }
        assert_eq!(
            looked(&mut answer, RunState::Running, Provenance::Session),
            None
        );
        assert!(looked(&mut answer, RunState::Paused, Provenance::Session).is_some());
    }

    #[test]
    fn force_is_asked_for_when_the_server_has_said_what_the_device_does() {
        let mut answer = Answer::new(true);
        assert!(!answer.is_to_ask());
        assert_eq!(
            looked(&mut answer, RunState::Running, Provenance::Group),
            None
        );
        assert!(!answer.is_to_ask(), "a state of the group says nothing");
        assert_eq!(
            looked(&mut answer, RunState::Paused, Provenance::Session),
            None
        );
        assert!(answer.is_to_ask());
        let mut armed = Answer::new(true);
        assert!(looked(&mut armed, RunState::Running, Provenance::Session).is_some());
    }
}
