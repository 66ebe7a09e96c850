//! A panic's message, said without waiting.
//!
//! The standard hook writes to standard error and waits for it. A loop that panics while the terminal stands would never get to
//! the code that switches the force off.

use std::panic::PanicHookInfo;

/// From now on panics say their message by [`crate::say`].
pub(crate) fn say_without_waiting() {
    std::panic::set_hook(Box::new(|panic| crate::say(&sentence(panic))));
}

fn sentence(panic: &PanicHookInfo<'_>) -> String {
    let thread = std::thread::current();
    let name = thread.name().unwrap_or("without a name").to_owned();
    let place = panic
        .location()
        .map_or_else(String::new, |at| format!(" at {at}"));
    let message = panic.payload_as_str().unwrap_or("no message");
    let trace = std::backtrace::Backtrace::capture();
    match trace.status() {
        std::backtrace::BacktraceStatus::Captured => {
            format!("the thread {name} panicked{place}: {message}\n{trace}")
        }
        _ => format!("the thread {name} panicked{place}: {message}"),
    }
}
