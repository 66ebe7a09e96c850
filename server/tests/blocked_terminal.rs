//! `taut serve` with a terminal that takes nothing: an operator's wish for no force is granted, and the signals of an end are heard.
#![cfg(unix)]

use std::io::{BufRead, BufReader, PipeReader, PipeWriter, Write, pipe};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use taut_link::{ClientLink, ClientOptions, Role, connect, create_key_file, read_key_file};
use taut_proto::control::LogLevel;
use taut_proto::state::RunState;
use taut_scene::SHIPPED_WORKBENCH;
use tempfile::TempDir;

/// Much longer than anything here takes; the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(60);
/// A force that is one, N.
const FELT: f32 = 0.5;
/// Lines that the operator has for the log: more than a pipe and the server's queue hold between two looks.
const LINES: usize = 30;

/// A server as a process, whose standard output and standard error are one pipe.
struct Server {
    process: Child,
    address: String,
    /// Kept, so that the pipe is not broken but full.
    _reader: BufReader<PipeReader>,
    writer: PipeWriter,
    directory: TempDir,
}

impl Server {
    fn start() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let key = directory.path().join("key");
        create_key_file(&key).unwrap_or_else(|error| panic!("{error}"));
        let config = directory.path().join("workbench.toml");
        std::fs::write(&config, SHIPPED_WORKBENCH).expect("written");
        let (reader, writer) = pipe().expect("a pipe");
        let output = || Stdio::from(writer.try_clone().expect("a handle"));
        // Whoever runs the tests may ignore SIGHUP (nohup), and children inherit that.
        let process = Command::new("env")
            .args(["--default-signal=HUP", env!("CARGO_BIN_EXE_taut")])
            .arg("serve")
            .args(["--scene", "sphere-on-plane", "--no-monitor"])
            .args(["--quic", "127.0.0.1:0", "--udp", "127.0.0.1:0"])
            .arg("--config")
            .arg(&config)
            .arg("--key")
            .arg(&key)
            .env("TAUT_LOG", "info")
            .stdin(Stdio::null())
            .stdout(output())
            .stderr(output())
            .spawn()
            .expect("the program starts");
        let mut reader = BufReader::new(reader);
        let mut line = String::new();
        let address = loop {
            line.clear();
            assert!(reader.read_line(&mut line).is_ok_and(|length| length > 0));
            // serving on 127.0.0.1:1 (control) and 127.0.0.1:2 (poses)
            if let Some(rest) = line.trim().strip_prefix("serving on ") {
                break rest
                    .split_whitespace()
                    .next()
                    .expect("an address")
                    .to_owned();
            }
        };
        Self {
            process,
            address,
            _reader: reader,
            writer,
            directory,
        }
    }

    /// From now on nobody reads, and the pipe is full.
    fn stop_the_terminal(&self) {
        let mut writer = self.writer.try_clone().expect("a handle");
        let (told, filling) = std::sync::mpsc::channel();
        // Waits in the pipe from then on, as everybody does who writes.
        let filler = std::thread::Builder::new().spawn(move || {
            while writer.write_all(&[b'\n'; 512]).is_ok() {
                let _ = told.send(());
            }
        });
        assert!(filler.is_ok());
        while filling.recv_timeout(Duration::from_millis(300)).is_ok() {}
    }

    fn signal(&self, signal: &str) {
        let id = self.process.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status();
        assert!(sent.is_ok_and(|status| status.success()));
    }

    /// Waits for the end; the exit code.
    fn end(&mut self, what: &str) -> Option<i32> {
        let begun = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("a child") {
                println!("{what}: ended after {:?}", begun.elapsed());
                return status.code();
            }
            assert!(begun.elapsed() < PATIENCE, "{what}: it goes on");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    async fn operator(&self) -> ClientLink {
        let key = read_key_file(&self.directory.path().join("key"));
        let key = key.unwrap_or_else(|error| panic!("{error}"));
        let options = ClientOptions::new(&self.address, key, Role::Operator, "desk");
        connect(options)
            .await
            .unwrap_or_else(|error| panic!("{error}"))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill(); // it has ended, unless the test failed
        let _ = self.process.wait();
    }
}

/// Waits for a state in which there is a force, or there is none; how long that took.
async fn until(operator: &ClientLink, run: RunState) -> Duration {
    let begun = Instant::now();
    let mut states = Vec::new();
    loop {
        assert_eq!(operator.is_closed(), None, "waiting for {run:?}");
        operator.drain_states(&mut states);
        let reached = states.drain(..).any(|received| {
            let force = received
                .state
                .tools
                .first()
                .map_or([0.0; 3], |tool| tool.force);
            let norm = force.iter().map(|x| x * x).sum::<f32>().sqrt();
            received.state.run == run && (run != RunState::Running || norm > FELT)
        });
        if reached {
            return begun.elapsed();
        }
        assert!(begun.elapsed() < PATIENCE, "{run:?} never comes");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Runtime::new().expect("a runtime")
}

#[test]
fn a_terminal_that_takes_nothing_keeps_neither_an_operator_nor_a_signal_from_the_force() {
    let mut server = Server::start();
    runtime().block_on(async {
        let operator = server.operator().await;
        until(&operator, RunState::Running).await;
        server.stop_the_terminal();
        // Each is logged: whoever waits for the terminal does so from here on.
        for line in 0..LINES {
            operator.post_log(LogLevel::Warning, format!("line {line}"));
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        assert!(operator.post_arm(false));
        let took = until(&operator, RunState::Paused).await;
        println!("no force {took:?} after the operator's wish, terminal stopped");
        assert!(operator.post_arm(true));
        until(&operator, RunState::Running).await;
        server.signal("-TERM");
    });
    assert_eq!(server.end("SIGTERM, terminal stopped"), Some(0));
}

#[test]
fn every_signal_that_ends_a_server_ends_it_in_good_order() {
    for signal in ["-INT", "-HUP", "-QUIT"] {
        let mut server = Server::start();
        runtime().block_on(async {
            let operator = server.operator().await;
            until(&operator, RunState::Running).await;
        });
        server.signal(signal);
        assert_eq!(server.end(signal), Some(0));
    }
}
