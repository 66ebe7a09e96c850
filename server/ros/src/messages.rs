//! ROS 2 messages: their definitions as MCAP's `ros2msg` schemas, their bytes as CDR, little-endian, and their type hashes.
//!
//! Sources: the published definitions of `builtin_interfaces`, `std_msgs`, `geometry_msgs`, `sensor_msgs` and `tf2_msgs` (Humble to Jazzy: the same);
//! mcap.dev/spec/registry for how a schema holds the definitions that it needs; REP 2011 for the type hash (RIHS01: SHA-256 of the type description as
//! JSON). The hashes here are those that ROS 2 Jazzy publishes; a test computes them from the definitions.

use std::io;
use std::time::Duration;

use byteorder::LittleEndian;
use god_object::nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use god_object::spatial::{Pose, Vector6, angular, linear, six};
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
pub trait Message: Serialize + Sized {
    /// Its name in ROS 2.
    const NAME: &'static str;
    /// Its type hash.
    const HASH: &'static str;
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
    ///
    /// # Errors
    /// A string or a list is longer than CDR can say.
    fn encode(&self, bytes: &mut Vec<u8>) -> io::Result<()> {
        bytes.clear();
        bytes.extend(ENCAPSULATION);
        cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, self).map_err(io::Error::other)
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Copy, Serialize)]
pub struct Header<'a> {
    sec: i32,
    nanosec: u32,
    frame_id: &'a str,
}

impl<'a> Header<'a> {
    /// `None` where the time since 1970, or since a session began, is beyond what ROS can say, 68 years.
    #[must_use]
    pub fn new(time: Duration, frame_id: &'a str) -> Option<Self> {
        Some(Self {
            sec: i32::try_from(time.as_secs()).ok()?,
            nanosec: time.subsec_nanos(),
            frame_id,
        })
    }

    /// The same moment in another frame.
    #[must_use]
    pub fn in_frame<'b>(&self, frame_id: &'b str) -> Header<'b> {
        Header {
            sec: self.sec,
            nanosec: self.nanosec,
            frame_id,
        }
    }
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Serialize)]
pub struct PoseStamped<'a> {
    header: Header<'a>,
    position: [f64; 3],
    orientation: [f64; 4],
}

impl<'a> PoseStamped<'a> {
    /// `pose` stands in the header's frame.
    #[must_use]
    pub fn new(header: Header<'a>, pose: &Pose) -> Self {
        Self {
            header,
            position: position(pose),
            orientation: orientation(pose),
        }
    }
}

impl Message for PoseStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/PoseStamped";
    const HASH: &'static str =
        "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Pose pose\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, POSE, POINT, QUATERNION];
}

/// `geometry_msgs/msg/TwistStamped`.
#[derive(Serialize)]
pub struct TwistStamped<'a> {
    header: Header<'a>,
    linear: [f64; 3],
    angular: [f64; 3],
}

impl<'a> TwistStamped<'a> {
    /// Linear then angular, m/s and rad/s.
    #[must_use]
    pub fn new(header: Header<'a>, velocity: &Vector6) -> Self {
        Self {
            header,
            linear: linear(velocity).into(),
            angular: angular(velocity).into(),
        }
    }
}

impl Message for TwistStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/TwistStamped";
    const HASH: &'static str =
        "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Twist twist\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, TWIST, VECTOR3];
}

/// `geometry_msgs/msg/WrenchStamped`.
#[derive(Serialize)]
pub struct WrenchStamped<'a> {
    header: Header<'a>,
    force: [f64; 3],
    torque: [f64; 3],
}

impl<'a> WrenchStamped<'a> {
    /// Force then torque, N and N m.
    #[must_use]
    pub fn new(header: Header<'a>, wrench: &Vector6) -> Self {
        Self {
            header,
            force: linear(wrench).into(),
            torque: angular(wrench).into(),
        }
    }
}

impl Message for WrenchStamped<'_> {
    const NAME: &'static str = "geometry_msgs/msg/WrenchStamped";
    const HASH: &'static str =
        "RIHS01_8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77";
    const DEFINITION: &'static str = "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME, WRENCH, VECTOR3];
}

/// `sensor_msgs/msg/Joy`.
#[derive(Serialize)]
pub struct Joy<'a> {
    header: Header<'a>,
    axes: Vec<f32>,
    buttons: Vec<i32>,
}

impl<'a> Joy<'a> {
    /// One bit per button, the lowest first.
    #[must_use]
    pub fn new(header: Header<'a>, buttons: u16) -> Self {
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
    const HASH: &'static str =
        "RIHS01_0d356c79cad3401e35ffeb75a96a96e08be3ef896b8b83841d73e890989372c5";
    const DEFINITION: &'static str = "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n";
    const NEEDS: &'static [(&'static str, &'static str)] = &[HEADER, TIME];
}

/// `geometry_msgs/TransformStamped`, in a [`TfMessage`].
#[derive(Serialize)]
pub struct TransformStamped<'a> {
    header: Header<'a>,
    child_frame_id: &'a str,
    translation: [f64; 3],
    rotation: [f64; 4],
}

impl<'a> TransformStamped<'a> {
    /// `pose` is the parent, which the header names, from the child.
    #[must_use]
    pub fn new(header: Header<'a>, child_frame_id: &'a str, pose: &Pose) -> Self {
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
pub struct TfMessage<'a> {
    /// All of them at one moment or several.
    pub transforms: Vec<TransformStamped<'a>>,
}

impl Message for TfMessage<'_> {
    const NAME: &'static str = "tf2_msgs/msg/TFMessage";
    const HASH: &'static str =
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087";
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

/// Most bytes of a received wrench: 4 of the encapsulation, 8 of the time, 48 of the numbers, and a frame's name.
const MAX_WRENCH_BYTES: usize = 512;

/// A `geometry_msgs/msg/WrenchStamped` as it came, of either byte order.
#[derive(Clone, Debug, PartialEq)]
pub struct ReceivedWrench {
    /// Its time, s and ns, as its sender wrote it.
    pub stamp: (i32, u32),
    /// Name of its frame.
    pub frame_id: String,
    /// Force then torque, N and N m: whatever was sent, also what is no number.
    pub wrench: Vector6,
}

impl ReceivedWrench {
    /// Reads it; `None` where these bytes are no such message, or have more behind it than CDR pads with.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        #[derive(serde::Deserialize)]
        struct Read {
            sec: i32,
            nanosec: u32,
            frame_id: String,
            force: [f64; 3],
            torque: [f64; 3],
        }
        let (encapsulation, body) = bytes.split_at_checked(ENCAPSULATION.len())?;
        if bytes.len() > MAX_WRENCH_BYTES {
            return None;
        }
        let (read, used): (Read, usize) = match encapsulation {
            [0, 1, _, _] => cdr_encoding::from_bytes::<_, LittleEndian>(body).ok()?,
            [0, 0, _, _] => cdr_encoding::from_bytes::<_, byteorder::BigEndian>(body).ok()?,
            _ => return None,
        };
        (body.len() < used + 4 && read.nanosec < 1_000_000_000).then(|| Self {
            stamp: (read.sec, read.nanosec),
            frame_id: read.frame_id,
            wrench: six(&read.force.into(), &read.torque.into()),
        })
    }
}

/// Such as `obstacle_2_upper_plate`: a name in ROS has letters, digits and underscores, and the index tells two apart that become the same.
#[must_use]
pub fn obstacle_frame(index: usize, name: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name: String = name.chars().map(plain).collect();
    format!("obstacle_{index}_{name}")
}

/// The frame at the reference point of `body`, with the axes of the world: where wrenches and twists stand.
#[must_use]
pub fn reference_frame(body: &Pose, reference_point: &Point3<f64>) -> Pose {
    let at = body * reference_point;
    Pose::from_parts(Translation3::from(at.coords), UnitQuaternion::identity())
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
#[path = "messages_tests.rs"]
mod tests;
