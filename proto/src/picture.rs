//! Pictures of what a render node shows, for whoever operates the workbench.
//!
//! The server opens a stream to a node that offers them, and asks: `PictureRequest`. The node answers on it: `PictureHeader` and the raw bytes of a PNG,
//! once for each picture, of which the last says so; or `NoPicture`. Nobody else is asked, and nothing of it travels unasked.

use crate::{
    DecodeError, EncodeError, Untrusted,
    codec::{Reader, Wire, Writer, wire_struct},
    range::{PICTURE_BYTES, PICTURE_EDGE, TIME},
};

/// Most pixels of a picture's longer edge: a screen can be judged by it, and its PNG is about a megabyte.
pub const MAX_PICTURE_EDGE: u16 = 1280;
/// Most bytes of a PNG: those of the largest picture, three a pixel and not compressed at all, are 4 916 480.
pub const MAX_PICTURE_BYTES: u32 = 5 << 20;
/// Most pictures of one node: eight screens with two windows each.
pub const MAX_NODE_PICTURES: usize = 16;

wire_struct! {
    /// The server asks a node for pictures of all that it shows.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct PictureRequest {
        /// Most pixels of the longer edge; larger ones are scaled down.
        pub longest_edge: u16 => PICTURE_EDGE,
    }
}

wire_struct! {
    /// Answers [`PictureRequest`]; the bytes of a PNG follow raw on the same stream.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct PictureHeader {
        /// Name of the screen, and of the eye where it has a picture of its own.
        pub screen: Untrusted,
        /// Session time when it was shown, ns.
        pub shown_ns: u64 => TIME,
        /// Pixels across.
        pub width: u16 => PICTURE_EDGE,
        /// Pixels down.
        pub height: u16 => PICTURE_EDGE,
        /// Bytes that follow.
        pub length: u32 => PICTURE_BYTES,
        /// Another picture follows these.
        pub more: bool,
    }
}

wire_struct! {
    /// Answers [`PictureRequest`] where there is none.
    #[derive(Clone, Debug, PartialEq, Eq)]
    pub struct NoPicture {
        /// Why, one sentence.
        pub reason: Untrusted,
    }
}

/// What a client does beside what every client of its role does. It stands at the end of its Hello, and only where there is something: who knows nothing
/// of it does not read that far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Offers(u8);

impl Offers {
    /// Nothing.
    pub const NONE: Offers = Offers(0);
    /// Answers [`PictureRequest`].
    pub const PICTURES: Offers = Offers(1);

    /// Whether it offers all of `others`.
    #[must_use]
    pub const fn has(self, others: Offers) -> bool {
        self.0 & others.0 == others.0
    }
}

impl Wire for Offers {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        match self.0 {
            0 => Ok(()),
            bits => bits.write(to),
        }
    }

    fn read(from: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match from.is_at_end() {
            true => Ok(Self::NONE),
            false => Ok(Self(u8::read(from)?)), // bits that nobody knows mean nothing here
        }
    }
}
