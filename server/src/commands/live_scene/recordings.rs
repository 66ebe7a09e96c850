//! A recording that an operator begins while the session runs: where it goes, and why there is none.
//!
//! What is recorded can be computed again only from its start, with everything that the loops begin with. So a session of the same scene begins anew, and is
//! recorded from its first tick.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use taut_scene::{Device, Workbench, free_name};

use crate::commands::recording_size;
use crate::session::setup::SessionSetup;
use crate::shared::failure::Failure;

/// Told of a device of the server's own: no session can follow another.
pub(super) const OPENED_ONCE: &str = "the force device is opened by the server itself, and once; write kind = \"remote\" in [device] and run `taut bridge` beside it";

/// What is not recorded from here.
pub(super) fn why_not(
    workbench: &Workbench,
    setup: &SessionSetup,
    from_start: bool,
) -> Option<&'static str> {
    let monitor = setup.monitor.as_ref();
    if from_start {
        return Some(
            "every session is recorded since the start (--recording); serve without, to begin and end recordings here",
        );
    }
    if monitor.is_some_and(|monitor| monitor.record.is_some()) {
        return Some(
            "what the monitor shows is written to one file since the start, which is of one session ([monitoring] record, --record); serve without",
        );
    }
    if is_opened_once(workbench) {
        return Some(OPENED_ONCE);
    }
    if workbench.operator.recordings.is_none() {
        return Some(
            "the workbench file names no folder for recordings; write recordings = \"DIR\" in [operator]",
        );
    }
    None
}

/// Whether the device of the server cannot be opened for another session.
pub(super) fn is_opened_once(workbench: &Workbench) -> bool {
    matches!(&workbench.device, Device::Driver(chosen) if chosen.kind.has_motors)
}

/// The folder of a recording that begins now, named by the time, in UTC: `2026-11-29T12-03-22Z`. Nothing is made.
pub(super) fn place(recordings: &Path) -> PathBuf {
    let now = humantime::format_rfc3339_seconds(SystemTime::now());
    free_name(&recordings.join(now.to_string().replace(':', "-")))
}

/// Makes the folder, so that a disk that is not there is no news for a session that has begun.
pub(super) fn make(directory: &Path) -> Result<(), Failure> {
    let cannot = |error: std::io::Error| {
        Failure::BadInput(format!(
            "{} cannot be made ({error}); check `recordings` in [operator] of the workbench file, its permissions and its disk",
            directory.display()
        ))
    };
    if let Some(parent) = directory.parent() {
        fs::create_dir_all(parent).map_err(cannot)?;
    }
    fs::create_dir(directory).map_err(cannot)?;
    recording_size::check_room(directory).map_err(|why| {
        let _ = fs::remove_dir(directory); // it is empty
        Failure::BadInput(why)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_is_named_by_its_date_and_takes_no_other_s_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let recordings = folder.path().join("not/there/yet");
        let first = place(&recordings);
        let name = first.file_name().and_then(|name| name.to_str());
        let name = name.expect("a name").to_owned();
        assert!(name.len() == 20 && name.ends_with('Z'), "{name}");
        assert!(!name.contains(':'), "{name}");
        assert!(make(&first).is_ok() && first.is_dir());
        let refused = make(&first).expect_err("it is there").to_string();
        assert!(refused.contains("recordings"), "{refused}");
        // Of the same second, most often.
        assert_ne!(place(&recordings), first);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named_with_what_to_do() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("file"), "x").expect("written");
        let why = make(&folder.path().join("file/a"))
            .expect_err("a file")
            .to_string();
        assert!(
            why.contains("file/a cannot be made") && why.contains("`recordings`"),
            "{why}"
        );
    }
}
