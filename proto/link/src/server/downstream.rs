//! What the server tells a client on its control stream after the join: the group, and discrete events.

use super::{session::Session, shared::Shared};
use crate::framing::{WriteMessageError, close_text, peer_text, write_message};
use quinn::SendStream;
use taut_proto::{EventsTold, control::ControlMessage};

/// Writes until the stream or the connection ends; returns why it ended.
pub(crate) async fn tell(shared: &Shared, session: &Session, send: SendStream) -> String {
    if let Err(WriteMessageError::Encode(error)) = write(shared, session, send).await {
        return format!("the server could not tell it all: {error}");
    }
    close_text(&session.connection.closed().await, "the node")
}

async fn write(
    shared: &Shared,
    session: &Session,
    mut send: SendStream,
) -> Result<(), WriteMessageError> {
    let ended = |error: quinn::WriteError| WriteMessageError::Ended(peer_text(&error));
    let (mut group, mut events) = (shared.group.follow(), shared.discrete.follow());
    let mut newest = session.after_event;
    let entry = EventsTold {
        after: newest,
        records: Vec::new(),
    };
    write_message(&mut send, &ControlMessage::Events(entry)).await?;
    loop {
        let told = group.borrow_and_update().clone();
        // Before its first own group, the newest one may be that of the others.
        if let Some(told) = told.filter(|told| told.group.member(session.number).is_some()) {
            send.write_all(&told.frame).await.map_err(ended)?;
        }
        // Until the group changes again.
        loop {
            newest = tell_events(shared, newest, &mut events, &mut send).await?;
            tokio::select! {
                changed = group.changed() => match changed {
                    Ok(()) => break,
                    Err(_) => return Ok(()), // the server stops
                },
                changed = events.changed() => match changed {
                    Ok(()) => {}
                    Err(_) => return Ok(()),
                },
            }
        }
    }
}

/// Tells what came after event `newest`; returns the number of the last.
async fn tell_events(
    shared: &Shared,
    mut newest: u32,
    events: &mut tokio::sync::watch::Receiver<u32>,
    send: &mut SendStream,
) -> Result<u32, WriteMessageError> {
    events.mark_unchanged();
    loop {
        let told = shared.discrete.told_after(newest);
        let Some(last) = told.records.last() else {
            return Ok(newest);
        };
        newest = last.id;
        write_message(send, &ControlMessage::Events(told)).await?;
    }
}
