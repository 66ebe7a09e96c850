//! HOT payload: the whole state of the workbench at one tick of the haptics loop. Fixed capacity, no allocation.
//!
//! | block   | bytes   | count |
//! |---------|---------|-------|
//! | frame   | 28      | 1     |
//! | head    | 40      | 1     |
//! | tool    | 112     | ≤ 2   |
//! | body    | 32      | ≤ 12  |
//! | contact | 28      | ≤ 8   |
//! | event   | 12      | ≤ 8   |
//!
//! Fullest datagram: 24 + 28 + 40 + 224 + 384 + 224 + 96 + 16 = 1036 bytes. Numbers are plain f32 except the contact normal
//! (octahedral, 2 × i16, error below 1e-4 rad): nothing to tune, and a millimetre scene keeps nanometres.

use crate::{
    DecodeError, EncodeError, PoseF32,
    codec::{Reader, Wire, Writer, codes, encode_into, read_elements, wire_struct},
    header::MAX_PAYLOAD_BYTES,
    octahedral::{normal_from_octahedral, octahedral_from_normal},
    range::{
        AGE_US, BITS, COUNT, COUNT_32, FORCE, LENGTH, NAME, Number, PUPILS, TIME, VELOCITY, WRAPS,
    },
};
use arrayvec::ArrayVec;

/// Most tools (god-object and device pairs) in one state.
pub const MAX_TOOLS: usize = 2;
/// Most moving bodies in one state.
pub const MAX_BODIES: usize = 12;
/// Most contacts in one state: for pictures; the force uses all of them in the server.
pub const MAX_CONTACTS: usize = 8;
/// Most events repeated in one state.
pub const MAX_EVENTS: usize = 8;

/// State of the workbench, published as one tuple so that all screens of a frame draw the same numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HotState {
    /// When the device was sampled: session time, ns.
    pub sample_time_ns: u64,
    /// Tick of the haptics loop; strictly increasing.
    pub tick: u64,
    /// Revision of the scene description that the body numbers refer to.
    pub scene_revision: u32,
    /// Whether forces are given.
    pub run: RunState,
    /// Age of the constraint set that the force was computed from, µs.
    pub constraint_age_us: u32,
    /// The viewer.
    pub head: HeadState,
    /// God-objects with their devices; the first is the scene's god-object.
    pub tools: ArrayVec<ToolState, MAX_TOOLS>,
    /// Bodies that moved; one not named here stands where the scene description put it.
    pub bodies: ArrayVec<BodyState, MAX_BODIES>,
    /// Contacts, strongest first.
    pub contacts: ArrayVec<ContactState, MAX_CONTACTS>,
    /// The latest events, repeated for a moment; see [`crate::events`] for how none is lost.
    pub events: ArrayVec<EventRecord, MAX_EVENTS>,
}

/// Whether the workbench gives forces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RunState {
    /// No device yet.
    #[default]
    Waiting,
    /// Loops run, forces are given.
    Running,
    /// Forces are held at zero on request.
    Paused,
    /// The device or a loop failed; forces are zero.
    Fault,
}

wire_struct! {
    /// The viewer's head.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub struct HeadState {
        /// Head in the workbench frame: between the eyes, x to the right ear, y up, −z ahead.
        pub pose: PoseF32,
        /// How much older than `sample_time_ns` the pose is, µs.
        pub age_us: i32 => AGE_US,
        /// Distance between the pupils, m.
        pub eye_separation: f32 => PUPILS,
        /// Bit 0: tracked (otherwise the workbench file's default viewer).
        pub flags: u32 => BITS,
    }
}

wire_struct! {
    /// One god-object and the device that pulls it.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub struct ToolState {
        /// God-object, in the scene frame: what is drawn.
        pub god_object: PoseF32,
        /// Device as used by the loops, in the scene frame: the ghost.
        pub device: PoseF32,
        /// Velocity of the god-object at the reference point, m/s, scene axes.
        pub linear_velocity: [f32; 3] => VELOCITY,
        /// Angular velocity of the god-object, rad/s, scene axes.
        pub angular_velocity: [f32; 3] => VELOCITY,
        /// Force on the user's hand, N, scene axes.
        pub force: [f32; 3] => FORCE,
        /// Torque on the user's hand at the reference point, N m, scene axes.
        pub torque: [f32; 3] => FORCE,
        /// Device buttons, bit 0 the first.
        pub buttons: u16 => BITS,
        /// Bit 0: the force was limited. Bit 1: the device is silent.
        pub flags: u16 => BITS,
        /// Number of the tool, from 0.
        pub id: u32 => NAME,
    }
}

wire_struct! {
    /// A body that moved.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct BodyState {
        /// Index into the scene description's obstacles.
        pub id: u16 => NAME,
        /// Reserved, 0.
        pub flags: u16 => BITS,
        /// Body in the scene frame.
        pub pose: PoseF32,
    }
}

/// One contact of the god-object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactState {
    /// Tool number, obstacle index.
    pub pair: [u16; 2],
    /// Point on the obstacle, m, scene frame.
    pub point: [f32; 3],
    /// Unit normal, obstacle towards god-object, scene axes. Rounded on the wire.
    pub normal: [f32; 3],
    /// Normal force, N; 0 when the constraint is inactive.
    pub force: f32,
    /// Gap, m.
    pub gap: f32,
}

wire_struct! {
    /// One discrete event.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct EventRecord {
        /// Number of the event, strictly increasing: a client takes each once.
        pub id: u32 => WRAPS,
        /// Low half of the tick at which it happened.
        pub tick: u32 => WRAPS,
        /// What happened: see [`event_code`].
        pub code: u32 => NAME,
    }
}

/// Values of [`EventRecord::code`].
pub mod event_code {
    /// First contact after free motion.
    pub const CONTACT_ON: u32 = 1;
    /// Free motion after contact.
    pub const CONTACT_OFF: u32 = 2;
    /// A button went down; the number of the button is in the upper 16 bits.
    pub const BUTTON_DOWN: u32 = 3;
    /// A button went up; the number of the button is in the upper 16 bits.
    pub const BUTTON_UP: u32 = 4;
    /// The device or a loop failed.
    pub const FAULT: u32 = 5;
    /// Forces are given again.
    pub const RESUMED: u32 = 6;
    /// Events of the device port: this plus their number (`taut_bridge::EventKind`), below [`SAFETY_END`]; the upper 16 bits hold how
    /// much, in thousandths of the kind's unit, at most 65535 of them.
    pub const SAFETY: u32 = 0x100;
    /// One above the codes of the device port.
    pub const SAFETY_END: u32 = 0x200;
    /// Where the amount of a device port's event begins, as the number of a button does.
    pub const VALUE_SHIFT: u32 = 16;

    /// The code of an event of the device port.
    pub fn safety(kind: u8, value: f64) -> u32 {
        // `as` saturates, and takes NaN for zero.
        let thousandths = (value.abs() * 1e3).round() as u16;
        (SAFETY + u32::from(kind)) | u32::from(thousandths) << VALUE_SHIFT
    }

    /// Kind and amount of an event of the device port, if the code is that of one.
    pub fn safety_of(code: u32) -> Option<(u8, f64)> {
        let low = code & 0xffff;
        let kind = (SAFETY..SAFETY_END).contains(&low).then(|| low - SAFETY)?;
        let value = f64::from(code >> VALUE_SHIFT) * 1e-3;
        u8::try_from(kind).ok().map(|kind| (kind, value))
    }
}

/// [`HeadState::flags`]: the head is tracked.
pub const HEAD_TRACKED: u32 = 1;
/// [`ToolState::flags`]: the force was limited.
pub const TOOL_FORCE_LIMITED: u16 = 1;
/// [`ToolState::flags`]: the device is silent.
pub const TOOL_DEVICE_SILENT: u16 = 2;

impl HotState {
    /// A state with nothing in it.
    pub fn empty() -> HotState {
        HotState::default()
    }

    /// Fingerprint of the state as sent: equal on all clients that draw the same state.
    ///
    /// Fails only where sending would fail too.
    pub fn hash(&self) -> Result<u64, EncodeError> {
        let mut buffer = [0; MAX_PAYLOAD_BYTES];
        let used = encode_into(self, &mut buffer)?;
        Ok(payload_hash(&buffer[..used]))
    }
}

/// Fingerprint of an encoded state: the first 8 bytes of its BLAKE3 hash.
pub fn payload_hash(payload: &[u8]) -> u64 {
    let hash = blake3::hash(payload);
    let mut first = [0; 8];
    first.copy_from_slice(&hash.as_bytes()[..8]);
    u64::from_le_bytes(first)
}

codes!(RunState, "run state" { Waiting = 0, Running = 1, Paused = 2, Fault = 3 });

const SAMPLE_TIME: Number = Number::new("HotState.sample_time_ns", TIME);
const TICK: Number = Number::new("HotState.tick", COUNT);
const REVISION: Number = Number::new("HotState.scene_revision", NAME);
const CONSTRAINT_AGE: Number = Number::new("HotState.constraint_age_us", COUNT_32);
const PAIR: Number = Number::new("ContactState.pair", NAME);
const POINT: Number = Number::new("ContactState.point", LENGTH);
const CONTACT_FORCE: Number = Number::new("ContactState.force", FORCE);
const GAP: Number = Number::new("ContactState.gap", LENGTH);

impl HotState {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[SAMPLE_TIME, TICK, REVISION, CONSTRAINT_AGE];
}

impl ContactState {
    /// Its numbers and what each may be; any normal on the wire is one.
    pub const NUMBERS: &'static [Number] = &[PAIR, POINT, CONTACT_FORCE, GAP];
}

impl Wire for HotState {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        SAMPLE_TIME.write(&self.sample_time_ns, to)?;
        TICK.write(&self.tick, to)?;
        REVISION.write(&self.scene_revision, to)?;
        for len in [self.tools.len(), self.bodies.len(), self.contacts.len()] {
            (len as u8).write(to)?; // capacities are far below 256
        }
        // Four bits each: one byte for the run state and the number of events.
        (self.run.code() | (self.events.len() as u8) << 4).write(to)?;
        CONSTRAINT_AGE.write(&self.constraint_age_us, to)?;
        self.head.write(to)?;
        self.tools.iter().try_for_each(|tool| tool.write(to))?;
        self.bodies.iter().try_for_each(|body| body.write(to))?;
        self.contacts
            .iter()
            .try_for_each(|contact| contact.write(to))?;
        self.events.iter().try_for_each(|event| event.write(to))
    }

    fn read(from: &mut Reader<'_>) -> Result<HotState, DecodeError> {
        let sample_time_ns = SAMPLE_TIME.read(from)?;
        let tick = TICK.read(from)?;
        let scene_revision = REVISION.read(from)?;
        let [tools, bodies, contacts, packed] = <[u8; 4]>::read(from)?;
        let run = RunState::from_code(packed & 0x0f)?;
        Ok(HotState {
            sample_time_ns,
            tick,
            scene_revision,
            run,
            constraint_age_us: CONSTRAINT_AGE.read(from)?,
            head: Wire::read(from)?,
            tools: read_elements(from, tools)?,
            bodies: read_elements(from, bodies)?,
            contacts: read_elements(from, contacts)?,
            events: read_elements(from, packed >> 4)?,
        })
    }
}

impl Wire for ContactState {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        PAIR.write(&self.pair, to)?;
        POINT.write(&self.point, to)?;
        let [u, v] = octahedral_from_normal(self.normal).ok_or(EncodeError::NotFinite)?;
        u.write(to)?;
        v.write(to)?;
        CONTACT_FORCE.write(&self.force, to)?;
        GAP.write(&self.gap, to)
    }

    fn read(from: &mut Reader<'_>) -> Result<ContactState, DecodeError> {
        Ok(ContactState {
            pair: PAIR.read(from)?,
            point: POINT.read(from)?,
            normal: normal_from_octahedral([Wire::read(from)?, Wire::read(from)?]),
            force: CONTACT_FORCE.read(from)?,
            gap: GAP.read(from)?,
        })
    }
}
