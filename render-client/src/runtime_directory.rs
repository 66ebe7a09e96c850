//! The directory that graphics drivers want of a login session.

/// Graphics drivers complain on standard error, once for each way in which they look for a screen, where nobody has set a directory for
/// what a login session needs. Nothing is put there: this program executes itself again, in the same process, with one. For the start of a program,
/// before any thread. Returns if there is no need, or if that failed, which the log tells.
pub fn restart_with_runtime_directory() {
    const DIRECTORY: &str = "XDG_RUNTIME_DIR";
    if std::env::var_os(DIRECTORY).is_some_and(|directory| !directory.is_empty()) {
        return;
    }
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;

        let error = std::env::current_exe().map_or_else(
            |error| error,
            |program| {
                std::process::Command::new(program)
                    .args(std::env::args_os().skip(1))
                    .env(DIRECTORY, std::env::temp_dir())
                    .exec()
            },
        );
        tracing::warn!("graphics drivers may complain of {DIRECTORY} ({error})");
    }
}
