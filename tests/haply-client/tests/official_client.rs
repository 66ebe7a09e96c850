//! The vendor's client, unchanged, is the judge of the simulated service: version, inventory, states, forces, grip.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use haply::HaplyDevice;
use haply::device_model::{
    ControlMode, Force, ForceInput, Inverse3CommandClear, ProfileConfig, ServiceData,
    SessionConfigure,
};
use haply::interfaces::http::InverseHttpClient;

/// Only a hang takes this long.
const PATIENCE: Duration = Duration::from_secs(60);

struct Service(Child);

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The program is built beforehand, so that what is killed is the service and not its builder.
fn start() -> (Service, String) {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
    let built = Command::new(env!("CARGO"))
        .args(["build", "--quiet", "--manifest-path", manifest])
        .args(["--package", "taut-bridge", "--bin", "taut-bridge"])
        .args(["--message-format", "json"])
        .env_remove("CARGO_TARGET_DIR")
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo runs");
    assert!(built.status.success(), "the program is not built");
    let messages = String::from_utf8(built.stdout).expect("text");
    let key = "\"executable\":\"";
    let program = messages.lines().rev().find_map(|line| {
        let from = line.find(key)? + key.len();
        line[from..].split('"').next()
    });
    let mut child = Command::new(program.expect("an executable"))
        .args(["simulate-device", "haply", "--bind", "127.0.0.1:0"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let out = child.stdout.take().expect("piped");
    let service = Service(child);
    let mut line = String::new();
    BufReader::new(out).read_line(&mut line).expect("a line");
    let address = line.trim().rsplit('=').next().expect("an address");
    (service, address.to_owned())
}

/// Keeps the force, until the state is as wanted.
async fn until(
    device: &mut HaplyDevice,
    what: &str,
    force: Option<Force>,
    done: impl Fn(&ServiceData) -> bool,
) -> ServiceData {
    let begun = Instant::now();
    loop {
        let state = device.read_state().await.expect("a state");
        if done(&state) {
            return state;
        }
        assert!(begun.elapsed() < PATIENCE, "{what}: {state:?}");
        match (force, state.inverse3.first()) {
            (Some(forces), Some(arm)) => {
                let device_id = arm.device_id.clone();
                let input = vec![ForceInput { device_id, forces }];
                device.update_force(input, None, Some(true)).await.expect("sent");
            }
            _ => device.send_force_full_render().await.expect("sent"),
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_vendors_client_reads_and_pushes_the_simulated_arm() {
    let (_service, address) = start();
    let http = InverseHttpClient::new(&format!("http://{address}"));
    let version = http.get_version().await.expect("a version");
    assert!(version.project_version.starts_with("3.5"), "{version:?}");

    let mut device = HaplyDevice::new(&format!("http://{address}"), &format!("ws://{address}/"))
        .await
        .expect("a connection");
    // The inventory comes without a word from this side.
    let begun = Instant::now();
    while device.read_state().await.expect("a state").inverse3.is_empty() {
        assert!(begun.elapsed() < PATIENCE, "no inventory");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let first = device.read_state().await.expect("a state");
    let config = first.inverse3[0].config.as_ref().expect("a configuration");
    assert_eq!(config.coordinate_system.as_ref().expect("a basis").permutation, "XYZ");
    let [grip] = &first.wireless_verse_grip[..] else {
        panic!("one grip: {first:?}")
    };
    let q = grip.state.orientation.expect("an orientation");
    assert!((q.norm() - 1.0).abs() < 1e-5);

    let profile = Some(ProfileConfig {
        name: "judge".to_owned(),
        required_version: Some(">=3.5".to_owned()),
    });
    let session = SessionConfigure { profile, ..SessionConfigure::default() };
    device.configure_session(session, Some(true)).await.expect("sent");

    // A force to the right is rendered, said back, and moves the hand that way.
    let right = Some(Force { x: 2.0, y: 0.0, z: 0.0 });
    let x_of = |state: &ServiceData| state.inverse3[0].state.cursor_position.expect("a position").x;
    let before = x_of(&first);
    let pushed = until(&mut device, "the push", right, |state| x_of(state) > before + 0.01).await;
    let state = &pushed.inverse3[0].state;
    assert_eq!(state.control_mode, Some(ControlMode::Force));
    let rendered = state.current_cursor_force.expect("a force");
    assert!((rendered.x - 2.0).abs() < 1e-6 && rendered.y == 0.0, "{rendered:?}");

    // Without the command it is gone, and the hand goes back.
    let id = pushed.inverse3[0].device_id.clone();
    device.clear_inverse3_commands(&id, Inverse3CommandClear::all()).await.expect("cleared");
    until(&mut device, "the way back", None, |state| {
        let arm = &state.inverse3[0].state;
        arm.control_mode == Some(ControlMode::Idle) && x_of(state) < before + 0.005
    })
    .await;
    device.shutdown().await.expect("an end");
}
