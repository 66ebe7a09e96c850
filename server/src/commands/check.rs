//! `taut check`: what `taut_scene::check` finds in the files, and what a session would refuse of a workbench.

use std::path::Path;

use taut_scene::{
    Device, Document, FileKind, FileReport, LengthUnit, Problem, Workbench, looping_fault,
};

use crate::session::setup::refusals;

/// Reads each file and says everything that is wrong with it.
pub(super) fn reports<P: AsRef<Path>>(files: &[P], unit: Option<LengthUnit>) -> Vec<FileReport> {
    let mut reports = taut_scene::check_in(files, unit);
    for (report, file) in reports.iter_mut().zip(files) {
        if report.kind == FileKind::Workbench {
            let (problems, warnings) = refused(file.as_ref());
            report.problems.extend(problems);
            report.notes.extend(warnings);
        }
    }
    reports
}

/// What a session would refuse, each with its line, and what it would warn of.
fn refused(file: &Path) -> (Vec<Problem>, Vec<String>) {
    let Ok(workbench) = Workbench::load(file) else {
        return Default::default(); // told already
    };
    let name = file.display().to_string();
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let document = Document::parse(&name, &text).ok();
    let (refusals, warnings) = refusals(&workbench);
    let problems = refusals.into_iter().map(|refusal| {
        let path = (refusal.table, refusal.key) == ("device", "path");
        let of_path = path.then(|| hand_fault(&workbench)).flatten();
        Problem {
            file: name.clone(),
            line: document
                .as_ref()
                .and_then(|document| document.line_of(refusal.table, refusal.key)),
            text: of_path.map_or_else(|| refusal.why.to_string(), |problem| problem.to_string()),
        }
    });
    (problems.collect(), warnings)
}

/// Why the simulated hand cannot follow its path, with the line of the path's file.
fn hand_fault(workbench: &Workbench) -> Option<Problem> {
    match &workbench.device {
        Device::Simulated {
            path: Some(path), ..
        } => looping_fault(path),
        Device::Simulated { path: None, .. } => workbench.load_scene().ok()?.hand_fault(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::SHIPPED_WORKBENCH;

    fn faults(scene: &str, changes: &[(&str, &str)]) -> Vec<String> {
        report(scene, changes).0
    }

    /// Problems, and notes.
    fn report(scene: &str, changes: &[(&str, &str)]) -> (Vec<String>, Vec<String>) {
        let directory = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
        let mut text = SHIPPED_WORKBENCH.to_owned();
        for (old, new) in changes {
            assert!(text.contains(old), "{old}");
            text = text.replacen(old, new, 1);
        }
        let [file, scene_file] =
            ["workbench.toml", "scene.toml"].map(|name| directory.path().join(name));
        let trace = include_str!("../../scenes/moving-plate.csv");
        for (path, text) in [
            (&file, text.as_str()),
            (&scene_file, scene),
            (&directory.path().join("still.csv"), trace),
        ] {
            assert!(std::fs::write(path, text).is_ok());
        }
        let [report] = &reports(&[&file], None)[..] else {
            panic!("one report of one file");
        };
        let folder = directory.path().display().to_string();
        let told = report.problems.iter();
        let told = told.map(|problem| problem.to_string().replace(&folder, "."));
        (told.collect(), report.notes.clone())
    }

    const SCENE: &str = "name = \"a\"\n[god_object]\nshape = { box = { half_extents = [0.01, 0.01, 0.01] } }\nmass = 1.0\npose = { position = [0.0, 0.0, 0.5] }\n";
    const NAMES_SCENE: (&str, &str) = ("scene = \"peg-in-a-hole\"", "scene = \"scene.toml\"");

    #[test]
    fn the_shipped_workbench_is_good_and_so_is_a_scene_of_ones_own() {
        assert_eq!(faults("", &[]), [""; 0]);
        assert_eq!(faults(SCENE, &[NAMES_SCENE]), [""; 0]);
    }

    #[test]
    fn files_that_cannot_be_read_are_named_with_their_lines() {
        let path = ("# path = \"my-hand.csv\"", "path = \"none.csv\"");
        let strings = ("# strings = \"wb\"", "strings = \"none.toml\"");
        let token = (
            "enabled = false\nport = 4861",
            "enabled = true\ntoken_file = \"none.token\"\nport = 4861",
        );
        let unread = "cannot use the token of [operator] in ./none.token";
        for (change, further, expected) in [
            (path, 0, "./none.csv: cannot be opened"),
            (strings, 0, "./none.toml"),
            (token, 1, unread),
        ] {
            let at = SHIPPED_WORKBENCH.find(change.0).expect("a part of it");
            let line = SHIPPED_WORKBENCH[..at].lines().count() + 1 + further;
            let told = faults("", &[change]);
            let [told] = &told[..] else {
                panic!("{told:?}");
            };
            let place = format!("./workbench.toml:{line}: ");
            assert!(
                told.starts_with(&place) && told.contains(expected),
                "{told}"
            );
        }
    }

    #[test]
    fn what_a_session_cannot_bear_is_named() {
        let stiff = format!("{SCENE}[coupling]\nk_h = 500000.0\n");
        let moving: String = (0..13)
            .map(|i| {
                format!("[[obstacle]]\nname = \"plate {i}\"\nshape = {{ box = {{ half_extents = [0.01, 0.01, 0.01] }} }}\nmotion = {{ trace = \"still.csv\" }}\n")
            })
            .collect();
        let sticky = format!(
            "{SCENE}[[obstacle]]\nname = \"floor\"\nshape = {{ box = {{ half_extents = [0.01, 0.01, 0.01] }} }}\nsurface = {{ friction = 1e9 }}\n"
        );
        for (scene, expected) in [
            (stiff, "is above the"),
            (sticky, "EdgeSurface.friction out of its range"),
            (SCENE.to_owned() + &moving, "has 13 obstacles with a motion"),
        ] {
            let told = faults(&scene, &[NAMES_SCENE]);
            assert!(
                told.len() == 1
                    && told[0].starts_with("./workbench.toml:10: ")
                    && told[0].contains(expected),
                "{told:?}"
            );
        }
    }

    #[test]
    fn the_cluster_key_is_no_token() {
        let files = tempfile::tempdir().expect("a folder");
        let key = files.path().join("cluster.key");
        assert!(std::fs::write(&key, "3a".repeat(32)).is_ok());
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::Permissions::from_mode(0o600);
            assert!(std::fs::set_permissions(&key, mode).is_ok());
        }
        let path = key.display();
        let told = faults(
            "",
            &[
                (
                    "# key_file = \"cluster.key\"",
                    &format!("key_file = \"{path}\""),
                ),
                (
                    "enabled = false\nport = 4861",
                    &format!("enabled = true\ntoken_file = \"{path}\"\nport = 4861"),
                ),
            ],
        );
        assert!(
            told.iter()
                .any(|told| told.contains("the token of [operator] is the cluster key")),
            "{told:?}"
        );
    }

    #[test]
    fn a_hand_that_does_not_return_is_told_with_the_line_of_its_path() {
        let path = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.05,1,0,0,0\n1,0,0,0.02,1,0,0,0\n";
        let files = tempfile::tempdir().expect("a folder");
        let open = files.path().join("open.csv");
        assert!(std::fs::write(&open, path).is_ok());
        let named = format!("path = \"{}\"", open.display());
        let in_scene = format!(
            "{SCENE}[hand]\npath = \"{}\"\nloop = true\n",
            open.display()
        );
        for (scene, changes) in [
            (
                SCENE,
                &[NAMES_SCENE, ("# path = \"my-hand.csv\"", named.as_str())][..],
            ),
            (&in_scene, &[NAMES_SCENE]),
        ] {
            let told = faults(scene, changes);
            let [told] = &told[..] else {
                panic!("{told:?}");
            };
            assert!(
                told.starts_with("./workbench.toml:") && told.contains("open.csv:3: "),
                "{told}"
            );
        }
    }

    /// A session logs them when it starts; whoever checks before wants to know, too.
    #[test]
    fn what_a_session_warns_of_is_a_note() {
        let stiff = format!("{SCENE}[coupling]\nk_h = 4000.0\n");
        let (problems, notes) = report(&stiff, &[NAMES_SCENE]);
        assert_eq!(problems, [""; 0]);
        assert!(
            notes.iter().any(|note| note.contains("lets go")),
            "{notes:?}"
        );
        assert_eq!(report(SCENE, &[NAMES_SCENE]).1, [""; 0]);
    }
}
