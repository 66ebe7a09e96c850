//! The server asks for pictures of what this node shows; the frame loop gives them when it has shown a frame.
//!
//! Writer: the task of the link, which puts one question at a time there. Reader: the frame loop, which looks once per turn.

use super::inbound::lock;
use crate::framing::{WriteMessageError, peer_text, read_message, write_message};
use quinn::{Connection, RecvStream, SendStream};
use std::{
    sync::{Arc, Mutex},
    time::Duration,
};
use taut_proto::{
    VersionRange,
    control::{ControlMessage, NoPicture, PictureHeader},
    picture::{MAX_NODE_PICTURES, MAX_PICTURE_BYTES},
};
use tokio::{
    sync::oneshot,
    time::{sleep, timeout},
};

/// Time for a question to come, once its stream is open.
const QUESTION_TIME: Duration = Duration::from_secs(3);
/// Longest that the frame loop is waited for: shorter than the server waits, which hears why.
const FRAME_PATIENCE: Duration = Duration::from_secs(6);
/// Shortest time between two answers: drawing goes first.
const REST: Duration = Duration::from_millis(500);
/// Most bytes of the question.
const MAX_QUESTION_BYTES: usize = 64;
/// Bytes of a picture that are written at a time, and the rest after them: 8 MiB a second, a fifteenth of a gigabit link, so that what the device and the
/// other nodes send to the server finds room.
const CHUNK_BYTES: usize = 32 << 10;
/// See [`CHUNK_BYTES`].
const CHUNK_REST: Duration = Duration::from_millis(4);
/// Pictures go after everything else.
const PICTURE_PRIORITY: i32 = -1;

/// A picture of what a node shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShownPicture {
    /// Name of the screen, and of the eye where it has a picture of its own.
    pub screen: String,
    /// Session time when it was shown, ns.
    pub shown_ns: u64,
    /// Pixels across and down.
    pub size: (u16, u16),
    /// A PNG.
    pub png: Vec<u8>,
}

/// The pictures; or why there are none, for people.
pub type Shown = Result<Vec<ShownPicture>, String>;

/// Somebody at the server wants to see what this node shows. Dropped, it is answered with no.
#[derive(Debug)]
pub struct PictureAsk {
    longest_edge: u16,
    answer: oneshot::Sender<Shown>,
}

/// Where a question waits for the frame loop.
pub(crate) type PictureSlot = Arc<Mutex<Option<PictureAsk>>>;

impl PictureAsk {
    /// Most pixels of the longer edge of a picture.
    #[must_use]
    pub fn longest_edge(&self) -> u16 {
        self.longest_edge
    }

    /// Gives the pictures, from any thread.
    pub fn answer(self, shown: Shown) {
        let _ = self.answer.send(shown); // nobody waits any more
    }
}

/// Takes questions until the connection ends.
pub(crate) async fn listen(connection: Connection, version: u8, slot: PictureSlot) {
    while let Ok((send, recv)) = connection.accept_bi().await {
        if let Err(error) = attend(send, recv, version, &slot).await {
            tracing::debug!("pictures for the server: {error}");
        }
        sleep(REST).await;
    }
}

async fn attend(
    mut send: SendStream,
    mut recv: RecvStream,
    version: u8,
    slot: &PictureSlot,
) -> Result<(), WriteMessageError> {
    let spoken = VersionRange::only(version);
    let question = read_message(&mut recv, MAX_QUESTION_BYTES, spoken);
    let Ok(Ok(ControlMessage::PictureRequest(request))) = timeout(QUESTION_TIME, question).await
    else {
        return Ok(()); // dropping the streams resets them
    };
    let (answer, shown) = oneshot::channel();
    *lock(slot) = Some(PictureAsk {
        longest_edge: request.longest_edge,
        answer,
    });
    let shown = match timeout(FRAME_PATIENCE, shown).await {
        Ok(Ok(shown)) => shown,
        Ok(Err(_)) => Err("it was busy with another scene; ask again".to_owned()),
        Err(_) => Err(format!(
            "it showed no frame within {} s; look at its screen",
            FRAME_PATIENCE.as_secs()
        )),
    };
    lock(slot).take();
    let _ = send.set_priority(PICTURE_PRIORITY); // fails only if the stream is gone, and then writing fails, too
    match shown.and_then(check) {
        Ok(pictures) => write_pictures(&mut send, &pictures, version).await?,
        Err(reason) => {
            let none = ControlMessage::NoPicture(NoPicture {
                reason: reason.into(),
            });
            write_message(&mut send, &none, version).await?;
        }
    }
    let _ = send.finish();
    Ok(())
}

/// Refuses what the server would refuse.
fn check(pictures: Vec<ShownPicture>) -> Shown {
    let is_fit = |picture: &ShownPicture| {
        u32::try_from(picture.png.len()).is_ok_and(|length| length <= MAX_PICTURE_BYTES)
    };
    if pictures.is_empty() || pictures.len() > MAX_NODE_PICTURES {
        return Err(format!(
            "it shows {} pictures, and 1 to {MAX_NODE_PICTURES} can be sent",
            pictures.len()
        ));
    }
    match pictures.iter().find(|picture| !is_fit(picture)) {
        None => Ok(pictures),
        Some(large) => Err(format!(
            "the picture of {} takes {} bytes, and at most {MAX_PICTURE_BYTES} can be sent",
            large.screen,
            large.png.len()
        )),
    }
}

async fn write_pictures(
    send: &mut SendStream,
    pictures: &[ShownPicture],
    version: u8,
) -> Result<(), WriteMessageError> {
    for (place, picture) in pictures.iter().enumerate() {
        let (width, height) = picture.size;
        let header = ControlMessage::PictureHeader(PictureHeader {
            screen: picture.screen.as_str().into(),
            shown_ns: picture.shown_ns,
            width,
            height,
            length: picture.png.len() as u32, // checked
            more: place + 1 < pictures.len(),
        });
        write_message(send, &header, version).await?;
        for chunk in picture.png.chunks(CHUNK_BYTES) {
            let written = send.write_all(chunk).await;
            written.map_err(|error| WriteMessageError::Ended(peer_text(&error)))?;
            sleep(CHUNK_REST).await;
        }
    }
    Ok(())
}
