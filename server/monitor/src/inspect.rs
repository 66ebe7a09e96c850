//! Looks on with rerun's own reader: is a recording whole, does a stream arrive, and what is in it?

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::time::{Duration, Instant};

use re_async::AsyncRuntimeHandle;
use re_log_channel::{DataSourceMessage, RecvTimeoutError, SmartMessagePayload};
use rerun::StoreKind;
use rerun::external::re_log_encoding::DecoderApp;
use rerun::external::{re_grpc_client, re_uri};
use rerun::log::{Chunk, LogMsg};

use crate::error::InspectError;

/// What a recording or a stream holds, blueprints aside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RrdSummary {
    /// Rows per entity path: one row is one set of values at one time.
    pub rows: BTreeMap<String, u64>,
    /// Names of the timelines.
    pub timelines: BTreeSet<String>,
    /// First and last session time of any row, nanoseconds.
    pub time_ns: Option<(i64, i64)>,
    /// Blueprints (layouts of the viewer).
    pub blueprints: usize,
    /// Least and largest number of a plot per entity path.
    pub numbers: BTreeMap<String, (f64, f64)>,
    /// The log's lines.
    pub lines: Vec<String>,
}

/// Decodes the whole file; an error if any part of it cannot be decoded.
pub fn inspect(path: &Path) -> Result<RrdSummary, InspectError> {
    let file = File::open(path).map_err(|source| InspectError::Open {
        path: path.to_owned(),
        source,
    })?;
    let decode = |reason: String| InspectError::Decode {
        path: path.to_owned(),
        reason,
    };

    let messages = DecoderApp::decode_eager(BufReader::new(file))
        .map_err(|error| decode(error.to_string()))?;
    let mut summary = RrdSummary::default();
    for message in messages {
        let message = message.map_err(|error| decode(error.to_string()))?;
        summary.add(&message).map_err(decode)?;
    }
    Ok(summary)
}

/// Looks on at a running session for a while, as a viewer on another machine does.
///
/// `stream_address` is what [`crate::Monitor::stream_address`] says. A stream that ends early is no error.
pub fn observe(stream_address: &str, duration: Duration) -> Result<RrdSummary, InspectError> {
    let mut summary = RrdSummary::default();
    follow(stream_address, duration, |message| summary.add(message))?;
    Ok(summary)
}

/// Looks on in the same way; `told` gets the newest session time of every message as it arrives, ns.
pub fn observe_times(
    stream_address: &str,
    duration: Duration,
    mut on_newest: impl FnMut(u64),
) -> Result<(), InspectError> {
    follow(stream_address, duration, |message| {
        let mut summary = RrdSummary::default();
        summary.add(message)?;
        if let Some((_, newest)) = summary.time_ns {
            on_newest(newest.unsigned_abs());
        }
        Ok(())
    })
}

fn follow(
    stream_address: &str,
    duration: Duration,
    mut take: impl FnMut(&LogMsg) -> Result<(), String>,
) -> Result<(), InspectError> {
    let connect = |reason: String| InspectError::Connect {
        address: stream_address.to_owned(),
        reason,
    };
    let uri: re_uri::ProxyUri = stream_address
        .parse()
        .map_err(|error: re_uri::Error| connect(error.to_string()))?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("taut-observe")
        .enable_all()
        .build()
        .map_err(|error| connect(error.to_string()))?;
    let handle = AsyncRuntimeHandle::new_native(runtime.handle().clone());
    let messages = re_grpc_client::stream(&handle, uri);

    let mut none_yet = true;
    let end = Instant::now() + duration;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            break;
        }
        match messages.recv_timeout(left).map(|message| message.payload) {
            Ok(SmartMessagePayload::Msg(DataSourceMessage::LogMsg(message))) => {
                take(&message).map_err(connect)?;
                none_yet = false;
            }
            Ok(SmartMessagePayload::Msg(_) | SmartMessagePayload::Flush { .. }) => {}
            Ok(SmartMessagePayload::Quit(Some(error))) if none_yet => {
                return Err(connect(error.to_string()));
            }
            Ok(SmartMessagePayload::Quit(_))
            | Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
        }
    }
    runtime.shutdown_background();
    Ok(())
}

impl RrdSummary {
    fn add(&mut self, message: &LogMsg) -> Result<(), String> {
        match message {
            LogMsg::ArrowMsg(store, arrow) if store.kind() == StoreKind::Recording => {
                let chunk = Chunk::from_arrow_msg(arrow).map_err(|error| error.to_string())?;
                self.add_chunk(&chunk);
            }
            LogMsg::BlueprintActivationCommand(_) => self.blueprints += 1,
            LogMsg::ArrowMsg(..) | LogMsg::SetStoreInfo(_) => {}
        }
        Ok(())
    }

    fn add_chunk(&mut self, chunk: &Chunk) {
        let path = chunk.entity_path().to_string();
        *self.rows.entry(path.clone()).or_default() += chunk.num_rows() as u64;
        let scalars = rerun::Scalars::descriptor_scalars().component;
        for number in chunk.iter_slices::<f64>(scalars).flatten() {
            let none = (f64::INFINITY, f64::NEG_INFINITY);
            let (least, largest) = self.numbers.entry(path.clone()).or_insert(none);
            (*least, *largest) = (least.min(*number), largest.max(*number));
        }
        let text = rerun::TextLog::descriptor_text().component;
        let texts = chunk.iter_slices::<String>(text).flatten();
        self.lines.extend(texts.map(|line| line.to_string()));
        for (name, column) in chunk.timelines() {
            self.timelines.insert(name.to_string());
            if name.as_str() == crate::stream::TIMELINE {
                let range = column.time_range();
                let (first, last) = (range.min().as_i64(), range.max().as_i64());
                let (old_first, old_last) = self.time_ns.unwrap_or((first, last));
                self.time_ns = Some((old_first.min(first), old_last.max(last)));
            }
        }
    }
}
