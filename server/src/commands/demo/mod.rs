//! `taut demo`: the whole workbench on this machine. The server runs in this process, every render node (and the bridge, if
//! wanted) in a process of its own, with a fresh cluster key that nobody else knows.

mod children;
mod directory;
mod ports;

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use taut_bridge::DeviceChoice;
use taut_bridge::signals::EndFlag;
use taut_scene::{Device, HeadTracking, Scene, Workbench};

use crate::cli::DemoArgs;
use crate::commands::demo::children::{NamedChild, Said, wait_or_kill};
use crate::commands::demo::directory::DemoDirectory;
use crate::commands::demo::ports::use_free_ports;
use crate::commands::serve::{HELP_ARM, announce, watch};
use crate::commands::{recording_size, render};
use crate::loops::realtime::after_parent;
use crate::report::SessionReport;
use crate::session::Session;
use crate::session::monitor::MonitorFeed;
use crate::session::setup::DeviceSource;
use crate::session::setup::workbench::{Overrides, session_setup};
use crate::shared::failure::Failure;

/// Children have this long to end by themselves once the server closed.
const GRACE: Duration = Duration::from_secs(3);
/// Sets what a process logs.
const LOG_VARIABLE: &str = "TAUT_LOG";
/// Silence after which the mouse counts as lost.
const MOUSE_MAX_AGE: Duration = Duration::from_millis(200);
/// How the mouse holds the body.
const HELP_MOUSE: &str = "mouse in the first window: left button moves the body along the screen, right button or wheel to and fro, middle button (or Shift + left) turns it; P lets go or takes hold, R goes back to the start, arrow and page keys move in small steps; more in docs/devices.md";
/// What the bridge is called.
const BRIDGE_NODE: &str = "bridge";

/// Runs the demo. The report comes with the failure, if the session broke down on the way.
pub(super) fn run(args: &DemoArgs) -> Result<(SessionReport, Option<Failure>), Failure> {
    let (directory, key) = DemoDirectory::create()?;
    let mut workbench = Workbench::shipped()?;
    // A demonstration is nobody else's business.
    workbench.network.bind = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let scene = args
        .scene
        .clone()
        .unwrap_or_else(|| workbench.scene.clone());
    let device = args.device.as_deref().unwrap_or("simulated");
    let choice: DeviceChoice = device.parse().map_err(Failure::bad_input)?;
    let hold = choice == DeviceChoice::Mouse;
    if hold && (args.bridge || !render::BUILT_IN || !has_windows(args)) {
        return Err(Failure::BadInput(
            "the mouse moves the god-object in a window: leave out --bridge, --headless and --out, and start where there is a display".into(),
        ));
    }
    let hand_path = if args.bridge {
        write_hand_path(&scene, directory.path())?
    } else {
        None
    };
    use_device(&mut workbench, &choice, args.bridge);
    let overrides = overrides(args, scene, choice);
    let mut setup = session_setup(&workbench, key, &overrides)?;
    // A scene that is refused gets its one sentence and nothing else, so other lines come after this.
    if !MonitorFeed::BUILT_IN {
        taut_log::say("this program was built without the monitor; the demo goes on without it");
    }
    if let (true, DeviceSource::Remote { max_age, .. }) = (hold, &mut setup.device) {
        // Drawing shares the processor with the mouse; a pose that is late harms nobody who feels no force.
        *max_age = MOUSE_MAX_AGE;
    }
    use_free_ports(&mut setup, args.port);
    let end = EndFlag::listen().map_err(Failure::failed)?;
    let mut session = Session::start(setup)?;
    session.end_with(&end);
    announce(&session);
    if let Some(directory) = &args.recording {
        taut_log::say(&recording_size::sentence(directory));
    }
    let pushes = |input: &taut_bridge::InputChoice| input.force_device().is_some();
    if overrides.input.as_ref().is_some_and(pushes) {
        // Somebody holds it: a person arms.
        taut_bridge::listen_at_console(session.arm_switch());
        taut_log::say(HELP_ARM);
    }

    let launcher = Launcher::new(&session, &directory, args)?;
    let mut children = Vec::new();
    if args.bridge {
        children.push(launcher.bridge(device, hand_path.as_ref())?);
    }
    start_render_nodes(&launcher, &workbench, hold, &mut children)?;

    let early = watch_all(&mut session, &mut children, args.duration);
    taut_log::end_status();
    // One that is still joining would complain.
    children.iter().for_each(NamedChild::mute);
    let (report, failure) = session.stop();
    let early = (!early.is_empty()).then(|| Failure::Failed(early.join(", ")));
    end.let_signals_kill();
    children.iter_mut().for_each(NamedChild::interrupt);
    for name in wait_or_kill(children, GRACE) {
        taut_log::say(&format!(
            "taut: {name} did not end by itself and was killed"
        ));
    }
    Ok((report, failure.or(early)))
}

fn overrides(args: &DemoArgs, scene: String, choice: DeviceChoice) -> Overrides {
    Overrides {
        scene: Some(scene),
        allow_unstable: args.allow_unstable,
        no_monitor: args.no_monitor || !MonitorFeed::BUILT_IN,
        record: args.record.clone(),
        input: match choice {
            DeviceChoice::Input(input) if !args.bridge => Some(input),
            _ => None,
        },
        recording: args.recording.clone(),
        ..Overrides::default()
    }
}

/// Lets the chosen device move the god-object; the mouse and a bridge are remote ones.
fn use_device(workbench: &mut Workbench, choice: &DeviceChoice, by_bridge: bool) {
    let by_mouse = *choice == DeviceChoice::Mouse;
    if by_mouse {
        // A picture that sways under the mouse is no help.
        workbench.viewer.tracking = HeadTracking::Fixed;
    }
    if by_bridge || by_mouse {
        workbench.device = Device::Remote;
    } else if let DeviceChoice::Trace(path) = choice {
        workbench.device = Device::Trace {
            path: path.clone(),
            repeat: true,
        };
    } else if let (
        DeviceChoice::Simulated {
            strings: Some(named),
        },
        Device::Simulated { strings, .. },
    ) = (choice, &mut workbench.device)
    {
        *strings = Some(named.clone());
    }
}

/// Starts a process for every render node; one window holds the body, if any, and the others look on.
fn start_render_nodes(
    launcher: &Launcher<'_>,
    workbench: &Workbench,
    hold: bool,
    children: &mut Vec<NamedChild>,
) -> Result<(), Failure> {
    if !render::BUILT_IN {
        taut_log::say("this program was built without drawing; the demo goes on without it");
        return Ok(());
    }
    for (place, node) in workbench.nodes.iter().enumerate() {
        children.push(launcher.render_node(&node.name, hold && place == 0)?);
    }
    if hold {
        taut_log::say(HELP_MOUSE);
    }
    Ok(())
}

/// Runs until the session is over. Says which children ended with a failure before that.
fn watch_all(
    session: &mut Session,
    children: &mut [NamedChild],
    duration: Option<f64>,
) -> Vec<String> {
    let mut early = Vec::new();
    watch(session, duration, |_| {
        for child in &mut *children {
            if let Some(status) = child.newly_ended()
                && !status.success()
            {
                let what = format!("{} ended early ({status})", child.name());
                taut_log::say(&format!("taut: {what}; the demo goes on without it"));
                early.push(what);
            }
        }
        true
    });
    early
}

/// The intention of the scene's hand as a file for the bridge, and how the hand holds.
struct HandPath {
    path: PathBuf,
    repeat: bool,
    preset: &'static str,
}

fn write_hand_path(scene: &str, directory: &Path) -> Result<Option<HandPath>, Failure> {
    let scene = Scene::named_or_file(scene)?;
    let (Some(hand), Some(trace)) = (scene.hand(), scene.hand_path()?) else {
        return Ok(None);
    };
    let path = directory.join("hand.csv");
    std::fs::write(&path, trace.to_csv()).map_err(|error| {
        Failure::failed(format!(
            "{}: cannot be written ({error}); check TMPDIR",
            path.display()
        ))
    })?;
    Ok(Some(HandPath {
        path,
        repeat: hand.repeat,
        preset: hand.preset.name(),
    }))
}

/// Starts the other roles from this very program.
struct Launcher<'a> {
    program: PathBuf,
    server: SocketAddr,
    directory: &'a DemoDirectory,
    args: &'a DemoArgs,
    headless: bool,
    said: Said,
}

impl<'a> Launcher<'a> {
    fn new(
        session: &Session,
        directory: &'a DemoDirectory,
        args: &'a DemoArgs,
    ) -> Result<Self, Failure> {
        let program = std::env::current_exe().map_err(|error| {
            Failure::failed(format!(
                "this program's own file is not known ({error}); start it by its path"
            ))
        })?;
        let server = session.quic_address().ok_or_else(|| {
            Failure::failed("the server has no address: this is a fault of the program")
        })?;
        Ok(Self {
            program,
            server,
            directory,
            args,
            headless: !has_windows(args),
            said: Said::default(),
        })
    }

    fn role(&self, role: &str, node: &str) -> Command {
        let mut command = Command::new(&self.program);
        command
            .arg(role)
            .args(["--server", &self.server.to_string(), "--node", node]);
        command.arg("--key").arg(self.directory.key_file());
        command.args(["--transport", self.args.transport.name()]);
        command
    }

    fn render_node(&self, node: &str, hold: bool) -> Result<NamedChild, Failure> {
        let mut command = self.role("render", node);
        if self.args.device.as_deref() == Some("mouse") {
            // Who looks at a desk's screen has no glasses on, and sees the force that nobody feels.
            command.args(["--stereo", "mono", "--show", "force"]);
        }
        if hold {
            command.arg("--hold");
            if std::env::var_os(LOG_VARIABLE).is_none() {
                // A force that comes late is felt by nobody: no word of it.
                command.env(LOG_VARIABLE, "warn,taut_bridge=error");
            }
        }
        // Drawing in software takes every core that it gets; the loops come first.
        after_parent(&mut command);
        if self.headless {
            command.arg("--headless");
            // Without a display there is no compositor to ask which device it prefers; Mesa's layer would complain that there is none.
            command.env("NODEVICE_SELECT", "1");
        }
        if let Some(frames) = self.args.frames {
            command.args(["--frames", &frames.to_string()]);
        }
        if let Some(out) = &self.args.out {
            command.arg("--out").arg(out);
        }
        self.start(node, command)
    }

    fn bridge(&self, device: &str, hand: Option<&HandPath>) -> Result<NamedChild, Failure> {
        let mut command = self.role("bridge", BRIDGE_NODE);
        command.args(["--device", device]);
        if std::env::var_os(LOG_VARIABLE).is_none() {
            // Its events come over the network as well.
            command.env(LOG_VARIABLE, "error");
        }
        if let Some(hand) = hand {
            command
                .arg("--path")
                .arg(&hand.path)
                .args(["--hand", hand.preset]);
            if hand.repeat {
                command.arg("--loop");
            }
        }
        self.start(BRIDGE_NODE, command)
    }

    fn start(&self, name: &str, command: Command) -> Result<NamedChild, Failure> {
        NamedChild::start(name, command, &self.said).map_err(|error| {
            Failure::failed(format!(
                "{name} cannot be started ({error}); check the limit on processes (ulimit -u)"
            ))
        })
    }
}

/// Whether the render nodes open windows.
fn has_windows(args: &DemoArgs) -> bool {
    let has_display = ["DISPLAY", "WAYLAND_DISPLAY"]
        .iter()
        .any(|name| std::env::var_os(name).is_some_and(|value| !value.is_empty()));
    has_display && !args.headless && args.out.is_none()
}
