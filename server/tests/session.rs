//! A whole session in this process: what happens when a part of it breaks.

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use god_object::Vector6;
use taut::config::{Overrides, session_setup};
use taut::session::Session;
use taut::setup::{DeviceSource, SessionSetup};
use taut::terminal::Terminal;
use taut_bridge::{Device, DeviceFault, DeviceInfo, DeviceSample};
use taut_link::ClusterKey;
use taut_scene::{SHIPPED_WORKBENCH, Workbench};

/// Much longer than a session takes to notice; the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(20);

fn setup() -> SessionSetup {
    let free_ports = [
        "network.quic_port=0",
        "network.udp_port=0",
        "scene=\"sphere-on-plane\"",
    ];
    let workbench = match Workbench::parse_with_overrides(
        "workbench.toml",
        SHIPPED_WORKBENCH,
        Path::new(""),
        &free_ports,
    ) {
        Ok(workbench) => workbench,
        Err(error) => panic!("{error}"),
    };
    let Ok(key) = ClusterKey::generate() else {
        panic!("no random numbers");
    };
    match session_setup(
        &workbench,
        key,
        &Overrides {
            no_monitor: true,
            ..Overrides::default()
        },
    ) {
        Ok(setup) => setup,
        Err(error) => panic!("{error}"),
    }
}

/// A driver with a bug.
struct Buggy {
    inner: Box<dyn Device>,
    breaks_at: Duration,
    written: Arc<Mutex<Option<Vector6>>>,
}

impl Device for Buggy {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        assert!(
            now < self.breaks_at,
            "the driver breaks, as this test wants"
        );
        self.inner.read(now)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6) {
        if let Ok(mut written) = self.written.lock() {
            *written = Some(*wrench);
        }
        self.inner.write(now, wrench);
    }
}

#[test]
fn a_loop_that_breaks_ends_the_session_without_force_and_says_why() {
    let mut setup = setup();
    let written = Arc::new(Mutex::new(None));
    let DeviceSource::Local(inner) = setup.device else {
        panic!("the shipped workbench has a simulated device");
    };
    setup.device = DeviceSource::Local(Box::new(Buggy {
        inner,
        breaks_at: Duration::from_millis(700),
        written: Arc::clone(&written),
    }));
    let Ok(session) = Session::start(setup) else {
        panic!("the session does not start");
    };
    let begun = Instant::now();
    while !session.is_ending() && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(10));
    }
    assert!(session.is_ending(), "nobody noticed");
    let (report, failure) = session.stop(&Terminal::standard_error());
    let Some(failure) = failure else {
        panic!("the failure was not told");
    };
    assert!(failure.to_string().contains("haptics"), "{failure}");
    assert_eq!(failure.exit_code(), taut::failure::EXIT_FAILED);
    assert!(report.haptics_period_us.count > 10);
    assert_eq!(
        written.lock().ok().and_then(|wrench| *wrench),
        Some(Vector6::zeros())
    );
}

#[test]
fn a_session_that_is_dropped_gives_its_ports_back() {
    let Ok(session) = Session::start(setup()) else {
        panic!("the session does not start");
    };
    let (Some(quic), Some(udp)) = (session.quic_address(), session.udp_address()) else {
        panic!("no addresses");
    };
    assert!(
        std::net::UdpSocket::bind(quic).is_err(),
        "the port is in use meanwhile"
    );
    drop(session);
    for address in [quic, udp] {
        assert!(
            std::net::UdpSocket::bind(address).is_ok(),
            "{address} is still in use"
        );
    }
}
