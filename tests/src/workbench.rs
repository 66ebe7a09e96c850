//! A workbench of a test's own: a directory with a workbench file on free ports and a cluster key; one runs at a time.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

use taut_link::{
    ClientLink, ClientOptions, ClusterKey, LinkError, Role, connect, create_key_file, read_key_file,
};
use taut_scene::Scene;
use tempfile::TempDir;
use tokio::runtime::Runtime;
use toml::{Table, Value};

use crate::process::{Ended, Process};

/// Longest wait for a server to serve: a debug build on a busy machine loads a scene of 27,000 triangles.
pub const START_LIMIT: Duration = Duration::from_secs(60);
/// Longest wait for the end of a process that was asked to end.
pub const END_LIMIT: Duration = Duration::from_secs(60);
/// Longest wait for the end of a process that is given bad input.
const REFUSAL_LIMIT: Duration = Duration::from_secs(30);

/// The directory, the files in it, and the right to run a workbench now.
#[derive(Debug)]
pub struct TestWorkbench {
    program: PathBuf,
    /// The workbench file's content.
    pub file: Table,
    /// What the processes log, such as `taut=info`; without it warnings.
    pub log: Option<&'static str>,
    directory: TempDir,
    /// Held until the end: two workbenches at once would starve each other on a small machine.
    _turn: Turn,
}

impl TestWorkbench {
    /// The shipped workbench on free ports of loopback, without monitor, patient with silent nodes. `program` is the program under test. Waits
    /// until no other test runs a workbench.
    pub fn new(program: &str) -> Self {
        let turn = Turn::wait();
        let directory = tempfile::Builder::new()
            .prefix("taut-tests-")
            .tempdir()
            .expect("a temporary directory");
        create_key_file(&directory.path().join("cluster.key"))
            .unwrap_or_else(|error| panic!("{error}"));
        let file = taut_scene::SHIPPED_WORKBENCH
            .parse()
            .expect("the shipped workbench file is TOML");
        let mut workbench = Self {
            program: program.into(),
            file,
            log: None,
            directory,
            _turn: turn,
        };
        for port in [
            "network.quic_port",
            "network.udp_port",
            "monitoring.grpc_port",
            "monitoring.web_port",
        ] {
            workbench.set(port, 0);
        }
        workbench.set("monitoring.enabled", false);
        // A busy machine may starve a client for longer than a workbench would forgive.
        workbench.set("network.node_timeout", 4.0);
        workbench
    }

    /// Changes a value of the workbench file, such as `network.quic_port`.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) {
        match key.split_once('.') {
            Some((table, key)) => {
                let table = self.file.get_mut(table).and_then(Value::as_table_mut);
                table
                    .unwrap_or_else(|| panic!("the workbench file has no table for {key}"))
                    .insert(key.into(), value.into());
            }
            None => {
                self.file.insert(key.into(), value.into());
            }
        }
    }

    /// Writes the workbench file as it is now; its path. For a server that runs: [`Self::serve`] does it.
    pub fn save(&self) -> String {
        self.write("workbench.toml", self.file.to_string())
    }

    /// Where its files are.
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }

    /// Writes a file into the directory; its path.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        let path = self.directory().join(name);
        std::fs::write(&path, content)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path.display().to_string()
    }

    /// The cluster key's file.
    pub fn key_path(&self) -> String {
        self.directory().join("cluster.key").display().to_string()
    }

    /// The cluster key.
    pub fn key(&self) -> ClusterKey {
        read_key_file(self.key_path().as_ref()).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Starts the program under test in the directory.
    pub fn start(&self, name: &str, arguments: &[&str]) -> Process {
        let (program, directory) = (&self.program, self.directory());
        Process::start(name, program, arguments, directory, self.log)
    }

    /// A server whose device is behind a bridge, and that bridge, started with `more` arguments: in its hand the body of a shipped scene goes the
    /// scene's own way, firmly, again and again.
    pub fn serve_with_bridge(&mut self, scene: &str, more: &[&str]) -> (Server, Process) {
        self.set("scene", scene);
        self.set(
            "device",
            Table::from_iter([("kind".to_owned(), Value::from("remote"))]),
        );
        let server = self.serve(&[]);
        let hand = Scene::named_or_file(scene)
            .and_then(|scene| scene.hand_path())
            .unwrap_or_else(|error| panic!("{error}"));
        let path = self.write("hand.csv", hand.expect("the scene has a hand").to_csv());
        let always = ["--json", "--hand", "firm", "--path", &path, "--loop"];
        let bridge = self.join("bridge", "bridge", &server, &[&always, more].concat());
        (server, bridge)
    }

    /// Runs the program under test to its end.
    pub fn run(&self, name: &str, arguments: &[&str]) -> Ended {
        self.start(name, arguments).end(REFUSAL_LIMIT)
    }

    /// Starts `taut serve` on the workbench file as it is now, and waits until it serves.
    pub fn serve(&self, arguments: &[&str]) -> Server {
        self.serve_as("server", arguments)
    }

    /// The same at the addresses of a server that died.
    pub fn serve_again(&self, quic: &str, udp: &str) -> Server {
        self.serve_as("server-again", &["--quic", quic, "--udp", udp])
    }

    fn serve_as(&self, name: &str, arguments: &[&str]) -> Server {
        let (config, key) = (self.save(), self.key_path());
        let always = ["serve", "--config", &config, "--key", &key, "--json"];
        let mut process = self.start(name, &[&always, arguments].concat());
        // serving on 127.0.0.1:1 (control) and 127.0.0.1:2 (poses)
        let addresses = process.line_after("serving on ");
        let (quic, udp) = addresses
            .split_once(" (control) and ")
            .unwrap_or_else(|| panic!("two addresses: {addresses}"));
        let udp = udp
            .strip_suffix(" (poses)")
            .unwrap_or_else(|| panic!("two addresses: {addresses}"));
        Server {
            process,
            quic: quic.to_owned(),
            udp: udp.to_owned(),
        }
    }

    /// Starts another role that joins `server`.
    pub fn join(&self, role: &str, node: &str, server: &Server, arguments: &[&str]) -> Process {
        let key = self.key_path();
        let always = [
            role,
            "--server",
            &server.quic,
            "--node",
            node,
            "--key",
            &key,
        ];
        self.start(node, &[&always, arguments].concat())
    }

    /// Joins `server` from this process.
    ///
    /// # Errors
    /// What the link says.
    pub fn connect(
        &self,
        runtime: &Runtime,
        server: &Server,
        role: Role,
        node: &str,
    ) -> Result<ClientLink, LinkError> {
        let options = ClientOptions::new(server.quic.clone(), self.key(), role, node);
        runtime.block_on(connect(options))
    }

    /// What this machine draws with is there; else why not, in the program's own words.
    pub fn adapter(&self) -> Result<(), String> {
        let nowhere = [
            "render",
            "--headless",
            "--server",
            "127.0.0.1:1",
            "--node",
            "front",
            "--key",
            "no.key",
        ];
        let ended = self.run("adapter", &nowhere);
        if ended.stderr.contains("no graphics adapter") {
            Err(ended.one_sentence().to_owned())
        } else {
            Ok(())
        }
    }
}

/// A running server.
#[derive(Debug)]
pub struct Server {
    /// Its process.
    pub process: Process,
    /// Address of the control plane.
    pub quic: String,
    /// Address of the state plane.
    pub udp: String,
}

impl Server {
    /// Asks it to end and reads its report.
    pub fn stop(self) -> serde_json::Value {
        self.process.interrupt();
        let ended = self.process.end(END_LIMIT);
        assert!(
            ended.status.success(),
            "the server ended with {}: {}",
            ended.status,
            ended.stderr
        );
        ended.json()
    }
}

/// The right to run a workbench: a lock on a file that all test processes share. The system lets go when the process ends.
#[derive(Debug)]
struct Turn {
    _file: File,
}

impl Turn {
    fn wait() -> Self {
        let path = std::env::temp_dir().join("taut-tests.lock");
        let file = File::options()
            .create(true)
            .append(true)
            .open(&path)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        file.lock()
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        Self { _file: file }
    }
}
