//! A file that appears under its name only when it is whole.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes beside `path` under a name of its own, and takes the name when it is finished. Dropped before, it leaves nothing. What is there and is no
/// file, such as `/dev/null` or a pipe, is written to as it is: nobody wants it replaced.
#[derive(Debug)]
pub struct FinishedFile {
    path: PathBuf,
    /// None where `path` is written to as it is.
    partial: Option<PathBuf>,
    writer: Option<BufWriter<File>>,
    /// A file that is there is not replaced.
    is_new: bool,
    /// Dropped before it is finished, it stays under the name that it has.
    is_kept: bool,
}

impl FinishedFile {
    /// Begins the file; the directory must be there. It is none of the `inputs`, nor in a folder that is one: they would be lost.
    pub fn create(path: &Path, inputs: &[&Path]) -> io::Result<Self> {
        if path == Path::new("-") {
            let why = "`-` is no file here: the answer is renamed when it is whole, which standard output cannot be; name a file, such as ./answer";
            return Err(io::Error::new(io::ErrorKind::InvalidFilename, why));
        }
        if inputs.iter().any(|input| is_in(path, input)) {
            let why = "it is read for this answer, and would be lost; name another file";
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, why));
        }
        let is_special = |about: fs::Metadata| !about.is_file() && !about.is_dir();
        if fs::metadata(path).is_ok_and(is_special) {
            return Ok(Self {
                path: path.to_path_buf(),
                partial: None,
                writer: Some(BufWriter::new(File::options().write(true).open(path)?)),
                is_new: false,
                is_kept: false,
            });
        }
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        let mut partial_name = OsString::from(".");
        partial_name.push(name);
        partial_name.push(format!(".{}.partial", std::process::id()));
        // A process of this number may have left its own there.
        let partial = free_name(&path.with_file_name(partial_name));
        let writer = Some(BufWriter::new(File::create_new(&partial)?));
        Ok(Self {
            path: path.to_path_buf(),
            partial: Some(partial),
            writer,
            is_new: false,
            is_kept: false,
        })
    }

    /// The same for what cannot be made again: a file that is there already is not replaced, neither now nor when this one is finished.
    pub fn create_new(path: &Path, inputs: &[&Path]) -> io::Result<Self> {
        if is_taken(path) {
            return Err(taken());
        }
        let mut file = Self::create(path, inputs)?;
        file.is_new = true;
        Ok(file)
    }

    /// From now on what was written stays, whatever happens.
    pub fn keep(&mut self) {
        self.is_kept = true;
    }

    /// Where what was written stays if the file is not finished; `None` if nothing does.
    pub fn kept(&self) -> Option<&Path> {
        self.partial.as_deref().filter(|_| self.is_kept)
    }

    /// Gives the whole file its name.
    pub fn finish(mut self) -> io::Result<()> {
        let written = self.writer.take().map(BufWriter::into_inner).transpose();
        let written = written.map_err(io::IntoInnerError::into_error)?;
        let (Some(file), Some(partial)) = (written, &self.partial) else {
            return Ok(());
        };
        file.sync_all()?;
        if self.is_new && is_taken(&self.path) {
            return Err(taken());
        }
        fs::rename(partial, &self.path)
    }

    /// Puts a text in the place of what a file holds, with its permissions; whoever reads it finds the one or the other. A link stays one.
    pub fn replace(path: &Path, text: &str) -> io::Result<()> {
        let path = fs::canonicalize(path)?;
        let permissions = fs::metadata(&path)?.permissions();
        let mut file = Self::create(&path, &[])?;
        file.write_all(text.as_bytes())?;
        if let Some(partial) = &file.partial {
            fs::set_permissions(partial, permissions)?;
        }
        file.finish()
    }
}

/// Whether a file of this name would replace one, or a folder. What is no file, such as `/dev/null` or a pipe, is written to as it is.
pub fn is_taken(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|about| about.is_file() || about.is_dir())
}

/// `path`, or where it is taken the first of `NAME-2.ENDING`, `NAME-3.ENDING`, ... that is not.
pub fn free_name(path: &Path) -> PathBuf {
    let numbered = |number: u64| {
        let mut name = path.file_stem().unwrap_or_default().to_os_string();
        name.push(format!("-{number}"));
        if let Some(ending) = path.extension() {
            name.push(".");
            name.push(ending);
        }
        path.with_file_name(name)
    };
    let mut number = 1;
    let mut free = path.to_path_buf();
    while is_taken(&free) {
        number += 1;
        free = numbered(number);
    }
    free
}

fn taken() -> io::Error {
    let why = "it is there already, and is not written over; name another file";
    io::Error::new(io::ErrorKind::AlreadyExists, why)
}

/// `path` leads to `input`, or into it where that is a folder.
fn is_in(path: &Path, input: &Path) -> bool {
    let Ok(input) = fs::canonicalize(input) else {
        return false;
    };
    // What is not there yet is where its folder is.
    let parent = || {
        fs::canonicalize(
            path.parent()
                .filter(|p| *p != Path::new(""))
                .unwrap_or(Path::new(".")),
        )
    };
    let place = fs::canonicalize(path).or_else(|_| parent());
    place.is_ok_and(|place| place.starts_with(input))
}

impl Write for FinishedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.writer {
            Some(writer) => writer.write(bytes),
            None => Err(io::ErrorKind::BrokenPipe.into()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Drop for FinishedFile {
    fn drop(&mut self) {
        // Finished, there is nothing to remove; otherwise a failure to remove has nobody left to be told to.
        if let Some(partial) = self.partial.as_ref().filter(|_| !self.is_kept) {
            let _ = fs::remove_file(partial);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dash_is_refused_by_name() {
        let error = FinishedFile::create(Path::new("-"), &[]).map_err(|error| error.to_string());
        assert!(error.is_err_and(|error| error.contains("name a file")));
    }

    #[test]
    fn what_is_read_for_the_answer_is_not_replaced() {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let [input, output] = ["trace.csv", "answer.csv"].map(|name| directory.path().join(name));
        assert!(fs::write(&input, "precious").is_ok());
        let kind = |path: &Path, input: &Path| {
            let made = FinishedFile::create(path, &[Path::new("shipped-scene"), input]);
            made.map_err(|error| error.kind()).map(|_| ())
        };
        assert_eq!(kind(&input, &input), Err(io::ErrorKind::AlreadyExists));
        assert_eq!(
            kind(&output, directory.path()),
            Err(io::ErrorKind::AlreadyExists)
        );
        assert_eq!(kind(&output, &input), Ok(()));
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_written_to_and_stays_one() {
        use std::os::unix::fs::FileTypeExt;
        let directory = tempfile::tempdir().expect("no temporary directory");
        let path = directory.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.is_ok_and(|status| status.success()));
        let mut reader = std::process::Command::new("cat");
        let reader = reader.arg(&path).stdout(std::process::Stdio::piped());
        let reader = reader.spawn().expect("nobody reads");
        let mut file = FinishedFile::create(&path, &[]).expect("cannot write");
        assert!(file.write_all(b"whole").is_ok());
        assert!(file.finish().is_ok());
        let read = reader.wait_with_output();
        assert!(read.is_ok_and(|read| read.stdout == b"whole"));
        let about = fs::symlink_metadata(&path);
        assert!(about.is_ok_and(|about| about.file_type().is_fifo()));
        assert_eq!(fs::read_dir(directory.path()).map_or(0, Iterator::count), 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_is_replaced_keeps_its_permissions_and_its_link() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().expect("no temporary directory");
        let [path, link] = ["scene.toml", "link.toml"].map(|name| directory.path().join(name));
        assert!(
            FinishedFile::replace(&path, "new").is_err(),
            "there is nothing to replace"
        );
        assert!(fs::write(&path, "old").is_ok());
        assert!(fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).is_ok());
        assert!(std::os::unix::fs::symlink(&path, &link).is_ok());
        assert!(FinishedFile::replace(&link, "new").is_ok());
        assert!(fs::read(&path).is_ok_and(|bytes| bytes == b"new"));
        assert!(fs::symlink_metadata(&link).is_ok_and(|link| link.is_symlink()));
        let mode = fs::metadata(&path).map(|about| about.permissions().mode() & 0o777);
        assert_eq!(mode.ok(), Some(0o640));
        assert_eq!(fs::read_dir(directory.path()).map_or(0, Iterator::count), 2);
    }

    #[test]
    fn what_cannot_be_made_again_replaces_nothing_and_is_kept() {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let path = directory.path().join("hand.csv");
        let create = || FinishedFile::create_new(&path, &[]);
        let kind = |made: io::Result<()>| made.map_err(|error| error.kind());

        // Nothing is kept of what was begun and has nothing in it yet.
        drop(create());
        assert_eq!(fs::read_dir(directory.path()).map_or(1, Iterator::count), 0);
        let mut first = create().expect("cannot write");
        first.keep();
        let kept = first.kept().expect("it is kept").to_path_buf();
        assert!(first.write_all(b"first").is_ok());
        drop(first);
        assert!(fs::read(&kept).is_ok_and(|bytes| bytes == b"first"));

        // One of the same process is beside it.
        let mut second = create().expect("cannot write");
        second.keep();
        assert_ne!(second.kept(), Some(kept.as_path()));
        let kept = second.kept().expect("it is kept").to_path_buf();
        assert!(second.write_all(b"second").is_ok());
        assert!(fs::write(&path, "precious").is_ok());
        assert_eq!(kind(second.finish()), Err(io::ErrorKind::AlreadyExists));
        assert_eq!(kind(create().map(drop)), Err(io::ErrorKind::AlreadyExists));
        assert!(fs::read(&path).is_ok_and(|bytes| bytes == b"precious"));
        assert!(fs::read(&kept).is_ok_and(|bytes| bytes == b"second"));
    }

    #[test]
    fn names_are_numbered_where_they_are_taken() {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let path = |name: &str| directory.path().join(name);
        for (name, free) in [
            ("a.b.rrd", "a.b.rrd"),
            ("a.b.rrd", "a.b-2.rrd"),
            ("a.b.rrd", "a.b-3.rrd"),
            ("bare", "bare"),
            ("bare", "bare-2"),
        ] {
            assert_eq!(free_name(&path(name)), path(free));
            assert!(fs::write(path(free), "").is_ok());
        }
        #[cfg(unix)]
        assert_eq!(free_name(Path::new("/dev/null")), Path::new("/dev/null"));
    }

    #[test]
    fn the_name_appears_only_when_the_file_is_finished() {
        let directory = tempfile::tempdir().expect("no temporary directory");
        let path = directory.path().join("out.csv");
        let entries = || fs::read_dir(directory.path()).map_or(0, Iterator::count);

        let mut dropped = FinishedFile::create(&path, &[]).expect("cannot write");
        assert!(dropped.write_all(b"half").is_ok());
        assert!(!path.exists());
        drop(dropped);
        assert_eq!(entries(), 0);

        let mut finished = FinishedFile::create(&path, &[]).expect("cannot write");
        assert!(finished.write_all(b"whole").is_ok());
        assert!(finished.finish().is_ok());
        assert!(fs::read(&path).is_ok_and(|bytes| bytes == b"whole"));
        assert_eq!(entries(), 1);
    }
}
