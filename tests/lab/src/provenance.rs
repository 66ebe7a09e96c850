//! On what a report was made: machine, compiler, crates, commit, date.

use std::fs;
use std::process::Command;

/// Versions of all crates of this build.
const LOCK: &str = include_str!("../../../Cargo.lock");
/// The crates whose versions can change a figure.
const CRATES: [&str; 5] = [
    "god-object",
    "nalgebra",
    "parry3d-f64",
    "clarabel",
    "plotters",
];

/// The model of the first processor, as Linux names it.
pub(crate) fn processor() -> String {
    value_of("/proc/cpuinfo", "model name")
}

/// Names and values, in the order in which they are shown.
pub(crate) fn all() -> Vec<(&'static str, String)> {
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
    let build = if cfg!(debug_assertions) {
        "debug: its times say nothing"
    } else {
        "release"
    };
    vec![
        ("processor", format!("{}, {cores} cores", processor())),
        ("memory", value_of("/proc/meminfo", "MemTotal")),
        (
            "system",
            format!("{} {}", std::env::consts::OS, kernel.trim()),
        ),
        ("load at the end", load()),
        ("compiler", env!("TAUT_COMPILER").to_owned()),
        ("build", build.to_owned()),
        ("crates", CRATES.map(version).join(", ")),
        ("commit", commit()),
        (
            "date",
            answer(Command::new("date").args(["-u", "+%Y-%m-%d %H:%M UTC"])),
        ),
        ("command", command()),
    ]
}

/// The value after the first colon behind `key` in a file of the kernel.
fn value_of(file: &str, key: &str) -> String {
    let text = fs::read_to_string(file).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(key));
    let value = line.and_then(|line| line.split_once(':'));
    value.map_or("not known".into(), |(_, value)| value.trim().to_owned())
}

/// Processes that wanted to run in the last minutes: times of a busy machine are longer.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let averages: Vec<_> = text.split(' ').take(3).collect();
    format!("{} (1, 5, 15 minutes)", averages.join(", "))
}

fn version(name: &str) -> String {
    let entry = format!("name = \"{name}\"\nversion = \"");
    let found = LOCK
        .split_once(&entry)
        .and_then(|(_, rest)| rest.split_once('"'));
    format!(
        "{name} {}",
        found.map_or("not known", |(version, _)| version)
    )
}

/// Of the sources that the command stands in.
pub(crate) fn commit() -> String {
    let git = &mut Command::new("git");
    let git = git.args(["-C", env!("CARGO_MANIFEST_DIR")]);
    answer(git.args(["describe", "--always", "--dirty", "--abbrev=12"]))
}

/// What a program prints.
fn answer(asked: &mut Command) -> String {
    match asked.output() {
        Ok(answer) if answer.status.success() => {
            String::from_utf8_lossy(&answer.stdout).trim().to_owned()
        }
        _ => "not known".into(),
    }
}

/// Without the path of the program.
fn command() -> String {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    format!("taut-lab {}", arguments.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_are_those_of_the_lock() {
        for name in CRATES {
            assert!(!version(name).contains("not known"), "{name}");
        }
    }
}
