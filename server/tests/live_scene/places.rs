//! What is felt while the scene becomes another, and where the bodies stand afterwards.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3, Vector6};
use serde_json::json;
use taut_bridge::{
    BridgeArgs, Device, DeviceFault, DeviceInfo, DeviceSample, Grip, Hand, MinJerkPath, Pose,
    SimulatedDevice, ViaPoint, run_device,
};
use taut_link::{ClientLink, ClientOptions, Role, connect, read_key_file};

use super::{SCENE, bench, serve};
use crate::operator::Served;
use crate::support::{Workplace, wait_until};

/// A ball that a hand carries over a wall and keeps there, and a slab that goes by, far away.
const OVER_A_WALL: &str = r#"name = "bench"
[god_object]
shape = { sphere = { radius = 0.02 } }
mass = 1.0
pose = { position = [-0.05, 0.0, 0.05] }

[[obstacle]]
name = "wall"
shape = { box = { half_extents = [0.005, 0.1, 0.06] } }

[[obstacle]]
name = "slab"
shape = { box = { half_extents = [0.01, 0.01, 0.01] } }
motion = { trace = "slab.csv" }

[hand]
path = "over.csv"
"#;
const OVER: &str = "t,x,y,z,qw,qx,qy,qz
0,-0.05,0,0.05,1,0,0,0
0.5,-0.05,0,0.12,1,0,0,0
1,0.06,0,0.12,1,0,0,0
1.5,0.06,0,0.05,1,0,0,0
";
const SLAB: &str = "t,x,y,z,qw,qx,qy,qz
0,0,0,1,1,0,0,0
1000,10,0,1,1,0,0,0
";

/// What `look` finds as an observer who joins now.
fn observe<T>(served: &Served, look: impl FnOnce(&ClientLink) -> T) -> T {
    let server = served.word_after("serving on ");
    let key = read_key_file(&served.place.path("cluster.key")).expect("the key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let options = ClientOptions::new(server, key, Role::Observer, "looker".to_owned());
    let link = runtime.block_on(connect(options)).expect("in");
    let found = look(&link);
    runtime.block_on(link.close());
    found
}

/// Where the body and what moves are along x, m, as a client of this revision is told.
fn along_x(served: &Served, revision: u32) -> [f64; 2] {
    observe(served, |link| {
        let mut states = Vec::new();
        let mut newest = None;
        wait_until("a state", || {
            link.drain_states(&mut states);
            let of = states.last().filter(|s| s.state.scene_revision == revision);
            newest = of.map(|received| {
                let state = &received.state;
                let [body, slab] = [&state.tools[0].god_object, &state.bodies[0].pose];
                [body, slab].map(|pose| f64::from(pose.position[0]))
            });
            newest.is_some()
        });
        newest.expect("a state")
    })
}

/// How far the slab can have come since a trace began, which was after `begun`, m: 1 cm/s, and what a float rounds.
fn way_since(begun: Instant) -> f64 {
    0.01 * begun.elapsed().as_secs_f64() + 1e-6
}

/// Stiffness of the plate, N/m: k_h k_s for 1 kg.
const STIFFNESS: f64 = 1000.0;

/// Time, s, force, N, and place of the hand, m, of every write to a device.
type Written = Arc<Mutex<Vec<Write>>>;
type Write = (f64, Vector3<f64>, Vector3<f64>);

/// A device in a hand that presses down; what is written to it is kept.
struct Pressed {
    inner: SimulatedDevice,
    at: Vector3<f64>,
    written: Written,
}

impl Device for Pressed {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let sample = self.inner.read(now)?;
        self.at = sample.pose.translation.vector;
        Ok(sample)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        let force = wrench.fixed_rows::<3>(0).into_owned();
        let mut written = self.written.lock().expect("no panic");
        written.push((now.as_secs_f64(), force, self.at));
        self.inner.write(now, wrench);
    }
}

/// A bridge whose hand presses on the plate.
fn press(served: &Served, written: &Written) -> (Arc<AtomicBool>, JoinHandle<()>) {
    let server = served.word_after("serving on ");
    let mut args = BridgeArgs::joining(&server, "bridge").expect("an address");
    args.key = Some(served.place.path("cluster.key"));
    args.priority = 0;
    let stop = Arc::<AtomicBool>::default();
    let (asked, written) = (stop.clone(), written.clone());
    let thread = std::thread::Builder::new().spawn(move || {
        let ended = run_device(&args, asked, |placement| {
            let via = |time_s, z| ViaPoint {
                time_s,
                pose: Pose::translation(0.0, 0.0, z),
            };
            let z = placement.start.translation.z;
            let path = MinJerkPath::new(vec![via(0.0, z), via(1.0, 0.025)], false).expect("a path");
            Box::new(Pressed {
                inner: SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, Point3::origin()),
                at: Vector3::zeros(),
                written,
            })
        });
        assert!(ended.is_ok(), "{:?}", ended.err());
    });
    (stop, thread.expect("a thread"))
}

fn force_has_no_step(written: &[Write]) {
    for pair in written.windows(2) {
        let [(t0, f0, x0), (t1, f1, x1)] = pair else {
            continue;
        };
        // 0.5 N/ms, and 1 N at once; beside it what the hand's own motion explains.
        let most = 1.0 + 500.0 * (t1 - t0) + 1.05 * STIFFNESS * (x1 - x0).norm();
        let step = (f1 - f0).norm();
        assert!(step <= most, "{step} N at {t1} s, where {most} N may be");
    }
}

#[test]
fn a_pose_is_changed_under_a_hand_and_the_force_goes_to_zero_and_comes_again_without_a_step() {
    let served = serve(
        &[
            ("kind = \"simulated\"", "kind = \"remote\""),
            ("tremor = ", "# tremor = "),
            ("seed = ", "# seed = "),
            ("rearm = \"manual\"", "rearm = \"automatic\""),
        ],
        &[],
    );
    let written = Written::default();
    let (stop, bridge) = press(&served, &written);
    let newest = || {
        written
            .lock()
            .expect("no panic")
            .last()
            .map_or(0.0, |w| w.1.norm())
    };
    let count = || written.lock().expect("no panic").len();
    wait_until("the plate is felt", || newest() > 2.0);

    let before = count();
    let said = served.takes(&json!({
        "revision": 1,
        "edits": ["plate.pose.position=[0.0, 0.0, -0.005]", "plate.color=\"#30c030\""],
    }));
    for part in [
        "plate.pose.position: [0.0, 0.0, 0.0] -> [0.0, 0.0, -0.005]",
        "revision 2 runs",
        "does not have it",
    ] {
        assert!(said.contains(part), "{part} in {said}");
    }
    assert_eq!(served.plate("position"), json!([0.0, 0.0, -0.005]));
    wait_until("the plate is felt again", || {
        count() > before + 200 && newest() > 2.0
    });
    stop.store(true, Ordering::Relaxed);
    bridge.join().expect("no panic");

    let written = written.lock().expect("no panic");
    assert!(
        written[before..]
            .iter()
            .any(|(_, force, _)| force.norm() == 0.0)
    );
    force_has_no_step(&written);
    // Who joins now is told of the scene that runs.
    observe(&served, |link| {
        let plate = &link.description().obstacles[0];
        assert_eq!(plate.pose.position, [0.0, 0.0, -0.005]);
        assert!(plate.colour[1] > plate.colour[0], "green");
    });
    for part in ["event=\"edit\"", "event=\"joined\""] {
        wait_until(part, || served.says(&["taut::audit", part]));
    }
    assert!(served.says(&[
        "event=\"edit\"",
        "operator-page",
        "address=127.0.0.1:",
        "revision=2",
        "plate.color"
    ]));
    assert_eq!(served.file(), SCENE, "nothing was to be kept");
}

#[test]
fn a_change_leaves_the_body_and_what_moves_where_they_are() {
    let place = Workplace::new();
    for (name, text) in [
        ("bench.toml", OVER_A_WALL),
        ("over.csv", OVER),
        ("slab.csv", SLAB),
    ] {
        place.write(name, text);
    }
    let served = Served::start_in(place, &bench(&[]), &["--follow-scene"]);
    let (mut revision, mut slab) = (1, 0.0);
    wait_until("the hand is beyond the wall", || {
        let [body, moves] = along_x(&served, 1);
        slab = moves;
        (body - 0.06).abs() < 1e-3
    });
    // From the start the wall would be in the way.
    let edits = [
        "wall.surface.friction=0.4",
        "coupling.k_h=1500",
        "wall.color=#30c030",
    ];
    for edit in edits {
        let said = served.edits(&[edit], "");
        assert!(!said.contains("start"), "{edit}: {said}");
        revision += 1;
        let [body, moves] = along_x(&served, revision);
        assert!(
            (body - 0.06).abs() < 1e-3,
            "{edit}: the body is at {body} m"
        );
        assert!(moves >= slab, "{edit}: from {slab} m to {moves} m");
        slab = moves;
    }
    let text = served.file().replace("mass = 1.0", "mass = 1.2");
    served.place.write("bench.toml", &text);
    revision += 1;
    wait_until("the file is followed", || {
        served.revision() == u64::from(revision)
    });
    let [body, moves] = along_x(&served, revision);
    assert!(
        (body - 0.06).abs() < 1e-3 && moves >= slab,
        "{body} {moves}"
    );

    // Where it is, something else is to be: from the start it comes to the near side of that.
    let begun = Instant::now();
    let why = "begins at the scene's start and not where it was: there it would be in \"wall\"";
    served.edits(&["wall.pose.position=[0.06, 0.0, 0.0]"], why);
    assert!(served.says(&[why]));
    revision += 1;
    let [body, moves] = along_x(&served, revision);
    assert!(body < 0.06 - 0.005 - 0.0199, "{body}");
    let most = way_since(begun);
    assert!(moves <= most, "all of it begins: {moves} m after {slab} m");

    // Chosen anew it begins anew.
    wait_until("the slab has come some way", || {
        slab = along_x(&served, revision)[1];
        slab > 5e-3
    });
    let begun = Instant::now();
    served.takes(&json!({ "scene": "bench.toml" }));
    revision += 1;
    let [_, moves] = along_x(&served, revision);
    let most = way_since(begun);
    assert!(moves <= most, "from {slab} m to {moves} m");
}
