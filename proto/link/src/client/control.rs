//! What the server tells on the control stream after the join.

use super::hot::Hot;
use crate::framing::{CLOSE_PROTOCOL, ReadMessageError, read_message};
use quinn::RecvStream;
use std::{sync::Arc, time::Instant};
use taut_proto::{
    VersionRange,
    control::{ControlMessage, MAX_FRAME_BYTES},
};

/// `all_states`: the client wants every state, so that the group's are for it. Reads until the stream or the connection ends.
pub(crate) async fn listen(hot: Arc<Hot>, mut recv: RecvStream, all_states: bool) {
    let agreed = VersionRange::only(hot.version);
    let reason = loop {
        match read_message(&mut recv, MAX_FRAME_BYTES, agreed).await {
            Ok(ControlMessage::Group(group)) => {
                hot.group.learn(group, hot.inbound.local_ns(Instant::now()));
                hot.follow_group(all_states);
            }
            Ok(ControlMessage::Events(batch)) => {
                hot.inbound.receive_events(&batch);
                hot.acknowledge();
            }
            Ok(other) => break format!("the server sent {}", other.name()),
            Err(error @ (ReadMessageError::Decode(_) | ReadMessageError::Stalled)) => {
                break error.to_string();
            }
            Err(ReadMessageError::Ended(_)) => return,
        }
    };
    hot.connection.close(CLOSE_PROTOCOL, reason.as_bytes());
}
