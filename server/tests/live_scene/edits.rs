//! The scene of a real `taut serve` changed while it runs: by an operator at the page, by `taut edit`, and beside the file watch.

use std::io::{Read, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3, Vector6};
use serde_json::{Value, json};
use taut_bridge::{
    BridgeArgs, Device, DeviceFault, DeviceInfo, DeviceSample, Grip, Hand, MinJerkPath, Pose,
    SimulatedDevice, ViaPoint, run_device,
};
use taut_link::{ClientOptions, Role, connect, read_key_file};

use crate::operator::{Served, TOKEN, with_token_file};
use crate::support::{PATIENCE, wait_until};
use crate::support::{Workplace, taut};

/// A ball over a plate whose upper face is at 20 mm.
const SCENE: &str = r##"name = "bench"
[god_object]
shape = { sphere = { radius = 0.02 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.05] }

# The plate of the bench.
[[obstacle]]
name = "plate"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
pose = { position = [0.0, 0.0, 0.0] } # its middle
color = "#c03030" # red
surface = { friction = 0.2 }
"##;
/// Stiffness of the plate, N/m: k_h k_s for 1 kg.
const STIFFNESS: f64 = 1000.0;

/// The workbench with a page, the scene above, and these changes of its text.
fn bench(changes: &[(&str, &str)]) -> String {
    let mut text =
        with_token_file().replacen("scene = \"sphere-on-plane\"", "scene = \"bench.toml\"", 1);
    for (from, to) in changes {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        text = changed;
    }
    text
}

fn serve(changes: &[(&str, &str)], more: &[&str]) -> Served {
    let place = Workplace::new();
    place.write("bench.toml", SCENE);
    place.write("other.toml", &SCENE.replace("\"bench\"", "\"other\""));
    let served = Served::start_in(place, &bench(changes), more);
    wait_until("a session", || served.status().is_some());
    served
}

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

/// Where the body and what moves are along x, m, as a client of this revision is told.
fn along_x(served: &Served, revision: u32) -> [f64; 2] {
    let text = served.text();
    let server = text.rsplit_once("serving on ").expect("was said").1;
    let server = server.split(' ').next().expect("an address").to_owned();
    let key = read_key_file(&served.place.path("cluster.key")).expect("the key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let options = ClientOptions::new(server, key, Role::Observer, "looker".to_owned());
    let link = runtime.block_on(connect(options)).expect("in");
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
    runtime.block_on(link.close());
    newest.expect("a state")
}

impl Served {
    pub(crate) fn edit(&self, wish: &Value) -> (u16, String) {
        let body = wish.to_string();
        let head = format!(
            "{}Authorization: Bearer {TOKEN}\r\nContent-Length: {}\r\n",
            self.host(),
            body.len()
        );
        self.post(&head, &body)
    }

    fn post(&self, head: &str, body: &str) -> (u16, String) {
        let mut stream = self.send("POST /edit", head);
        // Who is refused by his head alone may find the connection closed.
        let _ = stream.write_all(body.as_bytes());
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        let (head, text) = answer.split_once("\r\n\r\n").unwrap_or((&answer, ""));
        let status = head.split(' ').nth(1).and_then(|word| word.parse().ok());
        (status.unwrap_or(0), text.trim().to_owned())
    }

    pub(crate) fn scene(&self) -> Value {
        let (status, text) = self.ask("GET /scene", &self.host());
        assert_eq!(status, 200, "{text}");
        serde_json::from_str(&text).expect("JSON")
    }

    fn revision(&self) -> u64 {
        self.scene()["standing"]["revision"]
            .as_u64()
            .expect("a number")
    }

    /// What the page shows of the plate.
    fn plate(&self, key: &str) -> Value {
        self.scene()["scene"]["objects"][1][key].clone()
    }

    fn file(&self) -> String {
        std::fs::read_to_string(self.place.path("bench.toml")).expect("a file")
    }

    fn taut_edit(&self, more: &[&str]) -> (Option<i32>, String) {
        let token = self.place.text("operator.token");
        let mut arguments = vec!["edit", "--page", &self.address, "--token-file", &token];
        arguments.extend(more);
        let output = taut(&arguments);
        let said = [output.stdout, output.stderr].concat();
        (
            output.status.code(),
            String::from_utf8_lossy(&said).into_owned(),
        )
    }
}

/// Time, s, force, N, and place of the hand, m, of every write to a device.
type Written = Arc<Mutex<Vec<(f64, Vector3<f64>, Vector3<f64>)>>>;

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
fn press(
    served: &Served,
    written: &Written,
) -> (
    Arc<std::sync::atomic::AtomicBool>,
    std::thread::JoinHandle<()>,
) {
    let text = served.text();
    let rest = text.split_once("serving on ").expect("was said").1;
    let server = rest.split(' ').next().expect("an address").to_owned();
    let mut args = BridgeArgs::joining(&server, "bridge").expect("an address");
    args.key = Some(served.place.path("cluster.key"));
    args.priority = 0;
    let stop = Arc::<std::sync::atomic::AtomicBool>::default();
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
    let (status, said) = served.edit(&json!({
        "revision": 1,
        "edits": ["plate.pose.position=[0.0, 0.0, -0.005]", "plate.color=\"#30c030\""],
    }));
    assert_eq!(status, 200, "{said}");
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
    stop.store(true, std::sync::atomic::Ordering::Relaxed);
    bridge.join().expect("no panic");

    let written = written.lock().expect("no panic");
    assert!(
        written[before..]
            .iter()
            .any(|(_, force, _)| force.norm() == 0.0)
    );
    for pair in written.windows(2) {
        let [(t0, f0, x0), (t1, f1, x1)] = pair else {
            continue;
        };
        // 0.5 N/ms, and 1 N at once; beside it what the hand's own motion explains.
        let most = 1.0 + 500.0 * (t1 - t0) + 1.05 * STIFFNESS * (x1 - x0).norm();
        let step = (f1 - f0).norm();
        assert!(step <= most, "{step} N at {t1} s, where {most} N may be");
    }
    // Who joins now is told of the scene that runs.
    let text = served.text();
    let server = text.split_once("serving on ").expect("was said").1;
    let server = server.split(' ').next().expect("an address").to_owned();
    let key = read_key_file(&served.place.path("cluster.key")).expect("the key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let options = ClientOptions::new(server, key, Role::Observer, "looker".to_owned());
        let link = connect(options).await.expect("in");
        let plate = &link.description().obstacles[0];
        assert_eq!(plate.pose.position, [0.0, 0.0, -0.005]);
        assert!(plate.colour[1] > plate.colour[0], "green");
        link.close().await;
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
fn what_cannot_be_taken_changes_nothing_and_says_why() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let text = "plate.surface.friction";
    for (edit, part) in [
        ("plaet.color=\"#ffffff\"", "did you mean `plate`"),
        ("plate.surface.friction=nan", "NaN"),
        ("plate.surface.friction=-1", text),
        ("plate.pose.position=[0, 0, inf]", "finite"),
        // The ball would start within it; out of what travels; stiffer than the device bears.
        ("plate.pose.position=[0, 0, 0.02]", "start"),
        ("plate.pose.position=[2e6, 0, 0]", "out of its range"),
        ("coupling.k_h=1e9", "stiff"),
        ("plate=2", "write plate.KEY=VALUE"),
        ("limits.force=1000", "no \"limits\""),
        ("plate.surface.friction=0.2", "already"),
        ("plate.shape.mesh=/etc/passwd", "no key that can be changed"),
    ] {
        let (status, said) = served.edit(&json!({ "edits": [edit], "keep": true }));
        assert_eq!(status, 409, "{edit}: {said}");
        assert!(
            said.contains(part) && said.contains("not taken"),
            "{edit}: {said}"
        );
    }
    // One of several: none.
    let two = ["plate.color=\"#ffffff\"", "plate.opacity=7"];
    assert_eq!(served.edit(&json!({ "edits": two })).0, 409);
    for wish in [
        json!({}),
        json!({ "scene": "other.toml" }),
        json!({ "scene": "../../etc/passwd" }),
        json!({ "edits": "x" }),
        json!([]),
    ] {
        assert_eq!(served.edit(&wish).0, 409, "{wish}");
    }
    assert_eq!(served.revision(), 1);
    assert_eq!(served.file(), SCENE);
    assert_eq!(served.plate("color"), "#c03030");
    assert!(!served.says(&["event=\"edit\""]));
    assert!(!served.says(&["another session begins"]));

    // Recorded is one scene.
    drop(served);
    let place = Workplace::new();
    place.write("bench.toml", SCENE);
    let recording = place.text("recording");
    let served = Served::start_in(place, &bench(&[]), &["--recording", &recording]);
    let (status, said) = served.edit(&json!({ "edits": ["plate.color=\"#ffffff\""] }));
    assert!(status == 409 && said.contains("recorded"), "{said}");
}

#[test]
fn who_may_not_change_it_costs_nobody_anything() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let host = served.host();
    let shown = format!("{host}Authorization: Bearer {TOKEN}\r\n");
    let body = json!({ "edits": ["plate.color=\"#ffffff\""] }).to_string();
    let sized = |head: &str, length: usize| format!("{head}Content-Length: {length}\r\n");
    for (head, status) in [
        (sized(&host, body.len()), 401),
        (
            sized(
                &format!("{host}Authorization: Bearer 0123456789abcdef0123456789abcdeF\r\n"),
                body.len(),
            ),
            401,
        ),
        (
            sized(
                &format!("{shown}Origin: http://evil.example\r\n"),
                body.len(),
            ),
            403,
        ),
        (
            sized(
                &format!("Host: rebound.example\r\nAuthorization: Bearer {TOKEN}\r\n"),
                body.len(),
            ),
            403,
        ),
        (sized(&shown, 1_000_000_000), 413),
        (shown.clone(), 411),
    ] {
        let (found, said) = served.post(&head, &body);
        assert_eq!(found, status, "{head} {said}");
    }
    assert_eq!(served.ask("GET /edit", &shown).0, 405);
    // One that says more than it sends is let go of, and nobody waits for it.
    let silent: Vec<_> = (0..20)
        .map(|_| served.send("POST /edit", &sized(&shown, 60_000)))
        .collect();
    // As fast as they go, of a holder of the token and of others.
    let begun = Instant::now();
    let mut sent = 0;
    while begun.elapsed() < Duration::from_secs(2) {
        let of_token =
            served.edit(&json!({ "revision": 99, "edits": ["plate.color=\"#ffffff\""] }));
        assert!(
            of_token.0 == 409 && of_token.1.contains("revision 99"),
            "{of_token:?}"
        );
        assert_eq!(served.post(&sized(&host, body.len()), &body).0, 401);
        sent += 2;
    }
    let t = served.now("t").as_f64().expect("a number");
    wait_until("the page goes on", || served.now("t").as_f64() > Some(t));
    let (status, said) = served.ask("POST /disarm", &format!("{shown}Content-Length: 0\r\n"));
    assert_eq!(status, 200, "{said}");
    assert_eq!(served.revision(), 1, "after {sent} requests");
    let refused = served.lines_with(&["event=\"refused\""]);
    assert!(refused < 20, "{refused} lines: {}", served.text());
    drop(silent);

    // A flood of changes that could be taken leaves the session some time: one a second at most.
    let begun = Instant::now();
    let mut taken = 0;
    while begun.elapsed() < Duration::from_secs(4) {
        let (status, _) =
            served.edit(&json!({ "edits": [format!("plate.opacity=0.{}", 1 + taken % 9)] }));
        taken += u64::from(status == 200);
    }
    let most = 1 + begun.elapsed().as_secs();
    assert!(
        (1..=most).contains(&taken),
        "{taken} in {:?}",
        begun.elapsed()
    );
    assert_eq!(served.revision(), 1 + taken);
}

#[test]
fn of_two_editors_the_later_one_builds_upon_the_first_or_hears_that_it_was_faster() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let friction = |value: &str| json!({ "revision": 1, "edits": [format!("plate.surface.friction={value}")] });
    let answers: Vec<(u16, String)> = std::thread::scope(|scope| {
        let editors = ["0.4", "0.6"].map(|value| {
            let served = &served;
            scope.spawn(move || served.edit(&friction(value)))
        });
        editors
            .map(|editor| editor.join().expect("no panic"))
            .into()
    });
    let mut taken = answers
        .iter()
        .zip(["0.4", "0.6"])
        .filter(|((status, _), _)| *status == 200);
    let (_, first) = taken.next().expect("one of them");
    assert!(taken.next().is_none(), "{answers:?}");
    let refused = answers
        .iter()
        .find(|(status, _)| *status == 409)
        .expect("the other");
    assert!(
        refused.1.contains("revision 1") || refused.1.contains("just being taken"),
        "{refused:?}"
    );
    assert_eq!(served.plate("friction").to_string(), first);
    // Of whatever runs: both stand.
    let (code, said) = served.taut_edit(&["plate.color=#30c030", "coupling.k_h=1500"]);
    assert!(
        code == Some(0) && said.contains("revision 3 runs"),
        "{said}"
    );
    assert!(
        said.contains("\nwarning: ") && said.contains("lets go"),
        "{said}"
    );
    let scene = served.scene();
    assert_eq!(scene["scene"]["objects"][1]["friction"].to_string(), first);
    assert_eq!(scene["scene"]["objects"][1]["color"], "#30c030");
    assert_eq!(scene["scene"]["coupling"]["stiffness"], 1500.0);
    assert_eq!(
        scene["standing"]["not_kept"].as_array().map(Vec::len),
        Some(4)
    );
    let (code, said) = served.taut_edit(&["--revision", "2", "plate.color=#3030c0"]);
    assert!(
        code == Some(2) && said.contains("revision 2 of the scene, and 3 runs"),
        "{said}"
    );
    let (code, said) = served.taut_edit(&[]);
    assert!(
        code == Some(0) && said.contains("plate.color=\"#30c030\""),
        "{said}"
    );
    assert!(said.contains("  plate.roughness: as usual\n"), "{said}");
    assert!(
        said.contains("not in the file: coupling.k_h: as usual -> 1500"),
        "{said}"
    );
}

#[test]
fn what_is_kept_is_in_the_file_with_its_comments_and_no_other_change_of_the_file_is_lost() {
    let served = serve(&[], &["--follow-scene"]);
    served.wait_for_run("paused");
    let (code, said) = served.taut_edit(&["plate.surface.friction=0.5"]);
    assert!(
        code == Some(0) && said.contains("does not have it"),
        "{said}"
    );
    let (code, said) = served.taut_edit(&["--keep", "plate.color=#30c030"]);
    assert!(
        code == Some(0) && said.contains("the file has it"),
        "{said}"
    );
    let kept = SCENE
        .replace("\"#c03030\" # red", "\"#30c030\" # red")
        .replace("friction = 0.2", "friction = 0.5");
    assert_eq!(served.file(), kept);
    assert_eq!(served.scene()["standing"]["not_kept"], json!([]));
    // Its own writing is no change of the file: a change of somebody's is.
    let (code, said) = served.taut_edit(&["plate.opacity=0.5"]);
    assert!(
        code == Some(0) && said.contains("revision 4 runs"),
        "{said}"
    );
    assert_eq!(served.file(), kept);
    served.place.write(
        "bench.toml",
        &kept.replace("friction = 0.5", "friction = 0.7"),
    );
    let (code, said) = served.taut_edit(&["--keep"]);
    let is_refused = code == Some(2) && said.contains("was changed since it was read");
    // On a busy machine it comes to the session that has read the file.
    let is_of_next = code == Some(2) && said.contains("went with that") && served.revision() == 5;
    assert!(is_refused || is_of_next, "{said}");
    wait_until("the file is followed", || served.revision() == 5);
    let (code, said) = served.taut_edit(&["--keep"]);
    assert!(
        code == Some(2) && said.contains("went with that (plate.opacity"),
        "{said}"
    );
    assert!(
        served.says(&["not kept in a file, is gone", "plate.opacity"]),
        "{}",
        served.text()
    );
    assert_eq!(served.plate("friction"), 0.7);
    assert_eq!(served.plate("opacity"), 1.0);
    // Later, by itself: what was changed before.
    let (code, said) = served.taut_edit(&["plate.opacity=0.25"]);
    assert!(code == Some(0), "{said}");
    wait_until("kept", || served.taut_edit(&["--keep"]).0 == Some(0));
    assert!(served.file().contains("opacity = 0.25") && served.file().contains("# The plate"));
    assert_eq!(served.revision(), 6, "no session for that");
    let (code, said) = served.taut_edit(&["plate.opacity=1"]);
    assert!(code == Some(0) && said.contains("revision 7"), "{said}");
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
        let (code, said) = served.taut_edit(&[edit]);
        assert!(code == Some(0) && !said.contains("start"), "{edit}: {said}");
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
    let (code, said) = served.taut_edit(&["wall.pose.position=[0.06, 0.0, 0.0]"]);
    let why = "begins at the scene's start and not where it was: there it would be in \"wall\"";
    assert!(code == Some(0) && said.contains(why), "{said}");
    assert!(served.says(&[why]));
    revision += 1;
    let [body, moves] = along_x(&served, revision);
    assert!(body < 0.06 - 0.005 - 0.0199, "{body}");
    assert!(moves < slab, "all of it begins: {moves} m after {slab} m");

    // Chosen anew it begins anew.
    std::thread::sleep(Duration::from_secs(2));
    let [_, slab] = along_x(&served, revision);
    let (status, said) = served.edit(&json!({ "scene": "bench.toml" }));
    assert_eq!(status, 200, "{said}");
    revision += 1;
    let [_, moves] = along_x(&served, revision);
    assert!(moves < slab, "from {slab} m to {moves} m");
}

#[test]
fn what_runs_already_is_kept_without_another_session() {
    let served = serve(&[], &[]);
    served.wait_for_run("paused");
    let edit = "plate.surface.friction=0.5";
    let (code, said) = served.taut_edit(&[edit]);
    assert!(
        code == Some(0) && said.contains("does not have it"),
        "{said}"
    );
    let (code, said) = served.taut_edit(&["--keep", edit]);
    assert!(code == Some(0) && said.contains("kept: "), "{said}");
    let kept = SCENE.replace("friction = 0.2", "friction = 0.5");
    assert_eq!(served.file(), kept);
    assert_eq!(served.scene()["standing"]["not_kept"], json!([]));
    assert_eq!(served.revision(), 2, "no session for that");
    // The file has it now.
    let (code, said) = served.taut_edit(&["--keep", edit]);
    assert!(code == Some(2) && said.contains("already"), "{said}");
}

#[test]
fn another_scene_is_chosen_of_those_that_the_workbench_file_names() {
    let changes = [
        ("rearm = \"manual\"", "rearm = \"automatic\""),
        (
            "token_file = \"operator",
            "scenes = [\"other.toml\", \"peg-in-a-hole\"]\ntoken_file = \"operator",
        ),
    ];

    let served = serve(&changes, &["--follow-scene"]);
    let session = |key: &str| {
        served
            .status()
            .map_or(Value::Null, |status| status["session"][key].clone())
    };
    served.wait_for_run("running");
    let instance = session("instance");
    // Somebody has taken the force away: no change of the scene brings it back.
    let shown = format!(
        "{}Authorization: Bearer {TOKEN}\r\nContent-Length: 0\r\n",
        served.host()
    );
    assert_eq!(served.ask("POST /disarm", &shown).0, 200);
    served.wait_for_run("paused");
    let (status, said) =
        served.edit(&json!({ "scene": "other.toml", "edits": ["plate.color=\"#30c030\""] }));
    assert_eq!(status, 200, "{said}");
    wait_until("the other scene", || session("scene") == "other");
    assert_eq!(session("instance"), instance, "the same page");
    served.wait_for_run("paused");
    assert!(served.now("force_n") == 0.0);
    let (status, said) = served.edit(&json!({ "scene": "peg-in-a-hole" }));
    assert_eq!(status, 200, "{said}");
    let (status, said) =
        served.edit(&json!({ "edits": ["god_object.color=\"#ffffff\""], "keep": true }));
    assert!(status == 409 && said.contains("no file"), "{said}");
    assert_eq!(served.ask("POST /arm", &shown).0, 200);
    served.wait_for_run("running");
    // The one that the workbench file names stays one of them.
    let (status, said) = served.edit(&json!({ "scene": "bench.toml" }));
    assert_eq!(status, 200, "{said}");
    wait_until("the bench again", || session("scene") == "bench");
    served.wait_for_run("running");
    let (status, said) = served.edit(&json!({ "scene": "other.toml" }));
    assert_eq!(status, 200, "{said}");
    wait_until("the other scene", || session("scene") == "other");
    // The workbench file names another: that counts again.
    let text = std::fs::read_to_string(served.place.path("workbench.toml")).expect("a file");
    let begun = Instant::now();
    served.place.write(
        "workbench.toml",
        &text.replacen("scene = \"bench.toml\"", "scene = \"sphere-on-plane\"", 1),
    );
    wait_until("the named one", || session("scene") == "sphere-on-plane");
    assert!(begun.elapsed() < PATIENCE);
    served.wait_for_run("running");
}
