//! Tells the program what it was built from: commit, whether files differed from it, target. A source archive has no commit, unless the packager
//! gives one as `TAUT_COMMIT`. A debug build has none either: it would have to follow the repository, and every edit of any test and every commit
//! would build the package and all that stands on it anew.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=TAUT_COMMIT");
    let commit = match std::env::var("TAUT_COMMIT") {
        Ok(commit) if !commit.trim().is_empty() => commit.trim().to_owned(),
        _ if std::env::var("PROFILE").as_deref() == Ok("debug") => "debug build".to_owned(),
        _ => of_repository().unwrap_or_else(|| "unknown".to_owned()),
    };
    println!("cargo::rustc-env=TAUT_BUILD_COMMIT={commit}");
    let target = std::env::var("TARGET").unwrap_or_else(|_| "unknown".to_owned());
    println!("cargo::rustc-env=TAUT_BUILD_TARGET={target}");
}

/// The commit of the repository that this package is in, with `-dirty` where tracked files differ from it.
fn of_repository() -> Option<String> {
    let top = git(&["rev-parse", "--show-toplevel"])?;
    for file in ["HEAD", "index"] {
        let path = git(&["rev-parse", "--path-format=absolute", "--git-path", file])?;
        println!("cargo::rerun-if-changed={path}");
    }
    // What the program is made of: with it changes whether the files are the commit's.
    for folder in [
        "server",
        "proto",
        "device-bridge",
        "render-client",
        "Cargo.lock",
    ] {
        println!("cargo::rerun-if-changed={top}/{folder}");
    }
    // An archive unpacked inside another repository is not of that repository's commit.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    let commit = git(&["rev-parse", "--short=10", "HEAD"])?;
    // Without its lock git does not write the index, which would make the next build think that it has changed.
    let changed = git(&[
        "--no-optional-locks",
        "status",
        "--porcelain",
        "--untracked-files=no",
    ]);
    let dirty = changed.is_none_or(|changed| !changed.is_empty());
    Some(if dirty {
        format!("{commit}-dirty")
    } else {
        commit
    })
}

/// What git answers; `None` without git, without a repository, or where it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
