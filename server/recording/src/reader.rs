//! A recording as it lies on disk.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use crate::columns::{Fields, Line, Parse};
use crate::error::RecordingError;
use crate::manifest::{FORMAT, Manifest, Records};
use crate::records::{ForceRecord, HapticsRecord, UpdateRecord};

/// A recording that was found to be one; its records are read as they are asked for.
#[derive(Clone, Debug)]
pub struct Recording {
    directory: PathBuf,
    manifest: Manifest,
    scene: String,
}

impl Recording {
    /// Reads manifest and scene.
    ///
    /// # Errors
    /// A file is missing, is not in its form, or is of another version.
    pub fn open(directory: &Path) -> Result<Self, RecordingError> {
        let path = directory.join("recording.json");
        let text = read(&path)?;
        let manifest: Manifest =
            serde_json::from_str(&text).map_err(|error| RecordingError::Form {
                path: path.clone(),
                line: error.line() as u64,
                text: error.to_string(),
            })?;
        if manifest.format != FORMAT {
            return Err(RecordingError::Format {
                path,
                found: manifest.format,
                program: manifest.program,
            });
        }
        Ok(Self {
            scene: read(&directory.join("scene.toml"))?,
            directory: directory.to_path_buf(),
            manifest,
        })
    }

    /// What it is, and whether it is whole.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Text of the scene.
    #[must_use]
    pub fn scene(&self) -> &str {
        &self.scene
    }

    /// Where the scene's text lies.
    #[must_use]
    pub fn scene_path(&self) -> PathBuf {
        self.directory.join("scene.toml")
    }

    /// The ticks of the haptics loop, in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn haptics(&self) -> Result<RecordReader<HapticsRecord>, RecordingError> {
        RecordReader::open(&self.directory, self.written(|records| records.haptics))
    }

    /// The updates of the god-object, in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn updates(&self) -> Result<RecordReader<UpdateRecord>, RecordingError> {
        RecordReader::open(&self.directory, self.written(|records| records.updates))
    }

    /// The forces, in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn forces(&self) -> Result<RecordReader<ForceRecord>, RecordingError> {
        RecordReader::open(&self.directory, self.written(|records| records.forces))
    }

    /// How many records a session wrote, where it came to its end and says so.
    fn written(&self, of: impl Fn(&Records) -> u64) -> Option<u64> {
        self.manifest.records.as_ref().map(of)
    }
}

fn read(path: &Path) -> Result<String, RecordingError> {
    fs::read_to_string(path).map_err(|error| RecordingError::Read {
        path: path.to_path_buf(),
        error,
    })
}

/// The records of one file, one after the other.
#[derive(Debug)]
pub struct RecordReader<T> {
    path: PathBuf,
    /// Up to where the file reached when it was opened: a session may still write to it.
    reader: csv::Reader<io::Take<File>>,
    record: csv::StringRecord,
    /// Where a line ends that has no end: its last number may have more digits. Beyond every file where all lines have one.
    cut_off_at: u64,
    /// Lines that were read, whole or not, and records that were written; a difference is told once.
    read: u64,
    written: Option<u64>,
    kind: PhantomData<T>,
}

impl<T: Line> RecordReader<T> {
    fn open(directory: &Path, written: Option<u64>) -> Result<Self, RecordingError> {
        let path = directory.join(T::FILE);
        let (file, cut_off_at) = open_lines(&path).map_err(|error| RecordingError::Read {
            path: path.clone(),
            error,
        })?;
        let mut reader = csv::ReaderBuilder::new()
            .quoting(false) // numbers only: a damaged byte must not join lines
            .from_reader(file);
        let found = reader
            .headers()
            .map(|header| header.iter().collect::<Vec<_>>().join(","));
        match found {
            Ok(header) if is_header::<T>(&header) => Ok(Self {
                path,
                reader,
                record: csv::StringRecord::new(),
                cut_off_at,
                read: 0,
                written,
                kind: PhantomData,
            }),
            Ok(header) => Err(RecordingError::Form {
                path,
                line: 1,
                text: format!("the header is `{header}`, but must be `{}`", T::HEADER),
            }),
            Err(error) => Err(RecordingError::Form {
                path,
                line: 1,
                text: error.to_string(),
            }),
        }
    }
}

impl<T: Parse> RecordReader<T> {
    /// The next record; `None` at the end. The last line of a session that was killed may be cut off: that is an error like any other. After one,
    /// the next line is next.
    ///
    /// # Errors
    /// A line that is not in its form, or a file that can be read no further.
    pub fn next_record(&mut self) -> Result<Option<T>, RecordingError> {
        let more = self.reader.read_record(&mut self.record);
        self.read += u64::from(!matches!(more, Ok(false)));
        match more {
            Ok(false) => match self.written.take() {
                Some(written) if written != self.read => Err(self.form(format!(
                    "the file ends after {} records, but the session wrote {written}",
                    self.read
                ))),
                _ => Ok(None),
            },
            Ok(true) if self.reader.position().byte() >= self.cut_off_at => {
                Err(self.form("the line has no end".to_owned()))
            }
            Ok(true) => T::parse(&mut Fields::of::<T>(&self.record))
                .map(Some)
                .map_err(|text| self.form(text)),
            Err(error) => Err(self.refused(error)),
        }
    }

    /// What is wrong with the line that was read last.
    pub(crate) fn form(&self, text: String) -> RecordingError {
        RecordingError::Form {
            path: self.path.clone(),
            line: self.record.position().map_or(0, csv::Position::line),
            text,
        }
    }

    fn refused(&self, error: csv::Error) -> RecordingError {
        let line = error.position().map_or(0, csv::Position::line);
        let (path, text) = (self.path.clone(), error.to_string());
        match error.into_kind() {
            csv::ErrorKind::Io(error) => RecordingError::Read { path, error },
            _ => RecordingError::Form { path, line, text },
        }
    }
}

fn is_header<T: Line>(header: &str) -> bool {
    header == T::HEADER || T::HEADER.strip_suffix(T::ADDED) == Some(header)
}

/// What the file holds now, and where a last line that has no end would end.
fn open_lines(path: &Path) -> io::Result<(io::Take<File>, u64)> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut last = [b'\n'];
    if length > 0 {
        file.seek(SeekFrom::Start(length - 1))?;
        file.read_exact(&mut last)?;
        file.rewind()?;
    }
    let cut_off_at = if last == [b'\n'] { u64::MAX } else { length };
    Ok((file.take(length), cut_off_at))
}
