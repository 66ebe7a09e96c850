//! What may be the next session, while it is read on a thread of its own: who looks after the session that runs has revocations, arming and its end to follow.

use std::io;
use std::thread::{Builder, JoinHandle};

use super::change::{Change, Wanted};
use super::load::{Loader, Next};
use crate::session::Session;
use crate::session::operator::AskedScene;
use crate::shared::failure::Failure;

/// What is being read.
pub(super) enum Pending {
    Wish(AskedScene, JoinHandle<Result<Option<Change>, Failure>>),
    Files(JoinHandle<Result<Next, Failure>>),
}

impl Pending {
    pub(super) fn is_finished(&self) -> bool {
        match self {
            Self::Wish(_, thread) => thread.is_finished(),
            Self::Files(thread) => thread.is_finished(),
        }
    }
}

pub(super) fn make(wanted: Wanted) -> io::Result<JoinHandle<Result<Option<Change>, Failure>>> {
    on_own_thread(move || wanted.make())
}

pub(super) fn load(loader: Loader) -> io::Result<JoinHandle<Result<Next, Failure>>> {
    on_own_thread(move || {
        let mut next = loader.load()?;
        Session::begin(&mut next.setup)?;
        Ok(next)
    })
}

fn on_own_thread<T: Send + 'static>(
    read: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> io::Result<JoinHandle<Result<T, Failure>>> {
    Builder::new().name("scene".to_owned()).spawn(read)
}

pub(super) fn joined<T>(thread: JoinHandle<Result<T, Failure>>) -> Result<T, Failure> {
    thread.join().unwrap_or_else(|_| {
        Err(Failure::failed(
            "the program broke down over it; look at the server's log",
        ))
    })
}
