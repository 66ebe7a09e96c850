//! Eight single-precision numbers side by side, one for each child of a node: loops over them become vector instructions.

/// Numbers in a [`Lanes`], children of a node of the wide tree.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

impl Lanes {
    /// The same number eight times.
    pub(crate) const fn splat(x: f32) -> Self {
        Self([x; LANES])
    }
}
