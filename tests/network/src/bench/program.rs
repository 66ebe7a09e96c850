//! The program `taut` in a directory of its own: a workbench file, a cluster key, processes that end with their owner.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{ChildStderr, Command, Stdio};

use taut_link::{ClusterKey, create_key_file};
use tempfile::TempDir;
use toml::{Table, Value};

use super::BenchError;
use super::process::Process;

/// The workbench file that is shipped.
const SHIPPED_WORKBENCH: &str = include_str!("../../../../server/workbench.toml");
/// The scene of all runs.
pub(super) const SCENE: &str = "sphere-on-plane";

/// A workbench on free ports of loopback.
pub(super) struct Workbench {
    program: PathBuf,
    directory: TempDir,
}

impl Workbench {
    /// The shipped one with the small scene, as `change` alters it.
    pub(super) fn new(
        program: &Path,
        change: impl FnOnce(&mut Table) -> Result<(), BenchError>,
    ) -> Result<Workbench, BenchError> {
        let workbench = Workbench {
            program: program.to_path_buf(),
            directory: tempfile::tempdir()?,
        };
        let mut file: Table = SHIPPED_WORKBENCH.parse().map_err(|_| broken())?;
        file.insert("scene".to_owned(), SCENE.into());
        set(&mut file, "network.quic_port", 0)?;
        set(&mut file, "network.udp_port", 0)?;
        change(&mut file)?;
        std::fs::write(workbench.config(), file.to_string())?;
        create_key_file(&workbench.key_path())?;
        Ok(workbench)
    }

    /// The cluster key.
    pub(super) fn key(&self) -> Result<ClusterKey, BenchError> {
        Ok(taut_link::read_key_file(&self.key_path())?)
    }

    pub(super) fn key_path(&self) -> PathBuf {
        self.directory.path().join("cluster.key")
    }

    fn config(&self) -> PathBuf {
        self.directory.path().join("workbench.toml")
    }

    /// Writes a file into its directory; where.
    pub(super) fn write(&self, name: &str, content: &str) -> Result<PathBuf, BenchError> {
        let path = self.directory.path().join(name);
        std::fs::write(&path, content)?;
        Ok(path)
    }

    /// Starts `taut serve`, at these addresses or at free ones, and waits until it serves.
    pub(super) fn serve(&self, at: Option<(&str, &str)>) -> Result<Served, BenchError> {
        let mut command = self.command();
        command.args(["serve", "--json", "--no-monitor", "--config"]);
        command.arg(self.config()).arg("--key").arg(self.key_path());
        if let Some((quic, udp)) = at {
            command.args(["--quic", quic, "--udp", udp]);
        }
        let mut process = Process::start(command.stderr(Stdio::piped()))?;
        let mut lines = process.errors()?;
        let (quic, udp) = addresses(&mut lines)?;
        // What it says later is read, too: nobody may wait for a full pipe.
        std::thread::Builder::new()
            .name("lines".to_owned())
            .spawn(move || std::io::copy(&mut lines, &mut std::io::sink()))?;
        Ok(Served { process, quic, udp })
    }

    /// Starts another role that joins `server` as `node`.
    pub(super) fn join(
        &self,
        role: &str,
        node: &str,
        server: &str,
        arguments: &[&str],
    ) -> Result<Process, BenchError> {
        let mut command = self.command();
        command.args([role, "--server", server, "--node", node, "--key"]);
        command.arg(self.key_path()).args(arguments);
        // What it says of a server that it lost is expected.
        Process::start(command.stderr(Stdio::null()))
    }

    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        command
            .current_dir(self.directory.path())
            .env_remove("TAUT_KEY_FILE")
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY")
            .env("XDG_CACHE_HOME", self.directory.path())
            .env("XDG_RUNTIME_DIR", self.directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        command
    }
}

/// Changes a value of a workbench file, such as `network.quic_port`.
pub(super) fn set(file: &mut Table, key: &str, value: impl Into<Value>) -> Result<(), BenchError> {
    let (table, key) = key.split_once('.').ok_or_else(broken)?;
    let table = file.get_mut(table).and_then(Value::as_table_mut);
    table
        .ok_or_else(broken)?
        .insert(key.to_owned(), value.into());
    Ok(())
}

fn broken() -> BenchError {
    BenchError::Missing("the shipped workbench file is not as it was".to_owned())
}

/// A running `taut serve`; killed when dropped.
pub(super) struct Served {
    process: Process,
    /// Address of the control plane.
    pub(super) quic: String,
    /// Address of the pose plane.
    pub(super) udp: String,
}

/// From `serving on 127.0.0.1:1 (control) and 127.0.0.1:2 (poses)`.
fn addresses(lines: &mut BufReader<ChildStderr>) -> Result<(String, String), BenchError> {
    let (mut line, mut all) = (String::new(), String::new());
    while lines.read_line(&mut line)? > 0 {
        let found = line.trim_end().strip_prefix("serving on ");
        let both =
            found.and_then(|text| text.strip_suffix(" (poses)")?.split_once(" (control) and "));
        if let Some((quic, udp)) = both {
            return Ok((quic.to_owned(), udp.to_owned()));
        }
        all.push_str(&line);
        line.clear();
    }
    Err(BenchError::Missing(format!(
        "the program does not serve: {}",
        all.trim()
    )))
}

impl Served {
    /// Its process's number.
    pub(super) fn number(&self) -> u32 {
        self.process.number()
    }

    /// Ends it as Ctrl-C does; its report.
    pub(super) fn stop(self) -> Result<serde_json::Value, BenchError> {
        self.process.report()
    }
}
