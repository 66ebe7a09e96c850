//! The ROS 2 messages of an export: their definitions as MCAP's `ros2msg` schemas, and their bytes as CDR, little-endian.
//!
//! Sources: the published definitions of `builtin_interfaces`, `std_msgs`, `geometry_msgs`, `sensor_msgs` and `tf2_msgs` (Humble to Jazzy: the same);
//! mcap.dev/spec/registry for how a schema holds the definitions that it needs.

use std::io;
use std::time::Duration;

use byteorder::LittleEndian;
use god_object::nalgebra::Vector3;
use god_object::spatial::{Pose, Vector6, angular, linear};
use serde::Serialize;

/// Before every CDR body: plain CDR, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];
/// Between the definitions of one schema.
const SEPARATOR: &str =
    "================================================================================\n";

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const HEADER: (&str, &str) = (
    "std_msgs/Header",
    "builtin_interfaces/Time stamp\nstring frame_id\n",
);
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR3: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
);
const POSE: (&str, &str) = (
    "geometry_msgs/Pose",
    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
);
const TWIST: (&str, &str) = (
    "geometry_msgs/Twist",
    "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
);
const WRENCH: (&str, &str) = (
    "geometry_msgs/Wrench",
    "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
);
const TRANSFORM: (&str, &str) = (
    "geometry_msgs/Transform",
    "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
);
const TRANSFORM_STAMPED: (&str, &str) = (
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
);

/// A message whose fields are serialised in the order of its definition.
pub(super) trait Message: Serialize + Sized {
    /// Its name in ROS 2.
    const NAME: &'static str;
    /// Its own definition.
    const DEFINITION: &'static str;
    /// Those of the types in it.
    const NEEDS: &'static [(&'static str, &'static str)];

    /// The text of its schema.
    fn schema() -> String {
        let mut text = Self::DEFINITION.to_owned();
        for (name, definition) in Self::NEEDS {
            text.push_str(&format!("{SEPARATOR}MSG: {name}\n{definition}"));
        }
        text
    }

    /// Its bytes, in place of what was in `bytes`.
    fn encode(&self, bytes: &mut Vec<u8>) -> io::Result<()> {
        bytes.clear();
        bytes.extend(ENCAPSULATION);
        cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, self).map_err(io::Error::other)
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Copy, Serialize)]
pub(super) struct Header<'a> {
    sec: i32,
    nanosec: u32,
    frame_id: &'a str,
}

impl<'a> Header<'a> {
    /// `None` where the time is beyond what ROS can say, 68 years.
    pub(super) fn new(time: Duration, frame_id: &'a str) -> Option<Self> {
        Some(Self {
            sec: i32::try_from(time.as_secs()).ok()?,
            nanosec: time.subsec_nanos(),
            frame_id,
        })
    }

    pub(super) fn in_frame<'b>(&self, frame_id: &'b str) -> Header<'b> {
        Header {
            sec: self.sec,
            nanosec: self.nanosec,
            frame_id,
        }
    }
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Serialize)]
pub(super) struct PoseStamped<'a> {
    header: Header<'a>,
    position: [f64; 3],
    orientation: [f64; 4],
}

impl<'a> PoseStamped<'a> {
    pub(super) fn new(header: Header<'a>, pose: &Pose) -> Self {
        Self {
            header,
            position: position(pose),
            orientation: orientation(pose),
        }
    }
}

impl Message for PoseStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/PoseStamped";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Pose pose\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, POSE, POINT, QUATERNION];
}

/// `geometry_msgs/msg/TwistStamped`.
#[derive(Serialize)]
pub(super) struct TwistStamped<'a> {
    header: Header<'a>,
    linear: [f64; 3],
    angular: [f64; 3],
}

impl<'a> TwistStamped<'a> {
    pub(super) fn new(header: Header<'a>, velocity: &Vector6) -> Self {
        Self {
            header,
            linear: linear(velocity).into(),
            angular: angular(velocity).into(),
        }
    }
}

impl Message for TwistStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/TwistStamped";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Twist twist\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, TWIST, VECTOR3];
}

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Serialize)]
pub(super) struct WrenchStamped<'a> {
    header: Header<'a>,
    force: [f64; 3],
    torque: [f64; 3],
}

impl<'a> WrenchStamped<'a> {
    pub(super) fn new(header: Header<'a>, wrench: &Vector6) -> Self {
        Self {
            header,
            force: linear(wrench).into(),
            torque: angular(wrench).into(),
        }
    }
}

impl Message for WrenchStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/WrenchStamped";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, WRENCH, VECTOR3];
}

/// `sensor_msgs/msg/Joy`.
#[derive(Serialize)]
pub(super) struct Joy<'a> {
    header: Header<'a>,
    axes: Vec<f32>,
    buttons: Vec<i32>,
}

impl<'a> Joy<'a> {
    /// One bit per button, the lowest first.
    pub(super) fn new(header: Header<'a>, buttons: u16) -> Self {
        Self {
            header,
            axes: Vec::new(),
            buttons: (0..u16::BITS)
                .map(|button| i32::from(buttons >> button & 1))
                .collect(),
        }
    }
}

impl Message for Joy<'_> {
    const NAME: &'static str = "sensor_msgs/msg/Joy";
    const DEFINITION: &'static str = "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME];
}

/// `geometry_msgs/TransformStamped`, in a [`TfMessage`].
#[derive(Serialize)]
pub(super) struct TransformStamped<'a> {
    header: Header<'a>,
    child_frame_id: &'a str,
    translation: [f64; 3],
    rotation: [f64; 4],
}

impl<'a> TransformStamped<'a> {
    /// `pose` is the parent, which the header names, from the child.
    pub(super) fn new(header: Header<'a>, child_frame_id: &'a str, pose: &Pose) -> Self {
        Self {
            header,
            child_frame_id,
            translation: position(pose),
            rotation: orientation(pose),
        }
    }
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Serialize)]
pub(super) struct TfMessage<'a> {
    pub(super) transforms: Vec<TransformStamped<'a>>,
}

impl Message for TfMessage<'_> {
    const NAME: &'static str = "tf2_msgs/msg/TFMessage";
    const DEFINITION: &'static str = "geometry_msgs/TransformStamped[] transforms\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[
        TRANSFORM_STAMPED,
        HEADER,
        TIME,
        TRANSFORM,
        VECTOR3,
        QUATERNION,
    ];
}

fn position(pose: &Pose) -> [f64; 3] {
    let at: Vector3<f64> = pose.translation.vector;
    at.into()
}

/// ROS writes x y z w.
fn orientation(pose: &Pose) -> [f64; 4] {
    let turn = &pose.rotation;
    [turn.i, turn.j, turn.k, turn.w]
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::{Quaternion, Translation3, UnitQuaternion};

    /// The bytes by hand, from the alignment rules of CDR: each number at a multiple of its size, counted behind the four bytes of the encapsulation.
    #[test]
    fn a_pose_is_plain_cdr_with_numbers_at_multiples_of_their_size() {
        let pose = Pose::from_parts(
            Translation3::new(1.0, 2.0, 3.0),
            UnitQuaternion::new_unchecked(Quaternion::new(0.5, -0.5, 0.5, -0.5)),
        );
        let time = Duration::new(7, 9);
        let Some(header) = Header::new(time, "world") else {
            panic!("seven seconds are not too many");
        };
        let mut bytes = vec![99; 3];
        assert!(PoseStamped::new(header, &pose).encode(&mut bytes).is_ok());
        let mut expected = vec![0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 6, 0, 0, 0];
        expected.extend(b"world\0");
        expected.extend([0; 6]); // 18 bytes so far: the next multiple of 8 is 24
        for number in [1.0, 2.0, 3.0, -0.5, 0.5, -0.5, 0.5] {
            expected.extend(f64::to_le_bytes(number));
        }
        assert_eq!(bytes, expected);
    }

    #[test]
    fn buttons_are_sixteen_numbers_and_there_are_no_axes() {
        let Some(header) = Header::new(Duration::ZERO, "device") else {
            panic!("zero is not too many");
        };
        let joy = Joy::new(header, 0x8001);
        assert!(joy.axes.is_empty());
        assert_eq!(joy.buttons[..2], [1, 0]);
        assert_eq!((joy.buttons[15], joy.buttons.len()), (1, 16));
    }

    #[test]
    fn a_time_that_ros_cannot_say_is_none() {
        assert!(Header::new(Duration::from_secs(1 << 31), "world").is_none());
        assert!(Header::new(Duration::from_secs((1 << 31) - 1), "world").is_some());
    }
}
