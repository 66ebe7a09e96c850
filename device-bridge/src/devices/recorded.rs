//! A recorded device: replays a trace of poses. It feels nothing: wrenches are ignored.
//!
//! Between rows the body's own frame moves on a straight line and turns at a constant rate by the shorter
//! arc.

use std::time::Duration;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector6};

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Pose};
use taut_plant::{is_finite, stack};
use taut_recording::TraceSample;

/// A recorded device trace, in order of time.
pub type Trace = Vec<TraceSample>;

/// What a recorded device does after the last row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AtEnd {
    /// [`DeviceFault::Ended`].
    #[default]
    Fault,
    /// Holds the last pose.
    Hold,
    /// Starts again at the first row. The trace's last pose should be its first: a jump is replayed as it is.
    Loop,
}

/// Why a trace cannot be replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    /// No row.
    #[error("the trace has no row; give at least one")]
    Empty,
    /// A time or a pose that is not finite: which row, from 0.
    #[error("row {0} of the trace is not finite; correct that row")]
    NotFinite(usize),
    /// A time that is not after the one before it: which row, from 0.
    #[error("row {0} of the trace is not later than the one before it; sort the rows")]
    TimeNotIncreasing(usize),
}

/// Replays a trace; its first row is the first call of [`Device::read`].
#[derive(Clone, Debug)]
pub struct RecordedDevice {
    info: DeviceInfo,
    trace: Trace,
    at_end: AtEnd,
    reference_point: Point3<f64>,
    epoch: Option<Duration>,
}

impl RecordedDevice {
    /// A device that replays `trace`; `reference_point` is G in the body's own frame.
    ///
    /// # Errors
    /// [`TraceError`] names the first row that is wrong.
    pub fn new(
        trace: Trace,
        at_end: AtEnd,
        reference_point: Point3<f64>,
    ) -> Result<Self, TraceError> {
        if trace.is_empty() {
            return Err(TraceError::Empty);
        }
        for (row, entry) in trace.iter().enumerate() {
            if !(entry.time.is_finite() && is_finite(&entry.pose)) {
                return Err(TraceError::NotFinite(row));
            }
            if row > 0 && entry.time <= trace[row - 1].time {
                return Err(TraceError::TimeNotIncreasing(row));
            }
        }
        Ok(Self {
            info: DeviceInfo::without_force("recorded trace"),
            trace,
            at_end,
            reference_point,
            epoch: None,
        })
    }

    /// Pose, velocity of G and buttons at `time_s` on the trace's own clock.
    fn at(&self, time_s: f64) -> (Pose, Vector6<f64>, u16) {
        let next = self.trace.partition_point(|row| row.time <= time_s);
        let from = &self.trace[next.saturating_sub(1)];
        let Some(to) = self.trace.get(next).filter(|_| next > 0) else {
            return (from.pose, Vector6::zeros(), from.buttons);
        };

        let duration = to.time - from.time;
        let fraction = (time_s - from.time) / duration;
        let travel = to.pose.translation.vector - from.pose.translation.vector;
        let turn = (to.pose.rotation * from.pose.rotation.inverse()).scaled_axis();
        let rotation = UnitQuaternion::from_scaled_axis(turn * fraction) * from.pose.rotation;
        let position = from.pose.translation.vector + travel * fraction;

        let angular = turn / duration;
        let lever = rotation * self.reference_point.coords;
        let velocity = stack(&(travel / duration + angular.cross(&lever)), &angular);
        let pose = Isometry3::from_parts(position.into(), rotation);
        (pose, velocity, from.buttons)
    }
}

impl Device for RecordedDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let epoch = *self.epoch.get_or_insert(now);
        let (first, last) = (&self.trace[0], &self.trace[self.trace.len() - 1]);
        let period = last.time - first.time;
        let mut passed = now.saturating_sub(epoch).as_secs_f64();
        if passed > period {
            match self.at_end {
                AtEnd::Fault => return Err(DeviceFault::Ended),
                AtEnd::Loop if period > 0.0 => passed = passed.rem_euclid(period),
                AtEnd::Hold | AtEnd::Loop => passed = period,
            }
        }
        let (pose, velocity, buttons) = self.at(first.time + passed);
        Ok(DeviceSample {
            time: now,
            pose,
            velocity,
            buttons,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn row(time: f64, x: f64, angle: f64, buttons: u16) -> TraceSample {
        let pose = Pose::new(Vector3::x() * x, Vector3::z() * angle);
        TraceSample {
            time,
            pose,
            buttons,
        }
    }

    fn device(at_end: AtEnd) -> RecordedDevice {
        let trace = vec![
            row(2.0, 0.0, 0.0, 1),
            row(2.5, 0.1, 0.4, 2),
            row(3.0, 0.0, 0.0, 0),
        ];
        RecordedDevice::new(trace, at_end, Point3::new(0.0, 0.05, 0.0)).expect("a valid trace")
    }

    const START: Duration = Duration::from_secs(77);

    #[test]
    fn poses_between_rows_are_interpolated_and_the_first_read_starts_the_trace() {
        let mut device = device(AtEnd::Fault);
        let first = device.read(START).expect("first row");
        assert_eq!(first.pose, row(2.0, 0.0, 0.0, 1).pose);
        let sample = device
            .read(START + Duration::from_millis(250))
            .expect("between rows");
        assert!((sample.pose.translation.vector.x - 0.05).abs() < 1e-12);
        assert!((sample.pose.rotation.angle() - 0.2).abs() < 1e-12);
        assert_eq!(sample.buttons, 1);
    }

    #[test]
    fn the_velocity_is_that_of_the_reference_point() {
        let mut device = device(AtEnd::Fault);
        let _ = device.read(START);
        let g = device.reference_point;
        let at = |device: &mut RecordedDevice, us| {
            device
                .read(START + Duration::from_micros(us))
                .expect("inside the trace")
        };
        let (before, here, after) = (
            at(&mut device, 99_900),
            at(&mut device, 100_000),
            at(&mut device, 100_100),
        );
        let measured = (after.pose * g - before.pose * g) / 2e-4;
        assert!((measured - here.velocity.fixed_rows::<3>(0)).norm() < 1e-6);
        assert!((here.velocity[5] - 0.8).abs() < 1e-12);
    }

    #[test]
    fn the_end_is_a_typed_fault_or_held_or_looped() {
        let late = START + Duration::from_millis(1250);
        let read = |at_end| {
            let mut device = device(at_end);
            let _ = device.read(START);
            device.read(late)
        };
        assert_eq!(read(AtEnd::Fault), Err(DeviceFault::Ended));
        let held = read(AtEnd::Hold).expect("held");
        assert_eq!(
            (held.pose, held.velocity),
            (row(0.0, 0.0, 0.0, 0).pose, Vector6::zeros())
        );
        let looped = read(AtEnd::Loop).expect("looped");
        assert!((looped.pose.translation.vector.x - 0.05).abs() < 1e-9);
    }

    #[test]
    fn bad_traces_are_refused_with_the_row() {
        let build = |trace| RecordedDevice::new(trace, AtEnd::Hold, Point3::origin()).map(|_| ());
        assert_eq!(build(vec![]), Err(TraceError::Empty));
        let backwards = vec![row(0.0, 0.0, 0.0, 0), row(-1.0, 0.0, 0.0, 0)];
        assert_eq!(build(backwards), Err(TraceError::TimeNotIncreasing(1)));
        assert_eq!(
            build(vec![row(f64::NAN, 0.0, 0.0, 0)]),
            Err(TraceError::NotFinite(0))
        );
    }
}
