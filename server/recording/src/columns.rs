//! Records as lines of CSV, and back. Numbers are the shortest text that reads back as the same value.

use std::fmt::Write as _;
use std::str::FromStr;
use std::time::Duration;

use god_object::constraint::Feature;
use god_object::spatial::{Pose, Vector6};
use god_object::{ShadedAcceleration, nalgebra};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use crate::records::{ConstraintRecord, ForceRecord, HapticsRecord, UpdateRecord};

/// A record that is a line of a file.
pub trait Line: Sized {
    const FILE: &'static str;
    const HEADER: &'static str;
    /// Name of a last column that older recordings have not.
    const ADDED: &'static str = "";

    /// Appends the line, without its end.
    fn write(&self, line: &mut String);
}

/// A record that can be read back.
pub trait Parse: Line {
    /// The record of a line; what is wrong with it otherwise.
    fn parse(fields: &mut Fields<'_>) -> Result<Self, String>;
}

impl Line for HapticsRecord {
    const FILE: &'static str = "haptics.csv";
    const HEADER: &'static str =
        "sample,t_ns,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz,buttons,faulty,fx,fy,fz,tx,ty,tz,tick_ns";
    const ADDED: &'static str = ",tick_ns";

    fn write(&self, line: &mut String) {
        first(line, self.sequence);
        nanoseconds(line, self.time);
        pose(line, &self.pose);
        six(line, &self.velocity);
        push(line, self.buttons);
        push(line, u8::from(self.faulty));
        six(line, &self.wrench);
        nanoseconds(line, self.tick);
    }
}

impl Parse for HapticsRecord {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, String> {
        let mut record = Self {
            sequence: fields.number()?,
            time: fields.time()?,
            tick: Duration::ZERO,
            pose: fields.pose()?,
            velocity: fields.six()?,
            buttons: fields.number()?,
            faulty: fields.number::<u8>()? != 0,
            wrench: fields.six()?,
        };
        record.tick = if fields.is_over() {
            record.time
        } else {
            fields.time()?
        };
        Ok(record)
    }
}

impl Line for UpdateRecord {
    const FILE: &'static str = "updates.csv";
    const HEADER: &'static str = "update,published_ns,sample,hx,hy,hz,hqw,hqx,hqy,hqz,obstacles_ns,ahead,shaded_set,ax,ay,az,awx,awy,awz,sx,sy,sz,sqw,sqx,sqy,sqz,contacts,gap_min";

    fn write(&self, line: &mut String) {
        first(line, self.sequence);
        nanoseconds(line, self.published);
        push(line, self.device_sequence);
        pose(line, &self.device_pose);
        nanoseconds(line, self.obstacle_time);
        push(line, self.device_ahead);
        match &self.shaded {
            Some(shaded) => {
                push(line, shaded.sequence);
                six(line, &shaded.acceleration);
            }
            None => line.push_str(",,,,,,,"),
        }
        pose(line, &self.pose);
        push(line, self.contacts);
        push(line, self.gap_min);
    }
}

impl Parse for UpdateRecord {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, String> {
        Ok(Self {
            sequence: fields.number()?,
            published: fields.time()?,
            device_sequence: fields.number()?,
            device_pose: fields.pose()?,
            obstacle_time: fields.time()?,
            device_ahead: fields.number()?,
            shaded: fields.shaded()?,
            pose: fields.pose()?,
            contacts: fields.number()?,
            gap_min: fields.number()?,
        })
    }
}

impl Line for ForceRecord {
    const FILE: &'static str = "forces.csv";
    const HEADER: &'static str = "force,t_ns,sample,hx,hy,hz,hqw,hqx,hqy,hqz,set,fx,fy,fz,tx,ty,tz";

    fn write(&self, line: &mut String) {
        first(line, self.sequence);
        nanoseconds(line, self.time);
        push(line, self.device_sequence);
        pose(line, &self.device_pose);
        push(line, self.constraint_sequence);
        six(line, &self.wrench);
    }
}

impl Parse for ForceRecord {
    fn parse(fields: &mut Fields<'_>) -> Result<Self, String> {
        Ok(Self {
            sequence: fields.number()?,
            time: fields.time()?,
            device_sequence: fields.number()?,
            device_pose: fields.pose()?,
            constraint_sequence: fields.number()?,
            wrench: fields.six()?,
        })
    }
}

impl Line for ConstraintRecord {
    const FILE: &'static str = "constraints.csv";
    const HEADER: &'static str = "set,obstacle,on_body,on_obstacle,px,py,pz,nx,ny,nz,gap";

    fn write(&self, line: &mut String) {
        let features = &self.row.features;
        first(line, self.set);
        push(line, features.obstacle);
        feature(line, features.on_body);
        feature(line, features.on_obstacle);
        self.row.point.iter().for_each(|value| push(line, value));
        self.row.normal.iter().for_each(|value| push(line, value));
        push(line, self.row.gap);
    }
}

/// A good sample of the device, as a line of a device trace.
pub(crate) const TRACE_HEADER: &str = "t,x,y,z,qw,qx,qy,qz,buttons";

/// Appends the sample as a line of a device trace.
pub(crate) fn trace_line(record: &HapticsRecord, line: &mut String) {
    first(line, record.time.as_secs_f64());
    pose(line, &record.pose);
    push(line, record.buttons);
}

fn first(line: &mut String, value: impl std::fmt::Display) {
    let _ = write!(line, "{value}"); // writing to a String cannot fail
}

fn push(line: &mut String, value: impl std::fmt::Display) {
    let _ = write!(line, ",{value}");
}

fn nanoseconds(line: &mut String, time: Duration) {
    push(line, time.as_nanos());
}

fn pose(line: &mut String, pose: &Pose) {
    let (at, turn) = (&pose.translation, &pose.rotation);
    for value in [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k] {
        push(line, value);
    }
}

fn six(line: &mut String, vector: &Vector6) {
    vector.iter().for_each(|value| push(line, value));
}

/// A vertex, edge or face by its index in the mesh; a part of a primitive by its name.
fn feature(line: &mut String, feature: Feature) {
    let _ = match feature {
        Feature::Vertex(index) => write!(line, ",vertex {index}"),
        Feature::Edge(index) => write!(line, ",edge {index}"),
        Feature::Face(index) => write!(line, ",face {index}"),
        Feature::Whole => write!(line, ",whole"),
        Feature::Side => write!(line, ",side"),
        Feature::Cap(end) => write!(line, ",cap {end}"),
        Feature::Rim(end, place) => write!(line, ",rim {end} {place}"),
    };
}

/// The fields of one line, taken from left to right.
pub struct Fields<'a> {
    header: std::str::Split<'static, char>,
    fields: csv::StringRecordIter<'a>,
}

impl<'a> Fields<'a> {
    pub(crate) fn of<T: Line>(record: &'a csv::StringRecord) -> Self {
        Self {
            header: T::HEADER.split(','),
            fields: record.iter(),
        }
    }

    fn is_over(&self) -> bool {
        self.fields.clone().next().is_none()
    }

    fn text(&mut self) -> Result<(&'static str, &'a str), String> {
        let column = self.header.next().unwrap_or("a further column");
        let text = self
            .fields
            .next()
            .ok_or_else(|| format!("{column} is missing"))?;
        Ok((column, text))
    }

    fn number<T: FromStr>(&mut self) -> Result<T, String> {
        let (column, text) = self.text()?;
        text.parse()
            .map_err(|_| format!("{column} is `{text}`, which is not its kind of number"))
    }

    fn time(&mut self) -> Result<Duration, String> {
        self.number().map(Duration::from_nanos)
    }

    /// Bit by bit as it was: not normalised.
    fn pose(&mut self) -> Result<Pose, String> {
        let translation = Translation3::new(self.number()?, self.number()?, self.number()?);
        let rotation = Quaternion::new(
            self.number()?,
            self.number()?,
            self.number()?,
            self.number()?,
        );
        Ok(Pose::from_parts(
            translation,
            UnitQuaternion::new_unchecked(rotation),
        ))
    }

    fn six(&mut self) -> Result<Vector6, String> {
        let mut vector = Vector6::zeros();
        for value in vector.iter_mut() {
            *value = self.number()?;
        }
        Ok(vector)
    }

    fn shaded(&mut self) -> Result<Option<ShadedAcceleration>, String> {
        let (column, sequence) = self.text()?;
        if sequence.is_empty() {
            for _ in 0..6 {
                self.text()?;
            }
            return Ok(None);
        }
        let sequence = sequence
            .parse()
            .map_err(|_| format!("{column} is `{sequence}`, which is no count"))?;
        Ok(Some(ShadedAcceleration {
            sequence,
            acceleration: self.six()?,
        }))
    }
}
