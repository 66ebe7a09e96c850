//! Age: forces computed from what is old.
//!
//! A congested link is enough, no key is needed: the relay lets each datagram wait a little longer than the one before, both ways. Nothing is lost,
//! nothing falls silent, and each datagram that arrives is genuine and new.

use std::path::Path;
use std::time::{Duration, Instant};

use taut::session::Session;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut_bridge::{BridgeArgs, BridgeReport, CouplingChoice, HandPreset};
use taut_scene::{SHIPPED_WORKBENCH, Workbench};
use taut_test_kit::BALL_ON_FLOOR;

use super::{Attack, Finding};
use crate::bench::BenchError;
use crate::relay::{Growth, Impairment, Treatment, Waiting};

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "growing-delay-shipped",
        tried: "a delay that grows to 2 s each way while the server computes the force",
        promised: PROMISE,
        run: |_| growing_delay(CouplingChoice::Server),
    },
    Attack {
        name: "growing-delay-edge",
        tried: "a delay that grows to 2 s each way while the bridge computes the force",
        promised: PROMISE,
        run: |_| growing_delay(CouplingChoice::Edge),
    },
    Attack {
        name: "growing-delay-down-edge",
        tried: "a delay on the way down alone that grows by 0.1 s each second while the bridge computes the force",
        promised: PROMISE,
        run: |_| growing_delay_down(),
    },
];

const PROMISE: &str = "at most 20 mJ more for the hand than without delay; no force from readings of 120 ms ago; an event";
/// J.
const MORE_ENERGY: f64 = 0.02;
/// A force that there is something of to be attacked, N.
const FELT: f64 = 0.5;
/// Longest wait for one.
const PATIENCE: Duration = Duration::from_secs(60);
const ZERO_AFTER: Duration = Duration::from_millis(120);

/// The hand taps and rubs, twice in three seconds.
const PATH: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.03,1,0,0,0\n0.4,0,0,0.012,1,0,0,0\n0.8,0.04,0,0.01,1,0,0,0\n1.1,0.04,0,0.022,1,0,0,0\n1.5,0,0,0.03,1,0,0,0\n";
/// Of each run, s.
const DURATION: f64 = 6.0;

/// 0.5 s per second at 1 kHz, from two seconds after the join on: the force has ramped in then.
const GROWTH: Growth = Growth {
    from: 2000,
    step: Duration::from_micros(500),
    most: Duration::from_secs(2),
};

fn growing_delay(coupling: CouplingChoice) -> Result<Finding, BenchError> {
    let slower = Impairment {
        growth: Some(GROWTH),
        ..Impairment::default()
    };
    compare(coupling, Treatment::both_ways(slower))
}

fn growing_delay_down() -> Result<Finding, BenchError> {
    let growth = Growth {
        step: Duration::from_micros(100),
        ..GROWTH
    };
    let treatment = Treatment {
        up: Impairment::default(),
        down: Impairment {
            growth: Some(growth),
            ..Impairment::default()
        },
    };
    compare(CouplingChoice::Edge, treatment)
}

/// What the hand is given behind this network, and without it.
fn compare(coupling: CouplingChoice, treatment: Treatment) -> Result<Finding, BenchError> {
    let usual = run(coupling, Treatment::both_ways(Impairment::default()))?;
    let begun = Instant::now();
    loop {
        let attacked = run(coupling, treatment.clone())?;
        let finding = judged(&usual, &attacked);
        // On a machine that pauses the bridge again and again there is no force that could be attacked; what is promised holds all the same.
        let is_attack = attacked.max_force_n > FELT;
        if is_attack || !finding.kept || begun.elapsed() > PATIENCE {
            let told = is_attack && attacked.safety_events > 0;
            return Ok(Finding {
                kept: finding.kept && told,
                ..finding
            });
        }
    }
}

fn judged(usual: &BridgeReport, attacked: &BridgeReport) -> Finding {
    let given = [usual, attacked].map(|report| report.energy_injected_j);
    // The loop of a machine that pauses it notices an age that much later.
    let late = attacked.period_us.map_or(0, |period| period.max);
    let allowed = ZERO_AFTER + Duration::from_micros(late);
    let oldest = attacked.max_force_age_ms;
    Finding {
        happened: format!(
            "{:.2} mJ given ({:.2} without delay), {:.1} N at most; oldest reading felt {oldest:.0} ms ({:.1} ms the longest period), {} events",
            given[1] * 1e3,
            given[0] * 1e3,
            attacked.max_force_n,
            late as f64 * 1e-3,
            attacked.safety_events,
        ),
        kept: given[1] <= given[0] + MORE_ENERGY && oldest <= allowed.as_secs_f64() * 1e3,
    }
}

/// A session with a remote device, and a bridge to it whose datagrams are treated like this.
fn run(coupling: CouplingChoice, treatment: Treatment) -> Result<BridgeReport, BenchError> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).map(|()| path)
    };
    let (scene, path) = (file("scene.toml", BALL_ON_FLOOR)?, file("path.csv", PATH)?);
    let key_path = folder.path().join("key");
    let key = taut_link::create_key_file(&key_path).map_err(BenchError::missing)?;
    let wanted = [
        "network.quic_port=0",
        "network.udp_port=0",
        "device={kind=\"remote\"}",
    ];
    let workbench = Workbench::parse_with_overrides(
        "workbench.toml",
        SHIPPED_WORKBENCH,
        Path::new(""),
        &wanted,
    )
    .map_err(BenchError::missing)?;
    let overrides = Overrides {
        scene: scene.to_str().map(str::to_owned),
        no_monitor: true,
        ..Overrides::default()
    };
    let mut setup = session_setup(&workbench, key, &overrides).map_err(BenchError::missing)?;
    let waiting = Waiting::bind()?;
    setup.link.announced_udp_port = Some(waiting.address().port());
    let mut session = Session::start(setup).map_err(BenchError::missing)?;
    let (Some(quic), Some(udp)) = (session.quic_address(), session.udp_address()) else {
        return Err(BenchError::missing("the session does not listen"));
    };
    let relay = waiting.start(udp, vec![treatment], 3)?;

    let Some(mut args) = BridgeArgs::joining(&quic.to_string(), "hand") else {
        return Err(BenchError::missing("the bridge takes no arguments"));
    };
    args.key = Some(key_path);
    args.path = Some(path);
    args.looping = true;
    args.hand = HandPreset::Light;
    args.duration = Some(DURATION);
    args.coupling = Some(coupling);
    args.priority = 0;
    let report = taut_bridge::run(&args).map_err(BenchError::missing);
    drop(relay);
    session.follow_network();
    let (_, failure) = session.stop();
    match failure {
        Some(failure) => Err(BenchError::missing(failure)),
        None => report,
    }
}
