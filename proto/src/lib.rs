//! Wire types of taut: what the haptic PC, the render nodes, the device bridge and the observers say to each other.
//!
//! No sockets, no clocks, no async: bytes and times are arguments. Two kinds of bytes exist.
//!
//! * **Datagrams** (hot plane, lossy, newest wins): [`header`] + payload + tag, sealed by [`seal`].
//!   Payloads: [`state::HotState`], [`input::InputSample`], [`head::HeadSample`], [`force::ForceSample`], [`force::PassedForce`],
//!   [`wrench::WrenchCommand`], [`constraints::ConstraintPart`], [`barrier`], [`time`].
//! * **Control messages** (QUIC streams, reliable): [`control::ControlMessage`]; meshes travel as [`mesh_blob::MeshBlob`], the pictures on them as
//!   [`texture::Texture`], the light around them as [`panorama::Panorama`].
//!
//! A datagram that is sealed opens once, and only with its bytes unchanged:
//!
//! ```
//! use taut_proto::header::MAX_DATAGRAM_BYTES;
//! use taut_proto::seal::{KEY_MATERIAL_BYTES, OpenError, Opener, Sealer};
//! use taut_proto::{ForceSample, Payload};
//!
//! let (material, epoch, sender) = ([7; KEY_MATERIAL_BYTES], 1, 3); // a session agrees on them over QUIC
//! let payload = Payload::Force(ForceSample {
//!     sample_time_ns: 1_000_000,
//!     clock_uncertainty_ns: 20_000,
//!     index: 1,
//!     wrench: [0.0, 0.0, 2.0, 0.0, 0.0, 0.0],
//! });
//! let mut buffer = [0; MAX_DATAGRAM_BYTES];
//! let sealer = Sealer::new(&material, epoch, sender);
//! let datagram = sealer.seal(&payload, &mut buffer).unwrap().to_vec();
//!
//! let mut opener = Opener::new(&material, epoch, sender);
//! let mut changed = datagram.clone();
//! changed[20] ^= 1;
//! assert!(opener.open(&changed).is_err());
//! assert_eq!(opener.open(&datagram).unwrap().payload, payload);
//! assert!(matches!(opener.open(&datagram), Err(OpenError::Replayed)));
//! ```
//!
//! Who may join is proven by [`proof`] with a secret from [`key`] or [`credential`]; what he may do then is in [`role`].
//!
//! Every byte goes through [`codec`]: little-endian, fixed size integers, explicit limits, no number that is not finite.
//! Poses are of a body's own frame; forces and torques are at the reference point, world axes; SI units.
#![forbid(unsafe_code)]

pub mod barrier;
pub mod clock;
pub mod codec;
pub mod confirmation;
pub mod constraint_parts;
pub mod constraints;
pub mod control;
pub mod coupling;
pub mod credential;
pub mod datagram;
mod derive;
pub mod events;
pub mod force;
pub mod group;
pub mod head;
pub mod header;
pub mod input;
pub mod key;
pub mod limits;
pub mod membership;
pub mod mesh_blob;
mod mesh_looks;
mod mesh_prefix;
pub mod mesh_textures;
pub mod multicast;
mod octahedral;
pub mod pace;
pub mod panorama;
pub mod path;
pub mod picture;
pub mod pin;
pub mod pose;
pub mod proof;
pub mod range;
pub mod replay;
pub mod revocation;
pub mod role;
pub mod scene;
pub mod seal;
pub mod state;
pub mod stats;
pub mod text;
pub mod texture;
pub mod time;
pub mod version;
pub mod waiting;
pub mod web;
pub mod wrench;

pub use arrayvec::ArrayVec;
pub use clock::{ClockFilter, SessionTime};
pub use codec::{DecodeError, EncodeError};
pub use confirmation::Confirmation;
pub use constraint_parts::{Assembler, Division, PartTaken};
pub use constraints::{ConstraintPart, ConstraintSet};
pub use control::{ControlMessage, Refusal, Transport};
pub use coupling::{CouplingOffer, EdgeCoupling};
pub use credential::{Credential, Holder, JoinKey};
pub use datagram::Payload;
pub use events::{EventBatch, EventInbox, EventOutbox};
pub use force::{ForceSample, PassedForce};
pub use group::{Group, GroupMember, GroupOpener, GroupSealer};
pub use head::HeadSample;
pub use header::{Header, Kind};
pub use input::InputSample;
pub use key::ClusterKey;
pub use mesh_blob::{Finish, Look, Looks, MeshBlob, MeshHash};
pub use mesh_textures::{TextureUse, Textures, Wrap};
pub use panorama::Panorama;
pub use pin::ServerPin;
pub use pose::{PoseF32, PoseF64};
pub use revocation::{JoinPolicy, Revoked};
pub use role::{Act, Role};
pub use scene::SceneDescription;
pub use state::HotState;
pub use stats::ClientStats;
pub use text::{Printable, Untrusted};
pub use texture::Texture;
pub use version::{PROTOCOL_VERSION, VersionRange};
pub use wrench::WrenchCommand;
