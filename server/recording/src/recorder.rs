//! The thread that writes what the loops leave in their queues.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::columns::{Line, TRACE_HEADER, trace_line};
use crate::error::RecordingError;
use crate::manifest::{Lost, Manifest, Records};
use crate::records::{ConstraintRecord, EventRecord, ForceRecord, HapticsRecord, UpdateRecord};
use crate::tap::{Drain, Drains, Taps, taps};

/// Time between two looks into the queues.
const DRAIN_PERIOD: Duration = Duration::from_millis(20);
/// Looks between two times at which everything is given to the system: a crash loses a second at most.
const FLUSH_LOOKS: u32 = 50;

/// A recording under way. Dropped, it ends as by [`Recorder::finish`].
#[derive(Debug)]
pub struct Recorder {
    events: Sender<EventRecord>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Summary>>,
}

/// What came of a recording.
#[derive(Debug, Default)]
pub struct Summary {
    /// Records written.
    pub records: Records,
    /// Records that found their queue full.
    pub lost: Lost,
    /// Why the recording is not whole.
    pub failure: Option<RecordingError>,
}

impl Recorder {
    /// Makes `directory`, which must be new or empty, writes manifest and scene, and starts the thread.
    ///
    /// # Errors
    /// The directory has something in it, or cannot be written.
    pub fn start(
        directory: &Path,
        manifest: Manifest,
        scene: &str,
    ) -> Result<(Taps, Self), RecordingError> {
        begin_directory(directory)?;
        write_whole(&directory.join("scene.toml"), scene.as_bytes())?;
        write_manifest(directory, &manifest)?;
        let files = Files::create(directory)?;
        let (taps, drains) = taps();
        let (events, received) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        let directory = directory.to_path_buf();
        let thread = std::thread::Builder::new()
            .name("recorder".into())
            .spawn({
                let directory = directory.clone();
                move || write_until(&directory, manifest, files, drains, &received, &asked)
            })
            .map_err(|error| RecordingError::Write {
                path: directory,
                error,
            })?;
        Ok((
            taps,
            Self {
                events,
                stop,
                thread: Some(thread),
            },
        ))
    }

    /// Has the event written. Not for the loops: sending allocates.
    pub fn tell(&self, event: EventRecord) {
        // A thread that is gone has nothing to write into.
        let _ = self.events.send(event);
    }

    /// Whether records are still written: not any more once a file has failed.
    #[must_use]
    pub fn is_writing(&self) -> bool {
        self.thread.as_ref().is_some_and(|it| !it.is_finished())
    }

    /// Writes what is left, closes the files and says what came of it. Call it when the loops have ended.
    pub fn finish(mut self) -> Summary {
        self.end()
    }

    fn end(&mut self) -> Summary {
        self.stop.store(true, Ordering::Release);
        self.thread
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default()
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let _ = self.end();
    }
}

fn begin_directory(directory: &Path) -> Result<(), RecordingError> {
    let cannot = |error| RecordingError::Write {
        path: directory.to_path_buf(),
        error,
    };
    fs::create_dir_all(directory).map_err(cannot)?;
    if fs::read_dir(directory).map_err(cannot)?.next().is_some() {
        return Err(RecordingError::NotEmpty(directory.to_path_buf()));
    }
    Ok(())
}

fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RecordingError> {
    fs::write(path, bytes).map_err(|error| RecordingError::Write {
        path: path.to_path_buf(),
        error,
    })
}

fn write_manifest(directory: &Path, manifest: &Manifest) -> Result<(), RecordingError> {
    let path = directory.join("recording.json");
    let mut text =
        serde_json::to_string_pretty(manifest).map_err(|error| RecordingError::Write {
            path: path.clone(),
            error: error.into(),
        })?;
    text.push('\n');
    // Under another name first: a manifest is never half there.
    let partial = directory.join(".recording.json.partial");
    write_whole(&partial, text.as_bytes())?;
    fs::rename(&partial, &path).map_err(|error| RecordingError::Write { path, error })
}

/// One file and what is being written into it.
#[derive(Debug)]
struct Sink {
    path: PathBuf,
    file: BufWriter<File>,
    line: String,
}

impl Sink {
    fn create(directory: &Path, name: &str, header: &str) -> Result<Self, RecordingError> {
        let path = directory.join(name);
        let file = File::create_new(&path).map_err(|error| RecordingError::Write {
            path: path.clone(),
            error,
        })?;
        let mut sink = Self {
            path,
            file: BufWriter::with_capacity(1 << 16, file),
            line: String::new(),
        };
        sink.put(|line| line.push_str(header))?;
        Ok(sink)
    }

    fn put(&mut self, write: impl FnOnce(&mut String)) -> Result<(), RecordingError> {
        self.line.clear();
        write(&mut self.line);
        self.line.push('\n');
        self.file
            .write_all(self.line.as_bytes())
            .map_err(|error| self.failed(error))
    }

    fn flush(&mut self) -> Result<(), RecordingError> {
        self.file.flush().map_err(|error| self.failed(error))
    }

    fn failed(&self, error: std::io::Error) -> RecordingError {
        RecordingError::Write {
            path: self.path.clone(),
            error,
        }
    }
}

/// All files that grow.
#[derive(Debug)]
struct Files {
    device: Sink,
    haptics: Sink,
    updates: Sink,
    constraints: Sink,
    forces: Sink,
    events: Sink,
    /// Of the last line of the device trace, whose times must increase.
    traced: Option<Duration>,
}

impl Files {
    fn create(directory: &Path) -> Result<Self, RecordingError> {
        let sink = |name, header| Sink::create(directory, name, header);
        Ok(Self {
            device: sink("device.csv", TRACE_HEADER)?,
            haptics: sink(HapticsRecord::FILE, HapticsRecord::HEADER)?,
            updates: sink(UpdateRecord::FILE, UpdateRecord::HEADER)?,
            constraints: sink(ConstraintRecord::FILE, ConstraintRecord::HEADER)?,
            forces: sink(ForceRecord::FILE, ForceRecord::HEADER)?,
            events: sink("events.csv", "t_ns,kind,text")?,
            traced: None,
        })
    }

    fn all(&mut self) -> [&mut Sink; 6] {
        [
            &mut self.device,
            &mut self.haptics,
            &mut self.updates,
            &mut self.constraints,
            &mut self.forces,
            &mut self.events,
        ]
    }

    fn tick(&mut self, record: &HapticsRecord) -> Result<(), RecordingError> {
        self.haptics.put(|line| record.write(line))?;
        let is_new = self.traced.is_none_or(|last| record.time > last);
        if record.faulty || !is_new {
            return Ok(());
        }
        self.traced = Some(record.time);
        self.device.put(|line| trace_line(record, line))
    }

    fn event(&mut self, event: &EventRecord) -> Result<(), RecordingError> {
        // A sentence may hold commas: quoted, and one line.
        let text = event.text.replace('"', "\"\"").replace(['\n', '\r'], " ");
        self.events.put(|line| {
            line.push_str(&format!(
                "{},{},\"{text}\"",
                event.time.as_nanos(),
                event.kind
            ))
        })
    }
}

/// Writes until asked to stop and everything is written, or until a file fails.
fn write_until(
    directory: &Path,
    manifest: Manifest,
    mut files: Files,
    mut drains: Drains,
    events: &Receiver<EventRecord>,
    stop: &AtomicBool,
) -> Summary {
    let mut summary = Summary::default();
    let written = write_records(&mut files, &mut drains, events, stop, &mut summary.records);
    summary.lost = Lost {
        haptics: drains.haptics.lost(),
        updates: drains.updates.lost(),
        constraints: drains.constraints.lost(),
        forces: drains.forces.lost(),
    };
    let failure = written.err();
    if let Some(error) = &failure {
        tracing::error!("nothing is recorded any more: {error}");
    }
    let reason = match &failure {
        Some(error) => Some(error.to_string()),
        None if !summary.lost.is_none() => {
            Some("the disk was too slow, and records were lost".to_owned())
        }
        None => None,
    };
    let manifest = Manifest {
        complete: reason.is_none(),
        reason,
        lost: summary.lost,
        records: failure.is_none().then_some(summary.records),
        ..manifest
    };
    summary.failure = failure.or(write_manifest(directory, &manifest).err());
    summary
}

fn write_records(
    files: &mut Files,
    drains: &mut Drains,
    events: &Receiver<EventRecord>,
    stop: &AtomicBool,
    written: &mut Records,
) -> Result<(), RecordingError> {
    let mut looks = 0;
    loop {
        // Asked before the last look, so that nothing that was pushed before the question stays behind.
        let is_last = stop.load(Ordering::Acquire);
        written.haptics += drain(&mut drains.haptics, |record| files.tick(record))?;
        written.updates += drain(&mut drains.updates, |record| {
            files.updates.put(|line| record.write(line))
        })?;
        drain(&mut drains.constraints, |record| {
            files.constraints.put(|line| record.write(line))
        })?;
        written.forces += drain(&mut drains.forces, |record| {
            files.forces.put(|line| record.write(line))
        })?;
        for event in events.try_iter() {
            files.event(&event)?;
        }
        looks += 1;
        if is_last || looks % FLUSH_LOOKS == 0 {
            files.all().into_iter().try_for_each(Sink::flush)?;
        }
        if is_last {
            return Ok(());
        }
        std::thread::sleep(DRAIN_PERIOD);
    }
}

/// Writes what the queue holds now; how many records that were.
fn drain<T: Copy>(
    drain: &mut Drain<T>,
    mut write: impl FnMut(&T) -> Result<(), RecordingError>,
) -> Result<u64, RecordingError> {
    let mut count = 0;
    for _ in 0..drain.queue.slots() {
        let Ok(record) = drain.queue.pop() else {
            break;
        };
        write(&record)?;
        count += 1;
    }
    Ok(count)
}
