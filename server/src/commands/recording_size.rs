//! What a recording will need on its disk, told when it begins.

use std::path::Path;

/// Size of an hour of recording, bytes: of the shipped scenes the least (sphere-on-plane) and the most (two-bunnies), from the files of 10 s at
/// 1 kHz. It grows with the rows of the constraint sets. `docs/recordings.md` has the command.
const AN_HOUR: [f64; 2] = [4.8e9, 6.7e9];
const GIGABYTE: f64 = 1e9;
/// Free space without which no recording is begun while a session runs, bytes: some nine minutes.
const LEAST_ROOM: f64 = 1e9;

/// Where the recording goes, how fast it grows, and for how long there is room.
pub(super) fn sentence(directory: &Path) -> String {
    let [least, most] = AN_HOUR.map(|bytes| bytes / GIGABYTE);
    let growth = format!(
        "recording to {}: {least:.0} to {most:.0} GB an hour with few contacts, more with many",
        directory.display()
    );
    match free(directory) {
        Some(free) => {
            let hours = free / AN_HOUR[1];
            format!(
                "{growth}; {:.0} GB are free there, enough for {hours:.1} hours",
                free / GIGABYTE
            )
        }
        None => growth,
    }
}

/// Refuses a disk with less than a gigabyte.
///
/// # Errors
/// A sentence.
pub(super) fn check_room(directory: &Path) -> Result<(), String> {
    match free(directory) {
        Some(free) if free < LEAST_ROOM => Err(format!(
            "{:.1} GB are free at {}, and an hour of recording takes {:.0} GB or more; make room, or name another disk",
            free / GIGABYTE,
            directory.display(),
            AN_HOUR[0] / GIGABYTE
        )),
        _ => Ok(()),
    }
}

/// Free space, bytes; it is not known on every file system.
fn free(directory: &Path) -> Option<f64> {
    let disk = rustix::fs::statvfs(directory).ok()?;
    Some(disk.f_bavail as f64 * disk.f_frsize as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_says_how_much_an_hour_takes_and_for_how_long_there_is_room() {
        let said = sentence(&std::env::temp_dir());
        assert!(
            said.contains("5 to 7 GB an hour") && said.contains("hours"),
            "{said}"
        );
        // Not there yet: the growth alone.
        let said = sentence(Path::new("/nowhere/at/all"));
        assert!(
            said.contains("GB an hour") && !said.contains("free"),
            "{said}"
        );
    }
}
