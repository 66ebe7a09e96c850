//! A 3Dconnexion SpaceMouse: six degrees of freedom in, no force out.
//!
//! A thread waits for reports and hands on what they add up to; the device loop moves the body by it
//! ([`RateControl`]). A device that is pulled out is a fault until it is back; the body stays where it is.

mod report;
mod source;

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nalgebra::Vector6;

pub use report::CapState;
use source::MAX_REPORT_BYTES;
pub use source::{HidPort, ReportPort, ReportSource, SourceError};

use super::rate_control::{CapSettings, RateControl};
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample};
use crate::own_thread::OwnThread;
use crate::placement::Placement;

/// How long one wait for a report lasts; the end of the program waits no longer.
const WAIT: Duration = Duration::from_millis(50);
/// Between two attempts to open the device.
const RETRY: Duration = Duration::from_millis(500);
/// A deflected cap reports its motion about every 16 ms; one that has not for this long is taken as let go.
const LET_GO_AFTER: Duration = Duration::from_millis(250);

/// What the reading thread hands to the device loop.
#[derive(Clone, Copy, Debug, Default)]
struct Newest {
    cap: CapState,
    is_open: bool,
    /// Counts reports of motion: a button or the battery says nothing of how far the cap is deflected.
    motions: u64,
}

/// The device. Dropping it ends its thread.
pub struct SpaceMouse {
    info: DeviceInfo,
    body: RateControl,
    newest: triple_buffer::Output<Newest>,
    /// Reports of motion seen, and when the last came, on the loop's clock.
    seen: (u64, Duration),
    was_open: bool,
    wrench: Vector6<f64>,
    _reader: OwnThread,
}

impl SpaceMouse {
    /// Opens the SpaceMouse behind `port`.
    ///
    /// # Errors
    /// [`SourceError`]: it is not there now. One that goes later is waited for.
    pub fn open(
        mut port: Box<dyn ReportPort>,
        settings: CapSettings,
        placement: Placement,
    ) -> Result<Self, SourceError> {
        let source = port.open()?;
        tracing::info!("reading {}", source.name());
        let info = DeviceInfo::without_force(source.name());
        let first = Newest {
            is_open: true,
            ..Newest::default()
        };
        let (output, newest) = triple_buffer::TripleBuffer::new(&first).split();
        let reader = OwnThread::start("taut-spacemouse", move |end| {
            read_reports(port, source, output, end);
        })
        .map_err(|error| SourceError::Gone(error.to_string()))?;
        Ok(Self {
            info,
            body: RateControl::new(settings, placement),
            newest,
            seen: (0, Duration::ZERO),
            was_open: true,
            wrench: Vector6::zeros(),
            _reader: reader,
        })
    }
}

impl Device for SpaceMouse {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn scale(&self) -> f64 {
        self.body.scale()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let newest = *self.newest.read();
        if newest.motions != self.seen.0 {
            self.seen = (newest.motions, now);
        }
        let silence = now.saturating_sub(self.seen.1);
        let held = newest.is_open && silence < LET_GO_AFTER;
        let deflection = if held {
            newest.cap.deflection()
        } else {
            Vector6::zeros()
        };
        self.body.step(now, &deflection, &self.wrench);
        let was_open = std::mem::replace(&mut self.was_open, newest.is_open);
        match (was_open, newest.is_open) {
            (_, false) => Err(DeviceFault::Lost { age: silence }),
            (false, true) => Err(DeviceFault::Reconnected),
            (true, true) => {
                let (pose, velocity) = self.body.state();
                Ok(DeviceSample {
                    time: now,
                    pose,
                    velocity,
                    buttons: newest.cap.buttons as u16,
                })
            }
        }
    }

    /// Nobody feels the wrench; the body yields to it.
    fn write(&mut self, _now: Duration, wrench: &Vector6<f64>) {
        self.wrench = *wrench;
    }
}

/// The thread: reports in, their sum out; opens the device again when it is gone.
fn read_reports(
    mut port: Box<dyn ReportPort>,
    first: Box<dyn ReportSource>,
    mut output: triple_buffer::Input<Newest>,
    end: &AtomicBool,
) {
    let mut newest = Newest {
        is_open: true,
        ..Newest::default()
    };
    let mut source = Some(first);
    let mut buffer = [0; MAX_REPORT_BYTES];
    while !end.load(Ordering::Relaxed) {
        let Some(open) = &mut source else {
            thread::sleep(RETRY);
            if let Ok(found) = port.open() {
                tracing::info!("{} is back", found.name());
                newest.is_open = true;
                output.write(newest);
                source = Some(found);
            }
            continue;
        };
        match open.read(&mut buffer, WAIT) {
            Ok(0) => {}
            Ok(bytes) => {
                // A report that is too short says nothing; the next one does.
                let report = &buffer[..bytes.min(MAX_REPORT_BYTES)];
                if let Some(is_motion) = newest.cap.take(report) {
                    newest.motions += u64::from(is_motion);
                    output.write(newest);
                }
            }
            Err(error) => {
                tracing::warn!("{error}");
                newest.cap = CapState::default();
                newest.is_open = false;
                output.write(newest);
                source = None;
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::device::Pose;
    use nalgebra::Point3;
    use std::os::unix::net::UnixDatagram;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::time::Instant;

    /// Sockets keep the borders of reports, as `/dev/hidraw*` does.
    struct Fake(UnixDatagram);
    struct FakePort(Receiver<UnixDatagram>);

    impl ReportPort for FakePort {
        fn open(&mut self) -> Result<Box<dyn ReportSource>, SourceError> {
            let socket = self.0.try_recv().map_err(|_| SourceError::NotFound)?;
            Ok(Box::new(Fake(socket)))
        }
    }

    impl ReportSource for Fake {
        fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, SourceError> {
            self.0.set_read_timeout(Some(timeout)).expect("a timeout");
            match self.0.recv(buffer) {
                // An empty datagram stands for a cable that is pulled.
                Ok(0) => Err(SourceError::Gone("end".to_owned())),
                Ok(bytes) => Ok(bytes),
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => Ok(0),
                Err(error) => Err(SourceError::Gone(error.to_string())),
            }
        }

        fn name(&self) -> &str {
            "fake"
        }
    }

    fn open(ports: Receiver<UnixDatagram>) -> Result<SpaceMouse, SourceError> {
        let placement = Placement::plain(Pose::translation(0.0, 0.0, 0.1), Point3::origin());
        SpaceMouse::open(Box::new(FakePort(ports)), CapSettings::default(), placement)
    }

    /// A mouse that is there: where later sockets come from, and the other end of the first.
    fn opened() -> (Sender<UnixDatagram>, UnixDatagram, SpaceMouse) {
        let (ports, receiver) = channel();
        let (device, host) = UnixDatagram::pair().expect("sockets");
        ports.send(host).expect("open");
        (ports, device, open(receiver).expect("it is there"))
    }

    /// Reads for so many milliseconds.
    fn pass(mouse: &mut SpaceMouse, now: &mut Duration, milliseconds: u32) {
        for _ in 0..milliseconds {
            *now += Duration::from_millis(1);
            let _ = mouse.read(*now);
        }
    }

    /// Reads at growing times of a virtual clock until `done`; only a hang takes a minute.
    fn read_until(
        mouse: &mut SpaceMouse,
        now: &mut Duration,
        done: impl Fn(&Result<DeviceSample, DeviceFault>) -> bool,
    ) -> Result<DeviceSample, DeviceFault> {
        let start = Instant::now();
        loop {
            *now += Duration::from_millis(1);
            let sample = mouse.read(*now);
            if done(&sample) {
                return sample;
            }
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "it never came: {sample:?}"
            );
            thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn reports_move_the_body_until_the_cap_is_let_go_or_the_cable_is_pulled() {
        let (ports, device, mut mouse) = opened();
        let mut now = Duration::ZERO;
        let first = mouse.read(now).expect("open");
        assert_eq!(first.pose, Pose::translation(0.0, 0.0, 0.1));

        // Full to the right, and button 2.
        device.send(b"\x03\x02\0").expect("sent");
        device.send(b"\x01\x5e\x01\0\0\0\0").expect("sent");
        let moving = read_until(&mut mouse, &mut now, |s| {
            s.as_ref().is_ok_and(|s| s.velocity[0] > 0.0)
        })
        .expect("a sample");
        assert!(moving.velocity[0] <= 0.1);
        assert_eq!(moving.buttons, 2);

        // Silence is a cap let go: the body stops, and no fault.
        pass(&mut mouse, &mut now, 1000);
        let still = mouse.read(now).expect("open");
        assert!(still.velocity.norm() < 1e-6);
        let moved = still.pose.translation.vector.x;
        assert!(
            (moved - 0.025).abs() < 5e-4,
            "a quarter of a second at 0.1 m/s: {moved}"
        );

        device.send(b"").expect("sent");
        let lost = read_until(&mut mouse, &mut now, Result::is_err);
        assert!(matches!(lost, Err(DeviceFault::Lost { .. })));
        let (_again, host) = UnixDatagram::pair().expect("sockets");
        ports.send(host).expect("open");
        let back = read_until(&mut mouse, &mut now, |s| {
            !matches!(s, Err(DeviceFault::Lost { .. }))
        });
        assert_eq!(back, Err(DeviceFault::Reconnected));
        let after = mouse.read(now).expect("open again");
        let drift = after.pose.translation.vector - still.pose.translation.vector;
        assert!(drift.norm() < 1e-6);
    }

    #[test]
    fn a_button_and_the_battery_revive_no_deflection() {
        let (_ports, device, mut mouse) = opened();
        let mut now = Duration::ZERO;
        device.send(b"\x01\x5e\x01\0\0\0\0").expect("sent");
        let _ = read_until(&mut mouse, &mut now, |s| {
            s.as_ref().is_ok_and(|s| s.velocity[0] > 0.0)
        });
        // The cap is let go, but the report that would say so is lost.
        pass(&mut mouse, &mut now, 1000);
        let still = mouse.read(now).expect("open").pose;

        device.send(b"\x17\x64").expect("sent");
        device.send(b"\x03\x01\0").expect("sent");
        let _ = read_until(&mut mouse, &mut now, |s| {
            s.as_ref().is_ok_and(|s| s.buttons == 1)
        });
        pass(&mut mouse, &mut now, 100);
        let after = mouse.read(now).expect("open").pose;
        let moved = after.translation.vector - still.translation.vector;
        assert!(moved.norm() < 1e-6, "{moved}");
    }

    #[test]
    fn a_device_that_is_not_there_is_said_at_once() {
        let (_ports, receiver) = channel();
        assert_eq!(open(receiver).err(), Some(SourceError::NotFound));
    }
}
