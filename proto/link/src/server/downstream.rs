//! What the server tells a client on its control stream after the join: the group.

use super::{session::Session, shared::Shared};
use crate::framing::close_text;
use quinn::SendStream;

/// Writes until the stream or the connection ends; returns why it ended.
pub(crate) async fn tell(shared: &Shared, session: &Session, mut send: SendStream) -> String {
    let mut group = shared.group.follow();
    loop {
        let told = group.borrow_and_update().clone();
        // Before its first own group, the newest one may be that of the others.
        if let Some(told) = told.filter(|told| told.group.member(session.number).is_some())
            && send.write_all(&told.frame).await.is_err()
        {
            break;
        }
        if group.changed().await.is_err() {
            break; // the server stops
        }
    }
    close_text(&session.connection.closed().await, "the node")
}
