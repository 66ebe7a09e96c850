//! The workbench as a node of ROS 2: each state as five kinds of messages, by the names and tokens of `rmw_zenoh_cpp` ([`taut_ros::wire`]).
//!
//! | topic                       | message                           | frame             |
//! |-----------------------------|-----------------------------------|-------------------|
//! | `/NAME/device/pose`         | `geometry_msgs/msg/PoseStamped`   | `world`           |
//! | `/NAME/god_object/pose`     | `geometry_msgs/msg/PoseStamped`   | `world`           |
//! | `/NAME/god_object/twist`    | `geometry_msgs/msg/TwistStamped`  | `reference_point` |
//! | `/NAME/hand/wrench`         | `geometry_msgs/msg/WrenchStamped` | `reference_point` |
//! | `/NAME/device/buttons`      | `sensor_msgs/msg/Joy`             | `device`          |
//! | `/tf`                       | `tf2_msgs/msg/TFMessage`          |                   |

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use god_object::nalgebra::Point3;
use god_object::spatial::{Pose, Vector6};
use taut_proto::{HotState, SceneDescription};
use taut_ros::wire::{self, gid_of};
use taut_ros::{
    Attachment, Domain, Header, Joy, Message, Node, PoseStamped, TfMessage, TransformStamped,
    TwistStamped, WrenchStamped, obstacle_frame, reference_frame,
};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

const WORLD: &str = "world";
const DEVICE: &str = "device";
const GOD_OBJECT: &str = "god_object";
const REFERENCE_POINT: &str = "reference_point";
/// Name of the node that publishes.
const NODE: &str = "taut";

/// How the workbench speaks to ROS 2.
#[derive(Clone, Copy, Debug)]
pub struct RosSettings {
    /// The domain.
    pub domain: Domain,
    /// Session time now, for the times of messages.
    pub session_time: SessionTime,
}

/// Session time for any thread: how long the server has been up.
#[derive(Clone, Copy, Debug)]
pub struct SessionTime {
    zero: Instant,
}

impl SessionTime {
    /// A clock that reads `now` at this moment.
    #[must_use]
    pub fn reading(now: Duration) -> Self {
        let here = Instant::now();
        Self {
            zero: here.checked_sub(now).unwrap_or(here),
        }
    }

    fn now(&self) -> Duration {
        self.zero.elapsed()
    }
}

/// A node of the workbench for a session's tokens. Each session has a name of its own: ROS 2 warns of two nodes that share one.
pub(crate) fn node(session: &Session, domain: Domain, workbench: &str, name: &str) -> Node {
    Node {
        domain,
        session: session.zid().to_string(),
        namespace: format!("/{workbench}"),
        name: name.to_owned(),
    }
}

/// One topic.
struct Topic<'s> {
    publisher: Publisher<'s>,
    gid: [u8; 16],
    sequence: i64,
    /// It is there as long as this is held.
    _token: LivelinessToken,
}

impl<'s> Topic<'s> {
    fn new<M: Message>(
        session: &'s Session,
        node: &Node,
        entity: u32,
        name: &str,
    ) -> zenoh::Result<Self> {
        let token = node.publisher::<M>(entity, name);
        let publisher = session
            .declare_publisher(wire::key::<M>(node.domain, name))
            .congestion_control(CongestionControl::Drop)
            // Not express: the six of a state go in one batch, so that a busy machine drops none of them for want of room.
            .priority(Priority::RealTime)
            .wait()?;
        Ok(Self {
            publisher,
            gid: gid_of(&token),
            sequence: 0,
            _token: session.liveliness().declare_token(token).wait()?,
        })
    }

    fn put(&mut self, message: &impl Message, bytes: &mut Vec<u8>) -> zenoh::Result<()> {
        message.encode(bytes)?;
        self.sequence += 1;
        let attachment = Attachment {
            sequence: self.sequence,
            sent_ns: i64::try_from(since_1970().as_nanos()).unwrap_or(0),
            gid: self.gid,
        };
        let put = self.publisher.put(bytes.as_slice());
        put.attachment(attachment.encode().as_slice()).wait()
    }
}

/// All topics of a session with a router.
pub(crate) struct RosTopics<'s> {
    settings: RosSettings,
    reference_point: Point3<f64>,
    /// Names of the obstacles' frames, by their place in the scene.
    obstacles: Vec<String>,
    device_pose: Topic<'s>,
    device_buttons: Topic<'s>,
    god_object_pose: Topic<'s>,
    god_object_twist: Topic<'s>,
    hand_wrench: Topic<'s>,
    transforms: Topic<'s>,
    sent: Option<(u16, Duration)>,
    bytes: Vec<u8>,
    _node: LivelinessToken,
}

/// Buttons that do not change are told again after this time, for those who came later.
const BUTTONS_PERIOD: Duration = Duration::from_secs(1);

impl<'s> RosTopics<'s> {
    pub(crate) fn new(
        session: &'s Session,
        name: &str,
        scene: &SceneDescription,
        settings: RosSettings,
    ) -> zenoh::Result<Self> {
        let node = node(session, settings.domain, name, NODE);
        let own = |topic: &str| format!("/{name}/{topic}");
        let n = &node;
        let names = scene.obstacles.iter().enumerate();
        Ok(Self {
            settings,
            reference_point: scene.reference_point.into(),
            obstacles: names
                .map(|(index, body)| obstacle_frame(index, body.name.raw()))
                .collect(),
            device_pose: Topic::new::<PoseStamped<'_>>(session, n, 1, &own("device/pose"))?,
            device_buttons: Topic::new::<Joy<'_>>(session, n, 2, &own("device/buttons"))?,
            god_object_pose: Topic::new::<PoseStamped<'_>>(session, n, 3, &own("god_object/pose"))?,
            god_object_twist: Topic::new::<TwistStamped<'_>>(
                session,
                n,
                4,
                &own("god_object/twist"),
            )?,
            hand_wrench: Topic::new::<WrenchStamped<'_>>(session, n, 5, &own("hand/wrench"))?,
            transforms: Topic::new::<TfMessage<'_>>(session, n, 6, "/tf")?,
            sent: None,
            bytes: Vec::new(),
            _node: session.liveliness().declare_token(node.token()).wait()?,
        })
    }

    /// Says a state. One whose numbers are no pose or beyond the time that ROS can say is left out.
    pub(crate) fn publish(&mut self, state: &HotState) -> zenoh::Result<()> {
        let sampled = Duration::from_nanos(state.sample_time_ns);
        let age = self.settings.session_time.now().saturating_sub(sampled);
        let Some(world) = Header::new(since_1970().saturating_sub(age), WORLD) else {
            return Ok(());
        };
        let Some(tool) = state.tools.first() else {
            return Ok(());
        };
        let (Some(device), Some(body)) = (tool.device.to_isometry(), tool.god_object.to_isometry())
        else {
            return Ok(());
        };
        let at = world.in_frame(REFERENCE_POINT);
        let twist = six(tool.linear_velocity, tool.angular_velocity);
        let wrench = six(tool.force, tool.torque);
        let bytes = &mut self.bytes;
        self.device_pose
            .put(&PoseStamped::new(world, &device), bytes)?;
        self.god_object_pose
            .put(&PoseStamped::new(world, &body), bytes)?;
        self.god_object_twist
            .put(&TwistStamped::new(at, &twist), bytes)?;
        self.hand_wrench
            .put(&WrenchStamped::new(at, &wrench), bytes)?;
        let is_sent = self.sent.is_some_and(|(buttons, when)| {
            buttons == tool.buttons && sampled < when + BUTTONS_PERIOD
        });
        if !is_sent {
            self.sent = Some((tool.buttons, sampled));
            let joy = Joy::new(world.in_frame(DEVICE), tool.buttons);
            self.device_buttons.put(&joy, bytes)?;
        }
        let point: Pose = reference_frame(&device, &self.reference_point);
        let moved = state.bodies.iter().filter_map(|moved| {
            let frame = self.obstacles.get(usize::from(moved.id))?;
            Some((frame.as_str(), moved.pose.to_isometry()?))
        });
        let frames = [
            (DEVICE, device),
            (GOD_OBJECT, body),
            (REFERENCE_POINT, point),
        ];
        let transforms = frames
            .into_iter()
            .chain(moved)
            .map(|(child, pose)| TransformStamped::new(world, child, &pose))
            .collect();
        self.transforms.put(&TfMessage { transforms }, bytes)
    }
}

fn six(linear: [f32; 3], angular: [f32; 3]) -> Vector6 {
    Vector6::from_iterator(linear.into_iter().chain(angular).map(f64::from))
}

fn since_1970() -> Duration {
    SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default()
}
