//! Input devices neither allocate when they are read nor when they are written to, whatever comes.

use std::time::Duration;

use assert_no_alloc::assert_no_alloc;
use nalgebra::{Point3, Vector3, Vector6};
use taut_bridge::{
    Anchor, CapSettings, Device, LedDevice, Placement, Pose, ReportPort, ReportSource, SourceError,
    SpaceMouse, Target, TrackerReader, TrackerState, VrpnDevice, VrpnMode, VrpnSettings,
    VrpnSource,
};
use taut_vrpn::{PoseReport, SensorMapping};

fn placement() -> Placement {
    Placement::plain(
        Pose::translation(0.0, 0.0, 0.1),
        Point3::new(0.0, 0.0, 0.01),
    )
}

/// Three seconds at 1 kHz; how many reads were samples.
fn run(device: &mut dyn Device) -> u32 {
    let mut samples = 0;
    assert_no_alloc(|| {
        for tick in 0..3000 {
            let now = Duration::from_millis(tick);
            samples += u32::from(device.read(now).is_ok());
            device.write(now, &Vector6::repeat(f64::from(samples) * 1e-3));
        }
    });
    samples
}

/// A report every 10 ticks, one in ten of a sensor that is lost, and silence in the last second.
struct Reader(u64);

impl TrackerReader for Reader {
    fn newest(&mut self) -> TrackerState {
        self.0 += 1;
        let reports = self.0.min(2000) / 10;
        let is_seen = reports % 10 != 5;
        TrackerState {
            reports,
            pose: Some(PoseReport {
                sensor: 0,
                position: [reports as f64 * 1e-3, 0.0, 0.0],
                rotation: [0.0, 0.0, 0.0, if is_seen { 1.0 } else { 0.0 }],
            }),
            buttons: 1,
            is_connected: true,
        }
    }
}

#[test]
fn a_tracker_allocates_nothing() {
    for anchor in [Anchor::Start, Anchor::Workbench] {
        let settings = VrpnSettings {
            source: VrpnSource {
                address: "T@h".parse().expect("valid"),
                sensor: 0,
                mode: VrpnMode::Tcp,
            },
            mapping: SensorMapping::identity(),
            anchor,
            max_age: VrpnSettings::DEFAULT_MAX_AGE,
        };
        let mut device = VrpnDevice::new(Box::new(Reader(0)), &settings, placement());
        let samples = run(&mut device);
        assert!((1500..2200).contains(&samples), "{samples}");
    }
}

#[test]
fn a_led_body_allocates_nothing() {
    let pose = Pose::new(Vector3::x(), Vector3::z());
    let first = Target { pose, buttons: 0 };
    let (_targets, output) = triple_buffer::TripleBuffer::new(&first).split();
    let mut device = LedDevice::new("mouse", output, placement());
    assert_eq!(run(&mut device), 3000);
}

struct Port;
struct Pushed;

impl ReportPort for Port {
    fn open(&mut self) -> Result<Box<dyn ReportSource>, SourceError> {
        Ok(Box::new(Pushed))
    }
}

impl ReportSource for Pushed {
    fn read(&mut self, buffer: &mut [u8], _timeout: Duration) -> Result<usize, SourceError> {
        std::thread::sleep(Duration::from_millis(1));
        let report = [1, 0x5e, 1, 0, 0, 0, 0];
        buffer[..report.len()].copy_from_slice(&report);
        Ok(report.len())
    }

    fn name(&self) -> &str {
        "pushed to the right"
    }
}

#[test]
fn a_space_mouse_allocates_nothing() {
    let mut device =
        SpaceMouse::open(Box::new(Port), CapSettings::default(), placement()).expect("open");
    assert_eq!(run(&mut device), 3000);
}
