//! The topics of an export, and how a record becomes messages on them.

use std::collections::BTreeMap;
use std::io::Write;
use std::time::Duration;

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, McapResult, WriteOptions, Writer};

use taut_ros::{
    Header, Joy, Message, PoseStamped, TfMessage, TransformStamped, TwistStamped, WrenchStamped,
    obstacle_frame, reference_frame,
};

use super::run::SceneFrames;
use crate::records::{ForceRecord, HapticsRecord, UpdateRecord};

const WORLD: &str = "world";
const DEVICE: &str = "device";
const GOD_OBJECT: &str = "god_object";
/// At the reference point of the body where the device is, with the axes of the world: where wrenches and twists stand.
const REFERENCE_POINT: &str = "reference_point";

struct Topic {
    channel: u16,
    messages: u32,
}

/// The file that grows, and room for a message on its way there.
struct Output<W: Write> {
    writer: Writer<NoSeek<W>>,
    bytes: Vec<u8>,
    /// Of all topics.
    messages: u64,
}

/// What is written into it.
pub(super) struct Topics<'a, W: Write> {
    out: Output<W>,
    scene: Option<&'a SceneFrames>,
    device_pose: Topic,
    device_twist: Topic,
    device_buttons: Topic,
    hand_wrench: Topic,
    god_object_pose: Topic,
    coupling_wrench: Topic,
    transforms: Topic,
    /// Name of its frame, and its topic.
    obstacles: Vec<(String, Topic)>,
    buttons: Option<u16>,
    /// When the device was where it was told to be last.
    newest_sample: Option<Duration>,
}

impl<'a, W: Write> Topics<'a, W> {
    pub(super) fn create(out: W, scene: Option<&'a SceneFrames>) -> McapResult<Self> {
        let writer = WriteOptions::new()
            .profile("ros2")
            .library(concat!("taut ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            .disable_seeking(true)
            .create(NoSeek::new(out))?;
        let mut out = Output {
            writer,
            bytes: Vec::new(),
            messages: 0,
        };
        let obstacles = scene.map_or(&[][..], |scene| &scene.obstacles);
        Ok(Self {
            device_pose: out.topic::<PoseStamped<'_>>("/device/pose")?,
            device_twist: out.topic::<TwistStamped<'_>>("/device/twist")?,
            device_buttons: out.topic::<Joy<'_>>("/device/buttons")?,
            hand_wrench: out.topic::<WrenchStamped<'_>>("/hand/wrench")?,
            god_object_pose: out.topic::<PoseStamped<'_>>("/god_object/pose")?,
            coupling_wrench: out.topic::<WrenchStamped<'_>>("/coupling/wrench")?,
            transforms: out.topic::<TfMessage<'_>>("/tf")?,
            obstacles: obstacles
                .iter()
                .map(|obstacle| {
                    let frame = obstacle_frame(obstacle.index, &obstacle.name);
                    let topic = out.topic::<PoseStamped<'_>>(&format!("/{frame}/pose"))?;
                    Ok((frame, topic))
                })
                .collect::<McapResult<_>>()?,
            out,
            scene,
            buttons: None,
            newest_sample: None,
        })
    }

    /// Where the device was, what it did, and what the hand felt.
    pub(super) fn tick(&mut self, record: &HapticsRecord) -> McapResult<()> {
        let headers = [record.tick, record.time].map(|time| Header::new(time, REFERENCE_POINT));
        let [Some(at), Some(sampled)] = headers else {
            return Ok(()); // its reader leaves out such times
        };
        let wrench = WrenchStamped::new(at, &record.wrench);
        self.out.put(&mut self.hand_wrench, record.tick, &wrench)?;
        if record.faulty {
            return Ok(()); // the pose is that of the tick before
        }
        if self.buttons.replace(record.buttons) != Some(record.buttons) {
            let joy = Joy::new(sampled.in_frame(DEVICE), record.buttons);
            self.out.put(&mut self.device_buttons, record.tick, &joy)?;
        }
        if self.newest_sample.replace(record.time) == Some(record.time) {
            return Ok(()); // the last sample, read again: readers of transforms complain of a time that comes twice
        }
        let world = sampled.in_frame(WORLD);
        let pose = PoseStamped::new(world, &record.pose);
        self.out.put(&mut self.device_pose, record.tick, &pose)?;
        let twist = TwistStamped::new(sampled, &record.velocity);
        self.out.put(&mut self.device_twist, record.tick, &twist)?;
        let mut transforms = vec![TransformStamped::new(world, DEVICE, &record.pose)];
        if let Some(scene) = self.scene {
            let point = reference_frame(&record.pose, &scene.reference_point);
            transforms.push(TransformStamped::new(world, REFERENCE_POINT, &point));
        }
        let message = TfMessage { transforms };
        self.out.put(&mut self.transforms, record.tick, &message)
    }

    /// Where the god-object came to, and where obstacles were sent, at the time at which that was published.
    pub(super) fn update(&mut self, record: &UpdateRecord) -> McapResult<()> {
        let time = record.published;
        let Some(world) = Header::new(time, WORLD) else {
            return Ok(());
        };
        let pose = PoseStamped::new(world, &record.pose);
        self.out.put(&mut self.god_object_pose, time, &pose)?;
        let mut transforms = vec![TransformStamped::new(world, GOD_OBJECT, &record.pose)];
        let moving = self.scene.map_or(&[][..], |scene| &scene.obstacles);
        for (obstacle, (frame, topic)) in moving.iter().zip(&mut self.obstacles) {
            let pose = (obstacle.pose_at)(record.obstacle_time.as_secs_f64());
            let message = PoseStamped::new(world, &pose);
            self.out.put(topic, time, &message)?;
            transforms.push(TransformStamped::new(world, frame, &pose));
        }
        let message = TfMessage { transforms };
        self.out.put(&mut self.transforms, time, &message)
    }

    /// What the coupling answered, before the safety stage.
    pub(super) fn force(&mut self, record: &ForceRecord) -> McapResult<()> {
        let Some(at) = Header::new(record.time, REFERENCE_POINT) else {
            return Ok(());
        };
        let wrench = WrenchStamped::new(at, &record.wrench);
        self.out
            .put(&mut self.coupling_wrench, record.time, &wrench)
    }

    pub(super) fn messages(&self) -> u64 {
        self.out.messages
    }

    /// Says in the file what it is, and ends it.
    pub(super) fn finish(mut self, about: Metadata) -> McapResult<()> {
        let writer = &mut self.out.writer;
        writer.write_metadata(&about)?;
        writer.finish()?;
        let mut file = self.out.writer.into_inner().into_inner();
        file.flush().map_err(McapError::Io)
    }
}

impl<W: Write> Output<W> {
    fn topic<M: Message>(&mut self, name: &str) -> McapResult<Topic> {
        let schema = self
            .writer
            .add_schema(M::NAME, "ros2msg", M::schema().as_bytes())?;
        // MCAP's profile of ROS 2 requires the list; nobody offered these messages on a network, so it is empty.
        let qos = ("offered_qos_profiles".to_owned(), "[]".to_owned());
        let channel = self
            .writer
            .add_channel(schema, name, "cdr", &BTreeMap::from([qos]))?;
        Ok(Topic {
            channel,
            messages: 0,
        })
    }

    fn put(&mut self, topic: &mut Topic, time: Duration, message: &impl Message) -> McapResult<()> {
        message.encode(&mut self.bytes)?;
        let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.messages,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        topic.messages = topic.messages.wrapping_add(1);
        self.messages += 1;
        self.writer.write_to_known_channel(&header, &self.bytes)
    }
}
