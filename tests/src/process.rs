//! The program under test as a real process that never outlives its test.
//!
//! A process leads a group of its own, which is killed when the [`Process`] is dropped (also by a panic), and it is killed by the
//! system should the test's thread vanish. What it writes goes to files; a test that fails shows them.

use std::fs::File;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::str::Lines;
use std::time::Duration;

use crate::patience::wait_for;
use crate::workbench::{END_LIMIT, START_LIMIT};

/// The end of a process by itself.
#[derive(Debug)]
pub struct Ended {
    /// How.
    pub status: ExitStatus,
    /// All that it wrote to standard output.
    pub stdout: String,
    /// All that it wrote to standard error.
    pub stderr: String,
}

impl Ended {
    /// Standard output as JSON.
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("no JSON ({error}): {}", self.stdout))
    }

    /// The one line on standard error.
    pub fn one_sentence(&self) -> &str {
        let lines: Vec<&str> = self.stderr.lines().collect();
        assert_eq!(lines.len(), 1, "not one line on standard error: {lines:#?}");
        lines[0]
    }
}

/// A running process.
#[derive(Debug)]
pub struct Process {
    name: String,
    child: Child,
    ended: Option<ExitStatus>,
    stdout: PathBuf,
    stderr: PathBuf,
}

impl Process {
    /// Starts `program` with `arguments`; its output goes to `NAME.out` and `NAME.err` in `directory`. `log` filters its log on standard error, such as
    /// `taut=info`.
    pub fn start(
        name: &str,
        program: &Path,
        arguments: &[&str],
        directory: &Path,
        log: Option<&str>,
    ) -> Self {
        let (stdout, stderr) = (
            directory.join(format!("{name}.out")),
            directory.join(format!("{name}.err")),
        );
        let file = |path: &Path| {
            File::create(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
        };
        let mut command = Command::new(program);
        command
            .args(arguments)
            .current_dir(directory)
            .process_group(0);
        command
            .env_remove("TAUT_KEY_FILE")
            .env_remove("TAUT_LOG")
            .env_remove("DISPLAY")
            .env_remove("WAYLAND_DISPLAY");
        command.envs(log.map(|filter| ("TAUT_LOG", filter)));
        // Nothing is kept from one test for another.
        command.env("XDG_CACHE_HOME", directory.join("cache"));
        // But what the driver that draws in software has compiled: the same code for everybody.
        command.env(
            "MESA_SHADER_CACHE_DIR",
            std::env::temp_dir().join("taut-tests-shaders"),
        );
        // Drivers complain aloud where a login session has not set it.
        command.env("XDG_RUNTIME_DIR", directory);
        command
            .stdin(Stdio::null())
            .stdout(file(&stdout))
            .stderr(file(&stderr));
        die_with_this_thread(&mut command);
        let child = command
            .spawn()
            .unwrap_or_else(|error| panic!("{} does not start: {error}", program.display()));
        Self {
            name: name.to_owned(),
            child,
            ended: None,
            stdout,
            stderr,
        }
    }

    /// What it wrote to standard error so far.
    pub fn stderr(&self) -> String {
        read(&self.stderr)
    }

    /// Its number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether it still runs.
    pub fn is_running(&mut self) -> bool {
        self.ended = self
            .ended
            .or_else(|| self.child.try_wait().expect("a child can be asked"));
        self.ended.is_none()
    }

    /// The first line of standard error with this beginning, once it is there: what follows the beginning.
    pub fn line_after(&mut self, beginning: &str) -> String {
        self.line(&format!("\"{beginning} ..\""), |mut lines| {
            lines.find_map(|line| line.strip_prefix(beginning).map(str::to_owned))
        })
    }

    /// The line of standard error that is the `count`-th with all of these parts, once it is there.
    pub fn line_with(&mut self, parts: &[&str], count: usize) -> String {
        self.line(&format!("{parts:?}, {count} times"), |lines| {
            let mut found = lines.filter(|line| parts.iter().all(|part| line.contains(part)));
            found.nth(count - 1).map(str::to_owned)
        })
    }

    fn line(&mut self, what: &str, find: impl Fn(Lines<'_>) -> Option<String>) -> String {
        wait_for(&format!("{what} of {}", self.name), START_LIMIT, || {
            let running = self.is_running();
            let text = self.stderr();
            // A line is whole once its end is written.
            let whole = text.rfind('\n').map_or("", |end| &text[..end]);
            let found = find(whole.lines());
            let name = &self.name;
            assert!(found.is_some() || running, "{name} ended before {what}");
            found
        })
    }

    /// Asks it to end as Ctrl-C does.
    pub fn interrupt(&self) {
        signal(self.child.id() as i32, libc::SIGINT);
    }

    /// Stops it as a starved or suspended machine would; [`Process::resume`] lets it go on.
    pub fn pause(&self) {
        signal(self.child.id() as i32, libc::SIGSTOP);
    }

    /// Lets it go on after [`Process::pause`].
    pub fn resume(&self) {
        signal(self.child.id() as i32, libc::SIGCONT);
    }

    /// Kills it alone, at once, as a crash would: no goodbye.
    pub fn kill(&mut self) {
        signal(self.child.id() as i32, libc::SIGKILL);
        let status = self.child.wait().expect("a killed child ends");
        assert_eq!(
            status.signal(),
            Some(libc::SIGKILL),
            "{} was not killed, it ended before",
            self.name
        );
        self.ended = Some(status);
    }

    /// Waits for its end, at most `limit`, and for that of every process that it started.
    pub fn end(mut self, limit: Duration) -> Ended {
        let status = wait_for(&format!("the end of {}", self.name), limit, || {
            self.is_running();
            self.ended
        });
        assert!(!self.group_lives(), "{} left a process behind", self.name);
        Ended {
            status,
            stdout: read(&self.stdout),
            stderr: read(&self.stderr),
        }
    }

    /// Asks it to end as a terminal does, and gives its report.
    pub fn leave(self) -> String {
        self.left().stdout
    }

    /// The same with a report in JSON.
    pub fn leave_json(self) -> serde_json::Value {
        self.left().json()
    }

    fn left(self) -> Ended {
        self.interrupt();
        let ended = self.end(END_LIMIT);
        assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
        ended
    }

    /// Whether any process of its group is there: itself, or one that it started.
    #[must_use]
    pub fn group_lives(&self) -> bool {
        signal(-(self.child.id() as i32), 0)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.group_lives() {
            signal(-(self.child.id() as i32), libc::SIGKILL);
        }
        if self.ended.is_none() {
            // It was killed: it ends.
            let _ = self.child.wait();
        }
        if std::thread::panicking() {
            let show = |what: &str, text: String| {
                if !text.is_empty() {
                    eprintln!("--- {what} of {}:\n{}", self.name, text.trim_end());
                }
            };
            show("standard output", read(&self.stdout));
            show("standard error", read(&self.stderr));
        }
    }
}

fn read(path: &Path) -> String {
    let bytes = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Sends a signal to a process, or to the group of a negative number; whether there was anybody.
#[allow(
    unsafe_code,
    reason = "std sends no signals but SIGKILL, and none to groups"
)]
fn signal(receiver: i32, number: i32) -> bool {
    // SAFETY: kill touches no memory of ours.
    unsafe { libc::kill(receiver, number) == 0 }
}

/// A test binary that is killed takes its processes along.
#[allow(
    unsafe_code,
    reason = "std cannot ask for a signal at the parent's death"
)]
fn die_with_this_thread(command: &mut Command) {
    let ask = || {
        // SAFETY: prctl with these arguments touches no memory; it is safe between fork and exec.
        match unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL) } {
            0 => Ok(()),
            _ => Err(std::io::Error::last_os_error()),
        }
    };
    // SAFETY: the closure makes one system call and does not allocate.
    unsafe { command.pre_exec(ask) };
}
