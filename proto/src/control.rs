//! Control messages, on QUIC streams.
//!
//! A message on a stream is framed as below. The frame, `Refused`, and the beginning of `Hello` (the range of versions) keep their layout in every
//! later version, so that programs of two versions agree on one, or can at least tell each other why they part. What a later version
//! adds to `Hello` stands behind the rest, and is not read by those who do not know it.
//!
//! | offset | field   | bytes | meaning                              |
//! |--------|---------|-------|--------------------------------------|
//! | 0      | length  | 4     | bytes after this field, ≥ 4          |
//! | 4      | magic   | 2     | [`MAGIC`]                            |
//! | 6      | version | 1     | of the session; of `Hello` and `Refused` the sender's newest |
//! | 7      | tag     | 1     | which message                        |
//! | 8      | body    |       | its fields                           |
//!
//! Join: the client opens the control stream and sends `Hello`; the server answers `Welcome` and `Scene`, to a device bridge also `Coupling`, or
//! `Refused`. There is no challenge:
//! both proofs are over the exporter of this very TLS connection, which is fresh, so an old or relayed proof does not verify.
//! After that the server sends `Group` on the control stream at join and whenever the membership changes, to all but devices, and `Events` at join and whenever there are some.
//! A mesh, or the panorama of the light, is asked for on a stream of its own: `MeshRequest`, then `MeshHeader` and the raw bytes of the blob.
//! Pictures of what a node shows are asked for by the server, on a stream of its own as well: see [`crate::picture`].

pub use crate::picture::{NoPicture, Offers, PictureHeader, PictureRequest};
pub use crate::role::Role;

use crate::{
    ClientStats, CouplingOffer, DecodeError, EncodeError, EventBatch, Group, MeshHash,
    PROTOCOL_VERSION, SceneDescription, Untrusted, VersionRange,
    codec::{self, MAX_VALUE_BYTES, Reader, Wire, Writer, wire_struct, wire_tag},
    proof::Grant,
    range::{MESH_BYTES, NAME, PORT, RATE, SESSION, SMALL, TIME, TIMEOUT},
    version::{FIRST_NEGOTIATED, MAGIC},
};

/// Bytes of a frame's `length` field.
pub const LENGTH_BYTES: usize = 4;
/// Bytes of magic, version and tag.
pub const PREFIX_BYTES: usize = 4;
/// Most bytes after a frame's `length` field.
pub const MAX_FRAME_BYTES: usize = MAX_VALUE_BYTES;
/// Most bytes of a node name.
pub const MAX_NODE_NAME_BYTES: usize = 64;

/// How states reach a client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transport {
    /// Sealed UDP: the fast way on a wired network.
    #[default]
    Udp,
    /// QUIC datagrams: one port, through firewalls and across sites.
    QuicDatagram,
}

/// Why a client was not let in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RefusalCode {
    /// The proof of the key does not verify.
    WrongKey,
    /// Another protocol version.
    WrongVersion,
    /// The node name is in use.
    NameTaken,
    /// There is a device bridge already.
    DeviceTaken,
    /// No room for another client.
    Full,
    /// The Hello makes no sense.
    BadHello,
    /// The server stops.
    Stopping,
    /// There is a head tracker already.
    TrackerTaken,
    /// The credential is revoked.
    Revoked,
    /// The role is not let in.
    RoleClosed,
    /// There is a force source already.
    ForceTaken,
}

wire_struct! {
    /// First message of a client.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct Hello {
        /// Versions that the client speaks: the highest that the server speaks, too, is used.
        pub versions: VersionRange,
        /// Name of the node, unique among the clients.
        pub node: Untrusted,
        /// What it is.
        pub role: Role,
        /// How it wants its states.
        pub transport: Transport,
        /// Most states per second that it wants; 0 for all.
        pub rate_hz: u32 => RATE,
        /// [`crate::proof::JoinSecret::client_proof`].
        pub proof: [u8; 32],
        /// By what right it joins: which secret the proof is of.
        pub grant: Grant,
        /// What else it does.
        pub offers: Offers,
    }
}

wire_struct! {
    /// The server lets the client in.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct Welcome {
        /// Version of this session: of the frame that this is in, and of all that follows.
        pub version: u8 => SMALL,
        /// [`crate::proof::JoinSecret::server_proof`].
        pub proof: [u8; 32],
        /// Session number: the client's `sender` in datagram headers.
        pub session: u16 => SESSION,
        /// Epoch in datagram headers.
        pub epoch: u32 => NAME,
        /// UDP port of the state plane, at the address that the client reached.
        pub udp_port: u16 => PORT,
        /// Session time when this was written, ns.
        pub session_time_ns: u64 => TIME,
        /// Silence on the hot plane after which either end gives the other up, ms.
        pub node_timeout_ms: u32 => TIMEOUT,
    }
}

wire_struct! {
    /// The server does not let the client in.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct Refusal {
        /// Why, for programs.
        pub code: RefusalCode,
        /// Newest protocol version of the server.
        pub version: u8 => SMALL,
        /// Why and what to do, for people: one sentence.
        pub text: Untrusted,
    }
}

wire_struct! {
    /// Asks for a mesh.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct MeshRequest {
        /// Which.
        pub hash: MeshHash,
    }
}

wire_struct! {
    /// Answers [`MeshRequest`]; the blob's bytes follow raw on the same stream.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct MeshHeader {
        /// Which.
        pub hash: MeshHash,
        /// Bytes that follow; 0 if the server has no such mesh.
        pub length: u32 => MESH_BYTES,
    }
}

/// Weight of a [`LogEvent`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Good to know.
    Info,
    /// Works, but not as it should.
    Warning,
    /// Does not work.
    Error,
}

wire_struct! {
    /// A line for the log of the whole workbench.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct LogEvent {
        /// Weight.
        pub level: LogLevel,
        /// One sentence.
        pub text: Untrusted,
    }
}

wire_struct! {
    /// An operator wants force at the device, or none.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct ArmRequest {
        /// Force, or none.
        pub arm: bool,
    }
}

wire_struct! {
    /// A client says how it takes its states from now on.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct StatesBy {
        /// From the group, or by unicast.
        pub multicast: bool,
        /// It leaves the group because a member sealed a state in the server's name.
        pub forged: bool,
    }
}

wire_struct! {
    /// Last words.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct Bye {
        /// Why, one sentence.
        pub reason: Untrusted,
    }
}

/// Declares all messages of a control stream, each with its tag.
macro_rules! control_messages {
    ($($variant:ident($body:ty) = $tag:literal),* $(,)?) => {
        /// Everything that is said on a control stream.
        #[derive(Clone, Debug, PartialEq)]
        #[allow(missing_docs, reason = "each variant is documented at its struct")]
        #[allow(clippy::large_enum_variant, reason = "the large one is the scene, made once per join")]
        pub enum ControlMessage { $( $variant($body), )* }

        impl ControlMessage {
            /// Name for error texts.
            pub fn name(&self) -> &'static str {
                match self { $( ControlMessage::$variant(_) => stringify!($variant), )* }
            }
        }

        impl Wire for ControlMessage {
            fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
                match self { $( ControlMessage::$variant(body) => { let tag: u8 = $tag; tag.write(to)?; body.write(to) } )* }
            }
            fn read(from: &mut Reader<'_>) -> Result<ControlMessage, DecodeError> {
                match u8::read(from)? {
                    $( $tag => Ok(ControlMessage::$variant(<$body>::read(from)?)), )*
                    tag => Err(DecodeError::UnknownTag { what: "message", tag }),
                }
            }
        }
    };
}
control_messages! {
    Refused(Refusal) = 0, Hello(Hello) = 1, Welcome(Welcome) = 2, Scene(SceneDescription) = 3, MeshRequest(MeshRequest) = 4,
    MeshHeader(MeshHeader) = 5, Stats(ClientStats) = 6, Log(LogEvent) = 7, Bye(Bye) = 8,
    Coupling(CouplingOffer) = 9, Arm(ArmRequest) = 10, Group(Group) = 14,
    Events(EventBatch) = 15, StatesBy(StatesBy) = 16,
    PictureRequest(PictureRequest) = 17, PictureHeader(PictureHeader) = 18, NoPicture(NoPicture) = 19,
}

const REFUSED_TAG: u8 = 0;
const HELLO_TAG: u8 = 1;

impl ControlMessage {
    /// The framed message, in the newest version.
    pub fn to_frame(&self) -> Result<Vec<u8>, EncodeError> {
        self.to_frame_of(PROTOCOL_VERSION)
    }

    /// The framed message of a session of this version.
    pub fn to_frame_of(&self, version: u8) -> Result<Vec<u8>, EncodeError> {
        let mut frame = vec![0; LENGTH_BYTES];
        codec::encode_onto(&MAGIC, &mut frame)?;
        frame.push(version);
        codec::encode_onto(self, &mut frame)?;
        let length = u32::try_from(frame.len() - LENGTH_BYTES)
            .ok()
            .filter(|length| *length as usize <= MAX_FRAME_BYTES)
            .ok_or(EncodeError::BufferFull)?;
        frame[..LENGTH_BYTES].copy_from_slice(&length.to_le_bytes());
        Ok(frame)
    }

    /// Length of what follows, from a frame's first four bytes; refused if no frame can have it.
    pub fn frame_length(bytes: [u8; LENGTH_BYTES], max: usize) -> Result<usize, DecodeError> {
        let len = u32::from_le_bytes(bytes) as usize;
        if len < PREFIX_BYTES {
            return Err(DecodeError::Truncated);
        }
        if len > max {
            return Err(DecodeError::TooLong {
                what: "message",
                len,
                max,
            });
        }
        Ok(len)
    }

    /// Reads a message from what follows a frame's `length` field, by an end that speaks what this build speaks.
    pub fn from_frame_body(bytes: &[u8]) -> Result<ControlMessage, DecodeError> {
        ControlMessage::from_frame_body_of(bytes, VersionRange::SUPPORTED)
    }

    /// The same by an end that speaks `ours`. A version that is not in it is an error, but `Refused` is always read, and `Hello` by the range
    /// that it states.
    pub fn from_frame_body_of(
        bytes: &[u8],
        ours: VersionRange,
    ) -> Result<ControlMessage, DecodeError> {
        let Some(([m0, m1, version], message)) = bytes.split_first_chunk::<3>() else {
            return Err(DecodeError::Truncated);
        };
        if u16::from_le_bytes([*m0, *m1]) != MAGIC {
            return Err(DecodeError::WrongMagic);
        }
        match message.split_first() {
            Some((&REFUSED_TAG, _)) => codec::decode(message),
            Some((&HELLO_TAG, hello)) if *version >= FIRST_NEGOTIATED => {
                // The range first: the rest may be of a version that is not known here.
                let (theirs, _) = codec::decode_front::<VersionRange>(hello)?;
                if ours.highest_common(theirs).is_none() {
                    return Err(DecodeError::WrongVersion { theirs, ours });
                }
                Ok(codec::decode_front(message)?.0)
            }
            _ if ours.contains(*version) => codec::decode(message),
            _ => Err(DecodeError::WrongVersion {
                theirs: VersionRange::only(*version),
                ours,
            }),
        }
    }
}

wire_tag!(Transport, "transport" { Udp = 0, QuicDatagram = 1 });
wire_tag!(RefusalCode, "refusal" { WrongKey = 0, WrongVersion = 1, NameTaken = 2, DeviceTaken = 3, Full = 4, BadHello = 5, Stopping = 6, TrackerTaken = 7, Revoked = 8, RoleClosed = 9, ForceTaken = 10 });
wire_tag!(LogLevel, "log level" { Info = 0, Warning = 1, Error = 2 });
