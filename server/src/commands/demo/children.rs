//! The child processes of `taut demo`: render nodes and the bridge.
//!
//! They end by themselves when the server closes; one that does not is killed after a grace period. Should this process
//! die first, the system kills them. What they write to standard error appears here, each line once, under their name.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::loops::realtime::die_with_parent;
use crate::shared::lock::lock;

/// Time between two looks at a child that is ending.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// Lines that one of the children has said: several have the same to say.
pub(super) type Said = Arc<Mutex<Vec<String>>>;

/// A process that was started here.
#[derive(Debug)]
pub(super) struct NamedChild {
    name: String,
    process: Child,
    /// Set when what it says is no longer of interest.
    muted: Arc<AtomicBool>,
    /// Passes its lines on; ends with the process.
    reader: Option<JoinHandle<()>>,
    ended: Option<ExitStatus>,
}

impl NamedChild {
    /// Starts `command` under `name`. It lives no longer than the calling thread.
    pub(super) fn start(name: &str, mut command: Command, said: &Said) -> std::io::Result<Self> {
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        die_with_parent(&mut command);
        let mut process = command.spawn()?;
        let muted = Arc::new(AtomicBool::new(false));
        let reader = process.stderr.take().map(|stderr| {
            let (said, muted) = (said.clone(), muted.clone());
            std::thread::Builder::new()
                .name(format!("lines of {name}"))
                .spawn(move || {
                    for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                        let mut said = lock(&said);
                        if !muted.load(Ordering::Relaxed) && !said.contains(&line) {
                            taut_log::say(&line);
                            said.push(line);
                        }
                    }
                })
        });
        Ok(Self {
            name: name.to_owned(),
            process,
            muted,
            reader: reader.and_then(Result::ok),
            ended: None,
        })
    }

    /// The name that it was started under.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// No longer passes on what it writes: it is about to be told to end, and would complain.
    pub(super) fn mute(&self) {
        self.muted.store(true, Ordering::Relaxed);
    }

    /// Asks it to end, as Ctrl-C does: one that is still joining hears nothing of a server that stops.
    pub(super) fn interrupt(&mut self) {
        if self.is_running() {
            #[cfg(unix)]
            taut_bridge::signals::interrupt(&self.process);
        }
    }

    /// Its exit status, the first time after it ended.
    pub(super) fn newly_ended(&mut self) -> Option<ExitStatus> {
        if self.ended.is_some() {
            return None;
        }
        self.ended = self.process.try_wait().ok().flatten();
        self.ended
    }

    pub(super) fn is_running(&mut self) -> bool {
        self.newly_ended();
        self.ended.is_none()
    }
}

impl Drop for NamedChild {
    fn drop(&mut self) {
        if self.is_running() {
            // It may end between the question and the kill; both failures mean that it is gone.
            let _ = self.process.kill();
            let _ = self.process.wait();
        }
        if let Some(reader) = self.reader.take() {
            // The pipe is closed by now; a reader that panicked has nothing left to say.
            let _ = reader.join();
        }
    }
}

/// Waits until every child has ended, at most `grace`, then kills those that have not. Their names.
pub(super) fn wait_or_kill(mut children: Vec<NamedChild>, grace: Duration) -> Vec<String> {
    let deadline = Instant::now() + grace;
    while children.iter_mut().any(NamedChild::is_running) && Instant::now() < deadline {
        std::thread::sleep(LOOK_PERIOD);
    }
    children
        .iter_mut()
        .filter_map(|child| child.is_running().then(|| child.name.clone()))
        .collect()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn a_child_that_ends_is_waited_for_and_one_that_does_not_is_killed() {
        let start = |name, script| NamedChild::start(name, shell(script), &Said::default());
        let (Ok(short), Ok(long)) = (start("short", "exit 3"), start("long", "exec sleep 600"))
        else {
            panic!("sh does not start");
        };
        let long_id = long.process.id();
        let killed = wait_or_kill(vec![short, long], Duration::from_millis(300));
        assert_eq!(killed, ["long"]);
        assert!(!std::path::Path::new(&format!("/proc/{long_id}")).exists());
    }

    #[test]
    fn an_end_is_told_once() {
        let Ok(mut child) = NamedChild::start("quick", shell("exit 2"), &Said::default()) else {
            panic!("sh does not start");
        };
        let status = loop {
            if let Some(status) = child.newly_ended() {
                break status;
            }
            std::thread::sleep(LOOK_PERIOD);
        };
        assert_eq!(status.code(), Some(2));
        assert_eq!(child.newly_ended(), None);
    }
}
