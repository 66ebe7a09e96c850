//! From the files to what a session is made of: at the start, and again when they are others.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;

use taut_link::ClusterKey;
use taut_scene::{Device, Scene, Workbench};

use super::files::SceneWatch;
use super::running::Running;
use crate::cli::ServeArgs;
use crate::commands::key;
use crate::session::setup::SessionSetup;
use crate::session::setup::workbench::{Overrides, session_setup};
use crate::shared::failure::Failure;

/// What a session is made of, and how that came about.
pub(in crate::commands) struct Next {
    pub(in crate::commands) workbench: Workbench,
    pub(in crate::commands) setup: SessionSetup,
    /// Text of the scene's file.
    pub(super) in_file: Arc<str>,
    /// What of the scene is not in the file.
    pub(super) not_kept: Vec<String>,
    /// It is the scene that runs, changed: its body stays where it is.
    pub(in crate::commands) goes_on: bool,
    pub(super) chosen: Option<Chosen>,
    /// Others than before, to be watched.
    pub(super) files: Option<SceneWatch>,
}

/// A scene that was chosen while another ran.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    pub(super) scene: String,
    /// What the workbench file or the command line names: when that becomes another, it counts.
    pub(super) instead_of: String,
}

/// Reads the files.
#[derive(Clone)]
pub(super) struct Loader {
    pub(super) args: ServeArgs,
    overrides: Overrides,
    /// Of a page that was opened by a token that was made for this start.
    token: Option<String>,
    chosen: Option<Chosen>,
}

impl Loader {
    pub(super) fn new(args: ServeArgs, overrides: Overrides) -> Self {
        Self {
            args,
            overrides,
            token: None,
            chosen: None,
        }
    }

    /// A session of this begins: what the next one is to have of it.
    pub(super) fn keep(&mut self, chosen: Option<Chosen>, setup: &SessionSetup) {
        self.chosen = chosen;
        self.overrides.prepared = Some(setup.prepared.clone());
        let page = setup.operator.as_ref();
        self.token = page.map(|page| page.server.token.clone());
    }

    /// The same with a recording, or without.
    pub(super) fn recorded_to(&self, directory: Option<PathBuf>) -> Self {
        let mut other = self.clone();
        other.overrides.recording = directory;
        other
    }

    /// Where whoever comes again comes to.
    pub(super) fn stay_at(&mut self, quic: Option<SocketAddr>, udp: Option<SocketAddr>) {
        (self.overrides.quic, self.overrides.udp) = (quic, udp);
    }

    /// As the files say, and as was chosen.
    pub(super) fn load(&self) -> Result<Next, Failure> {
        let mut workbench = load_workbench(&self.args)?;
        let counts = |chosen: &&Chosen| chosen.instead_of == workbench.scene;
        let chosen = self.chosen.as_ref().filter(counts).cloned();
        if let Some(chosen) = &chosen {
            workbench.scene.clone_from(&chosen.scene);
        }
        let mut next = self.load_scene(workbench, None, true)?;
        next.chosen = chosen;
        Ok(next)
    }

    /// With this scene chosen; `edited` is what was made of it.
    pub(super) fn choose(&self, scene: &str, edited: Option<Scene>) -> Result<Next, Failure> {
        let mut workbench = load_workbench(&self.args)?;
        let instead_of = std::mem::replace(&mut workbench.scene, scene.to_owned());
        let mut next = self.load_scene(workbench, edited, true)?;
        next.chosen = (instead_of != scene).then(|| Chosen {
            scene: scene.to_owned(),
            instead_of,
        });
        Ok(next)
    }

    /// The scene that runs, changed.
    pub(super) fn change(&self, running: &Running, edited: Scene) -> Result<Next, Failure> {
        let mut workbench = load_workbench(&self.args)?;
        workbench.scene.clone_from(&running.from);
        // The files are others only when they are read; whatever they are now, this is the scene that runs.
        let mut next = self.load_scene(workbench, Some(edited), false)?;
        next.chosen = self.chosen.clone();
        next.in_file = running.in_file.clone();
        next.not_kept.clone_from(&running.not_kept);
        Ok(next)
    }

    fn load_scene(
        &self,
        workbench: Workbench,
        edited: Option<Scene>,
        from_files: bool,
    ) -> Result<Next, Failure> {
        // Before the scene is read: what is written meanwhile is seen.
        let files = (self.args.follow_scene && from_files)
            .then(|| SceneWatch::new(&self.args.config, &workbench));
        let files = files.transpose()?;
        let is_named = self.args.scene.is_some() || self.chosen.is_some() || edited.is_some();
        let overrides = Overrides {
            scene: is_named.then(|| workbench.scene.clone()),
            edited,
            ..self.overrides.clone()
        };
        let key = workbench_key(&self.args, &workbench)?;
        let mut setup = session_setup(&workbench, key, &overrides)?;
        self.keep_token(&mut setup);
        Ok(Next {
            in_file: setup.scene.text().clone(),
            not_kept: Vec::new(),
            goes_on: false,
            chosen: None,
            files,
            workbench,
            setup,
        })
    }

    /// A page that was opened by a token that was made for this start goes on with it.
    fn keep_token(&self, setup: &mut SessionSetup) {
        if let (Some(page), Some(token)) = (&mut setup.operator, &self.token)
            && page.token_file.is_none()
        {
            page.server.token.clone_from(token);
        }
    }
}

/// The workbench file, with the scene of the command line.
pub(in crate::commands) fn load_workbench(args: &ServeArgs) -> Result<Workbench, Failure> {
    let mut workbench = Workbench::load(&args.config)?;
    if let Some(scene) = &args.scene {
        workbench.scene.clone_from(scene);
    }
    if args.follow_scene {
        refuse_to_follow(&workbench)?;
    }
    Ok(workbench)
}

/// What a session that is followed by another cannot have: a file that is of one session, or a force device, which can be opened once and
/// would be opened before the session before ends.
pub(in crate::commands) fn refuse_to_follow(workbench: &Workbench) -> Result<(), Failure> {
    if workbench.monitoring.record.is_some() {
        return Err(Failure::bad_input(
            "--follow-scene begins a session for each scene, and the file of [monitoring] record is of one; take record out, or serve without --follow-scene",
        ));
    }
    match &workbench.device {
        Device::Driver(chosen) if chosen.kind.has_motors => Err(Failure::BadInput(format!(
            "--follow-scene needs a device that stays while sessions change, but [device] is of kind \"{0}\"; write kind = \"remote\" there and run `taut bridge --device {0}` beside the server",
            chosen.kind.name
        ))),
        _ => Ok(()),
    }
}

/// The key of the command line, else of the workbench file, else of the environment.
fn workbench_key(args: &ServeArgs, workbench: &Workbench) -> Result<ClusterKey, Failure> {
    let named = args.key.as_deref();
    key::read(named.or(workbench.network.key_file.as_deref()))
}
