//! A node of the wide tree: the volumes of its eight children, component by component, so that one is tested against eight at a time.

use super::lanes::Lanes;
use super::volume::Volume;

/// Eight children, a lane each. Lanes without a child have boxes that meet nothing.
#[derive(Clone, Debug)]
pub(crate) struct WideNode {
    /// The point from which its children's centres are taken, from the tree's origin, m: about the middle of them.
    pub(crate) origin: [f32; 3],
    pub(crate) center: [Lanes; 3],
    pub(crate) half: [Lanes; 3],
    pub(crate) axis: [Lanes; 3],
    pub(crate) tangent: [Lanes; 3],
    pub(crate) middle: Lanes,
    pub(crate) slab: Lanes,
    pub(crate) along: Lanes,
    pub(crate) across: Lanes,
    pub(crate) radius: Lanes,
    pub(crate) cosine: Lanes,
    pub(crate) sine: Lanes,
}

impl WideNode {
    pub(super) fn empty(origin: [f32; 3]) -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            origin,
            center: [zero; 3],
            half: [Lanes::splat(f32::NEG_INFINITY); 3],
            axis: [zero; 3],
            tangent: [zero; 3],
            middle: zero,
            slab: zero,
            along: zero,
            across: zero,
            radius: zero,
            cosine: zero,
            sine: zero,
        }
    }

    /// The volume of lane `k`, without what lies below.
    #[cfg(test)]
    pub(super) fn child(&self, k: usize) -> Volume {
        let three = |v: &[Lanes; 3]| [v[0].0[k], v[1].0[k], v[2].0[k]];
        Volume {
            center: three(&self.center),
            half: three(&self.half),
            axis: three(&self.axis),
            tangent: three(&self.tangent),
            middle: self.middle.0[k],
            slab: self.slab.0[k],
            along: self.along.0[k],
            across: self.across.0[k],
            radius: self.radius.0[k],
            cosine: self.cosine.0[k],
            sine: self.sine.0[k],
            owned: 0,
        }
    }

    pub(super) fn set(&mut self, k: usize, volume: &Volume) {
        for i in 0..3 {
            self.center[i].0[k] = volume.center[i];
            self.half[i].0[k] = volume.half[i];
            self.axis[i].0[k] = volume.axis[i];
            self.tangent[i].0[k] = volume.tangent[i];
        }
        self.middle.0[k] = volume.middle;
        self.slab.0[k] = volume.slab;
        self.along.0[k] = volume.along;
        self.across.0[k] = volume.across;
        self.radius.0[k] = volume.radius;
        self.cosine.0[k] = volume.cosine;
        self.sine.0[k] = volume.sine;
    }
}
