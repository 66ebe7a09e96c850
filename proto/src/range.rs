//! What each number from outside may be: the only list, read where numbers are decoded.
//!
//! A message with a number out of its range is refused by name, in both directions: nobody sends what nobody takes. A field of a message that is a
//! number and has no range does not compile ([`wire_struct`](crate::codec)). What depends on what the receiver knows (a term near the known
//! one, an acknowledged event that was told) is checked by the state machine that knows it; `docs/numbers.md` lists both.

use crate::{
    DecodeError, EncodeError,
    codec::{Reader, Wire, Writer},
    picture::{MAX_PICTURE_BYTES, MAX_PICTURE_EDGE},
};
use arrayvec::ArrayVec;

/// Least and most of a number, with its unit and its sense.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    least: f64,
    most: f64,
    /// For people.
    pub text: &'static str,
}

impl Bounds {
    /// The smallest that a message may say.
    #[must_use]
    pub const fn least(&self) -> f64 {
        self.least
    }

    /// The largest.
    #[must_use]
    pub const fn most(&self) -> f64 {
        self.most
    }
}

/// A number of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// Message and field.
    pub name: &'static str,
    /// What it may be.
    pub bounds: Bounds,
}

const fn bounds(least: f64, most: f64, text: &'static str) -> Bounds {
    Bounds { least, most, text }
}

/// 2⁶¹: sums and differences of a few of these do not wrap, in 64 bits with a sign or without.
const FAR: f64 = (1_u64 << 61) as f64;
/// Longest period that a node may say it is made for, µs: a frame in a hundred seconds.
pub const MAX_NODE_PERIOD_US: u32 = 100_000_000;
/// Longest period of frames, µs.
pub const MAX_PERIOD_US: u32 = 1_000_000;
/// Longest silence after which a node is given up, ms.
pub const MAX_TIMEOUT_MS: u32 = 60_000;

/// Time of the session, or of a client's clock.
pub const TIME: Bounds = bounds(0.0, FAR, "0 to 2^61 ns, 73 years; 0 is unknown");
/// Something counted from the start.
pub const COUNT: Bounds = bounds(0.0, FAR, "0 to 2^61");
/// A saturating count or time in 32 bits.
pub const COUNT_32: Bounds = bounds(0.0, u32::MAX as f64, "any: saturates at 2^32 - 1");
/// A number that wraps: only its distance from a known one counts, and that is checked there.
pub const WRAPS: Bounds = bounds(0.0, u32::MAX as f64, "any: counts and wraps");
/// Bits, each with a sense or ignored.
pub const BITS: Bounds = bounds(0.0, u32::MAX as f64, "any: bits");
/// A name in digits: compared, never computed with.
pub const NAME: Bounds = bounds(0.0, u64::MAX as f64, "any: a name, compared and looked up");
/// Number of a session; 0 is the server.
pub const SENDER: Bounds = bounds(0.0, u16::MAX as f64, "any: 0 is the server");
/// Number of a client's session.
pub const SESSION: Bounds = bounds(1.0, u16::MAX as f64, "1 to 65535");
/// A UDP port.
pub const PORT: Bounds = bounds(1.0, u16::MAX as f64, "1 to 65535");
/// Age of a head, either way.
pub const AGE_US: Bounds = bounds(
    i32::MIN as f64,
    i32::MAX as f64,
    "any: 36 minutes either way",
);
/// Period that a node is made for.
pub const NODE_PERIOD: Bounds = bounds(
    0.0,
    MAX_NODE_PERIOD_US as f64,
    "0 to 100 s, in µs; 0 is no limit",
);
/// Period of frames.
pub const PERIOD: Bounds = bounds(0.0, MAX_PERIOD_US as f64, "0 to 1 s, in µs");
/// Silence after which a node is given up.
pub const TIMEOUT: Bounds = bounds(1.0, MAX_TIMEOUT_MS as f64, "1 ms to 60 s, in ms");
/// States per second.
pub const RATE: Bounds = bounds(0.0, 1e6, "0 to 10^6 per second; 0 is all");
/// A length or place: no scene is larger, and the square of it is far from the end of f32.
pub const LENGTH: Bounds = bounds(-1e6, 1e6, "-1000 km to 1000 km, in m");
/// A length that has a sense above zero.
pub const SIZE: Bounds = bounds(0.0, 1e6, "0 to 1000 km, in m");
/// Component of a unit vector or quaternion; its norm is checked where it becomes a pose or a normal.
pub const UNIT: Bounds = bounds(-1.001, 1.001, "-1 to 1, and a thousandth for rounding");
/// Velocity, linear or angular.
pub const VELOCITY: Bounds = bounds(-1e6, 1e6, "-10^6 to 10^6 m/s or rad/s");
/// Force or torque: the device port limits it to what the device may give.
pub const FORCE: Bounds = bounds(
    -1e6,
    1e6,
    "-10^6 to 10^6 N or N m; the device port limits it",
);
/// Work on the hand: the device port keeps account of no more than it may owe.
pub const ENERGY: Bounds = bounds(-1e9, 1e9, "-10^9 to 10^9 J");
/// Pixels of a picture of a screen, across or down.
pub const PICTURE_EDGE: Bounds = bounds(1.0, MAX_PICTURE_EDGE as f64, "1 to 1280");
/// Bytes of one.
pub const PICTURE_BYTES: Bounds = bounds(1.0, MAX_PICTURE_BYTES as f64, "1 to 5 MiB");
/// Between the pupils.
pub const PUPILS: Bounds = bounds(0.0, 1.0, "0 to 1 m");
/// A share.
pub const SHARE: Bounds = bounds(0.0, 1.0, "0 to 1");
/// Part of a colour.
pub const COLOUR: Bounds = bounds(0.0, 1.0, "0 to 1");
/// Part of a matrix that mixes colours.
pub const COLOUR_MIX: Bounds = bounds(-16.0, 16.0, "-16 to 16");
/// Exponent of a display's response.
pub const RESPONSE: Bounds = bounds(0.0, 8.0, "0 to 8; 0 is that of sRGB");
/// Exponent of a mask's values.
pub const EXPONENT: Bounds = bounds(0.1, 8.0, "0.1 to 8");
/// Pixels drawn for a pixel shown, each way.
pub const SAMPLING: Bounds = bounds(0.25, 4.0, "0.25 to 4");
/// Half a turn.
pub const ANGLE: Bounds = bounds(0.0, std::f64::consts::PI, "0 to pi rad");
/// Size on the workbench over size in the simulation.
pub const SCALE: Bounds = bounds(1e-9, 1e9, "10^-9 to 10^9");
/// Pixels of a window.
pub const PIXELS: Bounds = bounds(0.0, 65_536.0, "0 to 65536");
/// What a client measured of itself, ms: told, never computed with.
pub const MEASURED: Bounds = bounds(
    -1e12,
    1e12,
    "-10^12 to 10^12; reported, nothing depends on it",
);
/// Bytes of a mesh.
pub const MESH_BYTES: Bounds = bounds(0.0, crate::mesh_blob::MAX_MESH_BYTES as f64, "0 to 128 MiB");
/// Rows of a constraint set, and places among them.
pub const SET_ROWS: Bounds = bounds(
    0.0,
    crate::constraints::MAX_SET_ROWS as f64,
    "0 to 1024; within the set",
);
/// Parts of a constraint set.
pub const SET_PARTS: Bounds = bounds(1.0, crate::constraints::MAX_PARTS as f64, "1 to 128");
/// Place among the parts of a constraint set.
pub const SET_PART: Bounds = bounds(
    0.0,
    crate::constraints::MAX_PARTS as f64 - 1.0,
    "0 to 127; below the number of parts",
);
/// Place in a small enumeration.
pub const SMALL: Bounds = bounds(0.0, u8::MAX as f64, "any");

/// Mass of a body.
pub const MASS: Bounds = bounds(1e-12, 1e12, "10^-12 to 10^12 kg");
/// Component of an inertia tensor; that it is one is checked where it becomes a body's.
pub const INERTIA: Bounds = bounds(-1e24, 1e24, "-10^24 to 10^24 kg m²");
/// A length that cannot be zero.
pub const EXTENT: Bounds = bounds(1e-12, 1e6, "10^-12 m to 1000 km");
/// Depth as a negative gap.
pub const DEPTH: Bounds = bounds(-1e6, 0.0, "-1000 km to 0, in m");
/// Share of a way that is gone in a step.
pub const GAIN: Bounds = bounds(1e-6, 1.0, "10^-6 to 1");
/// Stiffness over mass.
pub const STIFFNESS: Bounds = bounds(1e-6, 1e12, "10^-6 to 10^12 per s²");
/// A time constant or a ramp.
pub const LASTS: Bounds = bounds(0.0, 3600.0, "0 to an hour, in s");
/// Largest force or torque.
pub const STRENGTH: Bounds = bounds(
    1e-9,
    1e6,
    "10^-9 to 10^6 N or N m; the device port limits it",
);
/// Constraint sets per second.
pub const SET_RATE: Bounds = bounds(1.0, 1e5, "1 to 10^5 per second");
/// Most rows of a set.
pub const CAPACITY: Bounds = bounds(1.0, crate::constraints::MAX_SET_ROWS as f64, "1 to 1024");
/// Most steps of an iteration.
pub const STEPS: Bounds = bounds(1.0, 1e6, "1 to 10^6");
/// Most linearisations of the rows for one force.
pub const ROUNDS: Bounds = bounds(0.0, 3.0, "0 to 3");
/// Coefficient of friction.
pub const FRICTION: Bounds = bounds(0.0, 1e6, "0 to 10^6");
/// Tangent of an angle.
pub const SLOPE: Bounds = bounds(-1e6, 1e6, "-10^6 to 10^6");

/// A number, or some of them, that can be compared with bounds.
pub trait InBounds {
    /// Whether all are within; false for NaN.
    fn are_within(&self, bounds: &Bounds) -> bool;
}

macro_rules! in_bounds {
    ($($kind:ty),*) => { $(
        impl InBounds for $kind {
            fn are_within(&self, bounds: &Bounds) -> bool {
                let value = *self as f64; // near 2⁶¹ it is rounded, which changes nothing
                value >= bounds.least && value <= bounds.most
            }
        }
    )* };
}
in_bounds!(u8, u16, u32, u64, i32, f32, f64);

impl<T: InBounds, const N: usize> InBounds for [T; N] {
    fn are_within(&self, bounds: &Bounds) -> bool {
        self.iter().all(|value| value.are_within(bounds))
    }
}

impl<T: InBounds, const N: usize> InBounds for ArrayVec<T, N> {
    fn are_within(&self, bounds: &Bounds) -> bool {
        self.iter().all(|value| value.are_within(bounds))
    }
}

impl<T: InBounds> InBounds for Option<T> {
    fn are_within(&self, bounds: &Bounds) -> bool {
        self.iter().all(|value| value.are_within(bounds))
    }
}

impl Number {
    /// The number `name` with these bounds.
    pub const fn new(name: &'static str, bounds: Bounds) -> Number {
        Number { name, bounds }
    }

    /// Writes it, if it is in its range.
    pub(crate) fn write(
        &self,
        value: &(impl Wire + InBounds),
        to: &mut Writer<'_>,
    ) -> Result<(), EncodeError> {
        // What is not finite says so, below.
        value.write(to)?;
        match value.are_within(&self.bounds) {
            true => Ok(()),
            false => Err(EncodeError::OutOfRange { number: self.name }),
        }
    }

    /// Reads it, if it is in its range.
    pub(crate) fn read<T: Wire + InBounds>(&self, from: &mut Reader<'_>) -> Result<T, DecodeError> {
        let value = T::read(from)?;
        match value.are_within(&self.bounds) {
            true => Ok(value),
            false => Err(DecodeError::OutOfRange {
                number: self.name,
                range: self.bounds.text,
            }),
        }
    }
}

/// Every number of every message, message by message.
pub fn numbers() -> impl Iterator<Item = &'static Number> {
    use crate::{
        barrier, constraints, control, coupling, events, force, group, head, input, path, picture,
        pose, scene, state,
    };
    use crate::{confirmation, stats, time, wrench};
    [
        barrier::Arrive::NUMBERS,
        barrier::ReleaseHead::NUMBERS,
        state::HotState::NUMBERS,
        state::HeadState::NUMBERS,
        state::ToolState::NUMBERS,
        state::BodyState::NUMBERS,
        state::ContactState::NUMBERS,
        state::EventRecord::NUMBERS,
        confirmation::Confirmation::NUMBERS,
        confirmation::SentState::NUMBERS,
        events::EventBatch::NUMBERS,
        events::EventAck::NUMBERS,
        time::TimeRequest::NUMBERS,
        time::TimeResponse::NUMBERS,
        input::InputSample::NUMBERS,
        head::HeadSample::NUMBERS,
        force::ForceSample::NUMBERS,
        force::PassedForce::NUMBERS,
        wrench::WrenchCommand::NUMBERS,
        constraints::SetHead::NUMBERS,
        constraints::ConstraintPart::NUMBERS,
        constraints::ConstraintRow::NUMBERS,
        path::PathToken::NUMBERS,
        pose::PoseF32::NUMBERS,
        pose::PoseF64::NUMBERS,
        control::Hello::NUMBERS,
        control::Welcome::NUMBERS,
        control::Refusal::NUMBERS,
        control::MeshHeader::NUMBERS,
        picture::PictureRequest::NUMBERS,
        picture::PictureHeader::NUMBERS,
        coupling::EdgeCoupling::NUMBERS,
        coupling::EdgeSettings::NUMBERS,
        coupling::EdgeAdaptation::NUMBERS,
        coupling::EdgeSurface::NUMBERS,
        coupling::EdgeSine::NUMBERS,
        group::Group::NUMBERS,
        group::GroupMember::NUMBERS,
        stats::ClientStats::NUMBERS,
        stats::DrawnState::NUMBERS,
        scene::SceneDescription::NUMBERS,
        scene::BodyDescription::NUMBERS,
        scene::ScreenDescription::NUMBERS,
        scene::OutputDescription::NUMBERS,
        scene::WindowDescription::NUMBERS,
    ]
    .into_iter()
    .flatten()
}
