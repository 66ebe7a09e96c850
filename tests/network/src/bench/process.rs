//! Processes that end with their owner.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command};

use rustix::process::{Pid, Signal, kill_process};

use super::{BenchError, wait_until};

/// A process that does not outlive its owner: killed when dropped.
#[derive(Debug)]
pub(crate) struct Process {
    child: Child,
    out: Option<BufReader<ChildStdout>>,
}

impl Process {
    pub(crate) fn start(command: &mut Command) -> Result<Process, BenchError> {
        let mut child = command.spawn()?;
        let out = child.stdout.take().map(BufReader::new);
        Ok(Process { child, out })
    }

    /// The next line that it writes to standard output; empty where it ends before.
    pub(crate) fn line(&mut self) -> Result<String, BenchError> {
        let mut line = String::new();
        if let Some(out) = &mut self.out {
            out.read_line(&mut line)?;
        }
        Ok(line)
    }

    /// Writes an empty line to its standard input; the line that it answers.
    pub(crate) fn ask(&mut self) -> Result<String, BenchError> {
        if let Some(input) = &mut self.child.stdin {
            input.write_all(b"\n")?;
        }
        self.line()
    }

    /// Its standard error.
    pub(crate) fn errors(&mut self) -> Result<BufReader<std::process::ChildStderr>, BenchError> {
        let errors = self.child.stderr.take();
        errors
            .map(BufReader::new)
            .ok_or_else(|| BenchError::missing("the program has no standard error"))
    }

    /// Its number.
    pub(crate) fn number(&self) -> u32 {
        self.child.id()
    }

    /// For signals from another thread, while it is not dropped.
    pub(crate) fn id(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Sends it a signal.
    pub(crate) fn signal(&self, signal: Signal) -> Result<(), BenchError> {
        Ok(kill_process(self.id(), signal).map_err(std::io::Error::from)?)
    }

    /// Waits for its end; whether that was in good order.
    pub(crate) fn wait(&mut self) -> Result<bool, BenchError> {
        let mut ended = None;
        wait_until("the end of a process", || {
            ended = self.child.try_wait().transpose();
            ended.is_some()
        })?;
        Ok(ended.transpose()?.is_some_and(|status| status.success()))
    }

    /// Ends it as Ctrl-C does; what it wrote to standard output and nobody has read.
    pub(crate) fn end(mut self) -> Result<String, BenchError> {
        self.signal(Signal::INT)?;
        let mut text = String::new();
        if let Some(mut out) = self.out.take() {
            out.read_to_string(&mut text)?;
        }
        self.child.wait()?;
        Ok(text)
    }

    /// The same; its report.
    pub(crate) fn report(self) -> Result<serde_json::Value, BenchError> {
        let text = self.end()?;
        serde_json::from_str(&text).map_err(|error| {
            BenchError::Missing(format!("the program's report is no JSON ({error}): {text}"))
        })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill(); // it has ended where all went well
        let _ = self.child.wait();
    }
}
