//! The scene of `taut serve` while it runs: one owner of what it is, and the ways in which it becomes another.
//!
//! A file is edited (`--follow-scene`), or an operator sets some keys or chooses another scene. Either way a whole scene comes out, is read and checked as at
//! the start, and begins another session: the force is led down, the loops are built anew, and nodes, bridge and observers join again as after a restart
//! of the server. So nothing jumps, and whoever has to arm after a restart has to arm. A body stays where it is where its scene is changed and none is chosen.
//! What cannot be served changes nothing.

mod change;
mod files;
mod load;
mod pending;
mod recordings;
mod running;

use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use taut_scene::shipped_scene_text;

use self::change::{Change, Wanted, write_scene};
use self::files::SceneWatch;
use self::load::Loader;
pub(super) use self::load::{Next, load_workbench, refuse_to_follow};
use self::pending::{Pending, joined};
use self::running::{NO_FILE, Running};
use crate::cli::ServeArgs;
use crate::session::Session;
use crate::session::audit::PageAudit;
use crate::session::operator::{AskedScene, SceneDesk};
use crate::session::setup::workbench::Overrides;
use crate::shared::failure::Failure;

/// Shortest life of a session before an operator changes its scene: a flood of changes leaves time for force.
const SHORTEST_LIFE: Duration = Duration::from_secs(1);

/// A wish whose session begins now, and what it came to.
struct Taken {
    asked: AskedScene,
    what: String,
    warnings: Vec<String>,
}

/// The scene of one `taut serve`.
pub(super) struct LiveScene {
    loader: Loader,
    desk: Arc<SceneDesk>,
    revision: u64,
    running: Option<Arc<Running>>,
    pending: Option<Pending>,
    taken: Option<Taken>,
    files: Option<SceneWatch>,
    /// Changes that were not kept and went when the files were taken.
    gone: Vec<String>,
}

impl LiveScene {
    pub(super) fn new(args: &ServeArgs, overrides: Overrides, desk: Arc<SceneDesk>) -> Self {
        Self {
            loader: Loader::new(args.clone(), overrides),
            desk,
            revision: 0,
            running: None,
            pending: None,
            taken: None,
            files: None,
            gone: Vec::new(),
        }
    }

    /// What the first session is made of.
    pub(super) fn first(&self) -> Result<Next, Failure> {
        self.loader.load()
    }

    /// A session of this begins.
    pub(super) fn begin(&mut self, next: &mut Next) {
        self.revision += 1;
        let revision = u32::try_from(self.revision).unwrap_or(u32::MAX);
        next.setup.content.description.revision = revision;
        let from_start = self.loader.args.recording.is_some();
        self.running = Some(Arc::new(Running::of(next, from_start)));
        self.loader.keep(next.chosen.take(), &next.setup);
        if let Some(files) = next.files.take() {
            self.files = Some(files);
        }
        self.show();
    }

    fn show(&self) {
        if let Some(running) = &self.running {
            running.show(&self.desk, self.revision);
        }
    }

    /// The session runs: it is where its clients find it again, and whoever asked for it hears so.
    pub(super) fn began(&mut self, session: &Session) {
        self.loader
            .stay_at(session.quic_address(), session.udp_address());
        let Some(Taken {
            asked,
            what,
            mut warnings,
        }) = self.taken.take()
        else {
            return;
        };
        if let Some(where_it_is) = session.beginning().sentence() {
            warnings.push(where_it_is);
        }
        PageAudit::edited(asked.peer, self.revision, &what);
        if asked.wish.recording.is_some() {
            return asked.answer(Ok(format!("{what}; revision {} runs", self.revision)));
        }
        let running = self.running.as_ref();
        let in_file = if running.is_some_and(|running| running.not_kept.is_empty()) {
            "the file has it"
        } else {
            "the file does not have it"
        };
        let mut said = format!(
            "taken: {what}; revision {} runs, and {in_file}",
            self.revision
        );
        for warning in warnings {
            said = format!("{said}\nwarning: {warning}");
        }
        asked.answer(Ok(said));
    }

    /// What is to take the place of this session, whose loops have run for `age`, if something is.
    pub(super) fn follow(&mut self, age: Duration) -> Option<Next> {
        match self.pending.take() {
            Some(pending) if !pending.is_finished() => {
                self.pending = Some(pending);
                return None;
            }
            Some(Pending::Wish(asked, thread)) => return self.conclude(asked, thread),
            Some(Pending::Files(thread)) => return self.take_files(thread),
            None => {}
        }
        if self.files.as_mut().is_some_and(SceneWatch::is_due) {
            self.read_files();
        } else if age >= SHORTEST_LIFE
            && let Some(asked) = self.desk.take()
        {
            self.look_at(asked);
        }
        None
    }

    /// Begins to read the files, which are others now.
    fn read_files(&mut self) {
        match pending::load(self.loader.clone()) {
            Ok(thread) => self.pending = Some(Pending::Files(thread)),
            Err(error) => taut_log::say(&format!(
                "the changed scene is not taken: no thread reads it ({error})"
            )),
        }
    }

    /// Takes what the files are now.
    fn take_files(&mut self, thread: JoinHandle<Result<Next, Failure>>) -> Option<Next> {
        let (files, running) = (self.files.as_ref()?, self.running.as_ref()?);
        let mut next = files.take(joined(thread))?;
        next.goes_on = next.workbench.scene == running.from;
        if let Some(recording) = running.recording.as_ref() {
            taut_log::say(&format!(
                "the recording to {} ends with the scene that it is of; begin another from the operator's page",
                recording.display()
            ));
        }
        self.gone.clone_from(&running.not_kept);
        if !self.gone.is_empty() {
            taut_log::say(&format!(
                "what was changed while it ran, and not kept in a file, is gone: {}",
                self.gone.join("; ")
            ));
        }
        Some(next)
    }

    /// Begins to look at a wish.
    fn look_at(&mut self, asked: AskedScene) {
        let Some(running) = &self.running else {
            return;
        };
        let wish = asked.wish.clone();
        if wish.recording.is_none() && wish.scene.is_none() && wish.edits.is_empty() {
            let kept = if wish.keep {
                self.keep_as_it_runs(&asked)
            } else {
                Err("nothing is asked for: name an edit or a scene".to_owned())
            };
            return asked.answer(kept.map_err(|why| format!("not kept: {why}")));
        }
        let keeps = wish.keep && wish.recording.is_none();
        if let (true, None, Some(why)) = (keeps, &wish.scene, running.why_not_kept()) {
            return asked.answer(Err(format!("not taken, since it cannot be kept: {why}")));
        }
        let wanted = Wanted {
            loader: self.loader.clone(),
            running: running.clone(),
            wish,
        };
        match pending::make(wanted) {
            Ok(thread) => self.pending = Some(Pending::Wish(asked, thread)),
            Err(error) => asked.answer(Err(format!("not taken: no thread reads it ({error})"))),
        }
    }

    /// Gives the file what was changed without it.
    fn keep_as_it_runs(&mut self, asked: &AskedScene) -> Result<String, String> {
        let running = Arc::make_mut(self.running.as_mut().ok_or("no scene runs")?);
        if let Some(why) = running.why_not_kept() {
            return Err(why.to_owned());
        }
        let text = running.scene.text().clone();
        if running.not_kept.is_empty() && !self.gone.is_empty() {
            return Err(format!(
                "{} was changed and taken since, and what was not kept before went with that ({}); set it again",
                running.from,
                self.gone.join("; ")
            ));
        }
        write_scene(&running.from, &text, &running.in_file)?;
        running.not_kept.clear();
        running.in_file = text;
        let from = running.from.clone();
        self.wrote(&from);
        self.show();
        PageAudit::edited(asked.peer, self.revision, "kept in the file");
        Ok(format!("kept: {from} has the scene as it runs"))
    }

    /// The file of a scene was written here: that is no change of it.
    fn wrote(&mut self, file: &str) {
        if let Some(files) = &mut self.files {
            files.wrote(file);
        }
    }

    /// Takes what came of a wish.
    fn conclude(
        &mut self,
        asked: AskedScene,
        thread: JoinHandle<Result<Option<Change>, Failure>>,
    ) -> Option<Next> {
        let Some(made) = joined(thread).transpose() else {
            let kept = self.keep_as_it_runs(&asked);
            asked.answer(kept.map_err(|why| format!("not kept: {why}")));
            return None;
        };
        let keeps = asked.wish.keep;
        let written = made.and_then(|(mut next, what)| {
            if keeps {
                self.write(&mut next)?;
            }
            Ok((next, what))
        });
        match written {
            Ok((mut next, what)) => {
                let does = if asked.wish.recording.is_some() {
                    "begins or ends a recording"
                } else {
                    "changes the scene"
                };
                taut_log::say(&format!(
                    "an operator {does} ({what}): the force fades, and another session begins"
                ));
                if keeps {
                    next.in_file = next.setup.scene.text().clone();
                }
                self.gone.clear();
                self.taken = Some(Taken {
                    asked,
                    what,
                    warnings: next.setup.warnings.clone(),
                });
                Some(next)
            }
            Err(why) => {
                asked.answer(Err(format!("not taken, and nothing is changed: {why}")));
                None
            }
        }
    }

    /// Gives the file of a scene that is about to run what it runs with.
    fn write(&mut self, next: &mut Next) -> Result<(), Failure> {
        let (file, text) = (&next.workbench.scene, next.setup.scene.text());
        if *text == next.in_file {
            return Ok(());
        }
        if shipped_scene_text(file).is_some() {
            return Err(Failure::bad_input(NO_FILE));
        }
        write_scene(file, text, &next.in_file).map_err(Failure::failed)?;
        // Of another scene other files are watched from now on.
        match &mut next.files {
            Some(files) => files.wrote(file),
            None => self.wrote(file),
        }
        Ok(())
    }
}
