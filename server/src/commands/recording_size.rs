//! What a recording will need on its disk, told when it begins.

use std::path::Path;

/// Size of an hour of recording, bytes: of the shipped scenes the least (sphere-on-plane) and the most (two-bunnies), from the files of 10 s at
/// 1 kHz. It grows with the rows of the constraint sets. `docs/recordings.md` has the command.
const AN_HOUR: [f64; 2] = [4.8e9, 6.7e9];
const GIGABYTE: f64 = 1e9;

/// Where the recording goes, how fast it grows, and for how long there is room.
pub(super) fn sentence(directory: &Path) -> String {
    let [least, most] = AN_HOUR.map(|bytes| bytes / GIGABYTE);
    let growth = format!(
        "recording to {}: {least:.0} to {most:.0} GB an hour with few contacts, more with many",
        directory.display()
    );
    match rustix::fs::statvfs(directory) {
        Ok(disk) => {
            let free = disk.f_bavail as f64 * disk.f_frsize as f64;
            let hours = free / AN_HOUR[1];
            format!(
                "{growth}; {:.0} GB are free there, enough for {hours:.1} hours",
                free / GIGABYTE
            )
        }
        Err(_) => growth, // the free space is not known on every file system
    }
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
