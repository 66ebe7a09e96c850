//! A state as VRPN says it, in the workbench frame.
//!
//! | sensor | what                       | reports                    |
//! |--------|----------------------------|----------------------------|
//! | 0      | god-object, as drawn       | `Pos_Quat`, `Velocity`     |
//! | 1      | device, as drawn           | `Pos_Quat`                 |
//! | 2      | the viewer's head          | `Pos_Quat`                 |
//!
//! `vrpn_ForceDevice Force` is the force on the hand in N, `SCP` the god-object once more. All are in metres on the workbench
//! axes (x right, y away from the viewer, z up): positions of the scene are scaled as on the screens, forces are not.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use taut_proto::state::ToolState;
use taut_proto::{HotState, PoseF32, SceneDescription};
use taut_vrpn::{
    ButtonChange, ButtonStates, ForceReport, PoseReport, Report, SurfaceContactReport,
    VelocityReport,
};

/// Number of the god-object's sensor.
pub(crate) const GOD_OBJECT: i32 = 0;
/// Number of the device's sensor.
pub(crate) const DEVICE: i32 = 1;
/// Number of the head's sensor.
pub(crate) const HEAD: i32 = 2;
/// Time for which a velocity report states the rotation, s: at 300 rad/s still less than half a turn.
const ROTATION_INTERVAL: f64 = 0.01;

/// Where the scene stands on the workbench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VrpnFrame {
    /// Workbench from scene; positions are scaled first.
    pub workbench_from_scene: Isometry3<f64>,
    /// Metres on the workbench for each metre of the scene.
    pub display_scale: f64,
    /// Point of the god-object whose velocity a state has, m, its own frame.
    pub reference_point: Point3<f64>,
}

impl VrpnFrame {
    /// The frame of a scene; `None` where its origin is no pose.
    #[must_use]
    pub fn of(scene: &SceneDescription) -> Option<Self> {
        Some(Self {
            workbench_from_scene: scene.scene_origin.to_isometry()?,
            display_scale: scene.display_scale,
            reference_point: Point3::from(scene.reference_point),
        })
    }

    fn pose(&self, in_scene: &PoseF32) -> Option<Isometry3<f64>> {
        let mut pose = in_scene.to_isometry()?;
        pose.translation.vector *= self.display_scale;
        Some(self.workbench_from_scene * pose)
    }

    fn vector(&self, in_scene: &[f32; 3]) -> Vector3<f64> {
        self.workbench_from_scene * Vector3::from(in_scene.map(f64::from))
    }

    /// What a state says of poses and forces. What is no pose is left out.
    pub(crate) fn reports(&self, state: &HotState, reports: &mut Vec<Report>) {
        reports.clear();
        if let Some(tool) = state.tools.first() {
            if let Some(god_object) = self.pose(&tool.god_object) {
                reports.push(Report::Pose(pose_report(GOD_OBJECT, &god_object)));
                reports.push(Report::Velocity(self.velocity(tool, &god_object)));
                let (position, rotation) = parts(&god_object);
                reports.push(Report::SurfaceContact(SurfaceContactReport {
                    position,
                    rotation,
                }));
            }
            if let Some(device) = self.pose(&tool.device) {
                reports.push(Report::Pose(pose_report(DEVICE, &device)));
            }
            let force = self.vector(&tool.force).into();
            reports.push(Report::Force(ForceReport { force }));
        }
        if let Some(head) = state.head.pose.to_isometry() {
            reports.push(Report::Pose(pose_report(HEAD, &head)));
        }
    }

    /// Of the origin of the god-object's frame, whose pose the sensor tells; a state has that of the reference point.
    fn velocity(&self, tool: &ToolState, god_object: &Isometry3<f64>) -> VelocityReport {
        let angular = self.vector(&tool.angular_velocity);
        let arm = god_object * (self.reference_point.coords * self.display_scale);
        let linear = self.vector(&tool.linear_velocity) * self.display_scale - angular.cross(&arm);
        let turn = UnitQuaternion::from_scaled_axis(angular * ROTATION_INTERVAL);
        VelocityReport {
            sensor: GOD_OBJECT,
            linear: linear.into(),
            rotation: turn.coords.into(), // x y z w
            interval: ROTATION_INTERVAL,
        }
    }
}

fn parts(pose: &Isometry3<f64>) -> ([f64; 3], [f64; 4]) {
    // nalgebra's order is VRPN's: x y z w.
    (pose.translation.vector.into(), pose.rotation.coords.into())
}

fn pose_report(sensor: i32, pose: &Isometry3<f64>) -> PoseReport {
    let (position, rotation) = parts(pose);
    PoseReport {
        sensor,
        position,
        rotation,
    }
}

/// What the buttons have done since `known`, all of them at first.
pub(crate) fn button_reports(known: &mut Option<u16>, now: u16, reports: &mut Vec<Report>) {
    let buttons = 0..u16::BITS as i32;
    let is_down = |button: i32| now >> button & 1 == 1;
    match known.replace(now) {
        None => reports.push(Report::Buttons(ButtonStates(
            buttons.map(is_down).collect(),
        ))),
        Some(before) => {
            let changed = buttons.filter(|button| (before ^ now) >> button & 1 == 1);
            reports.extend(changed.map(|button| {
                Report::Button(ButtonChange {
                    button,
                    pressed: is_down(button),
                })
            }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// The scene turned by 90 degrees about z, 1 m away and twice as large; the reference point 0.1 m along x.
    fn frame() -> VrpnFrame {
        VrpnFrame {
            workbench_from_scene: Isometry3::new(
                Vector3::new(0.0, 1.0, 0.0),
                Vector3::z() * FRAC_PI_2,
            ),
            display_scale: 2.0,
            reference_point: Point3::new(0.1, 0.0, 0.0),
        }
    }

    fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
        (Vector3::from(a) - Vector3::from(b)).norm() < 1e-6
    }

    #[test]
    fn everything_is_on_the_workbench_and_forces_keep_their_size() {
        let mut state = HotState::empty();
        let mut tool = ToolState {
            linear_velocity: [0.0, 0.3, 0.0],
            angular_velocity: [0.0, 0.0, 3.0],
            force: [5.0, 0.0, 0.0],
            ..ToolState::default()
        };
        tool.god_object.position = [0.25, 0.0, 0.0];
        state.tools.push(tool);
        state.head.pose.position = [0.0, -1.0, 1.0];
        let mut reports = Vec::new();
        frame().reports(&state, &mut reports);
        let [
            Report::Pose(god_object),
            Report::Velocity(velocity),
            Report::SurfaceContact(point),
            Report::Pose(device),
            Report::Force(force),
            Report::Pose(head),
        ] = &reports[..]
        else {
            panic!("{reports:?}");
        };
        assert_eq!((god_object.sensor, device.sensor, head.sensor), (0, 1, 2));
        assert!(is_near(god_object.position, [0.0, 1.5, 0.0]));
        assert!(is_near(point.position, god_object.position));
        let half = FRAC_PI_2 / 2.0;
        assert!(
            (god_object.rotation[2] - half.sin()).abs() < 1e-9,
            "x y z w"
        );
        assert!((god_object.rotation[3] - half.cos()).abs() < 1e-9);
        assert!(is_near(device.position, [0.0, 1.0, 0.0]));
        assert!(is_near(force.force, [0.0, 5.0, 0.0]));
        assert!(
            is_near(head.position, [0.0, -1.0, 1.0]),
            "not the scene's frame"
        );
        // It turns about its own origin: only the reference point moves.
        assert!(is_near(velocity.linear, [0.0; 3]), "{velocity:?}");
        let angle = 2.0 * velocity.rotation[2].asin() / velocity.interval;
        assert!((angle - 3.0).abs() < 1e-6);
    }

    #[test]
    fn what_is_no_pose_is_not_told() {
        let mut state = HotState::empty();
        state.head.pose.rotation = [0.0; 4];
        let mut reports = Vec::new();
        frame().reports(&state, &mut reports);
        assert_eq!(reports, []);
    }

    #[test]
    fn all_buttons_are_told_once_and_then_their_changes() {
        let (mut known, mut reports) = (None, Vec::new());
        button_reports(&mut known, 0b10, &mut reports);
        let mut states = vec![false; 16];
        states[1] = true;
        assert_eq!(reports, [Report::Buttons(ButtonStates(states))]);
        reports.clear();
        button_reports(&mut known, 0b10, &mut reports);
        assert_eq!(reports, []);
        button_reports(&mut known, 0b100, &mut reports);
        let change = |button, pressed| Report::Button(ButtonChange { button, pressed });
        assert_eq!(reports, [change(1, false), change(2, true)]);
    }
}
