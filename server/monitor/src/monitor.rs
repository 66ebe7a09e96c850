//! The monitor: a thread that owns rerun.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rerun::log::ChunkBatcherConfig;
use rerun::sink::{FileSink, FileSinkOptions, LogSink};
use rerun::{RecordingStream, RecordingStreamBuilder};

use crate::error::MonitorError;
use crate::history::History;
use crate::hosted::Hosted;
use crate::log::{Command, LINE_QUEUE_CAPACITY, LogLevel};
use crate::options::MonitorOptions;
use crate::ports::{self, GRPC_KEY, WEB_KEY};
use crate::queue::{self, Counters, MonitorReceiver, MonitorSender, SAMPLE_CAPACITY};
use crate::sample::MonitorSample;
use crate::scene::MonitorScene;
use crate::stream::Stream;
use crate::{APPLICATION, picture};

/// Time between two pictures: 30 a second, smooth enough to watch, cheap enough beside 1 kHz loops.
const PICTURE_PERIOD: Duration = Duration::from_nanos(1_000_000_000 / 30);

/// The plots are sent with every sixth picture: fewer, larger messages, which the viewer takes in faster.
const PICTURES_PER_PLOT: u32 = 6;

/// Most bytes on their way inside rerun: half a second, so that a machine too busy to encode loses pictures and not the present. A larger mesh passes alone.
const BYTES_IN_FLIGHT: u64 = 128 * 1024;

/// A running monitor. Dropping it stops it as [`Monitor::stop`] does.
#[derive(Debug)]
pub struct Monitor {
    commands: SyncSender<Command>,
    lines_dropped: Arc<AtomicU64>,
    counters: Arc<Counters>,
    messages_dropped: Arc<AtomicU64>,
    thread: Option<JoinHandle<Result<(), String>>>,
    recording: Option<PathBuf>,
    page: Option<String>,
    stream: Option<String>,
}

/// What the monitor did so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MonitorStats {
    /// Samples taken from the queue and sent to the plots.
    pub samples_shown: u64,
    /// Samples dropped because the queue was full.
    pub samples_dropped: u64,
    /// Pictures left out because the sample held a number that is not finite.
    pub samples_not_finite: u64,
    /// Lines of text dropped because too many waited.
    pub lines_dropped: u64,
    /// Messages that observers missed because they were too slow.
    pub messages_dropped: u64,
}

impl Monitor {
    /// Starts to serve and record, sends the scene, and returns the end of the queue for the loops.
    ///
    /// After an error nothing is left running and no port is held.
    pub fn start(
        options: &MonitorOptions,
        scene: MonitorScene,
    ) -> Result<(Monitor, MonitorSender), MonitorError> {
        for body in &scene.bodies {
            picture::check_mesh(body)?;
        }

        let mut sinks: Vec<Box<dyn LogSink>> = Vec::new();
        let messages_dropped = Arc::new(AtomicU64::new(0));
        let mut served = None;
        if options.serve {
            let (server, sink) = Served::start(options, Arc::clone(&messages_dropped))?;
            sinks.push(Box::new(sink));
            served = Some(server);
        }
        if let Some(path) = &options.record {
            sinks.push(Box::new(file_sink(path)?));
        }

        let rerun_refused = |error: rerun::RecordingStreamError| MonitorError::Rerun {
            what: "the scene",
            reason: error.to_string(),
        };
        let rerun = recording_stream(&scene.name, sinks).map_err(rerun_refused)?;
        let stream = Stream::open(rerun, &scene).map_err(rerun_refused)?;

        let counters = Arc::<Counters>::default();
        let lines_dropped = Arc::new(AtomicU64::new(0));
        let (sender, receiver) = queue::queue(Arc::clone(&counters), Arc::clone(&lines_dropped));
        let (commands, command_queue) = sync_channel(LINE_QUEUE_CAPACITY);
        let page = served.as_ref().map(|served| served.page_url.clone());
        let stream_url = served.as_ref().map(|served| served.stream_url.clone());
        let thread = std::thread::Builder::new()
            .name("taut-monitor".to_owned())
            .spawn(move || run(stream, receiver, &command_queue))
            .map_err(MonitorError::Thread)?;

        let monitor = Monitor {
            commands,
            lines_dropped,
            counters,
            messages_dropped,
            thread: Some(thread),
            recording: options.record.clone(),
            page,
            stream: stream_url,
        };
        Ok((monitor, sender))
    }

    /// The web page that opens the stream, for a browser; `None` unless serving.
    #[must_use]
    pub fn address(&self) -> Option<&str> {
        self.page.as_deref()
    }

    /// The stream's own address, for the native viewer (`rerun <address>`); `None` unless serving.
    #[must_use]
    pub fn stream_address(&self) -> Option<&str> {
        self.stream.as_deref()
    }

    /// The file to which everything is written, too.
    #[must_use]
    pub fn recording(&self) -> Option<&Path> {
        self.recording.as_deref()
    }

    /// Shows a line at the newest session time; never waits: drops and counts it when too many wait. Not for the loops.
    pub fn log(&self, level: LogLevel, text: impl Into<String>) {
        match self.commands.try_send(Command::Line(level, text.into())) {
            // Disconnected: the thread has ended, nobody looks any more.
            Ok(()) | Err(TrySendError::Disconnected(_)) => {}
            Err(TrySendError::Full(_)) => {
                self.lines_dropped.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// What was shown and dropped so far.
    #[must_use]
    pub fn stats(&self) -> MonitorStats {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        MonitorStats {
            samples_shown: read(&self.counters.samples_shown),
            samples_dropped: read(&self.counters.samples_dropped),
            samples_not_finite: read(&self.counters.samples_not_finite),
            lines_dropped: read(&self.lines_dropped),
            messages_dropped: read(&self.messages_dropped),
        }
    }

    /// Shows what is queued, completes the recording, closes the ports.
    pub fn stop(mut self) -> Result<MonitorStats, MonitorError> {
        self.finish()?;
        Ok(self.stats())
    }

    fn finish(&mut self) -> Result<(), MonitorError> {
        let Some(thread) = self.thread.take() else {
            return Ok(());
        };
        // Fails only when the thread has ended already, which the join tells.
        let _ = self.commands.send(Command::Stop);
        let closed = thread.join().map_err(|_| MonitorError::ThreadLost)?;
        closed.map_err(|reason| MonitorError::Record {
            path: self.recording.clone().unwrap_or_default(),
            reason,
        })
    }
}

impl Drop for Monitor {
    fn drop(&mut self) {
        if let Err(error) = self.finish() {
            tracing::error!("{error}");
        }
    }
}

/// What to type to reach the servers.
struct Served {
    page_url: String,
    stream_url: String,
}

impl Served {
    fn start(
        options: &MonitorOptions,
        messages_dropped: Arc<AtomicU64>,
    ) -> Result<(Served, Hosted), MonitorError> {
        let bind = options.bind;
        let (stream, grpc_port) = ports::listen(bind, options.grpc_port, GRPC_KEY)?;
        let (page, web_port) = ports::listen(bind, options.web_port, WEB_KEY)?;
        let history = History::new(options.memory_limit_bytes, messages_dropped);
        let origins = ports::allowed_origins(bind, web_port);
        let hosted = Hosted::start(stream, page, origins, history)?;

        let host = ports::reachable_by_observers(bind);
        let stream_url = ports::stream_url(host, grpc_port);
        let page_url = ports::page_url(host, web_port, &stream_url);
        let served = Served {
            page_url,
            stream_url,
        };
        Ok((served, hosted))
    }
}

/// Into a new file. What is no file, such as a pipe, is opened as it is.
fn file_sink(path: &Path) -> Result<FileSink, MonitorError> {
    let refused = |reason: String| MonitorError::Record {
        path: path.to_path_buf(),
        reason,
    };
    let is_special = |about: fs::Metadata| !about.is_file() && !about.is_dir();
    if !fs::metadata(path).is_ok_and(is_special) {
        // Made here, because rerun empties what it opens: it would empty a recording that is there.
        fs::File::create_new(path).map_err(|error| refused(error.to_string()))?;
    }
    // Without its footer a recording needs no memory that grows with its length; it opens just as well.
    let options = FileSinkOptions {
        write_footer: false,
    };
    FileSink::with_options(path, options).map_err(|error| refused(error.to_string()))
}

/// A stream into all `sinks`; into nothing without any.
fn recording_stream(
    scene_name: &str,
    sinks: Vec<Box<dyn LogSink>>,
) -> rerun::RecordingStreamResult<RecordingStream> {
    if sinks.is_empty() {
        return Ok(RecordingStream::disabled());
    }
    RecordingStreamBuilder::new(APPLICATION)
        .recording_name(scene_name)
        .batcher_config(ChunkBatcherConfig {
            flush_tick: PICTURE_PERIOD,
            max_bytes_in_flight: BYTES_IN_FLIGHT,
            ..ChunkBatcherConfig::DEFAULT
        })
        .set_sinks(sinks)
}

/// The thread: a picture every [`PICTURE_PERIOD`], the plots less often, lines in between, until told to stop.
fn run(
    mut stream: Stream,
    mut receiver: MonitorReceiver,
    commands: &Receiver<Command>,
) -> Result<(), String> {
    let mut samples = Vec::with_capacity(SAMPLE_CAPACITY);
    let mut next_picture = Instant::now();
    let mut pictures = 0u32;
    loop {
        let wait = next_picture.saturating_duration_since(Instant::now());
        let stopped = match commands.recv_timeout(wait) {
            Ok(Command::Line(level, text)) => {
                said(stream.line(stream.newest_ns(), level, &text));
                false
            }
            Err(RecvTimeoutError::Timeout) => false,
            Ok(Command::Stop) | Err(RecvTimeoutError::Disconnected) => true,
        };
        if stopped || Instant::now() >= next_picture {
            show_queued(&mut stream, &mut receiver, &mut samples);
            next_picture = (next_picture + PICTURE_PERIOD).max(Instant::now());
            pictures = pictures.wrapping_add(1);
            if stopped || pictures.is_multiple_of(PICTURES_PER_PLOT) {
                said(stream.show_plots(&samples));
                samples.clear();
            }
        }
        if stopped {
            break;
        }
    }
    stream.close()
}

/// Empties both queues: the newest sample into the picture, all into `samples` for the plots.
fn show_queued(
    stream: &mut Stream,
    receiver: &mut MonitorReceiver,
    samples: &mut Vec<MonitorSample>,
) {
    let counters = &receiver.counters;
    let before = samples.len();
    // At most one queue's worth at a time, however fast the writer is.
    while samples.len() < before + SAMPLE_CAPACITY
        && let Ok(sample) = receiver.samples.pop()
    {
        samples.push(sample);
    }
    let new = &samples[before..];
    counters
        .samples_shown
        .fetch_add(new.len() as u64, Ordering::Relaxed);
    if let Some(newest) = new.last()
        && said(stream.show_picture(newest)) == Some(false)
    {
        let earlier = counters.samples_not_finite.fetch_add(1, Ordering::Relaxed);
        if earlier == 0 {
            let text = "a sample holds a number that is not finite: the picture stands still";
            said(stream.line(stream.newest_ns(), LogLevel::Error, text));
        }
    }
    while let Ok(line) = receiver.lines.pop() {
        said(stream.line(line.session_time_ns, line.level, &line.text()));
    }
}

/// Reports what rerun refused; monitoring goes on, the session does not depend on it.
fn said<T>(result: rerun::RecordingStreamResult<T>) -> Option<T> {
    result
        .inspect_err(|error| tracing::warn!("rerun refused a message: {error}"))
        .ok()
}
