//! All that is whole in a recording, in the order of its times, into one file.

use std::collections::BTreeMap;
use std::io::Write;
use std::time::Duration;

use god_object::nalgebra::Point3;
use god_object::spatial::Pose;
use mcap::records::Metadata;

use super::report::ExportReport;
use super::topics::Topics;
use crate::columns::Parse;
use crate::error::RecordingError;
use crate::manifest::Manifest;
use crate::reader::{RecordReader, Recording};
use crate::records::{ForceRecord, HapticsRecord, UpdateRecord};

/// Most seconds of a time of ROS; a line that says more was damaged.
const MAX_TIME: Duration = Duration::from_secs(i32::MAX as u64);
/// So often is looked whether the export shall end.
const RECORDS_PER_LOOK: u64 = 1024;

/// What the scene says and the recording's files do not.
pub struct SceneFrames {
    /// Where wrenches act, in the frame of the body in the hand, m.
    pub reference_point: Point3<f64>,
    /// Those that move by a trace.
    pub obstacles: Vec<MovingObstacle>,
}

/// An obstacle that moves by a trace.
pub struct MovingObstacle {
    /// Its place among the scene's obstacles, from 0.
    pub index: usize,
    /// Its name in the scene.
    pub name: String,
    /// World from obstacle, so many seconds after its trace began.
    pub pose_at: Box<dyn Fn(f64) -> Pose>,
}

/// Writes what is whole in the recording. Without the scene, the reference point has no place and obstacles no poses: `Err` says why there is none.
///
/// # Errors
/// `out` cannot be written, or `interrupted` said so. Damage of the recording is no error: the report says what was left out.
pub fn export_mcap(
    recording: &Recording,
    scene: Result<&SceneFrames, String>,
    out: impl Write,
    interrupted: impl Fn() -> bool,
) -> Result<ExportReport, RecordingError> {
    let manifest = recording.manifest();
    let mut ticks = WholeRecords::new(recording.haptics());
    let mut updates = WholeRecords::new(recording.updates());
    let mut forces = WholeRecords::new(recording.forces());
    let mut topics = Topics::create(out, scene.as_ref().ok().copied())?;
    let mut looks = 0_u64;
    loop {
        looks += 1;
        if looks.is_multiple_of(RECORDS_PER_LOOK) && interrupted() {
            return Err(RecordingError::Interrupted);
        }
        let times = [ticks.time(), updates.time(), forces.time()];
        let Some(first) = times.into_iter().flatten().min() else {
            break;
        };
        if times[0] == Some(first) {
            ticks.take().map_or(Ok(()), |record| topics.tick(&record))?;
        } else if times[1] == Some(first) {
            updates
                .take()
                .map_or(Ok(()), |record| topics.update(&record))?;
        } else {
            forces
                .take()
                .map_or(Ok(()), |record| topics.force(&record))?;
        }
    }
    let mut left_out: Vec<String> = unfinished(manifest).into_iter().collect();
    left_out.extend(scene.err().map(|why| {
        format!("the transform of the reference point and the poses of obstacles that move: {why}")
    }));
    left_out.extend(
        [ticks.damage, updates.damage, forces.damage]
            .into_iter()
            .filter_map(Damage::sentence),
    );
    let report = ExportReport {
        scene: manifest.scene.clone(),
        messages: topics.messages(),
        ticks: ticks.count,
        updates: updates.count,
        forces: forces.count,
        left_out,
    };
    topics.finish(about(manifest, &report))?;
    Ok(report)
}

/// What the manifest says of records that never came into a file.
fn unfinished(manifest: &Manifest) -> Option<String> {
    if manifest.complete {
        return None;
    }
    let lost = match manifest.lost.is_none() {
        true => String::new(),
        false => format!(" ({})", manifest.lost),
    };
    let why = manifest
        .reason
        .as_deref()
        .unwrap_or("the session did not come to its end");
    Some(format!("what was never written: {why}{lost}"))
}

/// The same report inside the file, for whoever gets it alone.
fn about(manifest: &Manifest, report: &ExportReport) -> Metadata {
    Metadata {
        name: "taut".to_owned(),
        metadata: BTreeMap::from([
            ("program".to_owned(), manifest.program.clone()),
            ("scene".to_owned(), manifest.scene.clone()),
            ("identity".to_owned(), manifest.identity.clone()),
            ("left_out".to_owned(), report.left_out.join("\n")),
        ]),
    }
}

/// A record that has a place in time.
trait Timed {
    /// Its place among the others.
    fn at(&self) -> Duration;

    /// Of all times in it.
    fn latest(&self) -> Duration {
        self.at()
    }
}

impl Timed for HapticsRecord {
    fn at(&self) -> Duration {
        self.tick
    }

    fn latest(&self) -> Duration {
        self.tick.max(self.time)
    }
}

impl Timed for UpdateRecord {
    fn at(&self) -> Duration {
        self.published
    }
}

impl Timed for ForceRecord {
    fn at(&self) -> Duration {
        self.time
    }
}

/// What is wrong with one file.
#[derive(Default)]
struct Damage {
    lines: u64,
    first: Option<RecordingError>,
}

impl Damage {
    fn add(&mut self, error: RecordingError) {
        self.lines += 1;
        self.first.get_or_insert(error);
    }

    fn sentence(self) -> Option<String> {
        Some(match self.first? {
            // One line of many.
            RecordingError::Form { path, line, text } if line > 1 => format!(
                "{} of {}, the first is line {line}: {text}",
                if self.lines == 1 {
                    "1 line".to_owned()
                } else {
                    format!("{} lines", self.lines)
                },
                path.display()
            ),
            whole_file => format!("all or the rest of a file: {whole_file}"),
        })
    }
}

/// The records of a file whose lines are whole, with the next one in sight.
struct WholeRecords<T> {
    reader: Option<RecordReader<T>>,
    next: Option<T>,
    count: u64,
    damage: Damage,
}

impl<T: Parse + Timed> WholeRecords<T> {
    fn new(reader: Result<RecordReader<T>, RecordingError>) -> Self {
        let mut damage = Damage::default();
        let reader = reader.map_err(|error| damage.add(error)).ok();
        let mut records = Self {
            reader,
            next: None,
            count: 0,
            damage,
        };
        records.advance();
        records
    }

    fn time(&self) -> Option<Duration> {
        self.next.as_ref().map(Timed::at)
    }

    fn take(&mut self) -> Option<T> {
        let taken = self.next.take();
        self.count += u64::from(taken.is_some());
        self.advance();
        taken
    }

    /// To the next line that is whole.
    fn advance(&mut self) {
        while let Some(reader) = &mut self.reader {
            match reader.next_record() {
                Ok(Some(record)) if record.latest() <= MAX_TIME => {
                    self.next = Some(record);
                    return;
                }
                Ok(Some(record)) => {
                    let text = format!("the time is {:?}", record.latest());
                    self.damage.add(reader.form(text));
                }
                Ok(None) => self.reader = None,
                Err(error @ RecordingError::Form { .. }) => self.damage.add(error),
                Err(error) => {
                    self.damage.add(error);
                    self.reader = None;
                }
            }
        }
    }
}
