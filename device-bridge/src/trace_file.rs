//! Reads device traces: CSV with the header `t,x,y,z,qw,qx,qy,qz` and optionally `buttons`; s, m, unit
//! quaternion w x y z, poses of the body's own frame, t strictly increasing.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::devices::{Trace, TraceRow, ViaPoint};

const COLUMNS: [&str; 8] = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"];
const BUTTONS: &str = "buttons";

/// How far a written quaternion's norm may be from 1: rounding to a few digits. Farther is a mistake.
const NORM_TOLERANCE: f64 = 1e-3;

/// Why a trace file was not read.
#[derive(Debug, thiserror::Error)]
pub enum TraceFileError {
    /// The file cannot be opened or read, or is no CSV.
    #[error("cannot read the trace {}: {cause}; check the path and that it is a CSV file", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the reader said.
        cause: csv::Error,
    },
    /// The header is not that of a trace.
    #[error("the trace {} has {problem} in line 1; its header must be t,x,y,z,qw,qx,qy,qz and optionally buttons", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// A row is wrong.
    #[error("the trace {} has {problem} in line {line}; correct that row", path.display())]
    Row {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// What is wrong.
        problem: String,
    },
}

/// Reads the trace at `path`. Every row is checked: numbers finite, times increasing, quaternions of unit norm
/// within 1e-3 (and normalised).
///
/// # Errors
/// [`TraceFileError`] names file and line of the first mistake.
pub fn read_trace(path: &Path) -> Result<Trace, TraceFileError> {
    let unreadable = |cause| TraceFileError::Unreadable {
        path: path.to_owned(),
        cause,
    };
    let mut file = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .flexible(true) // rows of another length are told here, with their line
        .from_path(path)
        .map_err(unreadable)?;
    let columns = Columns::find(file.headers().map_err(unreadable)?).map_err(|problem| {
        TraceFileError::Header {
            path: path.to_owned(),
            problem,
        }
    })?;

    let mut trace = Trace::new();
    for record in file.records() {
        let record = record.map_err(unreadable)?;
        let row = columns
            .row(&record)
            .and_then(|row| match trace.last() {
                Some(last) if row.time_s <= last.time_s => Err(format!(
                    "the time {} s, which is not after the {} s before it",
                    row.time_s, last.time_s
                )),
                _ => Ok(row),
            })
            .map_err(|problem| TraceFileError::Row {
                path: path.to_owned(),
                line: record.position().map_or(0, csv::Position::line),
                problem,
            })?;
        trace.push(row);
    }
    if trace.is_empty() {
        return Err(TraceFileError::Row {
            path: path.to_owned(),
            line: 2,
            problem: "no row".to_owned(),
        });
    }
    Ok(trace)
}

/// The rows of a trace as via points of a hand's intention; their times count from the first row.
#[must_use]
pub fn via_points(trace: &[TraceRow]) -> Vec<ViaPoint> {
    let start_s = trace.first().map_or(0.0, |row| row.time_s);
    trace
        .iter()
        .map(|row| ViaPoint {
            time_s: row.time_s - start_s,
            pose: row.pose,
        })
        .collect()
}

/// Where the columns stand.
struct Columns {
    numbers: [usize; COLUMNS.len()],
    buttons: Option<usize>,
    /// How many there are in the header.
    count: usize,
}

impl Columns {
    fn find(header: &csv::StringRecord) -> Result<Self, String> {
        if let Some(unknown) = header
            .iter()
            .find(|name| !COLUMNS.contains(name) && *name != BUTTONS)
        {
            return Err(format!("the unknown column `{unknown}`"));
        }
        let place = |name| header.iter().position(|column| column == name);
        let mut numbers = [0; COLUMNS.len()];
        for (number, name) in numbers.iter_mut().zip(COLUMNS) {
            *number = place(name).ok_or_else(|| format!("no column `{name}`"))?;
        }
        Ok(Self {
            numbers,
            buttons: place(BUTTONS),
            count: header.len(),
        })
    }

    fn row(&self, record: &csv::StringRecord) -> Result<TraceRow, String> {
        if record.len() != self.count {
            return Err(format!(
                "{} columns where the header has {}",
                record.len(),
                self.count
            ));
        }
        let mut numbers = [0.0; COLUMNS.len()];
        for (i, number) in numbers.iter_mut().enumerate() {
            let text = record.get(self.numbers[i]).unwrap_or_default();
            *number = text
                .parse()
                .ok()
                .filter(|number: &f64| number.is_finite())
                .ok_or_else(|| format!("`{text}` for {}, which is no finite number", COLUMNS[i]))?;
        }
        let buttons = match self.buttons.and_then(|place| record.get(place)) {
            None => 0,
            Some(text) => text.parse().map_err(|_| {
                format!("`{text}` for buttons, which is no whole number from 0 to 65535")
            })?,
        };

        let [time_s, x, y, z, qw, qx, qy, qz] = numbers;
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        let norm = quaternion.norm();
        let unit = (norm - 1.0).abs() <= NORM_TOLERANCE; // false for NaN
        if !unit {
            return Err(format!("a quaternion of norm {norm}, which must be 1"));
        }
        let rotation = UnitQuaternion::from_quaternion(quaternion);
        Ok(TraceRow {
            time_s,
            pose: Isometry3::from_parts(Translation3::new(x, y, z), rotation),
            buttons,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn read(text: &str) -> Result<Trace, TraceFileError> {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.write_all(text.as_bytes()).expect("written");
        read_trace(file.path())
    }

    fn mistake(text: &str) -> String {
        read(text).expect_err("a broken trace").to_string()
    }

    const HEADER: &str = "t,x,y,z,qw,qx,qy,qz";

    #[test]
    fn rows_are_read_by_the_names_of_their_columns() {
        let trace =
            read("buttons, t,x,y,z, qw,qx,qy,qz\n3,0.5,1,2,3,0,0,0,1.0004\n0,0.6,1,2,3,1,0,0,0\n")
                .expect("a valid trace");
        assert_eq!(trace.len(), 2);
        assert_eq!((trace[0].time_s, trace[0].buttons), (0.5, 3));
        assert_eq!(trace[0].pose.translation.vector.as_slice(), [1.0, 2.0, 3.0]);
        assert!((trace[0].pose.rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
        let via = via_points(&trace);
        assert!(via[0].time_s == 0.0 && (via[1].time_s - 0.1).abs() < 1e-12);
    }

    #[test]
    fn every_mistake_is_told_with_its_line() {
        let row = "0,0,0,0,1,0,0,0";
        let told = |text: String, parts: [&str; 2]| {
            let sentence = mistake(&text);
            for part in parts {
                assert!(sentence.contains(part), "{sentence}");
            }
        };
        told(
            format!("{HEADER}\n{row}\n0,0,0,0,1,0,0,0\n"),
            ["line 3", "not after"],
        );
        told(
            format!("{HEADER}\n{row}\n1,nan,0,0,1,0,0,0\n"),
            ["line 3", "`nan` for x"],
        );
        told(
            format!("{HEADER}\n0,0,0,0,0.9,0,0,0\n"),
            ["line 2", "norm 0.9"],
        );
        told(
            format!("{HEADER},w\n{row},1\n"),
            ["line 1", "unknown column `w`"],
        );
        told(
            "t,x,y,z,qw,qx,qy\n".to_owned(),
            ["line 1", "no column `qz`"],
        );
        told(format!("{HEADER}\n"), ["line 2", "no row"]);
        told(
            format!("{HEADER}\n0,0\n"),
            ["line 2", "2 columns where the header has 8"],
        );
        let missing = read_trace(Path::new("no/such/trace.csv")).expect_err("a missing file");
        assert!(missing.to_string().contains("no/such/trace.csv"));
    }
}
