//! Logs and other lines for people, in every program of taut.
//!
//! A terminal that was stopped (Ctrl-S), an SSH session that hangs and a journal that is busy take nothing: whoever writes to them
//! waits, for as long as it lasts. So nobody here writes but one thread ([`terminal`]); everybody else hands it lines, and where it
//! is behind by [`MAX_WAITING`] of them, further ones are lost and counted. How many were lost is written when the way is
//! free again, and [`lost_lines`] says it at any time. Nothing that calls this waits: a stalled terminal costs lines, never time.
//!
//! [`start`] sets up `tracing` on top of it, and makes panics say their message the same way.
#![forbid(unsafe_code)]

mod filter;
mod panics;
mod writer;

pub use filter::{AUDIT_TARGET, VARIABLE, start, use_directives};
pub use writer::{MAX_WAITING, end_status, flush, lost_lines, say, status, terminal};
