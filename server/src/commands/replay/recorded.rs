//! `taut replay --recording`: a recorded session computed again, update by update and force by force, and compared bit by bit.
//!
//! The god-object is given the very device poses, shaded accelerations and obstacle poses that it was given then; the coupling the very times, device poses and
//! constraint sets. Nothing else goes into either, so both must come to the same bits, on any machine and in any build of the same method.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use god_object::spatial::{Pose, Vector6};
use god_object::{Coupling, GodObject};
use taut_recording::{
    ForceRecord, RecordReader, Recording, SceneOrigin, UpdateRecord, identity_of,
};
use taut_scene::{
    BuiltMotion, BuiltScene, FileError, FinishedFile, ReplayRow, ReplayWriter, Scene, SceneSource,
};

use crate::loops::realtime::thread_cpu_time;
use crate::report::RecordedReport;
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;
use crate::shared::timing::distribution_of;

/// Computes the recording in `directory` again. With `out`, every force and the pose it belongs to is written there.
///
/// # Errors
/// The recording cannot be read, is of other bodies or settings, or comes to something else: the first difference is told.
pub fn run(
    directory: &Path,
    out: Option<&Path>,
    timings: bool,
    interrupted: &Shutdown,
) -> Result<RecordedReport, Failure> {
    let recording = Recording::open(directory).map_err(Failure::bad_input)?;
    let mut session = RecordedSession::open(&recording)?;
    let cannot_write = |path: &Path, error: io::Error| {
        Failure::BadInput(format!(
            "{}: the answer cannot be written ({error}); check the path, its permissions and the free space",
            path.display()
        ))
    };
    let files = files_of(&recording);
    let of_scene = files.iter().map(PathBuf::as_path);
    let inputs: Vec<&Path> = [directory].into_iter().chain(of_scene).collect();
    let mut writer = match out {
        Some(path) => Some(
            FinishedFile::create(path, &inputs)
                .and_then(|file| ReplayWriter::new(file, timings))
                .map_err(|error| cannot_write(path, error))?,
        ),
        None => None,
    };
    while let Some(row) = session.next_force()? {
        if interrupted.is_asked() {
            return Err(Failure::failed(
                "the replay was interrupted; nothing was written",
            ));
        }
        if let (Some(writer), Some(path)) = (&mut writer, out) {
            writer
                .write(&row)
                .map_err(|error| cannot_write(path, error))?;
        }
    }
    session.finish_updates()?;
    if let (Some(writer), Some(path)) = (writer, out) {
        writer
            .finish()
            .and_then(FinishedFile::finish)
            .map_err(|error| cannot_write(path, error))?;
    }
    Ok(session.report(&recording))
}

/// The files that the scene of the recording names, where it can be read: what is made of them replaces none.
pub(in crate::commands) fn files_of(recording: &Recording) -> Vec<PathBuf> {
    let files = described(recording).and_then(|scene| scene.files());
    let found = files.into_iter().flatten().map(|(_, found)| found);
    found.collect()
}

/// The scene of the recording, with the bodies and settings that it had then.
pub(in crate::commands) fn scene_of(recording: &Recording) -> Result<BuiltScene, Failure> {
    let manifest = recording.manifest();
    let built = described(recording)?.build()?;
    if identity_of(&built.world, &built.settings, &built.start) != manifest.identity {
        return Err(Failure::BadInput(format!(
            "{}: gives other bodies or settings than those of the session ({}): a mesh has changed since, or this program has other defaults; use the files and the program of then",
            recording.scene_path().display(),
            manifest.program
        )));
    }
    Ok(built)
}

/// The same as it was written, without its meshes.
fn described(recording: &Recording) -> Result<Scene, FileError> {
    let manifest = recording.manifest();
    let source = SceneSource {
        text: recording.scene().into(),
        directory: match &manifest.origin {
            SceneOrigin::Shipped => None,
            SceneOrigin::Directory(directory) => Some(directory.clone()),
        },
        overrides: manifest.overrides.clone(),
    };
    let file = recording.scene_path().display().to_string();
    Scene::from_source(&file, &source)
}

/// The two loops of the method, fed with what they were fed with then.
struct RecordedSession {
    god_object: GodObject,
    coupling: Coupling,
    motions: Vec<BuiltMotion>,
    updates: RecordReader<UpdateRecord>,
    forces: RecordReader<ForceRecord>,
    /// When the newest constraint set was published, s.
    published: f64,
    measured: Measured,
    /// The recording says that nothing is missing.
    is_whole: bool,
    /// Of a recording that is not whole: what is missing first. Nothing behind it can be computed.
    gap: Option<String>,
}

/// What was measured so far.
#[derive(Debug, Default)]
struct Measured {
    updates: u64,
    forces: u64,
    update_us: Vec<f64>,
    force_us: Vec<f64>,
    first_difference: Option<String>,
    different_updates: u64,
    different_forces: u64,
}

impl RecordedSession {
    fn open(recording: &Recording) -> Result<Self, Failure> {
        let built = scene_of(recording)?;
        let world = Arc::new(built.world);
        let reader = |error| Failure::bad_input(error);
        Ok(Self {
            coupling: Coupling::new(&world, &built.settings),
            motions: built.motions,
            god_object: GodObject::new(world, built.settings, built.start)?,
            updates: recording.updates().map_err(reader)?,
            forces: recording.forces().map_err(reader)?,
            published: 0.0,
            measured: Measured::default(),
            is_whole: recording.manifest().complete,
            gap: None,
        })
    }

    /// Ends the session here, which is bad input where the recording says that it is whole.
    fn end_at<T>(&mut self, gap: String) -> Result<Option<T>, Failure> {
        if self.is_whole {
            return Err(Failure::BadInput(gap));
        }
        self.gap.get_or_insert(gap);
        Ok(None)
    }

    /// The next force and the pose it belongs to; `None` at the end.
    fn next_force(&mut self) -> Result<Option<ReplayRow>, Failure> {
        let force = match self.forces.next_record() {
            Ok(Some(force)) if self.gap.is_none() => force,
            Ok(_) => return Ok(None),
            Err(error) => return self.end_at(error.to_string()),
        };
        // The coupling goes on from force to force: behind one that was lost it would come to something else.
        let next = self.measured.forces + 1;
        if force.sequence != next {
            return self.end_at(format!(
                "forces.csv: force {} stands where force {next} should; the recording is not whole, and cannot be computed again from there",
                force.sequence
            ));
        }
        let mut update_us = 0.0;
        while self.god_object.constraint_set().sequence < force.constraint_sequence {
            match self.update()? {
                Some(took) => update_us += took,
                None => {
                    return self.end_at(format!(
                        "forces.csv: force {} rests on constraint set {}, whose update is not in updates.csv; the recording is not whole",
                        force.sequence, force.constraint_sequence
                    ));
                }
            }
        }
        for motion in &self.motions {
            if let Some(pose) = self.god_object.obstacle_poses().nth(motion.obstacle) {
                self.coupling.place_obstacle(motion.obstacle, pose);
            }
        }
        let time = force.time.as_secs_f64();
        let set = self.god_object.constraint_set();
        let before = thread_cpu_time();
        let output = self
            .coupling
            .answer(time, force.device_sequence, &force.device_pose, set);
        let took = thread_cpu_time().saturating_sub(before).as_secs_f64() * 1e6;
        self.measured.forces += 1;
        self.measured.force_us.push(took);
        if !same_wrench(&output.wrench, &force.wrench) {
            self.measured.different_forces += 1;
            let (sequence, was, is) = (force.sequence, force.wrench, output.wrench);
            self.measured.first_difference.get_or_insert_with(|| {
                format!(
                    "force {sequence}: {:?} then, {:?} now",
                    was.as_slice(),
                    is.as_slice()
                )
            });
        }
        Ok(Some(ReplayRow {
            time,
            device_pose: force.device_pose,
            god_object_pose: set.god_object_pose,
            wrench: output.wrench,
            contacts: set.constraints.len(),
            active: output.active,
            gap_min: set.gap_min,
            kkt: output.kkt,
            stale: time - self.published,
            timings_us: (update_us, took),
        }))
    }

    /// The updates that no force rests on any more.
    fn finish_updates(&mut self) -> Result<(), Failure> {
        while self.update()?.is_some() {}
        Ok(())
    }

    /// The next update; how long it took, us, and `None` at the end.
    fn update(&mut self) -> Result<Option<f64>, Failure> {
        let update = match self.updates.next_record() {
            Ok(Some(update)) if self.gap.is_none() => update,
            Ok(_) => return Ok(None),
            Err(error) => return self.end_at(error.to_string()),
        };
        self.god_object.set_device_ahead(update.device_ahead);
        for motion in &self.motions {
            let there = motion.pose_at(update.obstacle_time.as_secs_f64());
            self.god_object.move_obstacle(motion.obstacle, &there);
        }
        let before = thread_cpu_time();
        let _ = self
            .god_object
            .step(&update.device_pose, update.shaded.as_ref());
        let took = thread_cpu_time().saturating_sub(before).as_secs_f64() * 1e6;
        let reached = self.god_object.constraint_set().sequence;
        if reached != update.sequence {
            return self.end_at(format!(
                "updates.csv: update {} stands where set {reached} was made; the recording is not whole, and cannot be computed again from there",
                update.sequence
            ));
        }
        self.published = update.published.as_secs_f64();
        self.god_object.note_published(self.published);
        self.measured.updates += 1;
        self.measured.update_us.push(took);
        let set = self.god_object.constraint_set();
        let same = same_pose(&set.god_object_pose, &update.pose)
            && set.gap_min.to_bits() == update.gap_min.to_bits()
            && set.constraints.len() == update.contacts as usize;
        if !same {
            self.measured.different_updates += 1;
            self.measured.first_difference.get_or_insert_with(|| {
                format!(
                    "update {}: {:?}, gap {:e}, {} rows then; {:?}, gap {:e}, {} rows now",
                    update.sequence,
                    update.pose,
                    update.gap_min,
                    update.contacts,
                    set.god_object_pose,
                    set.gap_min,
                    set.constraints.len()
                )
            });
        }
        Ok(Some(took))
    }

    fn report(self, recording: &Recording) -> RecordedReport {
        let measured = self.measured;
        RecordedReport {
            scene: recording.manifest().scene.clone(),
            complete: recording.manifest().complete,
            updates: measured.updates,
            forces: measured.forces,
            different_updates: measured.different_updates,
            different_forces: measured.different_forces,
            first_difference: measured.first_difference,
            gap: self.gap,
            update_us: distribution_of(&measured.update_us),
            force_us: distribution_of(&measured.force_us),
        }
    }
}

fn same_pose(one: &Pose, other: &Pose) -> bool {
    let bits = |pose: &Pose| {
        let (at, turn) = (&pose.translation, &pose.rotation);
        [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k].map(f64::to_bits)
    };
    bits(one) == bits(other)
}

fn same_wrench(one: &Vector6, other: &Vector6) -> bool {
    let bits = |wrench: &Vector6| wrench.map(f64::to_bits);
    bits(one) == bits(other)
}
