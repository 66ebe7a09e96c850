//! The program as a process beside its test, which it never outlives.

use std::ffi::OsStr;
use std::io::Read;
use std::process::{Child, Command, Output};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use super::{command, wait_until};

/// What it says is read as it comes.
pub(crate) struct Running {
    child: Child,
    said: Arc<Mutex<String>>,
    reader: Option<JoinHandle<()>>,
}

impl Running {
    pub(crate) fn start<S: AsRef<OsStr>>(arguments: &[S]) -> Self {
        Self::of(&mut command(arguments))
    }

    /// Of a command whose standard output and standard error are pipes.
    pub(crate) fn of(command: &mut Command) -> Self {
        let mut child = command.spawn().expect("taut starts");
        let said = Arc::new(Mutex::new(String::new()));
        let (shared, mut pipe) = (said.clone(), child.stderr.take().expect("a pipe"));
        let reader = std::thread::Builder::new().spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(length @ 1..) = pipe.read(&mut bytes) {
                let more = String::from_utf8_lossy(&bytes[..length]).into_owned();
                shared.lock().expect("no panic").push_str(&more);
            }
        });
        Self {
            child,
            said,
            reader: Some(reader.expect("a thread")),
        }
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn runs(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// All that it said so far.
    pub(crate) fn text(&self) -> String {
        self.said.lock().expect("no panic").clone()
    }

    pub(crate) fn says(&self, part: &str) -> bool {
        self.said.lock().expect("no panic").contains(part)
    }

    /// What follows `mark` to the end of the word, once it is said.
    pub(crate) fn word_after(&self, mark: &str) -> String {
        let word = || {
            let text = self.text();
            let (word, _) = text.split_once(mark)?.1.split_once(char::is_whitespace)?;
            Some(word.to_owned())
        };
        wait_until(mark, || word().is_some());
        word().expect("it was said")
    }

    pub(crate) fn signal(&self, name: &str) {
        signal(&self.child, name);
    }

    /// Sends the signal, and waits for its end.
    pub(crate) fn end(self, signal: &str) -> Output {
        self.signal(signal);
        self.ended()
    }

    /// Waits until it ends; what it prints until then is less than a pipe holds.
    pub(crate) fn ended(mut self) -> Output {
        wait_until("it ends", || !self.runs());
        let mut stdout = Vec::new();
        let mut pipe = self.child.stdout.take().expect("a pipe");
        pipe.read_to_end(&mut stdout).expect("read");
        let reader = self.reader.take().expect("a thread");
        reader.join().expect("no panic");
        Output {
            status: self.child.wait().expect("a child"),
            stdout,
            stderr: self.text().into_bytes(),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking()
            && let Ok(said) = self.said.lock()
        {
            eprintln!("{said}");
        }
    }
}

/// Such as `-TERM`.
pub(crate) fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    let sent = Command::new("kill").args([name, &id]).status();
    assert!(sent.expect("kill").success());
}
