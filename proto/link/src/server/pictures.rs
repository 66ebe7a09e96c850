//! Asks render nodes for pictures of what they show. A node is nobody's friend: what it sends is bounded before it is read, in size, number and time.

use super::{session::Session, shared::Shared};
use crate::framing::{ReadMessageError, close_text, peer_text, read_message, write_message};
use quinn::{RecvStream, VarInt};
use std::{
    sync::{
        Arc, Weak,
        atomic::{AtomicUsize, Ordering},
        mpsc::{Receiver, Sender, channel},
    },
    time::Duration,
};
use taut_proto::{
    Role, Untrusted, VersionRange,
    control::{ControlMessage, Offers, PictureHeader, PictureRequest},
    picture::{MAX_NODE_PICTURES, MAX_PICTURE_EDGE},
};
use tokio::{runtime::Handle, time::timeout};

/// Longest that a node is waited for, with all its pictures: it draws a frame, compresses it, and sends some megabytes at its own pace.
pub const PICTURE_PATIENCE: Duration = Duration::from_secs(10);
/// Most bytes of pictures of all nodes that are held: some forty of the usual size.
pub const MAX_ASKED_BYTES: usize = 64 << 20;
/// Most bytes of a message before a picture: a name of the longest text and five numbers.
const MAX_HEADER_BYTES: usize = 1400;

/// A picture as it came. Nothing is known of its bytes but their number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodePicture {
    /// Name of the screen, and of the eye where it has a picture of its own.
    pub screen: Untrusted,
    /// For how long it had been shown when it came.
    pub age: Duration,
    /// Pixels across and down, as the node says.
    pub size: (u16, u16),
    /// What should be a PNG.
    pub png: Vec<u8>,
}

/// What came of asking one node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureAnswer {
    /// Its name.
    pub node: String,
    /// Its pictures; or why there are none, for people.
    pub pictures: Result<Vec<NodePicture>, String>,
}

/// Asks the nodes of one session, from any thread.
#[derive(Clone, Debug)]
pub struct PictureAsker {
    shared: WeakShared,
    runtime: Handle,
}

#[derive(Clone)]
struct WeakShared(Weak<Shared>);

impl std::fmt::Debug for WeakShared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("WeakShared")
    }
}

impl PictureAsker {
    pub(super) fn new(shared: &Arc<Shared>, runtime: Handle) -> Self {
        Self {
            shared: WeakShared(Arc::downgrade(shared)),
            runtime,
        }
    }

    /// Asks every render node that is in, all at once. Does not wait: the answers come one by one, each within [`PICTURE_PATIENCE`], and after the last the
    /// channel is closed. All together hold at most [`MAX_ASKED_BYTES`].
    #[must_use]
    pub fn ask(&self) -> Receiver<PictureAnswer> {
        let (answers, receiver) = channel();
        let Some(shared) = self.shared.0.upgrade() else {
            return receiver;
        };
        let room = Arc::new(AtomicUsize::new(MAX_ASKED_BYTES));
        for session in shared.sessions.all().iter() {
            if session.role == Role::Render {
                let asking = ask_node(
                    shared.clone(),
                    session.clone(),
                    room.clone(),
                    answers.clone(),
                );
                self.runtime.spawn(asking);
            }
        }
        receiver
    }
}

async fn ask_node(
    shared: Arc<Shared>,
    session: Arc<Session>,
    room: Arc<AtomicUsize>,
    answers: Sender<PictureAnswer>,
) {
    let pictures = if session.offers.has(Offers::PICTURES) {
        timeout(PICTURE_PATIENCE, exchange(&shared, &session, &room))
            .await
            .unwrap_or_else(|_| {
                let seconds = PICTURE_PATIENCE.as_secs();
                Err(format!("it did not answer within {seconds} s"))
            })
    } else {
        Err("it runs an older taut, which sends no pictures: update it".to_owned())
    };
    let node = session.node.clone();
    // Nobody listens where the page's server is gone.
    let _ = answers.send(PictureAnswer { node, pictures });
}

/// Dropping the streams, as a time-out does, tells the node to send no more.
async fn exchange(
    shared: &Shared,
    session: &Session,
    room: &AtomicUsize,
) -> Result<Vec<NodePicture>, String> {
    let connection = &session.connection;
    let ended = |text: String| {
        let closed = connection.close_reason();
        closed.map_or(text, |error| close_text(&error, "the node"))
    };
    let opened = connection.open_bi().await;
    let (mut send, mut recv) = opened.map_err(|error| close_text(&error, "the node"))?;
    let request = ControlMessage::PictureRequest(PictureRequest {
        longest_edge: MAX_PICTURE_EDGE,
    });
    write_message(&mut send, &request, session.version)
        .await
        .map_err(|error| ended(error.to_string()))?;
    let _ = send.finish(); // fails only if the stream is gone, and then reading fails too
    let read = read_pictures(shared, session, room, &mut recv).await;
    if read.is_err() {
        let _ = recv.stop(VarInt::from_u32(0)); // it is over already
    }
    read.map_err(ended)
}

async fn read_pictures(
    shared: &Shared,
    session: &Session,
    room: &AtomicUsize,
    recv: &mut RecvStream,
) -> Result<Vec<NodePicture>, String> {
    let spoken = VersionRange::only(session.version);
    let mut pictures = Vec::new();
    loop {
        let header = match read_message(recv, MAX_HEADER_BYTES, spoken).await {
            Ok(ControlMessage::PictureHeader(header)) => header,
            Ok(ControlMessage::NoPicture(none)) => return Err(none.reason.to_string()),
            Ok(other) => return Err(format!("it answered with {}", other.name())),
            Err(ReadMessageError::Ended(reason)) => {
                return Err(format!("it sent no whole picture: {reason}"));
            }
            Err(error) => return Err(format!("what it sent is no picture: {error}")),
        };
        let png = read_bytes(recv, &header, room).await?;
        let shown = header.shown_ns.min(shared.clock.now_ns());
        pictures.push(NodePicture {
            screen: header.screen,
            age: Duration::from_nanos(shared.clock.now_ns() - shown),
            size: (header.width, header.height),
            png,
        });
        if !header.more {
            return Ok(pictures);
        }
        if pictures.len() == MAX_NODE_PICTURES {
            return Err(format!(
                "it has more than {MAX_NODE_PICTURES} pictures: none are taken"
            ));
        }
    }
}

/// The bytes that a header announces. Memory grows with what arrives, and all nodes share `room`.
async fn read_bytes(
    recv: &mut RecvStream,
    header: &PictureHeader,
    room: &AtomicUsize,
) -> Result<Vec<u8>, String> {
    let length = header.length as usize; // at most MAX_PICTURE_BYTES: checked where it was decoded
    let take = |left: usize| left.checked_sub(length);
    if room
        .fetch_update(Ordering::Relaxed, Ordering::Relaxed, take)
        .is_err()
    {
        let most = MAX_ASKED_BYTES >> 20;
        return Err(format!(
            "the pictures of all nodes take more than {most} MiB: this one's are left out"
        ));
    }
    let mut bytes = Vec::new();
    while bytes.len() < length {
        match recv.read_chunk(length - bytes.len(), true).await {
            Ok(Some(chunk)) => bytes.extend_from_slice(&chunk.bytes),
            Ok(None) => return Err(format!("{} of {length} bytes came", bytes.len())),
            Err(error) => return Err(peer_text(&error)),
        }
    }
    Ok(bytes)
}
