//! Reads the rows of a device trace: CSV with the columns `t,x,y,z,qw,qx,qy,qz` and optionally `buttons`, in any order; the one reader of this
//! format.
//!
//! Times in s, strictly increasing; positions in m; unit quaternions, `w x y z`. Lines that start with `#` are comments.

use god_object::spatial::Pose;
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

/// The columns that every trace has.
pub const TRACE_COLUMNS: [&str; 8] = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"];
/// The optional column.
const BUTTONS: &str = "buttons";
/// Most faults reported of one file: after these, it is broken throughout.
const MAX_FAULTS: usize = 20;
/// Most characters of a header that a message repeats.
const MAX_QUOTED: usize = 100;
/// Largest magnitude of a time, s: thirty years, and nanoseconds still fit into 64 bits.
pub const MAX_TRACE_TIME: f64 = 1e9;
/// Largest trace file, bytes: more than an hour at 1 kHz.
pub const MAX_TRACE_BYTES: u64 = 1 << 29;
/// How far from 1 the norm of a quaternion in a file may be. Farther off it was not meant as a rotation; nearer ones are
/// digits that were cut, and are normalised.
pub const NORM_TOLERANCE: f64 = 1e-3;

/// One row of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceSample {
    /// Time, s, exactly as in the file.
    pub time: f64,
    /// Pose of the device, that is of the held body's own frame.
    pub pose: Pose,
    /// One bit each; 0 if the trace has none.
    pub buttons: u16,
}

/// All rows of a trace, in order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct TraceRows {
    /// At least one.
    pub samples: Vec<TraceSample>,
    /// Whether there is a column of buttons.
    pub has_buttons: bool,
}

/// What is wrong with a trace.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{text}")]
pub struct TraceFault {
    /// Line in the file, from 1, if one is at fault.
    pub line: Option<usize>,
    /// What is wrong and what to do.
    pub text: String,
}

/// Reads the text of a trace.
///
/// # Errors
/// Up to 20 faults, each with its line.
pub fn parse_trace(text: &str) -> Result<TraceRows, Vec<TraceFault>> {
    let whole = |text: String| TraceFault { line: None, text };
    let no_csv = |error: csv::Error| whole(format!("is no CSV ({error}); repair it"));
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true) // rows of another length are reported here, with their line
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| vec![no_csv(error)])?;
    let columns = Columns::find(text, header).map_err(|fault| vec![fault])?;
    let (mut faults, mut samples) = (Vec::new(), Vec::<TraceSample>::new());
    let mut record = csv::StringRecord::new();
    while faults.len() < MAX_FAULTS {
        match reader.read_record(&mut record) {
            Ok(false) => break,
            Ok(true) => match columns.sample(&record, samples.last().map(|last| last.time)) {
                Ok(sample) => samples.push(sample),
                Err(fault) => faults.push(TraceFault {
                    line: Some(line(text, &record)),
                    text: fault,
                }),
            },
            Err(error) => faults.push(no_csv(error)),
        }
    }
    if faults.is_empty() && samples.is_empty() {
        faults.push(whole("has no samples; record at least one".into()));
    }
    if faults.is_empty() {
        Ok(TraceRows {
            samples,
            has_buttons: columns.buttons.is_some(),
        })
    } else {
        Err(faults)
    }
}

/// The line of a record, from 1. The reader's position is where it began to look: before the comments and empty lines that it skipped.
fn line(text: &str, record: &csv::StringRecord) -> usize {
    record.position().map_or(1, |begun| {
        let rest = text.get(begun.byte() as usize..).unwrap_or_default();
        let skipped = rest
            .lines()
            .take_while(|line| line.starts_with('#') || line.is_empty())
            .count();
        begun.line() as usize + skipped
    })
}

struct Columns {
    numbers: [usize; TRACE_COLUMNS.len()],
    buttons: Option<usize>,
    count: usize,
}

impl Columns {
    fn find(text: &str, header: &csv::StringRecord) -> Result<Self, TraceFault> {
        let place = |name| header.iter().position(|column| column == name);
        let numbers = TRACE_COLUMNS.map(place);
        let buttons = place(BUTTONS);
        let known = TRACE_COLUMNS.len() + usize::from(buttons.is_some());
        if header.len() != known || numbers.contains(&None) {
            let names: Vec<&str> = header.iter().collect();
            let found: String = names.join(",").chars().take(MAX_QUOTED).collect();
            return Err(TraceFault {
                line: Some(line(text, header)),
                text: format!(
                    "the header is `{found}`, but must be `{}` and optionally `{BUTTONS}`",
                    TRACE_COLUMNS.join(",")
                ),
            });
        }
        Ok(Self {
            numbers: numbers.map(Option::unwrap_or_default),
            buttons,
            count: header.len(),
        })
    }

    fn sample(
        &self,
        record: &csv::StringRecord,
        previous: Option<f64>,
    ) -> Result<TraceSample, String> {
        if record.len() != self.count {
            return Err(format!(
                "the line has {} values, but must have {}; repair the line",
                record.len(),
                self.count
            ));
        }
        let mut numbers = [0.0; TRACE_COLUMNS.len()];
        for ((number, name), column) in numbers.iter_mut().zip(TRACE_COLUMNS).zip(self.numbers) {
            let word = record.get(column).unwrap_or_default();
            *number = word.parse().map_err(|_| {
                format!("`{name}` is `{word}`, which is no number; repair the line")
            })?;
            if !f64::is_finite(*number) {
                return Err(format!(
                    "`{name}` is {number}, but must be finite; repair the line"
                ));
            }
        }
        let [time, x, y, z, qw, qx, qy, qz] = numbers;
        if time.abs() > MAX_TRACE_TIME {
            return Err(format!(
                "`t` is {time}, but times are seconds and at most {MAX_TRACE_TIME:e}; convert them"
            ));
        }
        if let Some(previous) = previous.filter(|previous| time <= *previous) {
            return Err(format!(
                "`t` is {time} after {previous}, but times must increase; remove or reorder the line"
            ));
        }
        let buttons = match self.buttons.and_then(|column| record.get(column)) {
            Some(word) => word.parse().map_err(|_| {
                format!("`{BUTTONS}` is `{word}`, but must be 0 to 65535; repair the line")
            })?,
            None => 0,
        };
        let rotation = unit_quaternion([qw, qx, qy, qz])?;
        Ok(TraceSample {
            time,
            pose: Pose::from_parts(Translation3::new(x, y, z), rotation),
            buttons,
        })
    }
}

/// A rotation from `w x y z`.
///
/// # Errors
/// A sentence, where the norm is not 1 within [`NORM_TOLERANCE`].
pub fn unit_quaternion(wxyz: [f64; 4]) -> Result<UnitQuaternion<f64>, String> {
    let [w, x, y, z] = wxyz;
    let quaternion = Quaternion::new(w, x, y, z);
    let norm = quaternion.norm();
    let near_one = (norm - 1.0).abs() <= NORM_TOLERANCE; // false for NaN
    if !near_one {
        return Err(format!(
            "the quaternion has norm {norm}, but must have 1 within {NORM_TOLERANCE}; write w x y z of a unit quaternion"
        ));
    }
    Ok(UnitQuaternion::new_normalize(quaternion))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cut_digits_are_normalised_and_worse_is_refused() {
        let rotation = unit_quaternion([0.8, 0.6001, 0.0, 0.0]).unwrap();
        assert!((rotation.norm() - 1.0).abs() < 1e-15);
        assert!(unit_quaternion([1.0 + 0.99e-3, 0.0, 0.0, 0.0]).is_ok());
        for bad in [
            [1.0 + 1.01e-3, 0.0, 0.0, 0.0],
            [0.0; 4],
            [f64::NAN, 0.0, 0.0, 0.0],
            [f64::INFINITY, 0.0, 0.0, 0.0],
        ] {
            assert!(
                unit_quaternion(bad).unwrap_err().contains("norm"),
                "{bad:?}"
            );
        }
    }

    #[test]
    fn columns_are_found_by_name_and_comments_are_skipped() {
        let text = "# a hand\nbuttons, t,x,y,z, qw,qx,qy,qz\n# pressed\n3,0.5,1,2,3,0,0,0,1.0004\n0,0.6,1,2,3,1,0,0,0\n";
        let rows = parse_trace(text).unwrap();
        assert!(rows.has_buttons);
        assert_eq!((rows.samples[0].time, rows.samples[0].buttons), (0.5, 3));
        assert_eq!(
            rows.samples[0].pose.translation.vector.as_slice(),
            [1.0, 2.0, 3.0]
        );
        assert!((rows.samples[0].pose.rotation.angle() - std::f64::consts::PI).abs() < 1e-12);
    }

    #[test]
    fn a_column_too_many_or_too_few_is_a_fault_of_the_header() {
        for header in [
            "t,x,y,z,qw,qx,qy",
            "t,x,y,z,qw,qx,qy,qz,w",
            "t,t,x,y,z,qw,qx,qy,qz",
        ] {
            let faults = parse_trace(&format!("# a comment\n{header}\n")).unwrap_err();
            assert_eq!(faults[0].line, Some(2), "{faults:?}");
            assert!(faults[0].text.contains("the header is"), "{faults:?}");
        }
    }
}
