//! Operator → the thread that looks after the session: a wish to change the scene, one at a time.
//!
//! * Writer of wishes: the page's thread. Reader: the thread of `taut serve`, which answers each.
//! * Writer of what is shown: the latter.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use serde::Deserialize;
use taut_observers::{Answer, Outcome};

use super::scene_view::Standing;
use crate::shared::lock::lock;

/// Answer where the one who was asked is gone.
const NOT_TAKEN: &str = "not taken: the session ended meanwhile; look, and ask again";

/// How an operator wants the scene.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub(crate) struct SceneWish {
    /// Of the scene that he saw; another is not changed. `None`: whatever runs.
    #[serde(default)]
    pub(crate) revision: Option<u64>,
    /// Another scene, one of `[operator] scenes`.
    #[serde(default)]
    pub(crate) scene: Option<String>,
    /// Keys, each as `NAME.KEY=VALUE`.
    #[serde(default)]
    pub(crate) edits: Vec<String>,
    /// Whether the scene's file is to have it, too.
    #[serde(default)]
    pub(crate) keep: bool,
    /// Whether the session is to be recorded: another one of the same scene begins.
    #[serde(default)]
    pub(crate) recording: Option<bool>,
}

/// A wish, who made it, and where the answer goes. Dropped, it is answered with no.
#[derive(Debug)]
pub(crate) struct AskedScene {
    pub(crate) wish: SceneWish,
    pub(crate) peer: SocketAddr,
    desk: Arc<SceneDesk>,
    answer: Arc<Mutex<Option<Answer>>>,
}

impl AskedScene {
    pub(crate) fn answer(self, answer: Answer) {
        *lock(&self.answer) = Some(answer);
    }
}

impl Drop for AskedScene {
    fn drop(&mut self) {
        lock(&self.answer).get_or_insert_with(|| Err(NOT_TAKEN.to_owned()));
        lock(&self.desk.state).is_busy = false;
    }
}

#[derive(Debug)]
struct State {
    /// Why nobody changes the scene from here.
    closed: Option<String>,
    /// Why nobody begins or ends a recording from here.
    not_recorded: Option<String>,
    revision: u64,
    /// The scene, a JSON object.
    shown: Arc<str>,
    waiting: Option<AskedScene>,
    /// From a wish to its answer.
    is_busy: bool,
}

/// Where wishes are handed over.
#[derive(Debug)]
pub(crate) struct SceneDesk {
    state: Mutex<State>,
}

impl Default for SceneDesk {
    fn default() -> Self {
        Self {
            state: Mutex::new(State {
                closed: Some("this session takes no changes of its scene".to_owned()),
                not_recorded: Some("this session takes no changes from a page".to_owned()),
                revision: 1,
                shown: "null".into(),
                waiting: None,
                is_busy: false,
            }),
        }
    }
}

impl SceneDesk {
    /// Shows this scene from now on; `objects` is a JSON object.
    pub(crate) fn show(&self, standing: &Standing<'_>, objects: &str) {
        let mut state = lock(&self.state);
        let said = serde_json::to_string(standing).unwrap_or_default();
        state.shown = format!(r#"{{"standing":{said},"scene":{objects}}}"#).into();
        state.revision = standing.revision;
        state.closed = standing.why_closed.map(str::to_owned);
        state.not_recorded = standing.why_not_recorded.map(str::to_owned);
    }

    /// The scene, a JSON object.
    pub(crate) fn shown(&self) -> Arc<str> {
        lock(&self.state).shown.clone()
    }

    /// Which scene it is: the first is 1, and each that takes the place of another counts on.
    pub(crate) fn revision(&self) -> u64 {
        lock(&self.state).revision
    }

    /// Takes the body of a request of `peer`.
    ///
    /// # Errors
    /// A sentence: why it is not even looked at.
    pub(crate) fn ask(self: &Arc<Self>, body: &[u8], peer: SocketAddr) -> Result<Outcome, String> {
        let wish: SceneWish = serde_json::from_slice(body).map_err(|error| {
            format!(
                "not taken: no wish ({error}); send {{\"revision\": 1, \"edits\": [\"NAME.KEY=VALUE\"], \"keep\": false}}"
            )
        })?;
        let mut state = lock(&self.state);
        let closed = match wish.recording {
            Some(_) => &state.not_recorded,
            None => &state.closed,
        };
        if let Some(why) = closed {
            return Err(format!("not taken: {why}"));
        }
        if state.is_busy {
            return Err(
                "not taken: another change is just being taken; look, and ask again".to_owned(),
            );
        }
        check_revision(wish.revision, state.revision)?;
        let answer = Arc::<Mutex<Option<Answer>>>::default();
        state.is_busy = true;
        state.waiting = Some(AskedScene {
            wish,
            peer,
            desk: self.clone(),
            answer: answer.clone(),
        });
        Ok(Box::new(move || lock(&answer).take()))
    }

    /// The wish that waits; one that was meant for a scene that is gone by now is answered here.
    pub(crate) fn take(&self) -> Option<AskedScene> {
        let (asked, runs) = {
            let mut state = lock(&self.state);
            (state.waiting.take()?, state.revision)
        };
        match check_revision(asked.wish.revision, runs) {
            Ok(()) => Some(asked),
            Err(why) => {
                asked.answer(Err(why));
                None
            }
        }
    }
}

/// Refuses what was meant for another scene.
fn check_revision(meant: Option<u64>, runs: u64) -> Result<(), String> {
    match meant {
        Some(meant) if meant != runs => Err(format!(
            "not taken: it is meant for revision {meant} of the scene, and {runs} runs; look at what was changed, and ask again"
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peer() -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], 1))
    }

    fn open() -> Arc<SceneDesk> {
        let desk = Arc::<SceneDesk>::default();
        show(&desk, 7);
        desk
    }

    fn show(desk: &SceneDesk, revision: u64) {
        let standing = Standing {
            revision,
            name: "a",
            from: "a.toml",
            scenes: &[],
            not_kept: &[],
            why_closed: None,
            why_not_kept: None,
            recording: None,
            why_not_recorded: None,
        };
        desk.show(&standing, "{}");
    }

    fn refusal(desk: &Arc<SceneDesk>, body: &str) -> String {
        desk.ask(body.as_bytes(), peer()).err().expect("refused")
    }

    #[test]
    fn one_wish_at_a_time_and_each_is_answered() {
        let desk = open();
        let edit = r#"{"revision": 7, "edits": ["a.opacity=0.5"], "keep": true}"#;
        let mut outcome = desk.ask(edit.as_bytes(), peer()).expect("taken");
        assert_eq!(outcome(), None);
        assert!(refusal(&desk, edit).contains("just being taken"));
        let asked = desk.take().expect("waits");
        assert!(asked.wish.keep && asked.wish.revision == Some(7));
        assert!(desk.take().is_none());
        assert!(
            refusal(&desk, edit).contains("just being taken"),
            "not answered yet"
        );
        asked.answer(Ok("done".to_owned()));
        assert_eq!(outcome(), Some(Ok("done".to_owned())));
        let mut outcome = desk.ask(edit.as_bytes(), peer()).expect("the next");
        drop(desk.take());
        assert!(outcome().is_some_and(|answer| answer.is_err_and(|said| said == NOT_TAKEN)));
        show(&desk, 8);
        assert!(refusal(&desk, edit).contains("revision 7 of the scene, and 8 runs"));
        assert!(desk.ask(b"{}", peer()).is_ok(), "of whatever runs");
    }

    #[test]
    fn a_wish_that_waits_while_another_scene_comes_is_not_for_that() {
        let desk = open();
        let edit = br#"{"revision": 7, "edits": ["a.opacity=0.5"]}"#;
        let mut outcome = desk.ask(edit, peer()).expect("taken");
        show(&desk, 8);
        assert!(desk.take().is_none());
        let said = outcome().expect("answered").expect_err("refused");
        assert!(said.contains("revision 7 of the scene, and 8 runs"));
        let edit = br#"{"edits": ["a.opacity=0.5"]}"#;
        assert!(desk.ask(edit, peer()).is_ok(), "it keeps nobody out");
        show(&desk, 9);
        assert!(desk.take().is_some(), "of whatever runs");
    }

    #[test]
    fn what_is_no_wish_is_refused_and_keeps_nobody_out() {
        let desk = open();
        for bad in [
            "",
            "[\"x\"]",
            "{\"edit\": []}",
            "{\"edits\": [1]}",
            "{\"revision\": -1}",
            "{\"revision\": 1.5}",
            "\u{0}",
        ] {
            assert!(refusal(&desk, bad).contains("no wish"), "{bad}");
        }
        assert!(desk.ask(&[0xff; 100], peer()).is_err());
        let deep = "[".repeat(60_000);
        assert!(refusal(&desk, &deep).contains("no wish"));
        assert!(desk.ask(b"{}", peer()).is_ok());
        let closed = Arc::<SceneDesk>::default();
        assert!(refusal(&closed, "{}").contains("no changes"));
    }
}
