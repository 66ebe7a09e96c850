//! A file that appears under its name only when it is whole.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes beside `path` under a name of its own, and takes the name when it is finished. Dropped before, it leaves nothing.
#[derive(Debug)]
pub(super) struct FinishedFile {
    path: PathBuf,
    partial: PathBuf,
    writer: Option<BufWriter<File>>,
}

impl FinishedFile {
    /// Begins the file; the directory must be there.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        if path == Path::new("-") {
            let why = "`-` is no file here: the answer is renamed when it is whole, which standard output cannot be; name a file, such as ./out.csv";
            return Err(io::Error::new(io::ErrorKind::InvalidFilename, why));
        }
        let name = path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
        let mut partial_name = std::ffi::OsString::from(".");
        partial_name.push(name);
        partial_name.push(format!(".{}.partial", std::process::id()));
        let partial = path.with_file_name(partial_name);
        let writer = Some(BufWriter::new(File::create(&partial)?));
        Ok(Self {
            path: path.to_path_buf(),
            partial,
            writer,
        })
    }

    /// Gives the whole file its name.
    pub(super) fn finish(mut self) -> io::Result<()> {
        if let Some(writer) = self.writer.take() {
            writer
                .into_inner()
                .map_err(io::IntoInnerError::into_error)?
                .sync_all()?;
        }
        fs::rename(&self.partial, &self.path)
    }
}

/// Puts a text in the place of what a file holds, with its permissions; whoever reads it finds the one or the other. A link stays one.
pub(super) fn replace(path: &Path, text: &str) -> io::Result<()> {
    let path = fs::canonicalize(path)?;
    let permissions = fs::metadata(&path)?.permissions();
    let mut file = FinishedFile::create(&path)?;
    file.write_all(text.as_bytes())?;
    fs::set_permissions(&file.partial, permissions)?;
    file.finish()
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
        let _ = fs::remove_file(&self.partial);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dash_is_refused_by_name() {
        let error = FinishedFile::create(Path::new("-")).map_err(|error| error.to_string());
        assert!(error.is_err_and(|error| error.contains("name a file")));
    }

    #[cfg(unix)]
    #[test]
    fn what_is_replaced_keeps_its_permissions_and_its_link() {
        use std::os::unix::fs::PermissionsExt;
        let Ok(directory) = tempfile::tempdir() else {
            panic!("no temporary directory");
        };
        let [path, link] = ["scene.toml", "link.toml"].map(|name| directory.path().join(name));
        assert!(
            replace(&path, "new").is_err(),
            "there is nothing to replace"
        );
        assert!(fs::write(&path, "old").is_ok());
        assert!(fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).is_ok());
        assert!(std::os::unix::fs::symlink(&path, &link).is_ok());
        assert!(replace(&link, "new").is_ok());
        assert!(fs::read(&path).is_ok_and(|bytes| bytes == b"new"));
        assert!(fs::symlink_metadata(&link).is_ok_and(|link| link.is_symlink()));
        let mode = fs::metadata(&path).map(|about| about.permissions().mode() & 0o777);
        assert_eq!(mode.ok(), Some(0o640));
        assert_eq!(fs::read_dir(directory.path()).map_or(0, Iterator::count), 2);
    }

    #[test]
    fn the_name_appears_only_when_the_file_is_finished() {
        let Ok(directory) = tempfile::tempdir() else {
            panic!("no temporary directory");
        };
        let path = directory.path().join("out.csv");
        let entries = || fs::read_dir(directory.path()).map_or(0, Iterator::count);

        let Ok(mut dropped) = FinishedFile::create(&path) else {
            panic!("cannot write");
        };
        assert!(dropped.write_all(b"half").is_ok());
        assert!(!path.exists());
        drop(dropped);
        assert_eq!(entries(), 0);

        let Ok(mut finished) = FinishedFile::create(&path) else {
            panic!("cannot write");
        };
        assert!(finished.write_all(b"whole").is_ok());
        assert!(finished.finish().is_ok());
        assert!(fs::read(&path).is_ok_and(|bytes| bytes == b"whole"));
        assert_eq!(entries(), 1);
    }
}
