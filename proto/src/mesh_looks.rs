//! How the triangles of a mesh look where they do not all look alike. A part of [`MeshBlob`](crate::MeshBlob).

use crate::DecodeError;

/// Most looks of one mesh.
pub const MAX_LOOKS: usize = 255;

const LOOK_BYTES: usize = 20;

/// How a surface reflects, in the terms of glTF 2.0's metallic-roughness material; its colour is the body's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    /// 0 is a mirror, 1 is matt.
    pub roughness: f32,
    /// 0 is a dielectric (plastic, paint, wood), 1 a metal.
    pub metallic: f32,
}

/// How some of a body's triangles look, in the same terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Linear red, green and blue.
    pub colour: [f32; 3],
    /// How they reflect.
    pub finish: Finish,
}

/// Looks of a mesh whose triangles do not all look alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Looks {
    /// At most [`MAX_LOOKS`], and one at least.
    pub list: Vec<Look>,
    /// Place in the list, for each triangle.
    pub of_triangles: Vec<u8>,
}

impl Look {
    fn numbers(&self) -> [f32; 5] {
        let [red, green, blue] = self.colour;
        [
            red,
            green,
            blue,
            self.finish.roughness,
            self.finish.metallic,
        ]
    }
}

impl Looks {
    /// Checks that they are those of a mesh with so many triangles, and that their numbers are 0 to 1.
    pub(crate) fn check(&self, triangles: usize) -> Result<(), DecodeError> {
        let count = self.list.len();
        let known = |place: &u8| usize::from(*place) < count;
        if !(1..=MAX_LOOKS).contains(&count)
            || self.of_triangles.len() != triangles
            || !self.of_triangles.iter().all(known)
        {
            return Err(DecodeError::Inconsistent { what: "mesh looks" });
        }
        let mut numbers = self.list.iter().flat_map(Look::numbers);
        if numbers.all(|number| (0.0..=1.0).contains(&number)) {
            return Ok(());
        }
        Err(DecodeError::OutOfRange {
            number: "MeshBlob.looks",
            range: "0 to 1",
        })
    }

    /// Length of what [`Looks::write`] writes.
    pub(crate) fn encoded_len(&self) -> usize {
        4 + LOOK_BYTES * self.list.len() + self.of_triangles.len()
    }

    pub(crate) fn write(&self, to: &mut Vec<u8>) {
        to.extend((self.list.len() as u32).to_le_bytes()); // at most MAX_LOOKS
        let numbers = self.list.iter().flat_map(Look::numbers);
        to.extend(numbers.flat_map(f32::to_le_bytes));
        to.extend(&self.of_triangles);
    }

    /// Reads what [`Looks::write`] wrote for a mesh of so many triangles, and what follows it.
    pub(crate) fn read(bytes: &[u8], triangles: usize) -> Result<(Self, &[u8]), DecodeError> {
        let Some((count, rest)) = bytes.split_first_chunk::<4>() else {
            return Err(DecodeError::Truncated);
        };
        let list = LOOK_BYTES.checked_mul(u32::from_le_bytes(*count) as usize);
        let list = list.and_then(|length| rest.split_at_checked(length));
        let parts = list.and_then(|(list, rest)| Some((list, rest.split_at_checked(triangles)?)));
        let Some((list, (of_triangles, rest))) = parts else {
            return Err(DecodeError::Truncated);
        };
        let (numbers, _) = list.as_chunks::<4>();
        let (looks, _) = numbers.as_chunks::<5>();
        let looks = Self {
            list: looks.iter().map(look_of).collect(),
            of_triangles: of_triangles.to_vec(),
        };
        Ok((looks, rest))
    }
}

fn look_of(numbers: &[[u8; 4]; 5]) -> Look {
    let [red, green, blue, roughness, metallic] = numbers.map(f32::from_le_bytes);
    Look {
        colour: [red, green, blue],
        finish: Finish {
            roughness,
            metallic,
        },
    }
}
