//! A recording as it lies on disk.

use std::fs::{self, File};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use crate::columns::{Fields, Line, Parse};
use crate::error::RecordingError;
use crate::manifest::{FORMAT, Manifest};
use crate::records::{ForceRecord, UpdateRecord};

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

    /// The updates of the god-object, in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn updates(&self) -> Result<RecordReader<UpdateRecord>, RecordingError> {
        RecordReader::open(&self.directory)
    }

    /// The forces, in their order.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn forces(&self) -> Result<RecordReader<ForceRecord>, RecordingError> {
        RecordReader::open(&self.directory)
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
    reader: csv::Reader<File>,
    record: csv::StringRecord,
    kind: PhantomData<T>,
}

impl<T: Line> RecordReader<T> {
    fn open(directory: &Path) -> Result<Self, RecordingError> {
        let path = directory.join(T::FILE);
        let file = File::open(&path).map_err(|error| RecordingError::Read {
            path: path.clone(),
            error,
        })?;
        let mut reader = csv::Reader::from_reader(file);
        let found = reader
            .headers()
            .map(|header| header.iter().collect::<Vec<_>>().join(","));
        match found {
            Ok(header) if header == T::HEADER => Ok(Self {
                path,
                reader,
                record: csv::StringRecord::new(),
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
    /// The next record; `None` at the end. The last line of a session that was killed may be cut off: that is an error like any other.
    ///
    /// # Errors
    /// A line that is not in its form.
    pub fn next_record(&mut self) -> Result<Option<T>, RecordingError> {
        let form = |path: &Path, line, text| RecordingError::Form {
            path: path.to_path_buf(),
            line,
            text,
        };
        match self.reader.read_record(&mut self.record) {
            Ok(false) => return Ok(None),
            Ok(true) => {}
            Err(error) => {
                let line = error.position().map_or(0, csv::Position::line);
                return Err(form(&self.path, line, error.to_string()));
            }
        }
        let line = self.record.position().map_or(0, csv::Position::line);
        T::parse(&mut Fields::of::<T>(&self.record))
            .map(Some)
            .map_err(|text| form(&self.path, line, text))
    }
}
