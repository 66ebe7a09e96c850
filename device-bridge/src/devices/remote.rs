//! A device at the other end of the network, for the server's haptics loop.
//!
//! Poses come from the link's receiving thread by a triple buffer; wrenches go to the broadcast thread by another one. Both are
//! wait-free, one writer each: this device is the only reader of the first and the only writer of the
//! second. Age is a fault, of which silence is one cause: a pose that is old says nothing about where the hand is.
//!
//! A reading is as old as session time minus the bridge's stamp, plus what the bridge's clock may be off by. That it arrived just now says
//! nothing. A bridge whose clock is not locked yet stamps nothing, and a reading without a stamp moves nothing.
//!
//! `now` must be session time, the clock of [`taut_link::SessionClock`].

use std::time::Duration;

use nalgebra::Vector6;
use taut_link::DeviceInput;
use taut_link::proto::WrenchCommand;
use taut_link::proto::input::{INPUT_AT_EDGE, INPUT_FAULT};
use taut_link::proto::wrench::WRENCH_AT_EDGE;

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Felt};
use crate::port::SafetySettings;

/// Age of the newest reading from which on the device counts as lost.
pub const DEFAULT_MAX_AGE: Duration = Duration::from_millis(20);

/// The same for a bridge which couples by itself: no force waits for the reading, the bridge counts the age of its sets by itself, and one that answers
/// an older reading is of no use to it.
pub const MAX_EDGE_DELAY: Duration = SafetySettings::ZERO_AFTER;

/// How far the clocks of network and loops, which are one, may read apart: their zeros are taken one after the other.
const ONE_CLOCK: Duration = Duration::from_micros(100);

/// The command that says "no force".
const NO_FORCE: WrenchCommand = WrenchCommand {
    time_ns: 0,
    origin_ns: 0,
    wrench: [0.0; 6],
    obstacle_work: 0.0,
    flags: 0,
};

/// The device that a bridge reads and renders.
pub struct RemoteDevice {
    info: DeviceInfo,
    inputs: triple_buffer::Output<Option<DeviceInput>>,
    commands: triple_buffer::Input<WrenchCommand>,
    max_age: Duration,
    /// The session that the readings come from.
    session: Option<u16>,
    /// A reading of this session had a time.
    on_clock: bool,
    /// What the next command comes from.
    origin: Option<Duration>,
    /// Of the obstacles on the hand so far, J.
    obstacle_work: f64,
    faulty: bool,
    /// What the bridge says that it renders.
    felt: Option<Felt>,
}

impl RemoteDevice {
    /// The device behind `inputs` ([`taut_link::ServerLink::device_inputs`]) and the commands for the broadcast thread
    /// to send ([`taut_link::Broadcaster::send_wrench`]), newest each time it looks.
    ///
    /// `limits` are those of the device that the workbench expects there; `max_age` is the age and the silence after
    /// which it counts as lost ([`DEFAULT_MAX_AGE`] fits a local network); a bridge that couples by itself has at least [`MAX_EDGE_DELAY`].
    #[must_use]
    pub fn new(
        inputs: triple_buffer::Output<Option<DeviceInput>>,
        limits: DeviceLimits,
        max_age: Duration,
    ) -> (Self, triple_buffer::Output<WrenchCommand>) {
        let (commands, to_send) = triple_buffer::TripleBuffer::new(&NO_FORCE).split();
        let device = Self {
            info: DeviceInfo {
                limits,
                ..DeviceInfo::ideal("remote", 6)
            },
            inputs,
            commands,
            max_age,
            session: None,
            on_clock: false,
            origin: None,
            obstacle_work: 0.0,
            faulty: true,
            felt: None,
        };
        (device, to_send)
    }

    fn newest(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let Some(input) = *self.inputs.read() else {
            return Err(DeviceFault::NotStarted);
        };
        let known = self.session.replace(input.session);
        if known.is_some_and(|known| known != input.session) {
            self.on_clock = false;
            return Err(DeviceFault::Reconnected);
        }

        let at_edge = input.sample.flags & INPUT_AT_EDGE != 0;
        let wrench = Vector6::from(input.sample.rendered);
        let finite = wrench.iter().all(|x| x.is_finite());
        let set_made = Duration::from_nanos(input.sample.set_made_ns);
        self.felt = finite.then_some(Felt {
            wrench,
            at_edge,
            set_made: (at_edge && !set_made.is_zero()).then_some(set_made),
        });

        let received = Duration::from_nanos(input.received_ns);
        let stamp = input.sample.sample_time_ns;
        if stamp == 0 {
            // The bridge's clock locks a moment after it has joined.
            return Err(if self.on_clock {
                DeviceFault::TimeNotOnClock
            } else {
                DeviceFault::NotStarted
            });
        }
        self.on_clock = true;
        let measured = Duration::from_nanos(stamp);
        let uncertainty = Duration::from_nanos(input.sample.clock_uncertainty_ns);
        if measured.saturating_sub(now) > uncertainty.saturating_add(ONE_CLOCK) {
            return Err(DeviceFault::TimeNotOnClock);
        }
        let age = now
            .saturating_sub(measured.min(received))
            .saturating_add(uncertainty);
        let silence = now.saturating_sub(received);
        let allowed = if at_edge {
            MAX_EDGE_DELAY.max(self.max_age)
        } else {
            self.max_age
        };
        if age.max(silence) > allowed {
            return Err(DeviceFault::Lost { age });
        }
        if input.sample.flags & INPUT_FAULT != 0 {
            return Err(DeviceFault::ReportedFault);
        }
        let velocity = Vector6::from(input.sample.velocity);
        match input.sample.pose.to_isometry() {
            Some(pose) if velocity.iter().all(|x| x.is_finite()) => Ok(DeviceSample {
                time: measured.min(now),
                pose,
                velocity,
                buttons: input.sample.buttons,
            }),
            _ => Err(DeviceFault::NotFinite),
        }
    }
}

impl Device for RemoteDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        self.felt = None;
        let sample = self.newest(now);
        self.faulty = sample.is_err();
        if self.faulty {
            self.felt = None;
        }
        sample
    }

    fn comes_from(&mut self, origin: Option<Duration>, obstacle_work: f64) {
        self.origin = origin;
        self.obstacle_work = obstacle_work;
    }

    /// Hands the wrench to the broadcast thread; a zero one while the device is faulty.
    fn write(&mut self, now: Duration, wrench: &Vector6<f64>) {
        let renderable = !self.faulty && wrench.iter().all(|x| x.is_finite());
        let wrench = if renderable {
            (*wrench).into()
        } else {
            [0.0; 6]
        };
        self.commands.write(WrenchCommand {
            time_ns: nanoseconds(now),
            origin_ns: nanoseconds(self.origin.unwrap_or_default()),
            wrench,
            obstacle_work: self.obstacle_work,
            // A bridge that is faulty gets no sets: their silence lets its force fade.
            flags: if self.felt.is_some_and(|felt| felt.at_edge) {
                WRENCH_AT_EDGE
            } else {
                0
            },
        });
    }

    fn felt(&self) -> Option<Felt> {
        self.felt
    }
}

fn nanoseconds(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;
    use taut_link::proto::{InputSample, PoseF64};

    type Inputs = triple_buffer::Input<Option<DeviceInput>>;
    type Commands = triple_buffer::Output<WrenchCommand>;

    fn device() -> (Inputs, RemoteDevice, Commands) {
        let (inputs, output) = triple_buffer::TripleBuffer::new(&None).split();
        let (device, commands) =
            RemoteDevice::new(output, DeviceLimits::UNLIMITED, DEFAULT_MAX_AGE);
        (inputs, device, commands)
    }

    fn input(measured_ms: u64, received_ms: u64) -> DeviceInput {
        DeviceInput {
            sample: InputSample {
                sample_time_ns: measured_ms * 1_000_000,
                clock_uncertainty_ns: 0,
                index: 41,
                pose: PoseF64 {
                    position: [0.1, 0.2, 0.3],
                    ..PoseF64::IDENTITY
                },
                velocity: [0.0, 0.0, -0.5, 0.0, 0.0, 0.0],
                buttons: 5,
                flags: 0,
                rendered: [0.0; 6],
                set_made_ns: 0,
            },
            received_ns: received_ms * 1_000_000,
            session: 7,
        }
    }

    #[test]
    fn the_newest_reading_comes_through_and_the_wrench_answers_it() {
        let (mut inputs, mut device, mut commands) = device();
        assert_eq!(device.read(ms(1)), Err(DeviceFault::NotStarted));
        inputs.write(Some(input(998, 1000)));
        let sample = device.read(ms(1001)).expect("a fresh reading");
        assert_eq!(sample.time, ms(998));
        assert_eq!(sample.pose.translation.vector.as_slice(), [0.1, 0.2, 0.3]);
        assert_eq!((sample.velocity[2], sample.buttons), (-0.5, 5));

        device.comes_from(Some(ms(997)), 0.25);
        device.write(ms(1001), &Vector6::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3));
        let command = commands.read();
        assert_eq!(command.wrench, [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]);
        assert_eq!(command.obstacle_work, 0.25);
        let times = (command.origin_ns, command.time_ns);
        assert_eq!(times, (997_000_000, 1_001_000_000));
    }

    #[test]
    fn silence_of_more_than_20_ms_is_a_fault_and_stops_the_force() {
        let (mut inputs, mut device, mut commands) = device();
        inputs.write(Some(input(1000, 1000)));
        assert!(device.read(ms(1020)).is_ok());
        assert_eq!(
            device.read(ms(1021)),
            Err(DeviceFault::Lost { age: ms(21) })
        );
        device.write(ms(1021), &Vector6::repeat(3.0));
        assert_eq!(commands.read().wrench, [0.0; 6]);
        inputs.write(Some(input(1030, 1030)));
        assert!(device.read(ms(1030)).is_ok());
    }

    #[test]
    fn a_reading_that_was_long_on_its_way_is_stale_too() {
        let (mut inputs, mut device, _commands) = device();
        inputs.write(Some(input(900, 1000)));
        assert_eq!(
            device.read(ms(1000)),
            Err(DeviceFault::Lost { age: ms(100) })
        );
    }

    #[test]
    fn what_the_bridges_clock_may_be_off_by_counts_as_age() {
        let (mut inputs, mut device, _commands) = device();
        let mut doubtful = input(990, 999);
        doubtful.sample.clock_uncertainty_ns = 9_000_000;
        inputs.write(Some(doubtful));
        assert!(device.read(ms(1000)).is_ok());
        assert_eq!(
            device.read(ms(1002)),
            Err(DeviceFault::Lost { age: ms(21) })
        );
        // The clock may be ahead by that much, and no more.
        doubtful.sample.sample_time_ns = 1_008_000_000;
        inputs.write(Some(doubtful));
        assert_eq!(
            device.read(ms(1000)).map(|sample| sample.time),
            Ok(ms(1000))
        );
        doubtful.sample.sample_time_ns = 1_010_000_000;
        inputs.write(Some(doubtful));
        assert_eq!(device.read(ms(1000)), Err(DeviceFault::TimeNotOnClock));
        doubtful.sample.clock_uncertainty_ns = u64::MAX;
        inputs.write(Some(doubtful));
        assert!(
            device.read(ms(1000)).is_err(),
            "nothing is known of its age"
        );
    }

    #[test]
    fn a_bridge_whose_clock_is_not_locked_moves_nothing() {
        let (mut inputs, mut device, mut commands) = device();
        inputs.write(Some(input(0, 1000)));
        assert_eq!(device.read(ms(1000)), Err(DeviceFault::NotStarted));
        device.write(ms(1000), &Vector6::repeat(1.0));
        assert_eq!(commands.read().wrench, [0.0; 6]);
        inputs.write(Some(input(1001, 1001)));
        assert!(device.read(ms(1001)).is_ok());
        inputs.write(Some(input(0, 1002)));
        assert_eq!(device.read(ms(1002)), Err(DeviceFault::TimeNotOnClock));
    }

    #[test]
    fn a_bridge_that_couples_by_itself_may_be_far_away_or_silent_for_120_ms() {
        let (mut inputs, mut device, mut commands) = device();
        let mut edge = input(900, 1000);
        edge.sample.flags = INPUT_AT_EDGE;
        edge.sample.rendered = [0.0, 0.0, 3.0, 0.0, 0.1, 0.0];
        edge.sample.set_made_ns = 870_000_000;
        inputs.write(Some(edge));
        assert!(device.read(ms(1000)).is_ok(), "100 ms on the way");
        let wrench = Vector6::from(edge.sample.rendered);
        assert_eq!(
            device.felt(),
            Some(Felt {
                wrench,
                at_edge: true,
                set_made: Some(ms(870)),
            })
        );
        device.write(ms(1000), &Vector6::repeat(1.0));
        assert_eq!(commands.read().flags, WRENCH_AT_EDGE);
        assert!(device.read(ms(1020)).is_ok(), "120 ms old");
        assert!(device.read(ms(1021)).is_err(), "121 ms old");
        device.write(ms(1021), &Vector6::repeat(1.0));
        assert_eq!(commands.read().flags, 0, "no sets for a lost bridge");
        edge.sample.sample_time_ns = 1_000_000_000;
        inputs.write(Some(edge));
        assert!(device.read(ms(1120)).is_ok(), "120 ms of silence");
        assert!(device.read(ms(1121)).is_err(), "121 ms of silence");
        edge.sample.sample_time_ns = 1;
        inputs.write(Some(edge));
        assert!(device.read(ms(1000)).is_err(), "a second on the way");
    }

    #[test]
    fn broken_readings_are_faults() {
        let (mut inputs, mut device, mut commands) = device();
        let mut read = |change: fn(&mut DeviceInput)| {
            let mut broken = input(1000, 1000);
            change(&mut broken);
            inputs.write(Some(broken));
            device.read(ms(1001)).expect_err("a broken reading")
        };
        assert_eq!(
            read(|input| input.sample.pose.position[0] = f64::NAN),
            DeviceFault::NotFinite
        );
        assert_eq!(
            read(|input| input.sample.velocity[5] = f64::INFINITY),
            DeviceFault::NotFinite
        );
        assert_eq!(
            read(|input| input.sample.flags = INPUT_FAULT),
            DeviceFault::ReportedFault
        );
        assert_eq!(
            read(|input| input.sample.sample_time_ns = 5_000_000_000),
            DeviceFault::TimeNotOnClock
        );
        assert_eq!(read(|input| input.session = 8), DeviceFault::Reconnected);
        device.write(ms(1001), &Vector6::repeat(1.0));
        assert_eq!(commands.read().wrench, [0.0; 6]);
    }

    #[test]
    fn a_wrench_that_is_not_finite_is_sent_as_none() {
        let (mut inputs, mut device, mut commands) = device();
        inputs.write(Some(input(1000, 1000)));
        assert!(device.read(ms(1001)).is_ok());
        device.write(ms(1001), &Vector6::repeat(f64::NAN));
        assert_eq!(commands.read().wrench, [0.0; 6]);
    }
}
