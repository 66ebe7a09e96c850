//! A mesh as it travels: bytes named by their BLAKE3 hash.
//!
//! | offset | field     | bytes              | meaning                                      |
//! |--------|-----------|--------------------|----------------------------------------------|
//! | 0      | magic     | 4                  | "tmsh"                                       |
//! | 4      | layout    | 1                  | bit 0: f64 vertices, bit 1: normals, bit 2: finish, bit 3: looks, bit 4: textures of looks |
//! | 5      | reserved  | 3                  | 0                                            |
//! | 8      | vertices  | 4                  | count n                                      |
//! | 12     | triangles | 4                  | count m                                      |
//! | 16     | positions | n × 12 or n × 24   | m, body frame                                |
//! |        | triangles | m × 12             | vertex indices, counter-clockwise from outside |
//! |        | normals   | n × 12 or 0        | unit, per vertex                             |
//! |        | finish    | 8 or 0             | roughness, metallic: 0 to 1                  |
//! |        | looks     | 4 + k × 20 + m or 0 | count k from 1 to 255; of each red, green, blue (linear), roughness, metallic: 0 to 1; of each triangle, which |
//! |        | textures  | the rest, or 0     | see [`mesh_textures`](crate::mesh_textures)  |

use crate::codec::wire_struct;
pub use crate::mesh_looks::{Finish, Look, Looks, MAX_LOOKS};
use crate::mesh_prefix::{
    LAYOUT_F64, LAYOUT_FINISH, LAYOUT_LOOKS, LAYOUT_NORMALS, LAYOUT_TEXTURES, PREFIX_BYTES, Prefix,
};
use crate::mesh_textures::Textures;
use crate::{DecodeError, EncodeError, text::hex};

/// Most bytes of an encoded mesh: 4 million triangles.
pub const MAX_MESH_BYTES: usize = 128 << 20;

wire_struct! {
    /// BLAKE3 hash of an encoded mesh.
    #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub struct MeshHash {
        /// The 32 bytes.
        pub bytes: [u8; 32],
    }
}

impl MeshHash {
    /// Hash of an encoded mesh.
    pub fn of(encoded: &[u8]) -> MeshHash {
        MeshHash {
            bytes: *blake3::hash(encoded).as_bytes(),
        }
    }
}

impl std::fmt::Display for MeshHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&hex(&self.bytes))
    }
}

impl std::fmt::Debug for MeshHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "MeshHash({self})")
    }
}

/// Vertex positions, m, body frame, in the precision of the source.
#[derive(Clone, Debug, PartialEq)]
pub enum Positions {
    /// Single precision.
    F32(Vec<[f32; 3]>),
    /// Double precision.
    F64(Vec<[f64; 3]>),
}

/// A triangle mesh. Every index is below the number of vertices, every number finite: checked when made or decoded.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshBlob {
    positions: Positions,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    finish: Option<Finish>,
    looks: Option<Looks>,
    textures: Option<Textures>,
}

impl Positions {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        match self {
            Positions::F32(list) => list.len(),
            Positions::F64(list) => list.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl MeshBlob {
    /// Checks and keeps the parts. `normals`, if any, are one per vertex.
    pub fn new(
        positions: Positions,
        triangles: Vec<[u32; 3]>,
        normals: Option<Vec<[f32; 3]>>,
    ) -> Result<MeshBlob, DecodeError> {
        let finite = match &positions {
            Positions::F32(list) => list.iter().flatten().all(|x| x.is_finite()),
            Positions::F64(list) => list.iter().flatten().all(|x| x.is_finite()),
        };
        let normals_finite = normals.iter().flatten().flatten().all(|x| x.is_finite());
        if !(finite && normals_finite) {
            return Err(DecodeError::NotFinite);
        }
        if triangles
            .iter()
            .flatten()
            .any(|index| *index as usize >= positions.len())
        {
            return Err(DecodeError::Inconsistent {
                what: "vertex index",
            });
        }
        if normals
            .as_ref()
            .is_some_and(|normals| normals.len() != positions.len())
        {
            return Err(DecodeError::Inconsistent {
                what: "normal count",
            });
        }
        Ok(MeshBlob {
            positions,
            triangles,
            normals,
            finish: None,
            looks: None,
            textures: None,
        })
    }

    /// The same mesh with a finish; both its numbers are 0 to 1.
    pub fn with_finish(mut self, finish: Finish) -> Result<MeshBlob, DecodeError> {
        let parts = [finish.roughness, finish.metallic];
        if !parts.iter().all(|part| (0.0..=1.0).contains(part)) {
            return Err(DecodeError::OutOfRange {
                number: "MeshBlob.finish",
                range: "0 to 1",
            });
        }
        self.finish = Some(finish);
        Ok(self)
    }

    /// The same mesh with looks of its triangles, which count instead of the body's colour and finish; their numbers are 0 to 1.
    pub fn with_looks(mut self, looks: Looks) -> Result<MeshBlob, DecodeError> {
        looks.check(self.triangles.len())?;
        self.looks = Some(looks);
        self.textures = None; // those of other looks
        Ok(self)
    }

    /// The same mesh with textures of its looks, which it must have.
    pub fn with_textures(mut self, textures: Textures) -> Result<MeshBlob, DecodeError> {
        let looks = self.looks.as_ref().map_or(0, |looks| looks.list.len());
        textures.check(looks, self.triangles.len())?;
        self.textures = Some(textures);
        Ok(self)
    }

    /// Positions in the precision of the source.
    pub fn positions(&self) -> &Positions {
        &self.positions
    }

    /// Positions for computing.
    pub fn positions_f64(&self) -> Vec<[f64; 3]> {
        match &self.positions {
            Positions::F32(list) => list.iter().map(|p| p.map(f64::from)).collect(),
            Positions::F64(list) => list.clone(),
        }
    }

    /// Vertex indices, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Unit normals per vertex, if the source had any.
    pub fn normals(&self) -> Option<&[[f32; 3]]> {
        self.normals.as_deref()
    }

    /// How its surface reflects; `None` is as bodies of its kind do.
    pub fn finish(&self) -> Option<Finish> {
        self.finish
    }

    /// Looks of its triangles; `None` is the body's colour, and its finish.
    pub fn looks(&self) -> Option<&Looks> {
        self.looks.as_ref()
    }

    /// Textures of its looks; `None` is plain colours.
    pub fn textures(&self) -> Option<&Textures> {
        self.textures.as_ref()
    }

    /// The bytes that travel and are hashed. Fails above [`MAX_MESH_BYTES`].
    pub fn encode(&self) -> Result<Vec<u8>, EncodeError> {
        let prefix = self.prefix();
        let len = PREFIX_BYTES
            + prefix.lengths().iter().sum::<u64>() as usize // all of it lies in memory
            + self.looks.as_ref().map_or(0, Looks::encoded_len)
            + self.textures.as_ref().map_or(0, Textures::encoded_len);
        if len > MAX_MESH_BYTES {
            return Err(EncodeError::TooLong {
                what: "mesh",
                len,
                max: MAX_MESH_BYTES,
            });
        }
        let mut bytes = Vec::with_capacity(len);
        bytes.extend(prefix.to_bytes());
        match &self.positions {
            Positions::F32(list) => list
                .iter()
                .flatten()
                .for_each(|x| bytes.extend(x.to_le_bytes())),
            Positions::F64(list) => list
                .iter()
                .flatten()
                .for_each(|x| bytes.extend(x.to_le_bytes())),
        }
        self.triangles
            .iter()
            .flatten()
            .for_each(|i| bytes.extend(i.to_le_bytes()));
        self.normals
            .iter()
            .flatten()
            .flatten()
            .for_each(|x| bytes.extend(x.to_le_bytes()));
        self.finish
            .iter()
            .flat_map(|finish| [finish.roughness, finish.metallic])
            .for_each(|x| bytes.extend(x.to_le_bytes()));
        if let Some(looks) = &self.looks {
            looks.write(&mut bytes);
        }
        if let Some(textures) = &self.textures {
            textures.write(&mut bytes);
        }
        Ok(bytes)
    }

    fn prefix(&self) -> Prefix {
        let parts = [
            (matches!(self.positions, Positions::F64(_)), LAYOUT_F64),
            (self.normals.is_some(), LAYOUT_NORMALS),
            (self.finish.is_some(), LAYOUT_FINISH),
            (self.looks.is_some(), LAYOUT_LOOKS),
            (self.textures.is_some(), LAYOUT_TEXTURES),
        ];
        let present = parts.iter().filter(|(is_there, _)| *is_there);
        Prefix {
            layout: present.fold(0, |layout, (_, part)| layout | part),
            vertices: self.positions.len() as u64,
            triangles: self.triangles.len() as u64,
        }
    }

    /// Reads what [`MeshBlob::encode`] wrote. Memory is bounded by the length of `bytes`, whatever its counts claim.
    pub fn decode(bytes: &[u8]) -> Result<MeshBlob, DecodeError> {
        let (prefix, body) = Prefix::read(bytes)?;
        // The counts must account for every byte before anything is read.
        let lengths = prefix.lengths();
        let before_looks = lengths.iter().sum::<u64>();
        let looks_start = usize::try_from(before_looks).unwrap_or(usize::MAX);
        let (body, looks) = match body.split_at_checked(looks_start) {
            Some((body, looks)) if prefix.has(LAYOUT_LOOKS) != looks.is_empty() => (body, looks),
            _ => {
                return Err(DecodeError::Inconsistent {
                    what: "mesh length",
                });
            }
        };
        let [positions, triangles, normals, _] = lengths.map(|length| length as usize);
        let (positions, rest) = body.split_at(positions);
        let (triangles, rest) = rest.split_at(triangles);
        let (normals, finish) = rest.split_at(normals);
        let mut mesh = MeshBlob::new(
            if prefix.has(LAYOUT_F64) {
                Positions::F64(triples(positions, f64::from_le_bytes))
            } else {
                Positions::F32(triples(positions, f32::from_le_bytes))
            },
            triples(triangles, u32::from_le_bytes),
            prefix
                .has(LAYOUT_NORMALS)
                .then(|| triples(normals, f32::from_le_bytes)),
        )?;
        // Where there are none, the bytes are none: the lengths above agree.
        if let Ok([a, b, c, d, e, f, g, h]) = <[u8; 8]>::try_from(finish) {
            mesh = mesh.with_finish(Finish {
                roughness: f32::from_le_bytes([a, b, c, d]),
                metallic: f32::from_le_bytes([e, f, g, h]),
            })?;
        }
        if looks.is_empty() {
            return Ok(mesh);
        }
        let (looks, textures) = Looks::read(looks, mesh.triangles.len())?;
        let count = looks.list.len();
        let mesh = mesh.with_looks(looks)?;
        match (prefix.has(LAYOUT_TEXTURES), textures) {
            (false, []) => Ok(mesh),
            (false, _) => Err(DecodeError::Inconsistent {
                what: "mesh length",
            }),
            (true, textures) => mesh.with_textures(Textures::read(textures, count)?),
        }
    }
}

/// Numbers of `N` bytes, three by three; `bytes` is a whole number of triples.
fn triples<T: Copy, const N: usize>(bytes: &[u8], number: fn([u8; N]) -> T) -> Vec<[T; 3]> {
    let (numbers, _) = bytes.as_chunks::<N>();
    let (triples, _) = numbers.as_chunks::<3>();
    triples.iter().map(|triple| triple.map(number)).collect()
}
