//! `taut record`: takes the device trace of a live session, in the form that `taut replay` reads.
//!
//! Poses are those of the state stream, in single precision: a micrometre at ten metres.

use std::future::ready;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use taut_bridge::service_manager::{self, Turns};
use taut_link::{
    ClientLink, ClientOptions, LinkError, ReceivedState, RejoinPolicy, Renewal, Role,
    SupervisedLink,
};
use taut_proto::SceneDescription;
use taut_scene::{FinishedFile, free_name, is_taken};

use crate::cli::RecordArgs;
use crate::commands::key;
use crate::commands::signals::EndSignal;
use crate::shared::failure::Failure;

/// Time between two looks at what has arrived; the link queues meanwhile.
const DRAIN_PERIOD: Duration = Duration::from_millis(10);
/// Silence of the states after which the session counts as lost: nobody waits for a recorder, and a short pause of the network costs only its own samples.
const DEAD_AFTER: Duration = Duration::from_secs(2);
/// Least time between the last sample of one session and the first of the next.
const SESSIONS_APART_S: f64 = 1e-3;

/// Records until the duration is over, the user ends it, or the server stops; a server that is lost is joined again. The file, and how many rows
/// there are in it.
pub(super) async fn run(args: &RecordArgs) -> Result<(PathBuf, u64), Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let out = place(args)?;
    let cannot_write = |error: std::io::Error| not_written(&out, &error, None);
    let inputs: Vec<&Path> = args.key.as_deref().into_iter().collect();
    // Before anybody is waited for: what cannot be written is told at once.
    let file = FinishedFile::create_new(&out, &inputs).map_err(cannot_write)?;
    let trace = TraceWriter::begin(file).map_err(cannot_write)?;
    let mut signal = EndSignal::listen().map_err(Failure::failed)?;
    let any_name = || format!("record-{}", std::process::id());
    let node = key.node_name().map_or_else(any_name, str::to_owned);
    // It takes states and nothing else, so an observer's credential will do.
    let role = match key.role() {
        Some(Role::Observer) => Role::Observer,
        _ => Role::Operator,
    };
    let options = ClientOptions {
        transport: args.transport.into(),
        ..ClientOptions::new(&args.server, key, role, node)
    };
    let policy = RejoinPolicy {
        dead_after: Some(DEAD_AFTER),
        ..args.membership.policy()
    };
    let alive = Turns::default();
    let notifier = service_manager::start("the recorder runs", [alive.clone()], || false);
    let joining = SupervisedLink::join(options, policy, |_| ready(Ok::<(), LinkError>(())));
    let joined = tokio::select! {
        joined = alive.during(joining) => joined?,
        () = signal.given() => return Err(Failure::failed(format!(
            "ended before {} was there; nothing was written",
            args.server
        ))),
    };
    let (supervised, link, ()) = joined;
    let mut recorder = Recorder {
        trace,
        scene: link.description().clone(),
        link,
        lost: 0,
    };
    let recorded = recorder
        .take_states(&supervised, args.duration, &mut signal, &alive)
        .await;
    drop(notifier);
    // Nobody is to join again for the session that is left here.
    drop(supervised);
    let lost = recorder.lost + recorder.link.counters().lost;
    recorder.link.leave().await;
    let trace = recorder.trace;
    let kept = trace.file.kept().map(Path::to_path_buf);
    let cannot_write = |error: std::io::Error| not_written(&out, &error, kept.as_deref());
    recorded.map_err(cannot_write)?;
    if trace.rows == 0 {
        return Err(Failure::Failed(format!(
            "no device sample came from {}, so {} was not written; check that the device runs",
            args.server,
            out.display()
        )));
    }
    if lost > 0 {
        taut_log::say(&format!(
            "taut: {lost} samples were lost on the way; record on the haptic PC itself, or with --transport quic"
        ));
    }
    let rows = trace.rows;
    trace.file.finish().map_err(cannot_write)?;
    Ok((out, rows))
}

/// Where the trace goes: a recording cannot be made again, so none is written over.
fn place(args: &RecordArgs) -> Result<PathBuf, Failure> {
    let out = args.out.display();
    if !is_taken(&args.out) {
        return Ok(args.out.clone());
    }
    if !args.number {
        return Err(Failure::BadInput(format!(
            "{out} is there already and is not written over; give another --out, or --number"
        )));
    }
    let free = free_name(&args.out);
    taut_log::say(&format!(
        "taut: {out} is there already; the trace goes to {}",
        free.display()
    ));
    Ok(free)
}

fn not_written(out: &Path, error: &std::io::Error, kept: Option<&Path>) -> Failure {
    let out = out.display();
    Failure::BadInput(match kept {
        Some(kept) => format!(
            "{out}: the trace cannot be written ({error}); what could be is in {}",
            kept.display()
        ),
        None => format!(
            "{out}: the trace cannot be written ({error}); check the path, its permissions and the free space"
        ),
    })
}

struct Recorder {
    link: Arc<ClientLink>,
    /// Of the first session: a trace is of one scene.
    scene: SceneDescription,
    trace: TraceWriter,
    /// Samples lost in the sessions before this one.
    lost: u64,
}

impl Recorder {
    async fn take_states(
        &mut self,
        supervised: &SupervisedLink<()>,
        duration: Option<f64>,
        signal: &mut EndSignal,
        alive: &Turns,
    ) -> std::io::Result<()> {
        let mut states = Vec::new();
        let mut period = tokio::time::interval(DRAIN_PERIOD);
        loop {
            tokio::select! {
                () = signal.given() => return Ok(()),
                _ = period.tick() => {}
            }
            alive.count();
            let now = Instant::now();
            self.link.drain_states(&mut states);
            for received in states.drain(..) {
                self.trace.row(&received, now)?;
            }
            // Where nothing comes, or the device is silent, time goes on all the same.
            let reached = self.trace.age_s(now);
            if duration.is_some_and(|wanted| reached >= wanted) {
                return Ok(());
            }
            match supervised.take_renewal() {
                None => {}
                Some(Renewal::Session { link, .. }) if self.is_of_this_scene(&link) => {
                    self.lost += self.link.counters().lost;
                    self.link = link;
                    self.trace.next_session();
                    taut_log::say(&format!(
                        "taut: joined again; the trace has a gap after {:.3} s",
                        self.trace.last_time_s
                    ));
                }
                Some(Renewal::Session { link, .. }) => {
                    taut_log::say(&format!(
                        "taut: the server came back with another scene (\"{}\"): the trace ends where it went",
                        link.description().name
                    ));
                    link.leave().await;
                    return Ok(());
                }
                Some(Renewal::Ended(_)) => return Ok(()),
            }
        }
    }

    /// Whether poses mean the same there.
    fn is_of_this_scene(&self, link: &ClientLink) -> bool {
        let (ours, theirs) = (&self.scene, link.description());
        ours.name == theirs.name
            && ours.reference_point == theirs.reference_point
            && ours.god_object.pose == theirs.god_object.pose
    }
}

/// Writes rows with strictly increasing times that begin at 0 and go on over the sessions.
struct TraceWriter {
    file: FinishedFile,
    /// When the first row came.
    begun: Option<Instant>,
    /// Session time of this session's first row, ns, and the trace's time there, s.
    session: Option<(u64, f64)>,
    last_time_s: f64,
    rows: u64,
}

impl TraceWriter {
    fn begin(mut file: FinishedFile) -> std::io::Result<Self> {
        writeln!(file, "t,x,y,z,qw,qx,qy,qz,buttons")?;
        Ok(Self {
            file,
            begun: None,
            session: None,
            last_time_s: 0.0,
            rows: 0,
        })
    }

    /// Time since the first row, s.
    fn age_s(&self, now: Instant) -> f64 {
        self.begun.map_or(0.0, |begun| {
            now.saturating_duration_since(begun).as_secs_f64()
        })
    }

    /// What comes from now on has another clock. The trace's time goes on by the time that passed here.
    fn next_session(&mut self) {
        self.session = None;
    }

    fn row(&mut self, received: &ReceivedState, now: Instant) -> std::io::Result<()> {
        let state = &received.state;
        let Some(tool) = state.tools.first() else {
            return Ok(());
        };
        self.begun.get_or_insert(now);
        let start_s = if self.rows > 0 {
            self.age_s(now).max(self.last_time_s + SESSIONS_APART_S)
        } else {
            0.0
        };
        let (first_ns, start_s) = *self.session.get_or_insert((state.sample_time_ns, start_s));
        let time_s = start_s + state.sample_time_ns.saturating_sub(first_ns) as f64 * 1e-9;
        if self.rows > 0 && time_s <= self.last_time_s {
            // The device was not sampled anew.
            return Ok(());
        }
        let [x, y, z] = tool.device.position;
        let [w, i, j, k] = tool.device.rotation;
        writeln!(
            self.file,
            "{time_s:.9},{x},{y},{z},{w},{i},{j},{k},{}",
            tool.buttons
        )?;
        self.last_time_s = time_s;
        self.rows += 1;
        self.file.keep();
        Ok(())
    }
}
