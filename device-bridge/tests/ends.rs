//! Every end of a bridge's process that the system lets it see leaves no force on the device: signals, a loop that breaks down, and all of it with a
//! terminal that takes nothing.
//!
//! The bridge is a process of its own (this program again, in [`is_the_bridge`]) with a device that sends everything written to it to the test.
#![cfg(unix)]

use std::io::{PipeReader, PipeWriter, Read, Write, pipe};
use std::net::UdpSocket;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::support::{PATIENCE, Workbench};
use nalgebra::{Point3, Vector6};
use taut_bridge::signals::EndFlag;
use taut_bridge::{
    BridgeArgs, Device, DeviceFault, DeviceInfo, DeviceSample, Grip, Hand, MinJerkPath, Pose,
    SimulatedDevice, ViaPoint, run_device,
};

/// What the process is told by.
const SERVER: &str = "TAUT_TEST_SERVER";
const KEY: &str = "TAUT_TEST_KEY";
const RECORD: &str = "TAUT_TEST_RECORD";
const BREAKS: &str = "TAUT_TEST_BREAKS";
/// A force that the hand would notice, N: it comes to 5 N.
const FELT: f64 = 2.0;
/// Fastest change of a force that goes away, N/s, and the most that one write may change, N.
const SLEW: (f64, f64) = (500.0, 1.0);
/// Most processor time between two writes, s: some ten times what a panic takes whose backtrace another thread reads.
const MOST_WORK: f64 = 0.02;

/// A simulated device in a firm hand that presses on the wall; everything written goes to a socket.
struct Recorded {
    inner: SimulatedDevice,
    to: UdpSocket,
    force: f64,
    /// The driver breaks down at a force.
    breaks: bool,
}

impl Device for Recorded {
    fn info(&self) -> &DeviceInfo {
        self.inner.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        assert!(
            !(self.breaks && self.force > FELT),
            "the driver breaks, as the test wants"
        );
        self.inner.read(now)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        self.force = wrench.fixed_rows::<3>(0).norm();
        let words = [
            now.as_secs_f64(),
            self.force,
            wrench.norm(),
            own_processor_time(),
        ];
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let _ = self.to.send(&bytes);
        self.inner.write(now, wrench);
    }
}

/// Processor time of this thread, s: what a busy machine does not add to. Zero where the system does not say.
fn own_processor_time() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(0.0, |nanoseconds| nanoseconds * 1e-9)
}

#[test]
#[ignore = "the process that the other tests start"]
fn is_the_bridge() {
    let (Ok(server), Ok(record)) = (std::env::var(SERVER), std::env::var(RECORD)) else {
        return;
    };
    taut_log::start("info");
    let mut args = BridgeArgs::joining(&server, "bridge").expect("an address");
    args.key = std::env::var_os(KEY).map(Into::into);
    args.priority = 0;
    let to = UdpSocket::bind("127.0.0.1:0").expect("a socket");
    to.connect(record).expect("an address");
    let stop = Arc::default();
    let _signals = EndFlag::listen_into(Arc::clone(&stop)).expect("handlers");
    let ended = run_device(&args, stop, |placement| {
        let via = |time_s, z| ViaPoint {
            time_s,
            pose: Pose::translation(0.0, 0.0, z),
        };
        let z = placement.start.translation.z;
        let path = MinJerkPath::new(vec![via(0.0, z), via(0.7, -0.02)], false).expect("a path");
        Box::new(Recorded {
            inner: SimulatedDevice::new(Grip::workbench(), Hand::FIRM, path, Point3::origin()),
            to,
            force: 0.0,
            breaks: std::env::var_os(BREAKS).is_some(),
        })
    });
    taut_log::say(&format!("the bridge ended: {:?}", ended.map(|_| ())));
    taut_log::flush();
}

/// A bridge in a process of its own, pressing on the wall of a server.
struct Pressing {
    workbench: Option<Workbench>,
    bridge: Child,
    record: UdpSocket,
    /// Time and force of every write so far, the norm of the whole wrench, and the loop's processor time.
    written: Vec<[f64; 4]>,
}

impl Pressing {
    fn start(output: Option<&PipeWriter>, breaks: bool) -> Self {
        let workbench = Workbench::start();
        let record = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        record
            .set_read_timeout(Some(Duration::from_millis(20)))
            .expect("a timeout");
        let args = workbench.args(&[]);
        // Whoever runs the tests may ignore SIGHUP (nohup), and children inherit that.
        let mut command = Command::new("env");
        command.arg("--default-signal=HUP");
        command.arg(std::env::current_exe().expect("this program"));
        command
            .args(["--exact", "ends::is_the_bridge", "--ignored", "--nocapture"])
            .env(SERVER, &args.server)
            .env(KEY, args.key.as_ref().expect("given"))
            .env(RECORD, record.local_addr().expect("bound").to_string())
            .stdin(Stdio::null());
        if breaks {
            command.env(BREAKS, "1").env("RUST_BACKTRACE", "1");
        }
        if let Some(output) = output {
            let end = || Stdio::from(output.try_clone().expect("a handle"));
            command.stdout(end()).stderr(end());
        } else {
            command.stdout(Stdio::null()).stderr(Stdio::null());
        }
        Self {
            workbench: Some(workbench),
            bridge: command.spawn().expect("this program starts"),
            record,
            written: Vec::new(),
        }
    }

    /// Takes what was written until `is_enough`.
    fn follow(&mut self, what: &str, is_enough: impl Fn(&[[f64; 4]]) -> bool) {
        let begun = Instant::now();
        let mut bytes = [0; 32];
        while !is_enough(&self.written) {
            assert!(
                begun.elapsed() < PATIENCE,
                "{what}: {:?}",
                self.written.last()
            );
            if self
                .record
                .recv(&mut bytes)
                .is_ok_and(|length| length == 32)
            {
                let word = |at: usize| {
                    bytes[8 * at..8 * (at + 1)]
                        .try_into()
                        .map(f64::from_le_bytes)
                };
                self.written
                    .push([0, 1, 2, 3].map(|at| word(at).expect("eight bytes")));
            }
        }
    }

    fn until_felt(&mut self) {
        self.follow("no force comes", |written| {
            written.last().is_some_and(|[_, force, ..]| *force > FELT)
        });
    }

    fn signal(&self, signal: &str) {
        let id = self.bridge.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status();
        assert!(sent.is_ok_and(|status| status.success()));
    }

    /// The force goes away, by the slew limit, and stays away until the process has ended.
    fn leaves_nothing(mut self, what: &str, mut before_its_end: impl FnMut()) {
        let felt = self.written.len() - 1;
        self.follow(what, |written| {
            written
                .last()
                .is_some_and(|[_, _, wrench, _]| *wrench == 0.0)
        });
        let last = self.written[self.written.len() - 1][0];
        before_its_end();
        let begun = Instant::now();
        while self.bridge.try_wait().expect("a child").is_none() {
            assert!(begun.elapsed() < PATIENCE, "{what}: the process goes on");
            std::thread::sleep(Duration::from_millis(10));
        }
        let mut bytes = [0; 32];
        while self.record.recv(&mut bytes).is_ok() {
            let wrench = bytes[16..24].try_into().map(f64::from_le_bytes);
            assert!(
                wrench.is_ok_and(|wrench| wrench == 0.0),
                "{what}: a force after the end"
            );
        }
        for pair in self.written[felt..].windows(2) {
            let [time, force, ..] = pair[1];
            let allowed = (SLEW.0 * (time - pair[0][0])).min(SLEW.1);
            // Before the end is noticed, ordinary contact goes on.
            let falls = pair[0][1] - force;
            assert!(falls <= allowed + 2.0, "{what}: {falls} N at once");
        }
        println!(
            "{what}: {:.1} N were gone {:.0} ms after the last full force",
            self.written[felt][1],
            (last - self.written[felt][0]) * 1e3
        );
        let worked = self.written[felt..]
            .windows(2)
            .map(|pair| pair[1][3] - pair[0][3])
            .fold(0.0, f64::max);
        println!(
            "{what}: at most {:.1} ms of work between two writes",
            worked * 1e3
        );
        assert!(
            worked < MOST_WORK,
            "{what}: {worked} s of work before the force falls"
        );
        if let Some(workbench) = self.workbench.take() {
            workbench.finish();
        }
    }
}

impl Drop for Pressing {
    fn drop(&mut self) {
        let _ = self.bridge.kill(); // it has ended, unless the test failed
        let _ = self.bridge.wait();
    }
}

/// What takes nothing: a pipe that is full and that nobody reads.
struct Stopped {
    reader: Option<PipeReader>,
    writer: PipeWriter,
    goes_on: Arc<AtomicBool>,
}

impl Stopped {
    fn new() -> Self {
        let (reader, writer) = pipe().expect("a pipe");
        Self {
            reader: Some(reader),
            writer,
            goes_on: Arc::default(),
        }
    }

    /// Fills it, from a thread that waits in it from then on as everybody does who writes.
    fn stop(&self) {
        let mut writer = self.writer.try_clone().expect("a handle");
        let (is_full, filling) = std::sync::mpsc::channel();
        let goes_on = Arc::clone(&self.goes_on);
        let filler = std::thread::Builder::new().spawn(move || {
            while !goes_on.load(Ordering::Relaxed) && writer.write_all(&[b'\n'; 512]).is_ok() {
                let _ = is_full.send(());
            }
        });
        assert!(filler.is_ok());
        while filling.recv_timeout(Duration::from_millis(300)).is_ok() {}
    }

    /// Somebody reads again, until the last writer is gone; nobody fills it any more.
    fn go_on(&mut self) {
        self.goes_on.store(true, Ordering::Relaxed);
        let mut reader = self.reader.take().expect("stopped");
        let _ = std::thread::Builder::new().spawn(move || {
            let mut bytes = [0; 4096];
            while reader.read(&mut bytes).is_ok_and(|length| length > 0) {}
        });
    }
}

#[test]
fn every_signal_that_ends_a_bridge_leaves_no_force() {
    for signal in ["-TERM", "-INT", "-HUP", "-QUIT"] {
        let mut pressing = Pressing::start(None, false);
        pressing.until_felt();
        pressing.signal(signal);
        pressing.leaves_nothing(signal, || {});
    }
}

#[test]
fn a_driver_that_breaks_down_leaves_no_force() {
    let mut pressing = Pressing::start(None, true);
    pressing.until_felt();
    pressing.leaves_nothing("a panic in the device loop", || {});
}

#[test]
fn a_terminal_that_takes_nothing_keeps_no_force() {
    for breaks in [false, true] {
        let mut terminal = Stopped::new();
        let mut pressing = Pressing::start(Some(&terminal.writer), breaks);
        // Before the force comes, but after this program's harness has said what it runs.
        pressing.follow("nothing is written", |written| !written.is_empty());
        terminal.stop();
        pressing.until_felt();
        let what = if breaks {
            "a panic, terminal stopped"
        } else {
            pressing.signal("-TERM");
            "SIGTERM, terminal stopped"
        };
        // The harness of tests has something to say at the end.
        pressing.leaves_nothing(what, || terminal.go_on());
    }
}
