//! Paths that begin again at their end, and so have to end where they begin.

use std::path::Path;

use taut_plant::{MinJerkPath, PathError, ViaPoint};
use taut_recording::MAX_TRACE_BYTES;

use super::DeviceTrace;
use crate::check::length_text;
use crate::files::read_text;
use crate::problem::Problem;

/// Why a simulated hand cannot follow the path in this file again and again, with the line; `None` if it can, or if the file cannot be read.
pub fn looping_fault(path: &Path) -> Option<Problem> {
    let text = read_text(path, MAX_TRACE_BYTES).ok()?;
    looping_fault_of(&path.display().to_string(), &text)
}

/// The same of a text; `file` is its name in messages.
pub(crate) fn looping_fault_of(file: &str, text: &str) -> Option<Problem> {
    let trace = DeviceTrace::parse(file, text).ok()?;
    let start = trace.samples()[0].time;
    let via_points = trace.samples().iter().map(|sample| ViaPoint {
        time_s: sample.time - start,
        pose: sample.pose,
    });
    let error = MinJerkPath::new(via_points.collect(), true).err()?;
    let why = match error {
        PathError::LoopDoesNotClose {
            distance_m,
            angle_rad,
        } => format!(
            "the path begins again at its end, but this last row is {} and {angle_rad:.4} rad from the first; repeat the first pose as the last row",
            length_text(distance_m)
        ),
        other => other.to_string(),
    };
    Some(Problem {
        file: file.to_owned(),
        line: last_row(text),
        text: why,
    })
}

/// The line of the last row, from 1.
fn last_row(text: &str) -> Option<usize> {
    let is_row = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let rows = text.lines().enumerate().filter(|(_, line)| is_row(line));
    rows.last().map(|(index, _)| index + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_does_not_return_is_told_with_its_last_row() {
        let row = |t: f64, z: f64| format!("{t},0,0,{z},1,0,0,0\n");
        let head = "# a hand\nt,x,y,z,qw,qx,qy,qz\n";
        let open = [head, &row(0.0, 0.05), &row(1.0, 0.02), "# end\n\n"].concat();
        let told = looping_fault_of("a.csv", &open).unwrap().to_string();
        assert!(
            told.starts_with("a.csv:4: ") && told.contains("30.00 mm"),
            "{told}"
        );
        let closed = open + &row(2.0, 0.05);
        assert_eq!(looping_fault_of("a.csv", &closed), None);
        assert_eq!(looping_fault_of("a.csv", "no trace"), None);
    }
}
