//! The output of `taut replay`: one row for each input row, columns in a fixed order.
//!
//! Numbers are printed as the shortest text that reads back as the same value, so equal values give equal bytes.

use std::fmt::Write as _;
use std::io::{self, Write};

use god_object::{Pose, Vector6};

/// The columns, in order. h: device pose as used; s: god-object pose; f, t: force (N) and torque (N m) at the reference
/// point, world axes.
pub const REPLAY_COLUMNS: &str = "t,hx,hy,hz,hqw,hqx,hqy,hqz,sx,sy,sz,sqw,sqx,sqy,sqz,fx,fy,fz,tx,ty,tz,contacts,active,gap_min,kkt,stale";
/// What `--timings` adds to the right, microseconds.
pub const TIMING_COLUMNS: &str = ",update_us,force_us";

/// One row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReplayRow {
    /// Time as in the input, s.
    pub time: f64,
    /// Device pose as used.
    pub device_pose: Pose,
    /// God-object pose.
    pub god_object_pose: Pose,
    /// Force and torque on the hand, N and N m.
    pub wrench: Vector6,
    /// Rows in the constraint set.
    pub contacts: usize,
    /// Rows in the active set.
    pub active: usize,
    /// Smallest distance between the bodies, m; infinite, an empty field in the file, if nothing is near.
    pub gap_min: f64,
    /// Relative residual of the force's projection.
    pub kkt: f64,
    /// Age of the constraint set, s.
    pub stale: f64,
    /// Thread CPU time of update and force, microseconds; written only by a writer with timings.
    pub timings_us: (f64, f64),
}

impl ReplayWriter<Vec<u8>> {
    /// One row as a line, with its end and without timings.
    pub fn line(row: &ReplayRow) -> String {
        let mut writer = Self {
            sink: Vec::new(),
            timings: false,
            line: String::new(),
        };
        let _ = writer.write(row); // writing to a Vec cannot fail
        writer.line
    }
}

/// Writes rows as CSV.
#[derive(Debug)]
pub struct ReplayWriter<W> {
    sink: W,
    timings: bool,
    line: String,
}

impl<W: Write> ReplayWriter<W> {
    /// Writes the header.
    pub fn new(mut sink: W, timings: bool) -> io::Result<Self> {
        writeln!(
            sink,
            "{REPLAY_COLUMNS}{}",
            if timings { TIMING_COLUMNS } else { "" }
        )?;
        Ok(Self {
            sink,
            timings,
            line: String::new(),
        })
    }

    /// Writes one row.
    pub fn write(&mut self, row: &ReplayRow) -> io::Result<()> {
        self.line.clear();
        self.number(row.time);
        self.pose(&row.device_pose);
        self.pose(&row.god_object_pose);
        row.wrench
            .iter()
            .for_each(|component| self.number(*component));
        let _ = write!(self.line, ",{},{}", row.contacts, row.active); // writing to a String cannot fail
        for value in [row.gap_min, row.kkt, row.stale] {
            self.number(value);
        }
        if self.timings {
            self.number(row.timings_us.0);
            self.number(row.timings_us.1);
        }
        self.line.push('\n');
        self.sink.write_all(self.line.as_bytes())
    }

    /// Flushes and gives the sink back.
    pub fn finish(mut self) -> io::Result<W> {
        self.sink.flush()?;
        Ok(self.sink)
    }

    fn pose(&mut self, pose: &Pose) {
        let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
        for value in [p.x, p.y, p.z, q.w, q.i, q.j, q.k] {
            self.number(value);
        }
    }

    fn number(&mut self, value: f64) {
        if !self.line.is_empty() {
            self.line.push(',');
        }
        // What there is none of stays empty: tables and scripts read that, and not every one reads `inf`.
        if value.is_finite() {
            let _ = write!(self.line, "{value:?}"); // writing to a String cannot fail
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW: ReplayRow = ReplayRow {
        time: 0.001,
        device_pose: Pose {
            rotation: nalgebra::Unit::new_unchecked(nalgebra::Quaternion {
                coords: nalgebra::Vector4::new(0.0, 0.0, 0.0, 1.0),
            }),
            translation: nalgebra::Translation {
                vector: nalgebra::Vector3::new(0.1, -0.2, 1e-9),
            },
        },
        god_object_pose: Pose {
            rotation: nalgebra::Unit::new_unchecked(nalgebra::Quaternion {
                coords: nalgebra::Vector4::new(0.0, 0.0, 0.0, 1.0),
            }),
            translation: nalgebra::Translation {
                vector: nalgebra::Vector3::new(1.0, 2.0, 3.0),
            },
        },
        wrench: Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 0.1),
        contacts: 7,
        active: 2,
        gap_min: f64::INFINITY,
        kkt: 1e-17,
        stale: 0.0,
        timings_us: (12.5, 3.0),
    };

    fn written(timings: bool) -> String {
        let mut writer = ReplayWriter::new(Vec::new(), timings).unwrap();
        writer.write(&ROW).unwrap();
        String::from_utf8(writer.finish().unwrap()).unwrap()
    }

    #[test]
    fn columns_and_order_are_those_of_the_interface() {
        let expected = format!(
            "{REPLAY_COLUMNS}\n0.001,0.1,-0.2,1e-9,1.0,0.0,0.0,0.0,1.0,2.0,3.0,1.0,0.0,0.0,0.0,1.0,2.0,3.0,4.0,5.0,0.1,7,2,,1e-17,0.0\n"
        );
        assert_eq!(written(false), expected);
        assert_eq!(REPLAY_COLUMNS.split(',').count(), 26);
    }

    #[test]
    fn timings_come_only_to_the_right() {
        let lines = written(true);
        assert!(
            lines
                .lines()
                .next()
                .unwrap()
                .ends_with(",stale,update_us,force_us")
        );
        assert!(lines.ends_with(",0.0,12.5,3.0\n"));
    }
}
