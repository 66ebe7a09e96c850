//! The board's side: a report for each report, with an arm in a simulated hand; and the same on a socket.

use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nalgebra::Vector3;
use taut_plant::{Hand, MinJerkPath, Tremor};

use super::kinematics::WoodenModel;
use super::report::{BoardReport, HostReport};
use crate::devices::held_arm::{HeldArm, led_through};
use crate::own_thread::OwnThread;
use crate::realtime::monotonic_now;
use crate::simulated_place::make_room;

/// The firmware turns the motors off so long after the last report.
const MOTORS_OFF: Duration = Duration::from_millis(500);
/// How often a thread that waits looks for the end.
const LOOK: Duration = Duration::from_millis(20);

/// An arm on its board.
pub struct SimulatedWooden {
    model: WoodenModel,
    arm: HeldArm,
    /// What a host that set the counters added to them.
    offsets: [i16; 6],
    reports: u64,
    /// The hand waits where its path begins.
    waits: bool,
}

impl SimulatedWooden {
    /// The hand holds the arm at its home for a second, then goes 40 mm down from the middle of the workspace and up again, for ever; or along `path`,
    /// which has positions from that middle.
    #[must_use]
    pub fn new(
        model: WoodenModel,
        hand: Hand,
        path: Option<MinJerkPath>,
        tremor: Option<Tremor>,
    ) -> Self {
        let home = model.position(&model.home);
        let down = Vector3::new(0.0, 0.0, -0.04);
        let middle = Vector3::zeros();
        let points = [
            (0.0, home),
            (1.0, home),
            (2.5, middle),
            (4.0, down),
            (6.0, down),
            (7.0, middle),
        ];
        let path = path.unwrap_or_else(|| led_through(&points, false));
        Self {
            model,
            arm: HeldArm::new(crate::devices::polhem_grip(), hand, path, tremor),
            offsets: [0; 6],
            reports: 0,
            waits: false,
        }
    }

    /// The same whose hand waits where its path begins, until [`Self::go`].
    #[must_use]
    pub fn waiting(self) -> Self {
        Self {
            waits: true,
            ..self
        }
    }

    /// The hand sets off.
    pub fn go(&mut self) {
        self.waits = false;
    }

    /// The arm in the hand.
    #[must_use]
    pub fn held(&self) -> &HeldArm {
        &self.arm
    }

    /// Reports taken so far.
    #[must_use]
    pub fn reports(&self) -> u64 {
        self.reports
    }

    /// Takes a report of the host at `now`; the board's.
    pub fn take(&mut self, now: Duration, report: &[u8]) -> [u8; 14] {
        if self.waits {
            let _ = self.arm.due(now); // passes all the same
        } else {
            self.arm.advance(now, MOTORS_OFF);
        }
        self.reports += 1;
        let encoders = self.encoders();
        match HostReport::parse(report) {
            Some(HostReport::Currents(currents)) => {
                let force = self.model.force(&encoders, &currents).unwrap_or_default();
                self.arm.push(now, &force);
            }
            Some(HostReport::SetCounters(counters)) => {
                self.offsets = std::array::from_fn(|i| counters[i].wrapping_sub(encoders[i]));
            }
            None => {}
        }
        let counters = std::array::from_fn(|i| encoders[i].wrapping_add(self.offsets[i]));
        BoardReport {
            encoders: counters,
            ..BoardReport::default()
        }
        .bytes()
    }

    fn encoders(&self) -> [i16; 6] {
        let place = self.arm.plant.measured_pose().translation.vector;
        self.model.encoders(&place).unwrap_or(self.model.home)
    }
}

/// A simulated board on a socket, in place of hidraw. Dropping it is pulling the cable.
pub struct WoodenService {
    arm: Arc<Mutex<SimulatedWooden>>,
    path: PathBuf,
    _thread: OwnThread,
}

impl WoodenService {
    /// Answers at `path`; the socket of a board that is gone is replaced.
    ///
    /// # Errors
    /// Something else is there, or the socket or the thread cannot be had.
    pub fn start(arm: Arc<Mutex<SimulatedWooden>>, path: &Path) -> std::io::Result<Self> {
        make_room(path)?;
        let socket = UnixDatagram::bind(path)?;
        socket.set_read_timeout(Some(LOOK))?;
        let its = Arc::clone(&arm);
        let thread = OwnThread::start("wooden-board", move |end| {
            let mut report = [0; 64];
            while !end.load(Ordering::Relaxed) {
                let Ok((bytes, host)) = socket.recv_from(&mut report) else {
                    continue; // nothing for a moment
                };
                let answer = its
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .take(monotonic_now(), &report[..bytes]);
                if let Some(host) = host.as_pathname() {
                    let _ = socket.send_to(&answer, host); // a host that is gone hears nothing
                }
            }
        })?;
        Ok(Self {
            arm,
            path: path.to_owned(),
            _thread: thread,
        })
    }

    /// The arm.
    pub fn arm(&self) -> MutexGuard<'_, SimulatedWooden> {
        self.arm.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for WoodenService {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
