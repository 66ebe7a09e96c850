//! Names and metadata by which `rmw_zenoh_cpp` finds messages: one key expression per topic, a liveliness token per node and endpoint, an attachment per
//! message.
//!
//! ```text
//! key         DOMAIN/TOPIC/PACKAGE::msg::dds_::TYPE_/HASH
//! node        @ros2_lv/DOMAIN/SESSION/0/0/NN/%/NAMESPACE/NODE
//! endpoint    @ros2_lv/DOMAIN/SESSION/0/ENTITY/MP/%/NAMESPACE/NODE/TOPIC/PACKAGE::msg::dds_::TYPE_/HASH/QOS      (MS for a subscription)
//! attachment  sequence number (8 bytes), time of sending (8 bytes, ns since 1970), 16, GID (16 bytes); little-endian
//! ```
//!
//! In tokens every `/` of a name is a `%`. GID is XXH3 with 128 bits of the endpoint's token, the lower half first. QOS lists what differs from the default
//! (reliable, volatile, the last 42): best effort and the last 10 are `2::,10:,:,:,,`.
//!
//! Sources: docs/design.md of ros2/rmw_zenoh (branch jazzy), and `liveliness_utils.cpp`, `attachment_helpers.cpp` of `rmw_zenoh_cpp` there. rmw_zenoh itself was
//! not run; the tests hold tokens and attachments that others captured of it.

use std::fmt;

use twox_hash::XxHash3_128;

use crate::messages::Message;

/// Best effort, the last 10.
const QOS: &str = "2::,10:,:,:,,";
/// Bytes of an attachment.
pub const ATTACHMENT_BYTES: usize = 33;
const GID_BYTES: usize = 16;

/// A domain of ROS 2, as `ROS_DOMAIN_ID` has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Domain(pub u8);

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The name of a message's type in keys and tokens.
#[must_use]
pub fn type_name<M: Message>() -> String {
    match M::NAME.split_once("/msg/") {
        Some((package, name)) => format!("{package}::msg::dds_::{name}_"),
        None => M::NAME.to_owned(),
    }
}

/// The key of a topic, such as `/hand/wrench`.
#[must_use]
pub fn key<M: Message>(domain: Domain, topic: &str) -> String {
    let topic = topic.trim_matches('/');
    format!("{domain}/{topic}/{}/{}", type_name::<M>(), M::HASH)
}

/// A node, as its tokens name it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// Its domain.
    pub domain: Domain,
    /// The Zenoh session, in hexadecimal digits without leading zeros.
    pub session: String,
    /// Absolute; `/` for none.
    pub namespace: String,
    /// Its name.
    pub name: String,
}

impl Node {
    /// The node's own token.
    #[must_use]
    pub fn token(&self) -> String {
        self.part("0", "NN")
    }

    /// The token of a publisher; `entity` tells those of a session apart.
    #[must_use]
    pub fn publisher<M: Message>(&self, entity: u32, topic: &str) -> String {
        self.endpoint::<M>(entity, "MP", topic)
    }

    /// The token of a subscription.
    #[must_use]
    pub fn subscription<M: Message>(&self, entity: u32, topic: &str) -> String {
        self.endpoint::<M>(entity, "MS", topic)
    }

    fn endpoint<M: Message>(&self, entity: u32, kind: &str, topic: &str) -> String {
        let node = self.part(&entity.to_string(), kind);
        let (kind, hash) = (type_name::<M>(), M::HASH);
        format!("{node}/{}/{kind}/{hash}/{QOS}", mangled(topic))
    }

    fn part(&self, entity: &str, kind: &str) -> String {
        let Self {
            domain,
            session,
            namespace,
            name,
        } = self;
        let namespace = mangled(namespace);
        format!("@ros2_lv/{domain}/{session}/0/{entity}/{kind}/%/{namespace}/{name}")
    }
}

fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

/// What goes beside each message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Counts the messages of a publisher from 1.
    pub sequence: i64,
    /// When it was sent, ns since 1970 on the sender's clock.
    pub sent_ns: i64,
    /// Who sent it.
    pub gid: [u8; GID_BYTES],
}

/// The GID of the endpoint with this token.
#[must_use]
pub fn gid_of(token: &str) -> [u8; GID_BYTES] {
    // The lower half first, each with its lowest byte first: the whole number so.
    XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

impl Attachment {
    /// Its bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; ATTACHMENT_BYTES] {
        let mut bytes = [0; ATTACHMENT_BYTES];
        bytes[..8].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.sent_ns.to_le_bytes());
        bytes[16] = GID_BYTES as u8;
        bytes[17..].copy_from_slice(&self.gid);
        bytes
    }

    /// Reads it; `None` where it is none.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; ATTACHMENT_BYTES] = bytes.try_into().ok()?;
        let (sequence, rest) = bytes.split_first_chunk::<8>()?;
        let (sent_ns, rest) = rest.split_first_chunk::<8>()?;
        let (length, gid) = rest.split_first()?;
        if usize::from(*length) != GID_BYTES {
            return None;
        }
        Some(Self {
            sequence: i64::from_le_bytes(*sequence),
            sent_ns: i64::from_le_bytes(*sent_ns),
            gid: gid.try_into().ok()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{PoseStamped, TfMessage, WrenchStamped};

    fn bytes(hex: &str) -> Vec<u8> {
        let pair = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal");
        (0..hex.len()).step_by(2).map(pair).collect()
    }

    /// Captured by others of rmw_zenoh 0.2.11 (Jazzy): the token of a publisher, and the attachment of one of its messages.
    const CAPTURED: [(&str, &str); 3] = [
        (
            "@ros2_lv/0/45000cc3452ec777e9664270c90b5af/0/4/MP/%/%/p_be/%q_best_effort/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/2::,10:,:,:,,",
            "150000000000000058d1b24cf9a2dc1810a4461b1ae3b3b1de4a54c9c5e9e88fd0",
        ),
        (
            "@ros2_lv/0/a52f44b281e33efee354a095ad96d9e9/0/11/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,",
            "1a0000000000000005301f32f9a2dc18103e1e8c9234b1602a9dba5860eed86e33",
        ),
        (
            "@ros2_lv/7/6977b59f87229328a8d406ad77b301a6/0/11/MP/%/%cell4/gw/%cell4%chatter/std_msgs::msg::dds_::String_/RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18/::,7:,:,:,,",
            "1a00000000000000699e1332f9a2dc1810b7aef695b2cd04ba45f9eed0c4a6c584",
        ),
    ];

    #[test]
    fn attachments_and_gids_are_those_that_were_captured_of_rmw_zenoh() {
        for (token, hex) in CAPTURED {
            let captured = bytes(hex);
            let read = Attachment::decode(&captured).expect("33 bytes");
            assert_eq!(read.gid, gid_of(token), "{token}");
            assert!(read.sequence > 0);
            assert_eq!(read.encode().as_slice(), captured);
            for cut in 0..captured.len() {
                assert_eq!(Attachment::decode(&captured[..cut]), None);
            }
            let mut other = captured.clone();
            other[16] = 15;
            assert_eq!(Attachment::decode(&other), None);
        }
    }

    #[test]
    fn tokens_and_keys_have_the_parts_of_those_that_were_captured() {
        let node = Node {
            domain: Domain(7),
            session: "6977b59f87229328a8d406ad77b301a6".to_owned(),
            namespace: "/cell4".to_owned(),
            name: "gw".to_owned(),
        };
        assert_eq!(
            node.token(),
            "@ros2_lv/7/6977b59f87229328a8d406ad77b301a6/0/0/NN/%/%cell4/gw"
        );
        assert_eq!(
            node.publisher::<PoseStamped<'_>>(11, "/cell4/device/pose"),
            "@ros2_lv/7/6977b59f87229328a8d406ad77b301a6/0/11/MP/%/%cell4/gw/%cell4%device%pose/geometry_msgs::msg::dds_::PoseStamped_/RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8/2::,10:,:,:,,"
        );
        let subscription = node.subscription::<WrenchStamped<'_>>(1, "/w");
        assert!(
            subscription
                .contains("/0/1/MS/%/%cell4/gw/%w/geometry_msgs::msg::dds_::WrenchStamped_/")
        );
        let alone = Node {
            namespace: "/".to_owned(),
            ..node
        };
        assert!(alone.token().ends_with("/NN/%/%/gw"));
        assert_eq!(
            key::<TfMessage<'_>>(Domain(0), "/tf"),
            "0/tf/tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
        );
    }
}
