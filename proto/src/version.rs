//! The version of the protocol: one number for datagrams and control messages alike.

/// Version that this build speaks. Peers of any other version are refused; there is no negotiation.
pub const PROTOCOL_VERSION: u8 = 3;

/// First two bytes of every datagram and control message, little-endian on the wire.
pub const MAGIC: u16 = 0x4857;
