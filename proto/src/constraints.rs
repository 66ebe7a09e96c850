//! CONSTRAINTS payload: a constraint set, downstream to a device bridge that couples by itself.
//!
//! | block | bytes    | count |
//! |-------|----------|-------|
//! | head  | 88       | 1     |
//! | row   | 40 to 96 | ≤ 25  |
//!
//! A set has up to [`MAX_SET_ROWS`] rows and travels in as many datagrams as it needs, each with the whole head and a run of rows:
//! [`crate::constraint_parts`] divides and assembles. The pose is f64, since the device's place is compared with it; rows are f32 from the
//! god-object's origin: some nanometres on a body of 0.1 m, which changes the force by less than 1e-4 of itself (measured by the
//! package `taut-control-tests`).

use crate::{
    DecodeError, EncodeError, PoseF64,
    codec::{Reader, Wire, Writer, read_elements},
    header::MAX_PAYLOAD_BYTES,
    range::{COUNT, LENGTH, NAME, Number, SIZE, TIME, UNIT},
};
use arrayvec::ArrayVec;

/// Most rows of one set: the capacity of the method's sets.
pub const MAX_SET_ROWS: usize = 1024;
/// Most datagrams of one set: rows with everything that a row can have, ten to a datagram, fit.
pub const MAX_PARTS: usize = 128;
/// Bytes of a part before its rows.
pub const PART_HEAD_BYTES: usize = 88;
/// Bytes of the plainest row.
pub const SMALLEST_ROW_BYTES: usize = 40;
/// Most rows of one part.
pub const MAX_PART_ROWS: usize = (MAX_PAYLOAD_BYTES - PART_HEAD_BYTES) / SMALLEST_ROW_BYTES;

/// [`SetHead::flags`]: no force is to be given.
pub const SET_PAUSED: u8 = 1;
/// [`SetHead::flags`]: the capacity did not hold every row; the nearest were kept.
pub const SET_TRUNCATED: u8 = 2;
const KNOWN_SET_FLAGS: u8 = SET_PAUSED | SET_TRUNCATED;

/// [`SetHead::sequence`] of no set.
pub const NO_SET: u64 = u64::MAX;

/// What a set says besides its rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetHead {
    /// Number of the set, increasing; the newest wins. [`NO_SET`] where there is none.
    pub sequence: u64,
    /// When the god-object loop published it: session time, ns.
    pub made_ns: u64,
    /// [`crate::InputSample::sample_time_ns`] of the device reading that it answers, as the bridge stamped it: the age of the set counts
    /// from there. 0 for none.
    pub device_ns: u64,
    /// God-object's own frame in the scene frame, where the rows hold.
    pub pose: PoseF64,
    /// [`SET_PAUSED`], [`SET_TRUNCATED`].
    pub flags: u8,
}

/// A feature of a body, by kind and index: what names a contact through time. The method says what the kinds are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowFeature {
    /// 0 to 15.
    pub kind: u8,
    /// Index within its kind.
    pub index: u32,
}

/// How the distance of a row's features changes when the body turns; scene axes, points from the god-object's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RowSeparation {
    /// The normal is the obstacle's.
    #[default]
    OfObstacle,
    /// The normal is the body's.
    OfBody,
    /// Two edges, by their unit directions: of the body, of the obstacle.
    OfEdges([[f32; 3]; 2]),
    /// A ball of this radius, m.
    OfBall(f32),
    /// A rim: centre (m), unit axis, radius (m).
    OfRim([f32; 3], [f32; 3], f32),
    /// Points or lines with balls around: unit directions or zero, radii (m); of the body, of the obstacle.
    OfRods([[f32; 3]; 2], [f32; 2]),
}

/// One row of a set.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstraintRow {
    /// Index of the obstacle in the scene.
    pub obstacle: u16,
    /// Feature of the god-object's body.
    pub on_body: RowFeature,
    /// Feature of the obstacle.
    pub on_obstacle: RowFeature,
    /// From the god-object's origin to the contact point on the obstacle, m, scene axes.
    pub arm: [f32; 3],
    /// Unit normal, obstacle to god-object, scene axes.
    pub normal: [f32; 3],
    /// Distance of the features, m.
    pub gap: f32,
    /// How far the obstacle's point at the contact went since the set that was sent before, m, scene axes.
    pub obstacle_displacement: [f32; 3],
    /// How the distance changes when the body turns; the default where nobody re-linearises.
    pub separation: RowSeparation,
    /// Interpolated normal where the surface is shaded.
    pub shading_normal: Option<[f32; 3]>,
}

/// One datagram of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintPart {
    /// That of the whole set.
    pub head: SetHead,
    /// Rows of the whole set.
    pub rows_in_set: u16,
    /// Number of this part, from 0.
    pub part: u8,
    /// Parts of the set.
    pub parts: u8,
    /// Place of this part's first row in the set.
    pub first_row: u16,
    /// The rows from there on.
    pub rows: ArrayVec<ConstraintRow, MAX_PART_ROWS>,
}

/// A whole set.
#[derive(Debug, PartialEq)]
pub struct ConstraintSet {
    /// What it says besides its rows.
    pub head: SetHead,
    /// The rows, in ascending order of their features.
    pub rows: Vec<ConstraintRow>,
}

impl ConstraintSet {
    /// An empty set that takes [`MAX_SET_ROWS`] rows without allocating.
    pub fn new() -> ConstraintSet {
        ConstraintSet {
            head: SetHead::default(),
            rows: Vec::with_capacity(MAX_SET_ROWS),
        }
    }
}

impl Default for ConstraintSet {
    fn default() -> ConstraintSet {
        ConstraintSet::new()
    }
}

// By hand for the capacity, and for `clone_from`, which reuses memory.
impl Clone for ConstraintSet {
    fn clone(&self) -> ConstraintSet {
        let mut copy = ConstraintSet::new();
        copy.clone_from(self);
        copy
    }

    fn clone_from(&mut self, source: &ConstraintSet) {
        self.head = source.head;
        self.rows.clone_from(&source.rows);
    }
}

impl Default for SetHead {
    fn default() -> SetHead {
        SetHead {
            sequence: NO_SET,
            made_ns: 0,
            device_ns: 0,
            pose: PoseF64::IDENTITY,
            flags: 0,
        }
    }
}

const SEQUENCE: Number = Number::new("SetHead.sequence", COUNT);
const MADE: Number = Number::new("SetHead.made_ns", TIME);
const DEVICE: Number = Number::new("SetHead.device_ns", TIME);
const ROWS_IN_SET: Number = Number::new("ConstraintPart.rows_in_set", crate::range::SET_ROWS);
const PART: Number = Number::new("ConstraintPart.part", crate::range::SET_PART);
const PARTS: Number = Number::new("ConstraintPart.parts", crate::range::SET_PARTS);
const FIRST_ROW: Number = Number::new("ConstraintPart.first_row", crate::range::SET_ROWS);
const OBSTACLE: Number = Number::new("ConstraintRow.obstacle", NAME);
const FEATURE: Number = Number::new("ConstraintRow.feature", NAME);
const ARM: Number = Number::new("ConstraintRow.arm", LENGTH);
const NORMAL: Number = Number::new("ConstraintRow.normal", UNIT);
const GAP: Number = Number::new("ConstraintRow.gap", LENGTH);
const DISPLACEMENT: Number = Number::new("ConstraintRow.obstacle_displacement", LENGTH);
const DIRECTION: Number = Number::new("ConstraintRow.direction", UNIT);
const CENTRE: Number = Number::new("ConstraintRow.centre", LENGTH);
const RADIUS: Number = Number::new("ConstraintRow.radius", SIZE);

impl SetHead {
    /// Its numbers and what each may be. [`NO_SET`] is none of them: it does not travel.
    pub const NUMBERS: &'static [Number] = &[SEQUENCE, MADE, DEVICE];
}

impl ConstraintPart {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[ROWS_IN_SET, PART, PARTS, FIRST_ROW];
}

impl ConstraintRow {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[
        OBSTACLE,
        FEATURE,
        ARM,
        NORMAL,
        GAP,
        DISPLACEMENT,
        DIRECTION,
        CENTRE,
        RADIUS,
    ];
}

/// Bits of a row's `has` byte.
mod has {
    pub(super) const SEPARATION: u8 = 0b0111;
    pub(super) const SHADING_NORMAL: u8 = 0b0000_1000;
    pub(super) const DISPLACEMENT: u8 = 0b0001_0000;
    pub(super) const KNOWN: u8 = SEPARATION | SHADING_NORMAL | DISPLACEMENT;
}

impl RowSeparation {
    fn code(&self) -> u8 {
        match self {
            RowSeparation::OfObstacle => 0,
            RowSeparation::OfBody => 1,
            RowSeparation::OfEdges(_) => 2,
            RowSeparation::OfBall(_) => 3,
            RowSeparation::OfRim(..) => 4,
            RowSeparation::OfRods(..) => 5,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            RowSeparation::OfObstacle | RowSeparation::OfBody => 0,
            RowSeparation::OfEdges(_) => 24,
            RowSeparation::OfBall(_) => 4,
            RowSeparation::OfRim(..) => 28,
            RowSeparation::OfRods(..) => 32,
        }
    }

    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        match self {
            RowSeparation::OfObstacle | RowSeparation::OfBody => Ok(()),
            RowSeparation::OfEdges(along) => {
                along.iter().try_for_each(|edge| DIRECTION.write(edge, to))
            }
            RowSeparation::OfBall(radius) => RADIUS.write(radius, to),
            RowSeparation::OfRim(center, axis, radius) => {
                CENTRE.write(center, to)?;
                DIRECTION.write(axis, to)?;
                RADIUS.write(radius, to)
            }
            RowSeparation::OfRods(along, radii) => {
                along.iter().try_for_each(|rod| DIRECTION.write(rod, to))?;
                RADIUS.write(radii, to)
            }
        }
    }

    fn read(code: u8, from: &mut Reader<'_>) -> Result<RowSeparation, DecodeError> {
        Ok(match code {
            0 => RowSeparation::OfObstacle,
            1 => RowSeparation::OfBody,
            2 => RowSeparation::OfEdges([DIRECTION.read(from)?, DIRECTION.read(from)?]),
            3 => RowSeparation::OfBall(RADIUS.read(from)?),
            4 => RowSeparation::OfRim(
                CENTRE.read(from)?,
                DIRECTION.read(from)?,
                RADIUS.read(from)?,
            ),
            5 => RowSeparation::OfRods(
                [DIRECTION.read(from)?, DIRECTION.read(from)?],
                RADIUS.read(from)?,
            ),
            tag => {
                return Err(DecodeError::UnknownTag {
                    what: "separation",
                    tag,
                });
            }
        })
    }
}

impl ConstraintRow {
    /// Whether the obstacle did not move.
    fn stands(&self) -> bool {
        self.obstacle_displacement == [0.0; 3]
    }

    /// Bytes on the wire.
    pub fn bytes(&self) -> usize {
        let moved = if self.stands() { 0 } else { 12 };
        let shading = if self.shading_normal.is_some() { 12 } else { 0 };
        SMALLEST_ROW_BYTES + moved + shading + self.separation.bytes()
    }
}

impl Wire for ConstraintRow {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        let (body, obstacle) = (self.on_body.kind, self.on_obstacle.kind);
        if body > 15 || obstacle > 15 {
            return Err(EncodeError::TooLong {
                what: "feature kind",
                len: usize::from(body.max(obstacle)),
                max: 15,
            });
        }
        OBSTACLE.write(&self.obstacle, to)?;
        (body | obstacle << 4).write(to)?;
        FEATURE.write(&self.on_body.index, to)?;
        FEATURE.write(&self.on_obstacle.index, to)?;
        let mut has = self.separation.code();
        if self.shading_normal.is_some() {
            has |= has::SHADING_NORMAL;
        }
        if !self.stands() {
            has |= has::DISPLACEMENT;
        }
        has.write(to)?;
        ARM.write(&self.arm, to)?;
        NORMAL.write(&self.normal, to)?;
        GAP.write(&self.gap, to)?;
        if !self.stands() {
            DISPLACEMENT.write(&self.obstacle_displacement, to)?;
        }
        if let Some(normal) = &self.shading_normal {
            NORMAL.write(normal, to)?;
        }
        self.separation.write(to)
    }

    fn read(from: &mut Reader<'_>) -> Result<ConstraintRow, DecodeError> {
        let obstacle = OBSTACLE.read(from)?;
        let kinds = u8::read(from)?;
        let on_body = RowFeature {
            kind: kinds & 0x0f,
            index: FEATURE.read(from)?,
        };
        let on_obstacle = RowFeature {
            kind: kinds >> 4,
            index: FEATURE.read(from)?,
        };
        let has = u8::read(from)?;
        if has & !has::KNOWN != 0 {
            return Err(DecodeError::UnknownTag {
                what: "row content",
                tag: has,
            });
        }
        let arm = ARM.read(from)?;
        let normal = NORMAL.read(from)?;
        let gap = GAP.read(from)?;
        let mut obstacle_displacement = [0.0; 3];
        if has & has::DISPLACEMENT != 0 {
            obstacle_displacement = DISPLACEMENT.read(from)?;
            // A zero is not sent: one value, one encoding.
            if obstacle_displacement == [0.0; 3] {
                return Err(DecodeError::Inconsistent {
                    what: "obstacle displacement",
                });
            }
        }
        let shading_normal = if has & has::SHADING_NORMAL != 0 {
            Some(NORMAL.read(from)?)
        } else {
            None
        };
        Ok(ConstraintRow {
            obstacle,
            on_body,
            on_obstacle,
            arm,
            normal,
            gap,
            obstacle_displacement,
            separation: RowSeparation::read(has & has::SEPARATION, from)?,
            shading_normal,
        })
    }
}

impl Wire for ConstraintPart {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        SEQUENCE.write(&self.head.sequence, to)?;
        MADE.write(&self.head.made_ns, to)?;
        DEVICE.write(&self.head.device_ns, to)?;
        self.head.pose.write(to)?;
        ROWS_IN_SET.write(&self.rows_in_set, to)?;
        PART.write(&self.part, to)?;
        PARTS.write(&self.parts, to)?;
        FIRST_ROW.write(&self.first_row, to)?;
        (self.rows.len() as u8).write(to)?; // MAX_PART_ROWS is far below 256
        self.head.flags.write(to)?;
        self.rows.iter().try_for_each(|row| row.write(to))
    }

    fn read(from: &mut Reader<'_>) -> Result<ConstraintPart, DecodeError> {
        let mut head = SetHead {
            sequence: SEQUENCE.read(from)?,
            made_ns: MADE.read(from)?,
            device_ns: DEVICE.read(from)?,
            pose: Wire::read(from)?,
            flags: 0,
        };
        let rows_in_set: u16 = ROWS_IN_SET.read(from)?;
        let part: u8 = PART.read(from)?;
        let parts: u8 = PARTS.read(from)?;
        let first_row: u16 = FIRST_ROW.read(from)?;
        let count = u8::read(from)?;
        head.flags = Wire::read(from)?;
        if head.flags & !KNOWN_SET_FLAGS != 0 {
            return Err(DecodeError::UnknownTag {
                what: "set flags",
                tag: head.flags,
            });
        }
        let last_row = usize::from(first_row) + usize::from(count);
        let in_place = part < parts && last_row <= usize::from(rows_in_set);
        if !in_place {
            return Err(DecodeError::Inconsistent {
                what: "place in the set",
            });
        }
        Ok(ConstraintPart {
            head,
            rows_in_set,
            part,
            parts,
            first_row,
            rows: read_elements(from, count)?,
        })
    }
}
