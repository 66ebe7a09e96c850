//! A bridge that couples by itself, against a real session, over a relay that delays by 20 ms each way and loses one datagram in
//! twenty: the force at the device is that of the device's own pose. The same with the force computed at the server is not.

use std::path::Path;
use std::time::{Duration, Instant};

use crate::support::{
    MachineWatch, PATIENCE, no_monitor, shipped_workbench, start_behind_relay, start_bridge,
};
use taut::session::setup::DeviceSource;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut_bridge::{BridgeReport, DeviceLimits, MAX_EDGE_DELAY};
use taut_link::{ClientOptions, Role, connect, create_key_file};
use taut_proto::state::RunState;
use taut_test_kit::BALL_ON_FLOOR;
use taut_test_kit::relay::{Direction, Impairment};

const STIFFNESS: f64 = 1000.0;
const RADIUS: f64 = 0.02;
/// The force starts this far above the floor: 1e-4 of the ball's size, m.
const REST_DISTANCE: f64 = 4e-6;

/// The hand presses for a second, slides, and goes on up and down.
const PATH: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.04,1,0,0,0\n0.8,0,0,0.012,1,0,0,0\n1.3,0.05,0,0.012,1,0,0,0\n1.6,0.05,0,0.016,1,0,0,0\n1.9,0.05,0,0.01,1,0,0,0\n2.2,0,0,0.016,1,0,0,0\n2.6,0,0,0.012,1,0,0,0\n3.5,0,0,0.012,1,0,0,0\n";
const DURATION_S: f64 = 3.5;
/// The force ramps in during this time after the server began to give force, of session time.
const RAMPED_IN: Duration = Duration::from_millis(900);

/// A force fades once its reading is 75 ms old. The way there and back takes 40, through some seven threads: where one of them waits for a core as long as this,
/// the machine may be why, and not the network.
const STALL: Duration = Duration::from_millis(5);
/// Runs until one without a safety event.
const ATTEMPTS: u32 = 4;

/// What was seen of one run.
struct Run {
    /// Force error against the closed form, N, and the closed form, for every state that came.
    errors: Vec<(f64, f64)>,
    /// The server has taken the force away in between.
    interrupted: bool,
    report: BridgeReport,
    lost_down: u64,
    /// The machine let its threads wait: [`MachineWatch::longest_wait`].
    waited: Duration,
}

fn run(coupling: &str) -> Run {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path
    };
    let (scene, path) = (file("scene.toml", BALL_ON_FLOOR), file("path.csv", PATH));
    let key_path = folder.path().join("key");
    let key = create_key_file(&key_path).expect("a key");

    let workbench = shipped_workbench(&["device={kind=\"remote\"}"]);
    let overrides = Overrides {
        scene: scene.to_str().map(str::to_owned),
        ..no_monitor()
    };
    let mut setup =
        session_setup(&workbench, key, &overrides).unwrap_or_else(|error| panic!("{error}"));
    // The server's watchdog would take 20 ms on the way for a loss, where it couples by itself.
    setup.device = DeviceSource::Remote {
        limits: DeviceLimits::UNLIMITED,
        max_age: MAX_EDGE_DELAY,
    };
    let impairment = Impairment {
        lost: 0.05,
        delay: Duration::from_millis(20),
        ..Impairment::default()
    };
    let (mut session, relay) = start_behind_relay(setup, impairment);

    let watch = MachineWatch::start();
    let server = session.quic_address().expect("listens").to_string();
    let duration = DURATION_S.to_string();
    // What is looked at is the force of the coupling alone.
    let more = ["--coupling", coupling, "--passivity", "observe"];
    let more = [&more[..], &["--duration", &duration]].concat();
    let bridge = start_bridge(&server, &key_path, &path, &more);
    let (errors, interrupted) = observe(&server, &key_path, || bridge.is_finished());
    let report = bridge
        .join()
        .expect("no panic")
        .unwrap_or_else(|error| panic!("{error}"));
    let waited = watch.longest_wait();
    let lost_down = relay.counts(Direction::Down).all_lost();
    session.follow_network();
    let (_, failure) = session.stop();
    assert!(failure.is_none());
    Run {
        errors,
        interrupted,
        waited,
        report,
        lost_down,
    }
}

/// Force and device pose as the server tells them, until the bridge has ended, and whether the server stopped giving force before. Over QUIC, past the
/// relay: what is seen is what the bridge sent.
fn observe(server: &str, key: &Path, ended: impl Fn() -> bool) -> (Vec<(f64, f64)>, bool) {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .expect("a runtime");
    let key = taut_link::read_key_file(key).expect("the key");
    let mut options = ClientOptions::new(server, key, Role::Observer, "watcher");
    options.transport = taut_link::Transport::QuicDatagram;
    let link = runtime.block_on(connect(options)).expect("joined");
    let begun = Instant::now();
    let (mut states, mut errors, mut first) = (Vec::new(), Vec::new(), None);
    let (mut running, mut interrupted, mut before) = (false, false, None);
    while !ended() {
        assert!(begun.elapsed() < PATIENCE, "the bridge does not end");
        std::thread::sleep(Duration::from_millis(5));
        states.clear();
        link.drain_states(&mut states);
        for received in &states {
            let state = &received.state;
            let Some(tool) = state.tools.first() else {
                continue;
            };
            let ran = std::mem::replace(&mut running, state.run == RunState::Running);
            if !running {
                continue;
            }
            // A server that stood still was silent towards the bridge, too.
            let last = before.replace(state.sample_time_ns);
            let since_last = last.map(|last| state.sample_time_ns.saturating_sub(last));
            let stood = since_last.is_some_and(|ns| Duration::from_nanos(ns) > MAX_EDGE_DELAY);
            if !ran || stood {
                interrupted |= first.take().is_some();
            }
            let since = *first.get_or_insert(state.sample_time_ns);
            let elapsed = Duration::from_nanos(state.sample_time_ns.saturating_sub(since));
            let ramped = elapsed > RAMPED_IN;
            let right =
                STIFFNESS * (RADIUS + REST_DISTANCE - f64::from(tool.device.position[2])).max(0.0);
            if ramped && elapsed.as_secs_f64() < DURATION_S - 0.1 {
                let felt = nalgebra::Vector3::from(tool.force.map(f64::from));
                errors.push(((felt - nalgebra::Vector3::z() * right).norm(), right));
            }
        }
    }
    (errors, interrupted)
}

/// The error below which a share of the states is, N.
fn quantile(run: &Run, share: f64) -> f64 {
    let mut errors: Vec<f64> = run.errors.iter().map(|(error, _)| *error).collect();
    errors.sort_unstable_by(f64::total_cmp);
    let place = (share * errors.len().saturating_sub(1) as f64) as usize;
    errors.get(place).copied().unwrap_or(f64::INFINITY)
}

/// Whether no watchdog of either end let the force fade, and the bridge had joined soon enough to be watched; else the machine must have paused a thread.
fn is_whole(run: &Run) -> bool {
    let whole = run.report.safety_events == 0 && !run.interrupted && run.errors.len() > 500;
    let waited = run.waited;
    assert!(whole || waited > STALL, "waited {waited:?}; {}", run.report);
    whole
}

#[test]
fn the_edge_keeps_the_force_right_over_20_ms_and_5_percent_loss_where_shipping_does_not() {
    let mut edge = run("edge");
    for attempt in 1..ATTEMPTS {
        if is_whole(&edge) {
            break;
        }
        println!("attempt {attempt}: threads waited for cores; once more");
        let again = run("edge");
        if is_whole(&again) || quantile(&again, 0.25) < quantile(&edge, 0.25) {
            edge = again;
        }
    }
    assert_eq!(edge.report.coupling, "edge");
    assert_eq!(edge.report.broken_sets, 0);
    // Where no run was whole, the watchdog let the force fade and come back in between, up to three times in a run: a quarter of the states is right all
    // the same. That all of them are is asserted under a virtual clock: `taut-control-tests`.
    let whole = is_whole(&edge);
    let share = if whole { 0.5 } else { 0.25 };
    assert!(edge.lost_down > 0, "{}", edge.report);
    // By the bridge's clock alone: how old a set is said to be is off by what the way there was slower than the way back while the clocks were compared.
    assert!(edge.report.set_age_us.is_some(), "{}", edge.report);
    assert!(edge.report.max_force_age_ms >= 40.0, "{}", edge.report);
    assert!(edge.errors.len() > 100, "{} states", edge.errors.len());
    assert!(edge.errors.iter().any(|(_, right)| *right > 2.0));
    println!(
        "edge: {} % below {:.4} N, 99 % below {:.4} N of up to 5 N; {} safety events; waited for cores {:?}",
        share * 100.0,
        quantile(&edge, share),
        quantile(&edge, 0.99),
        edge.report.safety_events,
        edge.waited,
    );
    assert!(quantile(&edge, share) < 1e-3, "{}", edge.report);
    assert!(
        !whole || quantile(&edge, 0.99) < 0.05,
        "{}",
        quantile(&edge, 0.99)
    );

    let shipped = run("server");
    assert_eq!(shipped.report.coupling, "server");
    assert!(shipped.report.wrenches > 0, "{}", shipped.report);
    let round_trip = shipped.report.round_trip_us.expect("forces came");
    assert!(round_trip.p50 >= 40_000, "{round_trip:?}");
    println!(
        "server: {:.2} N at most, {} safety events",
        shipped.report.max_force_n, shipped.report.safety_events
    );
    // What was computed from a reading of 40 ms ago is not felt: the wall is not there.
    assert!(edge.report.max_force_n > 3.0, "{}", edge.report);
    assert!(shipped.report.max_force_n < 0.5, "{}", shipped.report);
}
