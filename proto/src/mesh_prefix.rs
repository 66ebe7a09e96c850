//! How the bytes of a [`MeshBlob`](crate::MeshBlob) begin: which parts it has, and how many vertices and triangles.

use crate::DecodeError;

const BLOB_MAGIC: [u8; 4] = *b"tmsh";
pub(crate) const PREFIX_BYTES: usize = 16;
pub(crate) const LAYOUT_F64: u8 = 1;
pub(crate) const LAYOUT_NORMALS: u8 = 2;
pub(crate) const LAYOUT_FINISH: u8 = 4;
pub(crate) const LAYOUT_LOOKS: u8 = 8;
pub(crate) const LAYOUT_TEXTURES: u8 = 16;

pub(crate) struct Prefix {
    pub(crate) layout: u8,
    pub(crate) vertices: u64,
    pub(crate) triangles: u64,
}

impl Prefix {
    pub(crate) fn has(&self, part: u8) -> bool {
        self.layout & part != 0
    }

    /// Bytes of the positions, triangles, normals and finish that follow, in this order.
    pub(crate) fn lengths(&self) -> [u64; 4] {
        let of = |part: u8, length: u64| if self.has(part) { length } else { 0 };
        [
            self.vertices * if self.has(LAYOUT_F64) { 24 } else { 12 },
            self.triangles * 12,
            of(LAYOUT_NORMALS, self.vertices * 12),
            of(LAYOUT_FINISH, 8),
        ]
    }

    /// Of a mesh that is not too long to travel: its counts are far below 2^32.
    pub(crate) fn to_bytes(&self) -> [u8; PREFIX_BYTES] {
        let mut bytes = [0; PREFIX_BYTES];
        bytes[..4].copy_from_slice(&BLOB_MAGIC);
        bytes[4] = self.layout;
        bytes[8..12].copy_from_slice(&(self.vertices as u32).to_le_bytes());
        bytes[12..].copy_from_slice(&(self.triangles as u32).to_le_bytes());
        bytes
    }

    /// Reads what [`Prefix::to_bytes`] made, and what follows it.
    pub(crate) fn read(bytes: &[u8]) -> Result<(Self, &[u8]), DecodeError> {
        let parts = bytes.split_at_checked(PREFIX_BYTES);
        let parts = parts.map(|(prefix, body)| (prefix.as_chunks::<4>().0, body));
        let Some((&[magic, [layout, reserved @ ..], vertices, triangles], body)) = parts else {
            return Err(DecodeError::Truncated);
        };
        if magic != BLOB_MAGIC {
            return Err(DecodeError::WrongMagic);
        }
        let known = LAYOUT_F64 | LAYOUT_NORMALS | LAYOUT_FINISH | LAYOUT_LOOKS | LAYOUT_TEXTURES;
        let has = |part: u8| layout & part != 0;
        let unknown = layout & !known != 0 || has(LAYOUT_TEXTURES) && !has(LAYOUT_LOOKS);
        if unknown || reserved != [0; 3] {
            return Err(DecodeError::UnknownTag {
                what: "mesh layout",
                tag: layout,
            });
        }
        let prefix = Self {
            layout,
            vertices: u32::from_le_bytes(vertices).into(),
            triangles: u32::from_le_bytes(triangles).into(),
        };
        Ok((prefix, body))
    }
}
