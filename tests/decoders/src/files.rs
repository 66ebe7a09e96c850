//! Files that people write, copy or record: keys, TOML, traces, recordings.

use std::cell::RefCell;
use std::fs;
use std::path::Path;
use std::time::Duration;

use god_object::{Pose, Vector6};
use taut_proto::{ClusterKey, Credential, Holder, JoinKey, Role};
use taut_recording::{
    FORMAT, ForceRecord, Lost, Manifest, Recorder, Recording, SceneOrigin, UpdateRecord,
};
use taut_scene::{DeviceTrace, SHIPPED_SCENES, SHIPPED_WORKBENCH, Scene, Workbench};
use taut_spidar::Geometry;
use tempfile::TempDir;

/// Where the files of a scene would be: nowhere, so that no input reads a file of this machine.
const NOWHERE: &str = "/nowhere";
/// Files of a recording that are read back, by the first byte of the input.
const RECORDED: [&str; 3] = ["recording.json", "updates.csv", "forces.csv"];
/// Records that are read of one input.
const MAX_RECORDS: usize = 100_000;

/// A key file: what is read is written as the same digits.
pub(crate) fn key_file(text: &str) {
    if let Ok(key) = ClusterKey::parse(text) {
        assert_eq!(key.to_hex(), text.trim().to_ascii_lowercase());
    }
}

/// What a node joins by, a key or a credential: a credential that is read is written as the same.
pub(crate) fn join_key(text: &str) {
    if let Ok(JoinKey::Credential(credential)) = JoinKey::parse(text) {
        let again = Credential::parse(&credential.to_text());
        let again = again.unwrap_or_else(|error| panic!("written and not read: {error}"));
        assert_eq!(again.to_text(), credential.to_text());
        assert_eq!(again.fingerprint(), credential.fingerprint());
    }
}

/// A scene file; its meshes are not loaded. Reading it twice gives the same.
pub(crate) fn scene_toml(text: &str) {
    match Scene::parse("fuzz.toml", text, Path::new(NOWHERE)) {
        Ok(scene) => {
            let again = Scene::parse("fuzz.toml", text, Path::new(NOWHERE));
            assert_eq!(again.as_ref(), Ok(&scene));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

/// Edits of a scene, a line each: what comes out is a scene that is read as the same, with its name and the keys that were named.
pub(crate) fn scene_edit(text: &str) {
    thread_local! {
        static SCENE: Scene = Scene::named_or_file("sphere-on-plane").unwrap_or_else(|error| panic!("{error}"));
    }
    SCENE.with(|scene| {
        let edits: Vec<&str> = text.split('\n').collect();
        match scene.edited(&edits) {
            Ok((edited, keys)) => {
                assert_eq!(keys.len(), edits.len());
                assert_eq!(edited.name(), scene.name());
                let again = Scene::parse(edited.name(), edited.text(), Path::new(NOWHERE));
                assert!(again.is_ok(), "{again:?} of {text:?}");
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    });
}

pub(crate) fn scene_edit_seeds() -> Vec<Vec<u8>> {
    [
        "coupling.k_h=1500",
        "god_object.color=\"#ff8800\"",
        "plane.surface.friction=0.3\nplane.pose.position=[0, 0, -0.1]",
        "plane.opacity=0.5\ncoupling.damping_time=0.002",
    ]
    .map(|text| text.as_bytes().to_vec())
    .into()
}

/// A workbench file; nothing that it names is opened.
pub(crate) fn workbench_toml(text: &str) {
    if let Err(error) = Workbench::parse("fuzz.toml", text, Path::new(NOWHERE)) {
        assert!(!error.to_string().is_empty());
    }
}

/// The geometry of a string-driven device.
pub(crate) fn string_geometry(text: &str) {
    if let Err(error) = Geometry::parse("fuzz.toml", text) {
        assert!(!error.problems.is_empty());
    }
}

/// A device trace as `taut replay` reads it: finite, in order.
pub(crate) fn trace_csv(text: &str) {
    if let Ok(trace) = DeviceTrace::parse("fuzz.csv", text) {
        let samples = trace.samples();
        assert!(!samples.is_empty());
        assert!(samples.windows(2).all(|two| two[0].time < two[1].time));
        assert!(samples.iter().all(|sample| is_a_pose(&sample.pose)));
        let _ = trace.elapsed(&samples[samples.len() - 1]);
    }
}

/// The same file as the bridge reads it.
pub(crate) fn bridge_trace_csv(bytes: &[u8]) {
    let trace = with_file("trace.csv", bytes, taut_bridge::read_trace);
    if let Ok(trace) = trace {
        assert!(!trace.is_empty());
        assert!(trace.windows(2).all(|two| two[0].time < two[1].time));
        assert!(trace.iter().all(|row| is_a_pose(&row.pose)));
        assert_eq!(taut_bridge::via_points(&trace).len(), trace.len());
    }
}

fn is_a_pose(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|x| x.is_finite())
        && (pose.rotation.norm() - 1.0).abs() < 1e-6
}

/// A recording with one of its files replaced: the first byte says which.
pub(crate) fn recording(bytes: &[u8]) {
    let Some((which, content)) = bytes.split_first() else {
        return;
    };
    thread_local! {
        static KEPT: RefCell<Option<SampleRecording>> = const { RefCell::new(None) };
    }
    KEPT.with_borrow_mut(|kept| {
        let sample = kept.get_or_insert_with(SampleRecording::make);
        let which = usize::from(*which) % RECORDED.len();
        let path = sample.path(which);
        assert!(fs::write(&path, content).is_ok(), "{}", path.display());
        read_recording(&sample.directory.path().join("new"));
        assert!(fs::write(&path, &sample.valid[which]).is_ok());
    });
}

fn read_recording(directory: &Path) {
    let Ok(recording) = Recording::open(directory) else {
        return;
    };
    assert_eq!(recording.manifest().format, FORMAT);
    if let Ok(mut updates) = recording.updates() {
        let read = (0..MAX_RECORDS).map_while(|_| updates.next_record().ok().flatten());
        let _ = read.count();
    }
    if let Ok(mut forces) = recording.forces() {
        let read = (0..MAX_RECORDS).map_while(|_| forces.next_record().ok().flatten());
        let _ = read.count();
    }
}

/// A recording as the recorder writes it, in a directory of its own.
struct SampleRecording {
    directory: TempDir,
    /// Valid content of [`RECORDED`].
    valid: Vec<Vec<u8>>,
}

impl SampleRecording {
    fn make() -> SampleRecording {
        let directory = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let manifest = Manifest {
            format: FORMAT,
            program: "taut test".to_owned(),
            scene: "none".to_owned(),
            origin: SceneOrigin::Shipped,
            overrides: vec!["method.k_s=0.5".to_owned()],
            identity: "0".to_owned(),
            complete: false,
            reason: None,
            lost: Lost::default(),
            records: None,
        };
        let path = directory.path().join("new");
        let (mut taps, recorder) = Recorder::start(&path, manifest, "name = \"none\"\n")
            .unwrap_or_else(|error| panic!("{error}"));
        for sequence in 1..=3 {
            let time = Duration::from_millis(sequence);
            taps.updates.push(UpdateRecord {
                sequence,
                published: time,
                device_sequence: sequence,
                device_pose: Pose::translation(0.1, 0.2, 0.3),
                obstacle_time: time,
                device_ahead: 0.125,
                shaded: None,
                pose: Pose::identity(),
                contacts: 3,
                gap_min: if sequence == 2 { f64::INFINITY } else { 0.1 },
            });
            taps.forces.push(ForceRecord {
                sequence,
                time,
                device_sequence: sequence,
                device_pose: Pose::identity(),
                constraint_sequence: sequence,
                wrench: Vector6::new(1e-9, 2.0, -0.0, 1.0 / 7.0, 5.0, 6.0),
            });
        }
        assert!(recorder.finish().failure.is_none());
        let read = |name| fs::read(path.join(name)).unwrap_or_else(|error| panic!("{error}"));
        let valid = RECORDED.map(read).to_vec();
        SampleRecording { directory, valid }
    }

    fn path(&self, which: usize) -> std::path::PathBuf {
        self.directory.path().join("new").join(RECORDED[which])
    }
}

/// Writes `bytes` to a file of this thread and reads it by `read`.
pub(crate) fn with_file<T>(name: &str, bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static DIRECTORY: RefCell<Option<TempDir>> = const { RefCell::new(None) };
    }
    DIRECTORY.with_borrow_mut(|kept| {
        let directory = kept
            .get_or_insert_with(|| tempfile::tempdir().unwrap_or_else(|error| panic!("{error}")));
        let path = directory.path().join(name);
        assert!(fs::write(&path, bytes).is_ok(), "{}", path.display());
        read(&path)
    })
}

pub(crate) fn key_seeds() -> Vec<Vec<u8>> {
    let digits = "0123456789abcdefABCDEF".repeat(3)[..64].to_owned();
    vec![digits.clone().into(), format!(" {digits}\n").into()]
}

pub(crate) fn join_key_seeds() -> Vec<Vec<u8>> {
    let mut seeds = key_seeds();
    let key = ClusterKey::parse(&"5a".repeat(32));
    let key = key.unwrap_or_else(|error| panic!("{error}"));
    for (role, holder) in [(Role::Render, "left"), (Role::Device, "bridge-2")] {
        let holder = Holder::of(holder).unwrap_or_else(|error| panic!("{error}"));
        seeds.push(key.credential(role, holder, 3).to_text().into_bytes());
    }
    seeds
}

pub(crate) fn scene_seeds() -> Vec<Vec<u8>> {
    let texts = SHIPPED_SCENES.iter();
    let texts = texts.filter_map(|scene| taut_scene::shipped_scene_text(scene.name));
    texts.map(|text| text.as_bytes().to_vec()).collect()
}

pub(crate) fn workbench_seeds() -> Vec<Vec<u8>> {
    vec![SHIPPED_WORKBENCH.as_bytes().to_vec()]
}

pub(crate) fn string_geometry_seeds() -> Vec<Vec<u8>> {
    vec![
        include_bytes!("../../../device-bridge/spidar/devices/g6x3r.toml").to_vec(),
        include_bytes!("../../../device-bridge/spidar/devices/wb.toml").to_vec(),
    ]
}

pub(crate) fn trace_seeds() -> Vec<Vec<u8>> {
    let header = "t,x,y,z,qw,qx,qy,qz";
    vec![
        format!("{header}\n0,0,0,0,1,0,0,0\n0.001,1e-3,-2.5,3,0,1,0,0\n").into(),
        format!("# by hand\n{header},buttons\n0, 0, 0, 0, 1, 0, 0, 0, 3\n1,0,0,0,0,0,-1,0,65535\n")
            .into(),
    ]
}

pub(crate) fn recording_seeds() -> Vec<Vec<u8>> {
    let sample = SampleRecording::make();
    let numbered = sample.valid.iter().enumerate();
    numbered
        .map(|(which, content)| [&[which as u8], &content[..]].concat())
        .collect()
}
