//! The program from outside: a directory to work in, and how it is started.

mod bridge;
mod machine;
mod running;

use std::ffi::OsStr;
use std::net::UdpSocket;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use taut::session::setup::workbench::Overrides;
use taut_scene::{SHIPPED_WORKBENCH, Workbench};

pub(crate) use bridge::{start_behind_relay, start_bridge};
pub(crate) use machine::MachineWatch;
pub(crate) use running::{Running, signal};

/// A directory with a key and a workbench on free ports.
pub(crate) struct Workplace {
    directory: tempfile::TempDir,
}

impl Workplace {
    /// With a workbench file of a plain scene.
    pub(crate) fn new() -> Self {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let workplace = Self { directory };
        workplace.write("workbench.toml", &workbench());
        let output = taut(&["keys", "--out", workplace.text("cluster.key").as_str()]);
        assert!(output.status.success());
        workplace
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// The same as text.
    pub(crate) fn text(&self, name: &str) -> String {
        self.path(name).display().to_string()
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        assert!(std::fs::write(self.path(name), text).is_ok());
    }

    /// `taut serve` of the workbench file `name`, for `seconds`.
    pub(crate) fn serve(&self, name: &str, seconds: &str, more: &[&str]) -> Vec<String> {
        let mut arguments: Vec<String> = ["serve", "--no-monitor", "--json", "--duration", seconds]
            .map(String::from)
            .into();
        arguments.extend([
            "--config".into(),
            self.text(name),
            "--key".into(),
            self.text("cluster.key"),
        ]);
        arguments.extend(more.iter().map(|argument| (*argument).to_owned()));
        arguments
    }
}

/// The shipped workbench with a plain scene and free ports.
pub(crate) fn workbench() -> String {
    let text = SHIPPED_WORKBENCH
        .replace("scene = \"peg-in-a-hole\"", "scene = \"sphere-on-plane\"")
        .replace("quic_port = 4857", "quic_port = 0")
        .replace("udp_port = 4858", "udp_port = 0");
    assert_ne!(text, SHIPPED_WORKBENCH);
    text
}

/// Runs the program to its end.
pub(crate) fn taut<S: AsRef<OsStr>>(arguments: &[S]) -> Output {
    command(arguments).output().expect("taut starts")
}

/// What the program says that refuses to work.
pub(crate) fn refusal(output: &Output) -> String {
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    said
}

/// An address of this machine that was free just now.
pub(crate) fn free_address() -> String {
    let free = UdpSocket::bind(("127.0.0.1", 0)).and_then(|socket| socket.local_addr());
    free.expect("no port").to_string()
}

/// A session without a monitor.
pub(crate) fn no_monitor() -> Overrides {
    Overrides {
        no_monitor: true,
        ..Overrides::default()
    }
}

/// The program with pipes for what it says, and without what this process's environment may tell it.
pub(crate) fn command<S: AsRef<OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_taut"));
    command
        .args(arguments)
        .env_remove("TAUT_KEY_FILE")
        .env_remove("TAUT_LOG")
        .env_remove("RUST_LOG")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// The shipped workbench on free ports, with these keys instead of its own.
pub(crate) fn shipped_workbench(more: &[&str]) -> Workbench {
    let overrides = [&["network.quic_port=0", "network.udp_port=0"], more].concat();
    Workbench::parse_with_overrides(
        "workbench.toml",
        SHIPPED_WORKBENCH,
        Path::new(""),
        &overrides,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

/// Longer than anything takes on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);

pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}
