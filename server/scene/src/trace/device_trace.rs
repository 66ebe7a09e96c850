//! A recorded or written motion of the device: CSV with the header `t,x,y,z,qw,qx,qy,qz` and optionally `buttons`.
//!
//! Times in s, strictly increasing; positions in m; unit quaternions. Lines that start with `#` are comments.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use taut_recording::{
    MAX_TRACE_BYTES, MAX_TRACE_TIME, TRACE_COLUMNS, TraceFault, TraceSample, parse_trace,
};

use crate::files::read_text;
use crate::problem::{FileError, Problem};

/// A motion of the device. At least one sample, times finite and strictly increasing, rotations unit.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceTrace {
    samples: Vec<TraceSample>,
    has_buttons: bool,
}

impl DeviceTrace {
    /// Checks times and poses of samples made by a program.
    pub fn new(
        name: &str,
        samples: Vec<TraceSample>,
        has_buttons: bool,
    ) -> Result<Self, FileError> {
        let mut last = f64::NEG_INFINITY;
        for (number, sample) in samples.iter().enumerate() {
            let increasing = sample.time > last; // false for NaN
            if !increasing
                || sample.time.abs() > MAX_TRACE_TIME
                || !god_object::spatial::pose_is_finite(&sample.pose)
            {
                let text = format!(
                    "sample {number} at t = {} is out of order or not finite; write increasing times",
                    sample.time
                );
                return Err(Problem::of_file(name, text).into());
            }
            last = sample.time;
        }
        if samples.is_empty() {
            return Err(Problem::of_file(name, "has no samples; record at least one").into());
        }
        Ok(Self {
            samples,
            has_buttons,
        })
    }

    /// Reads a file.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        Self::parse(
            &path.display().to_string(),
            &read_text(path, MAX_TRACE_BYTES)?,
        )
    }

    /// Reads text; `file` is its name in messages. Up to 20 faults are reported, each with its line.
    pub fn parse(file: &str, text: &str) -> Result<Self, FileError> {
        let problem = |fault: TraceFault| match fault.line {
            Some(line) => Problem::at_line(file, line, fault.text),
            None => Problem::of_file(file, fault.text),
        };
        let rows = parse_trace(text)
            .map_err(|faults| FileError::of_all(faults.into_iter().map(problem).collect()))?;
        Self::new(file, rows.samples, rows.has_buttons)
    }

    /// At least one, in order.
    pub fn samples(&self) -> &[TraceSample] {
        &self.samples
    }

    /// Time of a sample since the first one.
    pub fn elapsed(&self, sample: &TraceSample) -> Duration {
        Duration::try_from_secs_f64(sample.time - self.samples[0].time).unwrap_or_default()
    }

    /// From the first sample to the last, s.
    pub fn duration(&self) -> f64 {
        self.samples[self.samples.len() - 1].time - self.samples[0].time
    }

    /// The trace as CSV. Numbers are the shortest that read back as the same: what is written is read back bit for bit,
    /// but for quaternions, whose norm is restored.
    pub fn to_csv(&self) -> String {
        let mut text = TRACE_COLUMNS.join(",");
        text.push_str(if self.has_buttons { ",buttons\n" } else { "\n" });
        for sample in &self.samples {
            let (p, q) = (
                sample.pose.translation.vector,
                sample.pose.rotation.quaternion(),
            );
            // Writing to a String cannot fail.
            let _ = write!(
                text,
                "{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
                sample.time, p.x, p.y, p.z, q.w, q.i, q.j, q.k
            );
            if self.has_buttons {
                let _ = write!(text, ",{}", sample.buttons);
            }
            text.push('\n');
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        "t,x,y,z,qw,qx,qy,qz\n0.0,0.1,0.2,0.3,1,0,0,0\n0.001,0.1,0.2,0.3,0.7071,0.7071,0,0\n";

    fn fault(text: &str) -> String {
        DeviceTrace::parse("a.csv", text).unwrap_err().to_string()
    }

    #[test]
    fn a_trace_is_read_and_written_back() {
        let trace = DeviceTrace::parse("a.csv", GOOD).unwrap();
        assert_eq!(trace.samples().len(), 2);
        assert_eq!(trace.elapsed(&trace.samples()[1]), Duration::from_millis(1));
        let again = DeviceTrace::parse("b.csv", &trace.to_csv()).unwrap();
        for (a, b) in trace.samples().iter().zip(again.samples()) {
            assert_eq!((a.time, a.pose.translation), (b.time, b.pose.translation));
            assert!(a.pose.rotation.angle_to(&b.pose.rotation) < 1e-7);
        }
    }

    #[test]
    fn buttons_are_read_where_there_are_some() {
        let text = "t,x,y,z,qw,qx,qy,qz,buttons\n0,0,0,0,1,0,0,0,5\n";
        let trace = DeviceTrace::parse("a.csv", text).unwrap();
        assert_eq!(trace.samples()[0].buttons, 5);
        assert_eq!(DeviceTrace::parse("a.csv", &trace.to_csv()).unwrap(), trace);
        assert!(fault(&text.replace(",5", ",-5")).starts_with("a.csv:2: `buttons` is `-5`"));
    }

    #[test]
    fn every_fault_names_file_and_line() {
        let cases = [
            (
                GOOD.replace("0.001,", "0.0,"),
                "a.csv:3: `t` is 0 after 0, but times must increase",
            ),
            (
                GOOD.replace("0.7071,0.7071", "0.7,0.7"),
                "a.csv:3: the quaternion has norm 0.98",
            ),
            (
                GOOD.replace("0.0,0.1", "0.0,NaN"),
                "a.csv:2: `x` is NaN, but must be finite",
            ),
            (
                GOOD.replace("0.0,0.1", "0.0,one"),
                "a.csv:2: `x` is `one`, which is no number",
            ),
            (
                GOOD.replace("0.0,0.1,", "0.0,"),
                "a.csv:2: the line has 7 values, but must have 8",
            ),
            (
                GOOD.replace("t,x", "t,X"),
                "a.csv:1: the header is `t,X,y,z,qw,qx,qy,qz`, but must be",
            ),
            (
                GOOD.replace("0.001", "1e12"),
                "a.csv:3: `t` is 1000000000000, but times are seconds",
            ),
            ("t,x,y,z,qw,qx,qy,qz\n".into(), "a.csv: has no samples"),
        ];
        for (text, expected) in cases {
            assert!(
                fault(&text).starts_with(expected),
                "{} / {expected}",
                fault(&text)
            );
        }
    }

    #[test]
    fn several_faults_are_all_reported() {
        let error = DeviceTrace::parse(
            "a.csv",
            "t,x,y,z,qw,qx,qy,qz\n0,a,0,0,1,0,0,0\n1,0,0,0,2,0,0,0\n",
        )
        .unwrap_err();
        let lines: Vec<_> = error.problems().iter().map(|p| p.line).collect();
        assert_eq!(lines, [Some(2), Some(3)]);
        assert!(
            error
                .to_string()
                .ends_with("(and one more fault; `taut check` lists all)")
        );
    }
}
