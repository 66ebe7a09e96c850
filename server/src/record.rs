//! `taut record`: takes the device trace of a live session, in the form that `taut replay` reads.
//!
//! Poses are those of the state stream, in single precision: a micrometre at ten metres.

use std::io::Write;
use std::time::Duration;

use taut_link::{ClientLink, ClientOptions, ReceivedState, Role, connect};

use crate::cli::RecordArgs;
use crate::failure::Failure;
use crate::finished_file::FinishedFile;
use crate::key;
use crate::signals::EndSignal;

/// Time between two looks at what has arrived; the link queues meanwhile.
const DRAIN_PERIOD: Duration = Duration::from_millis(10);

/// Records until the duration is over, the user ends it, or the session does. How many rows there are.
pub async fn run(args: &RecordArgs) -> Result<u64, Failure> {
    let key = key::read_to_join(args.key.as_deref())?;
    let cannot_write = |error: std::io::Error| {
        Failure::BadInput(format!(
            "{}: the trace cannot be written ({error}); check the path, its permissions and the free space",
            args.out.display()
        ))
    };
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
    let link = connect(options).await?;
    let mut trace = TraceWriter::begin(FinishedFile::create(&args.out).map_err(cannot_write)?)
        .map_err(cannot_write)?;
    let recorded = take_states(&link, &mut trace, args.duration, &mut signal).await;
    let lost = link.counters().lost;
    link.close().await;
    recorded.map_err(cannot_write)?;

    if trace.rows == 0 {
        return Err(Failure::Failed(format!(
            "no device sample came from {}, so {} was not written; check that the device runs",
            args.server,
            args.out.display()
        )));
    }
    if lost > 0 {
        eprintln!(
            "taut: {lost} samples were lost on the way; record on the haptic PC itself, or with --transport quic"
        );
    }
    let rows = trace.rows;
    trace.file.finish().map_err(cannot_write)?;
    Ok(rows)
}

async fn take_states(
    link: &ClientLink,
    trace: &mut TraceWriter,
    duration: Option<f64>,
    signal: &mut EndSignal,
) -> std::io::Result<()> {
    let mut states = Vec::new();
    let mut period = tokio::time::interval(DRAIN_PERIOD);
    loop {
        tokio::select! {
            () = signal.given() => return Ok(()),
            _ = period.tick() => {}
        }
        link.drain_states(&mut states);
        for received in states.drain(..) {
            trace.row(&received)?;
        }
        let long_enough = duration.is_some_and(|wanted| trace.last_time_s >= wanted);
        if long_enough || link.is_closed().is_some() {
            return Ok(());
        }
    }
}

/// Writes rows with strictly increasing times that begin at 0.
struct TraceWriter {
    file: FinishedFile,
    first_ns: Option<u64>,
    last_time_s: f64,
    rows: u64,
}

impl TraceWriter {
    fn begin(mut file: FinishedFile) -> std::io::Result<Self> {
        writeln!(file, "t,x,y,z,qw,qx,qy,qz,buttons")?;
        Ok(Self {
            file,
            first_ns: None,
            last_time_s: 0.0,
            rows: 0,
        })
    }

    fn row(&mut self, received: &ReceivedState) -> std::io::Result<()> {
        let state = &received.state;
        let Some(tool) = state.tools.first() else {
            return Ok(());
        };
        let first = *self.first_ns.get_or_insert(state.sample_time_ns);
        let time_s = state.sample_time_ns.saturating_sub(first) as f64 * 1e-9;
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
        Ok(())
    }
}
