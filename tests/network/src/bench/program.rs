//! The program `taut` in a directory of its own: a workbench file, a cluster key, processes that end with their owner.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

use taut_link::{ClusterKey, create_key_file};
use taut_scene::Scene;
use tempfile::TempDir;
use toml::{Table, Value};

use super::BenchError;
use super::process::Process;

/// The workbench file that is shipped.
const SHIPPED_WORKBENCH: &str = include_str!("../../../../server/workbench.toml");
/// The scene of all runs.
const SCENE: &str = "sphere-on-plane";

/// Lines of a server that are kept.
const MOST_LINES: usize = 10_000;

/// A workbench on free ports of loopback.
pub(crate) struct Workbench {
    program: PathBuf,
    directory: TempDir,
}

impl Workbench {
    /// The shipped one with the small scene, as `change` alters it.
    pub(crate) fn new(
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
    pub(crate) fn key(&self) -> Result<ClusterKey, BenchError> {
        Ok(taut_link::read_key_file(&self.key_path())?)
    }

    pub(crate) fn key_path(&self) -> PathBuf {
        self.directory.path().join("cluster.key")
    }

    fn config(&self) -> PathBuf {
        self.directory.path().join("workbench.toml")
    }

    /// A file in its directory.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// A file of the scene's own hand; where.
    pub(crate) fn write_hand(&self) -> Result<String, BenchError> {
        let hand = Scene::named_or_file(SCENE).and_then(|scene| scene.hand_path());
        let hand = hand.map_err(BenchError::missing)?;
        let hand = hand.ok_or_else(|| BenchError::missing("the scene has no hand"))?;
        let path = self.path("hand.csv");
        std::fs::write(&path, hand.to_csv())?;
        Ok(path.display().to_string())
    }

    /// Starts `taut serve`, at these addresses or at free ones, and waits until it serves.
    pub(crate) fn serve(&self, at: Option<(&str, &str)>) -> Result<Served, BenchError> {
        let mut command = self.server();
        if let Some((quic, udp)) = at {
            command.args(["--quic", quic, "--udp", udp]);
        }
        let mut process = Process::start(command.stderr(Stdio::piped()))?;
        let mut lines = process.errors()?;
        let (quic, udp) = addresses(&mut lines)?;
        let said = Arc::<Mutex<VecDeque<String>>>::default();
        let heard = Arc::clone(&said);
        // What it says later is read, too: nobody may wait for a full pipe.
        std::thread::Builder::new()
            .name("lines".to_owned())
            .spawn(move || {
                for line in lines.lines().map_while(Result::ok) {
                    let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
                    heard.truncate(MOST_LINES - 1);
                    heard.push_front(line);
                }
            })?;
        Ok(Served {
            process,
            quic,
            udp,
            said,
        })
    }

    /// The same with a pipe of one's own for what it says, which is read up to its addresses.
    pub(crate) fn serve_into<R: Read>(
        &self,
        reader: R,
        writer: Stdio,
    ) -> Result<(Served, R), BenchError> {
        let process = Process::start(self.server().stderr(writer))?;
        let mut lines = BufReader::with_capacity(1, reader);
        let (quic, udp) = addresses(&mut lines)?;
        let served = Served {
            process,
            quic,
            udp,
            said: Arc::default(),
        };
        Ok((served, lines.into_inner()))
    }

    fn server(&self) -> Command {
        let mut command = self.command();
        command.args(["serve", "--json", "--no-monitor", "--config"]);
        command.arg(self.config()).arg("--key").arg(self.key_path());
        command
    }

    /// Starts another role that joins `server` as `node`.
    pub(crate) fn join(
        &self,
        role: &str,
        node: &str,
        server: &str,
        arguments: &[&str],
    ) -> Result<Process, BenchError> {
        // What it says of a server that it lost is expected.
        self.join_telling(role, node, server, arguments, Stdio::null())
    }

    /// The same; what it says goes to `stderr`.
    pub(crate) fn join_telling(
        &self,
        role: &str,
        node: &str,
        server: &str,
        arguments: &[&str],
        stderr: Stdio,
    ) -> Result<Process, BenchError> {
        let mut command = self.command();
        command.args([role, "--server", server, "--node", node, "--key"]);
        command.arg(self.key_path()).args(arguments);
        Process::start(command.stderr(stderr))
    }

    fn command(&self) -> Command {
        // Whoever runs this may ignore SIGHUP (nohup), and children inherit that.
        let mut command = Command::new("env");
        command
            .arg("--default-signal=HUP")
            .arg(&self.program)
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

/// The device is behind a bridge.
pub(crate) fn remote_device(file: &mut Table) {
    let remote = Table::from_iter([("kind".to_owned(), Value::from("remote"))]);
    file.insert("device".to_owned(), remote.into());
}

/// A number of a report; NaN where there is none.
pub(crate) fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// Changes a value of a workbench file, such as `network.quic_port`.
pub(crate) fn set(file: &mut Table, key: &str, value: impl Into<Value>) -> Result<(), BenchError> {
    let (table, key) = key.split_once('.').ok_or_else(broken)?;
    let table = file.get_mut(table).and_then(Value::as_table_mut);
    table
        .ok_or_else(broken)?
        .insert(key.to_owned(), value.into());
    Ok(())
}

fn broken() -> BenchError {
    BenchError::missing("the shipped workbench file is not as it was")
}

/// A running `taut serve`; killed when dropped.
pub(crate) struct Served {
    pub(crate) process: Process,
    /// Address of the control plane.
    pub(crate) quic: String,
    /// Address of the pose plane.
    pub(crate) udp: String,
    /// The newest lines of its standard error first.
    said: Arc<Mutex<VecDeque<String>>>,
}

/// From `serving on 127.0.0.1:1 (control) and 127.0.0.1:2 (poses)`.
fn addresses(lines: &mut impl BufRead) -> Result<(String, String), BenchError> {
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
    pub(crate) fn number(&self) -> u32 {
        self.process.number()
    }

    /// Lines of its standard error so far that hold all `parts`.
    pub(crate) fn lines_with(&self, parts: &[&str]) -> Vec<String> {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let holds = |line: &&String| parts.iter().all(|part| line.contains(part));
        said.iter().filter(holds).cloned().collect()
    }

    /// Ends it as Ctrl-C does; its report.
    pub(crate) fn stop(self) -> Result<serde_json::Value, BenchError> {
        self.process.report()
    }
}
