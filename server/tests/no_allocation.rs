//! The haptics loop and the coupling allocate nothing, in contact and out of it.

use std::sync::Arc;
use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use god_object::{GodObject, Pose};
use taut::loops::wiring::WiredLoops;
use taut::session::setup::DeviceSource;
use taut::session::setup::devices::device;
use taut_bridge::{EventKind, SafetySettings};
use taut_recording::{FORMAT, Lost, Manifest, Recorder, SceneOrigin, Taps};
use taut_scene::{Device, Scene};

fn manifest() -> Manifest {
    Manifest {
        format: FORMAT,
        program: "a test".to_owned(),
        scene: "any".to_owned(),
        origin: SceneOrigin::Shipped,
        overrides: Vec::new(),
        identity: String::new(),
        complete: false,
        reason: None,
        lost: Lost::default(),
        records: None,
    }
}

/// The loops of a scene with a simulated device, pulled by these strings.
fn wired(name: &str, strings: Option<&str>, taps: Taps) -> WiredLoops {
    let scene = Scene::named_or_file(name)
        .and_then(|scene| scene.build())
        .unwrap_or_else(|error| panic!("{error}"));
    let wanted = Device::Simulated {
        hand: None,
        path: None,
        tremor: 5e-5,
        seed: 1,
        strings: strings.map(str::to_owned),
    };
    let Ok(DeviceSource::Local(device)) = device(&wanted, &scene, &Pose::identity()) else {
        panic!("no simulated device");
    };
    let world = Arc::new(scene.world);
    let Ok(god_object) = GodObject::new(world.clone(), scene.settings, scene.start) else {
        panic!("{name} starts in penetration");
    };
    WiredLoops::new(
        &world,
        &scene.settings,
        god_object,
        device,
        SafetySettings::default(),
        Some(taps),
    )
    .with_motions(scene.motions, Duration::ZERO)
}

#[test]
fn loops_two_and_three_allocate_nothing() {
    for (name, strings) in [
        ("sphere-on-plane", None),
        ("peg-in-a-hole", None),
        ("moving-plate", None),
        ("sphere-on-plane", Some("g6x3r")),
        ("peg-in-a-hole", Some("wb")),
    ] {
        // Recorded, too.
        let directory = tempfile::tempdir().expect("no temporary directory");
        let (taps, _recorder) =
            Recorder::start(directory.path(), manifest(), "").expect("cannot record");
        let mut loops = wired(name, strings, taps);
        let mut most_contacts = 0;
        for tick in 1..=4000_u64 {
            let now = Duration::from_millis(tick);
            assert_no_alloc(|| {
                loops.haptics.tick(now);
                loops.coupling.tick(now);
            });
            loops.god_object.tick(|| now);
            let contacts = loops.readers.monitor.contacts.newest();
            most_contacts = most_contacts.max(contacts.set.constraints.len());
        }
        assert!(most_contacts > 0, "{name}: nothing was touched");
        let faults = loops
            .statistics
            .haptics
            .incidents
            .of(EventKind::DeviceStrings);
        assert_eq!(faults, 0, "{name} with {strings:?}");
        let report = loops.statistics.report(Duration::from_secs(4));
        for times in [report.tension_us, report.coupling_and_tension_us] {
            assert_eq!(
                times.map(|times| times.count),
                strings.map(|_| 4000),
                "pose and tensions of every tick are timed"
            );
        }
        assert_eq!(report.answer_wait_us.count, 4000);
        assert_eq!(
            report.force_latency_us.count, 3999,
            "no force answers before the first sample"
        );
    }
}
