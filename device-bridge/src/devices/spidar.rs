//! A string-driven device (SPIDAR-G): counts in, pose out; wrench in, tensions out.
//!
//! | frame | meaning                                                        |
//! |-------|----------------------------------------------------------------|
//! | world | the scene's                                                    |
//! | frame | the device's, at the middle of its motors                      |
//! | grip  | the grip's, at the middle of its holes; equal to frame at rest |
//! | body  | the held body's own                                            |
//!
//! The model is `taut-spidar`; the electronics are a [`StringHardware`]: UART motor boards ([`crate::spidar_uart`]), or simulated ones
//! ([`HeldStrings`] has a hand). A laboratory with other electronics writes two functions, counts in and tensions out.
//!
//! [`HeldStrings`]: crate::HeldStrings

use std::time::Duration;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3, Vector6};
use taut_plant::stack;
use taut_spidar::{
    Encoders, ForwardKinematics, Geometry, LengthRates, MotorState, PoseAnswer, Reading,
    ResidualMonitor, STRINGS, StringFault, StringHardware, StringMatrix, TensionAnswer,
    TensionSettings, TensionSolver, capability,
};

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Felt, Pose};

/// Rate of the published controllers, Hz.
const RATE_HZ: f64 = 1000.0;
/// Delay of the force for the stated stiffness limits: one tick.
const DELAY_S: f64 = 1.0 / RATE_HZ;
/// A string counts as slack below this share of its least tension, where tensions are measured.
const SLACK_SHARE: f64 = 0.2;
/// Slack or inconsistent lengths are a fault only if they last so many samples: a jerk slackens a string for a moment.
const FAULT_SAMPLES: u32 = 20;

/// Where the device stands and what its grip holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpidarPlacement {
    /// The device's frame in the world.
    pub world_from_frame: Pose,
    /// The held body's own frame in the grip.
    pub grip_from_body: Pose,
    /// G, the body's reference point, in its own frame.
    pub reference_point: Point3<f64>,
}

impl Default for SpidarPlacement {
    /// All frames in one.
    fn default() -> Self {
        Self {
            world_from_frame: Pose::identity(),
            grip_from_body: Pose::identity(),
            reference_point: Point3::origin(),
        }
    }
}

impl SpidarPlacement {
    /// The frame stands with its centre at `centre` and its axes turned by `turned`, both in the world. With the grip at the centre, not
    /// turned, the body is turned by `body` in the world and its G is at the centre.
    #[must_use]
    pub fn around(
        centre: Point3<f64>,
        turned: UnitQuaternion<f64>,
        body: UnitQuaternion<f64>,
        reference_point: Point3<f64>,
    ) -> Self {
        let world_from_frame = Isometry3::from_parts(centre.into(), turned);
        let lever = body * reference_point.coords;
        let at_rest = Isometry3::from_parts((centre.coords - lever).into(), body);
        Self {
            world_from_frame,
            grip_from_body: world_from_frame.inverse() * at_rest,
            reference_point,
        }
    }

    /// Where the grip is in the frame when the body is at `world_from_body`.
    #[must_use]
    pub fn frame_from_grip(&self, world_from_body: &Pose) -> Pose {
        self.world_from_frame.inverse() * world_from_body * self.grip_from_body.inverse()
    }
}

/// A [`Device`] made of strings.
#[derive(Debug)]
pub struct SpidarDevice<H> {
    info: DeviceInfo,
    hardware: H,
    geometry: Geometry,
    placement: SpidarPlacement,
    encoders: Encoders,
    kinematics: ForwardKinematics,
    monitor: ResidualMonitor,
    rates: LengthRates,
    solver: TensionSolver,
    strings: StringMatrix,
    world_from_body: Pose,
    /// The last counts that gave a pose, and that pose: the same counts are the same pose to the bit, so that a device whose counters
    /// stopped can be told from one that moves.
    answered: Option<([i32; STRINGS], PoseAnswer)>,
    /// The sample of the newest reading: electronics that are read more slowly give one twice.
    newest: Option<DeviceSample>,
    tensions: Option<TensionAnswer>,
    /// Samples in a row with a slack string or inconsistent lengths.
    suspicious: u32,
    fault: Option<StringFault>,
    /// Thread CPU time, where somebody measures.
    clock: Option<fn() -> Duration>,
    /// CPU time of the last read, and of it with the last write.
    spent: (Duration, Duration),
}

impl<H: StringHardware> SpidarDevice<H> {
    /// A device whose grip is held at the centre of the frame, not turned, while this is called: its counters are
    /// calibrated there.
    ///
    /// # Errors
    /// [`StringFault::Hardware`] if the electronics do not answer.
    pub fn calibrated_at_centre(
        geometry: Geometry,
        mut hardware: H,
        placement: SpidarPlacement,
        now: Duration,
    ) -> Result<Self, StringFault> {
        let reading = hardware.read_counts(now)?;
        let encoders = Encoders::calibrated(&geometry, &Pose::identity(), &reading.counts);
        Ok(Self::calibrated(geometry, hardware, placement, encoders))
    }

    /// A device whose calibration is known.
    #[must_use]
    pub fn calibrated(
        geometry: Geometry,
        hardware: H,
        placement: SpidarPlacement,
        encoders: Encoders,
    ) -> Self {
        let centre = Pose::identity();
        let solver = TensionSolver::new(&geometry, TensionSettings::default());
        Self {
            info: info(&geometry),
            hardware,
            placement,
            encoders,
            kinematics: ForwardKinematics::new(&geometry),
            monitor: ResidualMonitor::new(),
            rates: LengthRates::new(&geometry.metres_per_count),
            solver,
            strings: StringMatrix::at(&geometry, &centre),
            world_from_body: placement.world_from_frame * placement.grip_from_body,
            geometry,
            answered: None,
            newest: None,
            tensions: None,
            suspicious: 0,
            fault: None,
            clock: None,
            spent: (Duration::ZERO, Duration::ZERO),
        }
    }

    /// Measures the CPU time of pose and tensions by `clock`, the calling thread's: [`Device::computing_time`].
    #[must_use]
    pub fn with_clock(mut self, clock: fn() -> Duration) -> Self {
        self.clock = Some(clock);
        self
    }

    /// Says what a motor does. The string of one that does not work is left out of the pose.
    pub fn set_motor(&mut self, string: usize, state: MotorState) {
        (self.answered, self.newest) = (None, None);
        self.solver.set_motor(string, state);
        self.kinematics
            .use_string(string, state == MotorState::Working);
    }

    /// The tensions of the last write, with what they render: N, N m about the grip's centre, axes of the device's frame.
    #[must_use]
    pub fn tensions(&self) -> Option<&TensionAnswer> {
        self.tensions.as_ref()
    }

    /// What was wrong at the last sample, if anything was.
    #[must_use]
    pub fn fault(&self) -> Option<StringFault> {
        self.fault
    }

    /// CPU time of the pose of the last read and of the tensions of the last write; zero without [`Self::with_clock`].
    #[must_use]
    pub fn computing_times(&self) -> (Duration, Duration) {
        (self.spent.0, self.spent.1.saturating_sub(self.spent.0))
    }

    /// The electronics.
    pub fn hardware_mut(&mut self) -> &mut H {
        &mut self.hardware
    }

    /// Time on the clock, if there is one.
    fn clocked(&self) -> Duration {
        self.clock.map_or(Duration::ZERO, |clock| clock())
    }

    fn sample(&mut self, reading: &Reading) -> Result<DeviceSample, StringFault> {
        if let Some(newest) = self.newest.filter(|newest| newest.time == reading.time) {
            return Ok(newest);
        }
        let lengths = self.encoders.lengths(&reading.counts);
        let rates = self.rates.step(reading.time, &lengths);
        let answer = match self.answered {
            Some((counts, answer)) if counts == reading.counts => answer,
            _ => self.kinematics.solve(&lengths)?,
        };
        self.answered = Some((reading.counts, answer));
        self.watch(reading, &answer)?;
        self.strings = answer.strings;

        let world_from_grip = self.placement.world_from_frame * answer.frame_from_grip;
        self.world_from_body = world_from_grip * self.placement.grip_from_body;
        let lever = self.lever();
        let (v, omega) = halves(&answer.twist(&rates));
        let turn = self.placement.world_from_frame.rotation;
        let (v, omega) = (turn * v, turn * omega);
        let sample = DeviceSample {
            time: reading.time,
            pose: self.world_from_body,
            velocity: stack(&(v + omega.cross(&lever)), &omega),
            buttons: reading.buttons,
        };
        self.newest = Some(sample);
        Ok(sample)
    }

    /// Slack strings and lengths that disagree become a fault when they last.
    fn watch(&mut self, reading: &Reading, answer: &PoseAnswer) -> Result<(), StringFault> {
        let consistency = self.monitor.step(answer);
        let slack_below = SLACK_SHARE * self.geometry.tension_min;
        let slack = reading.tensions.and_then(|tensions| {
            let used = self.kinematics.used();
            (0..STRINGS)
                .find(|i| used[*i] && tensions[*i] < slack_below)
                .map(|string| StringFault::Slack {
                    string,
                    tension: tensions[string],
                })
        });
        let inconsistent = consistency.alarm.then(|| StringFault::Inconsistent {
            disagreement: consistency.disagreement,
            suspect: consistency.culprit(),
        });
        let Some(found) = slack.or(inconsistent) else {
            self.suspicious = 0;
            return Ok(());
        };
        self.suspicious = self.suspicious.saturating_add(1);
        if self.suspicious >= FAULT_SAMPLES {
            return Err(found);
        }
        Ok(())
    }

    /// From the grip's centre to G, world axes.
    fn lever(&self) -> Vector3<f64> {
        let body_from_grip = self.placement.grip_from_body.inverse();
        let centre = body_from_grip * Point3::origin();
        self.world_from_body.rotation * (self.placement.reference_point - centre)
    }
}

impl<H: StringHardware> Device for SpidarDevice<H> {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let reading = self.hardware.read_counts(now);
        let before = self.clocked();
        let sample = reading.and_then(|reading| self.sample(&reading));
        self.fault = sample.as_ref().err().copied();
        if self.fault.is_some() {
            self.rates.reset();
            self.newest = None;
        }
        self.spent.0 = self.clocked().saturating_sub(before);
        sample.map_err(DeviceFault::Strings)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        let before = self.clocked();
        // Also at a fault, with the strings where they were: what to do then the port decides, which holds and fades.
        let (force, torque) = halves(wrench);
        let to_frame = self.placement.world_from_frame.rotation.inverse();
        // About the grip's centre instead of G.
        let torque = torque + self.lever().cross(&force);
        let at_grip = stack(&(to_frame * force), &(to_frame * torque));
        // A wrench that is not finite gets the least tensions.
        let answer = self.solver.distribute(&self.strings, &at_grip);
        self.tensions = Some(answer);
        self.spent.1 = self.spent.0 + self.clocked().saturating_sub(before);
        self.hardware.write_tensions(now, &answer.tensions);
    }

    fn let_go(&mut self) -> bool {
        self.hardware.let_go()
    }

    /// What the last tensions render at the last pose, bounds of the motors and all; not their lag.
    fn felt(&self) -> Option<Felt> {
        let (force, torque) = halves(&self.tensions?.wrench);
        let turn = self.placement.world_from_frame.rotation;
        let (force, torque) = (turn * force, turn * torque);
        // About G instead of the grip's centre.
        let torque = torque - self.lever().cross(&force);
        Some(Felt {
            wrench: stack(&force, &torque),
            at_edge: false,
            set_made: None,
        })
    }

    fn computing_time(&self) -> Option<Duration> {
        self.clock.map(|_| self.spent.1)
    }
}

fn halves(six: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (six.fixed_rows::<3>(0).into(), six.fixed_rows::<3>(3).into())
}

/// What the device bears at its centre, in every direction.
fn info(geometry: &Geometry) -> DeviceInfo {
    let centre = capability(geometry, &Isometry3::identity());
    let reach = 0.5 / RATE_HZ + DELAY_S;
    let arm = geometry.arm();
    DeviceInfo {
        name: format!("SPIDAR {}", geometry.name),
        sensed_degrees_of_freedom: 6,
        actuated_degrees_of_freedom: 6,
        limits: DeviceLimits {
            // b / (T/2 + t_d), with the damping at the grip's arm for rotation.
            max_stiffness: geometry.grip_damping / reach,
            max_rotational_stiffness: geometry.grip_damping * arm * arm / reach,
            max_force: centre.weakest_force.size,
            max_torque: centre.weakest_torque.size,
        },
        rate_hz: RATE_HZ,
    }
}
