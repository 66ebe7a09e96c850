//! A command that joins a session and sends values until it is told to end: the loop of `taut track` and `taut push-wrench`.

use std::future::ready;
use std::time::{Duration, Instant};

use taut_bridge::service_manager::{self, Turns};
use taut_link::{
    ClientLink, ClientOptions, LinkError, RejoinPolicy, Renewal, SessionEnd, SupervisedLink,
};

use crate::commands::signals::EndSignal;
use crate::shared::failure::Failure;

pub(super) trait Source {
    /// A session begins, the first or another one.
    fn begin(&mut self, _link: &ClientLink) {}

    /// Sends over `link` what is new, with this index, `since_start` after the first look.
    fn send(&mut self, link: &ClientLink, index: u64, since_start: Duration) -> Sent;
}

/// What came of a look at the source.
pub(super) enum Sent {
    /// A value went out.
    One,
    /// There is nothing new, or nobody to take it.
    Nothing,
    /// There will be no more, because of a failure or without one.
    Over(Result<(), Failure>),
}

/// How long and how often.
pub(super) struct Sending {
    /// What runs, for the service manager.
    pub(super) what: &'static str,
    /// Looks at the source per second.
    pub(super) rate: f64,
    /// s; `None`: until something else ends it.
    pub(super) duration: Option<f64>,
    pub(super) policy: RejoinPolicy,
}

/// Sends until the duration or the source is over, the user ends it, or the server stops; a server that is lost is joined again. How many values
/// were sent.
pub(super) async fn run(
    sending: Sending,
    options: ClientOptions,
    mut signal: EndSignal,
    mut source: impl Source,
) -> Result<u64, Failure> {
    let server = options.server.clone();
    let alive = Turns::default();
    let notifier = service_manager::start(sending.what, [alive.clone()], || false);
    let joining = SupervisedLink::join(options, sending.policy, |_| ready(Ok::<(), LinkError>(())));
    let (supervised, mut link, ()) = tokio::select! {
        joined = alive.during(joining) => joined?,
        () = signal.given() => return Ok(0),
    };
    source.begin(&link);

    let mut period = tokio::time::interval(Duration::from_secs_f64(sending.rate.recip()));
    period.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let start = Instant::now();
    let mut sent = 0;
    let end = loop {
        tokio::select! {
            () = signal.given() => break Ok(()),
            _ = period.tick() => {}
        }
        alive.count();
        let since_start = start.elapsed();
        let is_over = |wanted| since_start.as_secs_f64() >= wanted;
        if sending.duration.is_some_and(is_over) {
            break Ok(());
        }
        match supervised.take_renewal() {
            None => {}
            Some(Renewal::Session { link: next, .. }) => {
                source.begin(&next);
                link = next;
            }
            Some(Renewal::Ended(SessionEnd::Lost(reason))) => {
                break Err(Failure::Failed(format!(
                    "the server at {server} was lost: {reason}"
                )));
            }
            Some(Renewal::Ended(SessionEnd::ServerStopped)) => break Ok(()),
        }
        match source.send(&link, sent + 1, since_start) {
            Sent::One => sent += 1,
            Sent::Nothing => {}
            Sent::Over(end) => break end,
        }
    };
    drop(notifier);
    // Nobody is to join again for the session that is left here.
    drop(supervised);
    link.leave().await;
    end.map(|()| sent)
}
