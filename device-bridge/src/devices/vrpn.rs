//! A sensor of a VRPN tracker as a six-degree-of-freedom input without force.
//!
//! Reports come about 100 times a second; between them the body glides ([`super::glide`]), one and a half intervals late. A
//! tracker that falls silent, loses the sensor from sight or reports what is no pose is a fault at once or after
//! [`VrpnSettings::max_age`].

use std::time::Duration;

use nalgebra::Vector6;
use taut_vrpn::SensorMapping;

use super::glide::Glide;
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Pose};
use crate::placement::Placement;
use crate::vrpn::{TrackerFeed, TrackerState, VrpnSource};

/// How the body follows the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// The body stands at its start when the first report comes, and moves as the sensor does from there. After a loss
    /// it goes on from where it was.
    #[default]
    Start,
    /// The body is where the sensor is on the workbench: a tracked prop in the user's hand.
    Workbench,
}

impl Anchor {
    /// All, with their names on the command line and in files.
    pub const NAMED: [(&'static str, Self); 2] =
        [("start", Self::Start), ("workbench", Self::Workbench)];
}

/// A tracker as a device.
#[derive(Clone, Debug, PartialEq)]
pub struct VrpnSettings {
    /// Which sensor, and how its reports come.
    pub source: VrpnSource,
    /// From the tracker's frame to the workbench's.
    pub mapping: SensorMapping,
    /// How the body follows.
    pub anchor: Anchor,
    /// Silence after which the device counts as lost.
    pub max_age: Duration,
}

impl VrpnSettings {
    /// Longest silence unless said otherwise: six reports of a tracker of 60 Hz.
    pub const DEFAULT_MAX_AGE: Duration = Duration::from_millis(100);
}

/// What gives the newest tracker state: a [`TrackerFeed`], or a test.
pub trait TrackerReader: Send {
    /// What the tracker said last. Neither waits nor allocates.
    fn newest(&mut self) -> TrackerState;
}

impl TrackerReader for TrackerFeed {
    fn newest(&mut self) -> TrackerState {
        *Self::newest(self)
    }
}

/// The device.
pub struct VrpnDevice {
    info: DeviceInfo,
    reader: Box<dyn TrackerReader>,
    mapping: SensorMapping,
    anchor: Anchor,
    max_age: Duration,
    placement: Placement,
    /// Of the frame at G.
    glide: Glide,
    /// Pose of the sensor on the workbench, and of the body's frame at G, when the body was last anchored.
    anchored: Option<(Pose, Pose)>,
    reports: u64,
    arrival: Option<Duration>,
    lost: bool,
}

impl VrpnDevice {
    /// Starts to listen to the tracker; one that is not there yet is waited for.
    ///
    /// # Errors
    /// No thread or no socket can be had.
    pub fn start(settings: &VrpnSettings, placement: Placement) -> std::io::Result<Self> {
        let feed = TrackerFeed::start(settings.source.clone())?;
        Ok(Self::new(Box::new(feed), settings, placement))
    }

    /// A device that reads `reader`.
    #[must_use]
    pub fn new(
        reader: Box<dyn TrackerReader>,
        settings: &VrpnSettings,
        placement: Placement,
    ) -> Self {
        let name = format!("VRPN tracker {}", settings.source.address);
        Self {
            info: DeviceInfo::without_force(name),
            reader,
            mapping: settings.mapping,
            anchor: settings.anchor,
            max_age: settings.max_age,
            placement,
            glide: Glide::at_rest(placement.at_reference_point(&placement.start)),
            anchored: None,
            reports: 0,
            arrival: None,
            lost: false,
        }
    }

    /// Where the body's frame at G is to be for a sensor at `sensor` on the workbench.
    fn target(&mut self, now: Duration, sensor: &Pose) -> Pose {
        if self.anchor == Anchor::Workbench {
            let body = self.placement.pose_in_world(sensor);
            return self.placement.at_reference_point(&body);
        }
        let glide = &self.glide;
        let (sensor_then, body_then) = *self
            .anchored
            .get_or_insert_with(|| (*sensor, glide.at(now).0));
        self.placement.carried(&body_then, &sensor_then, sensor)
    }

    fn lose(&mut self, fault: DeviceFault) -> DeviceFault {
        self.lost = true;
        self.anchored = None;
        fault
    }
}

impl Device for VrpnDevice {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn scale(&self) -> f64 {
        self.placement.scale()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        let newest = self.reader.newest();
        let is_new = newest.reports != self.reports;
        if is_new {
            self.reports = newest.reports;
            self.arrival = Some(now);
        }
        let (Some(arrival), Some(report)) = (self.arrival, newest.pose) else {
            return Err(DeviceFault::NotStarted);
        };
        let age = now.saturating_sub(arrival);
        if !newest.is_connected || age > self.max_age {
            return Err(self.lose(DeviceFault::Lost { age }));
        }
        if is_new || self.lost {
            let Some(sensor) = self.mapping.pose(&report) else {
                return Err(self.lose(DeviceFault::NotFinite));
            };
            let was_lost = std::mem::replace(&mut self.lost, false);
            let first = self.anchor == Anchor::Workbench && self.anchored.is_none();
            let target = self.target(now, &sensor);
            if first {
                // It may be anywhere: it is there at once, and the force ramps in.
                self.glide = Glide::at_rest(target);
                self.anchored = Some((sensor, target));
            }
            self.glide.arrive(now, &target);
            if was_lost {
                return Err(DeviceFault::Reconnected);
            }
        }
        let (pose, velocity) = self.glide.at(now);
        Ok(DeviceSample {
            time: now,
            pose: self.placement.from_reference_point(&pose),
            velocity,
            buttons: newest.buttons,
        })
    }

    fn write(&mut self, _now: Duration, _wrench: &Vector6<f64>) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;
    use nalgebra::{Point3, Similarity3, Vector3};
    use std::sync::{Arc, Mutex};
    use taut_vrpn::PoseReport;

    #[derive(Clone, Default)]
    struct Tracker(Arc<Mutex<TrackerState>>);

    impl TrackerReader for Tracker {
        fn newest(&mut self) -> TrackerState {
            *self.0.lock().expect("not poisoned")
        }
    }

    impl Tracker {
        fn tell(&self, position: [f64; 3], rotation: [f64; 4]) {
            let mut state = self.0.lock().expect("not poisoned");
            state.reports += 1;
            state.is_connected = true;
            state.pose = Some(PoseReport {
                sensor: 0,
                position,
                rotation,
            });
        }
    }

    const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    fn device(anchor: Anchor) -> (Tracker, VrpnDevice) {
        let tracker = Tracker::default();
        let settings = VrpnSettings {
            source: VrpnSource {
                address: "Tracker0@here".parse().expect("valid"),
                sensor: 0,
                mode: crate::VrpnMode::Tcp,
            },
            mapping: SensorMapping::identity(),
            anchor,
            max_age: VrpnSettings::DEFAULT_MAX_AGE,
        };
        let placement = Placement {
            start: Pose::new(Vector3::new(0.0, 0.0, 0.1), Vector3::x() * 0.5),
            reference_point: Point3::new(0.0, 0.02, 0.0),
            workbench_from_world: Similarity3::from_parts(
                Vector3::new(0.0, -0.4, 0.2).into(),
                nalgebra::UnitQuaternion::identity(),
                2.0,
            ),
        };
        let device = VrpnDevice::new(Box::new(tracker.clone()), &settings, placement);
        (tracker, device)
    }

    #[test]
    fn the_body_starts_where_it_is_and_follows_the_sensor_at_the_display_s_scale() {
        let (tracker, mut device) = device(Anchor::Start);
        assert_eq!(device.read(ms(1)), Err(DeviceFault::NotStarted));
        tracker.tell([5.0, 6.0, 7.0], UPRIGHT);
        let first = device.read(ms(2)).expect("a sample");
        let start = device.placement.start;
        assert!((first.pose.to_homogeneous() - start.to_homogeneous()).norm() < 1e-12);
        tracker.tell([5.0, 6.0, 7.04], UPRIGHT);
        let _ = device.read(ms(12));
        let under_way = device.read(ms(15)).expect("a sample");
        assert!(under_way.velocity[2] > 0.0);
        let there = device.read(ms(60)).expect("a sample");
        let moved = there.pose.translation.vector - start.translation.vector;
        assert!((moved - Vector3::z() * 0.02).norm() < 1e-12, "{moved}");
    }

    #[test]
    fn a_turn_of_the_sensor_turns_about_the_reference_point() {
        let (tracker, mut device) = device(Anchor::Start);
        tracker.tell([0.0; 3], UPRIGHT);
        let _ = device.read(ms(0));
        let half = 0.4_f64;
        tracker.tell([0.0; 3], [0.0, 0.0, half.sin(), half.cos()]);
        let _ = device.read(ms(10));
        let there = device.read(ms(60)).expect("a sample").pose;
        let (start, g) = (device.placement.start, device.placement.reference_point);
        assert!((there * g - start * g).norm() < 1e-12);
        let turn = there.rotation * start.rotation.inverse();
        assert!((turn.scaled_axis() - Vector3::z() * 0.8).norm() < 1e-12);
    }

    #[test]
    fn silence_is_a_loss_and_the_return_does_not_jump() {
        let (tracker, mut device) = device(Anchor::Start);
        tracker.tell([0.0; 3], UPRIGHT);
        let before = device.read(ms(10)).expect("a sample").pose;
        assert!(device.read(ms(110)).is_ok());
        assert_eq!(
            device.read(ms(111)),
            Err(DeviceFault::Lost { age: ms(101) })
        );
        tracker.tell([1.0, 1.0, 1.0], UPRIGHT);
        assert_eq!(device.read(ms(200)), Err(DeviceFault::Reconnected));
        let after = device.read(ms(201)).expect("back").pose;
        assert!((after.to_homogeneous() - before.to_homogeneous()).norm() < 1e-12);
        tracker.0.lock().expect("not poisoned").is_connected = false;
        assert_eq!(device.read(ms(202)), Err(DeviceFault::Lost { age: ms(2) }));
    }

    #[test]
    fn a_sensor_out_of_sight_is_a_fault() {
        let (tracker, mut device) = device(Anchor::Start);
        tracker.tell([0.0; 3], UPRIGHT);
        assert!(device.read(ms(1)).is_ok());
        tracker.tell([0.0; 3], [0.0; 4]);
        assert_eq!(device.read(ms(2)), Err(DeviceFault::NotFinite));
        assert_eq!(device.read(ms(3)), Err(DeviceFault::NotFinite));
        tracker.tell([0.0; 3], UPRIGHT);
        assert_eq!(device.read(ms(4)), Err(DeviceFault::Reconnected));
        assert!(device.read(ms(5)).is_ok());
    }

    #[test]
    fn a_prop_on_the_workbench_is_where_it_is_seen() {
        let (tracker, mut device) = device(Anchor::Workbench);
        tracker.tell([0.2, -0.1, 0.4], UPRIGHT);
        let sample = device.read(ms(1)).expect("a sample");
        // Workbench = origin + 2 · world.
        let wanted = Vector3::new(0.1, 0.15, 0.1);
        assert!((sample.pose.translation.vector - wanted).norm() < 1e-12);
        assert!(sample.pose.rotation.angle() < 1e-12);
    }
}
