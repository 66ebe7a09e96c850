//! What the server tells a client on its control stream after the join: the group, and discrete events.

use super::{session::Session, shared::Shared};
use crate::framing::{WriteMessageError, close_text, write_frame, write_message};
use quinn::SendStream;
use taut_proto::{EventBatch, control::ControlMessage};

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
    let (mut group, mut events) = (shared.group.follow(), shared.discrete.follow());
    let mut newest = session.after_event;
    let entry = EventBatch {
        after: newest,
        records: Vec::new(),
    };
    let version = session.version;
    write_message(&mut send, &ControlMessage::Events(entry), version).await?;
    loop {
        let announced = group.borrow_and_update().clone();
        // Before its first own group, the newest one may be that of the others.
        if let Some(new) = announced.filter(|new| new.group.member(session.number).is_some()) {
            write_frame(&mut send, &new.frame, version).await?;
        }
        // Until the group changes again.
        loop {
            newest = tell_events(shared, newest, &mut events, &mut send, version).await?;
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
    version: u8,
) -> Result<u32, WriteMessageError> {
    events.mark_unchanged();
    loop {
        let batch = shared.discrete.batch_after(newest);
        let Some(last) = batch.records.last() else {
            return Ok(newest);
        };
        newest = last.id;
        write_message(send, &ControlMessage::Events(batch), version).await?;
    }
}
