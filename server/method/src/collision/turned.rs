//! Eight volumes of one tree as the other tree sees them: in its frame, with what their motion adds.
//!
//! A descent meets the same volumes again and again, each time against other ones. So a node is turned once for all its eight, and kept until
//! another takes its place.

use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

use super::facing_volumes::{FacingVolumes, Side};
use super::single::{apply, dot, product, smaller, sum};
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_node::WideNode;
use crate::geometry::wide_tree::{Child, WideTree};

/// Nodes of each tree that are kept turned: a quarter more of them would not fit the first cache, half as many are turned more often.
const KEPT: usize = 32;
/// Feet may lie outside their faces by this share of the gap, twice the tolerance of the collection, and sines come with rounding.
const FOOT_SHARE: f32 = 2e-4;

/// Eight volumes in the frame of the other tree. The axes point the other way: the product with an axis that they face is 1.
#[derive(Clone, Debug)]
pub(super) struct Turned {
    /// The node's origin, what is left of it where single precision ends, and the centres from there, m.
    pub(super) origin: [f32; 3],
    pub(super) origin_rest: [f32; 3],
    pub(super) center: [Lanes; 3],
    /// Half of the sides of the boxes along the frame's axes, and what points stray by along them, m.
    pub(super) reach: [Lanes; 3],
    pub(super) axis: [Lanes; 3],
    /// Of the box about the axis: tangent and its product with the axis, and half the sides.
    pub(super) tangents: [[Lanes; 3]; 2],
    pub(super) sides: [Lanes; 2],
    pub(super) middle: Lanes,
    pub(super) slab: Lanes,
    pub(super) cosine: Lanes,
    pub(super) sine: Lanes,
    /// How far what faces these features is for each metre that it lies aside of the axis, and how high above them for each metre of that gap, at least:
    /// see [`shares`].
    pub(super) gap_per_aside: Lanes,
    pub(super) rise_per_gap: Lanes,
    /// Of volumes of a motion, otherwise without meaning: the path, what their points stray by along the axis, and the path of the farthest about the centre.
    pub(super) sweep: [Lanes; 3],
    pub(super) stray_along_axis: Lanes,
    pub(super) turning: Lanes,
}

/// The nodes turned last, each in the place that its number gives it.
#[derive(Clone, Debug)]
pub(crate) struct TurnedNodes {
    kept: Box<[Turned; 2 * KEPT]>,
    /// Which volumes turned it, above which node it is.
    keys: Box<[u64; 2 * KEPT]>,
    serial: u32,
    processor: Arch,
}

impl TurnedNodes {
    /// Allocates everything that it will ever need.
    pub(super) fn new() -> Self {
        Self {
            kept: Box::new([const { Turned::zero() }; 2 * KEPT]),
            keys: Box::new([0; 2 * KEPT]),
            serial: 0,
            processor: Arch::new(),
        }
    }

    /// The vector instructions that the processor has.
    pub(super) fn processor(&self) -> Arch {
        self.processor
    }

    /// Other vectors than the processor's best, to compare.
    #[cfg(test)]
    pub(super) fn set_processor(&mut self, processor: Arch) {
        self.processor = processor;
    }

    /// A number that no volumes had whose nodes are still kept.
    pub(crate) fn next_serial(&mut self) -> u32 {
        self.serial = self.serial.wrapping_add(1);
        if self.serial == 0 {
            self.keys.fill(0);
            self.serial = 1;
        }
        self.serial
    }

    /// The node that holds `child`, a child of the tree on `side`, turned.
    #[inline(always)]
    pub(super) fn of(
        &mut self,
        volumes: &FacingVolumes,
        side: Side,
        tree: &WideTree,
        child: Child,
    ) -> &Turned {
        let node = child / LANES as u32;
        let place = side as usize * KEPT + node as usize % KEPT;
        let key = u64::from(volumes.serial) << 32 | u64::from(node);
        if self.keys[place] != key {
            self.keys[place] = key;
            let (kept, node) = (&mut self.kept[place], tree.node(node));
            let turn = Turn {
                kept,
                volumes,
                side,
                node,
            };
            volumes.processor.dispatch(turn);
        }
        &self.kept[place]
    }
}

/// Turns a node into the other tree's frame, with the vectors that the processor has.
struct Turn<'a> {
    kept: &'a mut Turned,
    volumes: &'a FacingVolumes,
    side: Side,
    node: &'a WideNode,
}

impl WithSimd for Turn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if self.volumes.moves() {
            self.kept.turn::<true>(self.volumes, self.side, self.node);
        } else {
            self.kept.turn::<false>(self.volumes, self.side, self.node);
        }
    }
}

impl Turned {
    const fn zero() -> Self {
        let zero = Lanes::splat(0.0);
        Self {
            origin: [0.0; 3],
            origin_rest: [0.0; 3],
            center: [zero; 3],
            reach: [zero; 3],
            axis: [zero; 3],
            tangents: [[zero; 3]; 2],
            sides: [zero; 2],
            middle: zero,
            slab: zero,
            cosine: zero,
            sine: zero,
            gap_per_aside: zero,
            rise_per_gap: zero,
            sweep: [zero; 3],
            stray_along_axis: zero,
            turning: zero,
        }
    }

    /// One loop over the lanes, without branches: the compiler makes vectors of it.
    #[allow(
        clippy::needless_range_loop,
        reason = "coordinates of many vectors side by side"
    )]
    #[inline(always)]
    fn turn<const MOVES: bool>(&mut self, volumes: &FacingVolumes, side: Side, node: &WideNode) {
        let frame = volumes.frame(side);
        let (n, rotation) = (node, &frame.rotation);
        let origin = frame.turn * Vector3::from(n.origin).map(f64::from);
        let arm_of_origin: [f32; 3] = origin.map(|x| x as f32).into();
        let origin = origin + frame.offset;
        let rounded = origin.map(|x| x as f32);
        self.origin_rest = (origin - rounded.map(f64::from)).map(|x| x as f32).into();
        self.origin = rounded.into();
        for k in 0..LANES {
            let lane = |v: &[Lanes; 3]| [v[0].0[k], v[1].0[k], v[2].0[k]];
            let (own_axis, own_tangent) = (lane(&n.axis), lane(&n.tangent));
            let center = apply(rotation, &lane(&n.center));
            let (axis, tangent) = (apply(rotation, &own_axis), apply(rotation, &own_tangent));
            let bitangent = product(&axis, &tangent);
            let (along, across) = (n.along.0[k], n.across.0[k]);
            let (middle, slab, radius) = (n.middle.0[k], n.slab.0[k], n.radius.0[k]);
            let turning = if MOVES { frame.angle * radius } else { 0.0 };
            let half = apply(&frame.rotation_abs, &lane(&n.half));
            // The box about the axis is the narrower one where the surface runs aslant.
            let thickness = middle.abs() + slab;
            for i in 0..3 {
                let aslant = axis[i].abs().mul_add(
                    thickness,
                    tangent[i].abs().mul_add(along, bitangent[i].abs() * across),
                );
                let half = if half[i] < aslant { half[i] } else { aslant };
                self.center[i].0[k] = center[i];
                self.reach[i].0[k] = half + volumes.stray + turning;
                self.axis[i].0[k] = -axis[i];
                self.tangents[0][i].0[k] = tangent[i];
                self.tangents[1][i].0[k] = bitangent[i];
            }
            let (cosine, sine) = volumes.widened(n.cosine.0[k], n.sine.0[k]);
            self.sides[0].0[k] = along;
            self.sides[1].0[k] = across;
            self.middle.0[k] = -middle;
            self.slab.0[k] = slab;
            self.cosine.0[k] = cosine;
            self.sine.0[k] = sine;
            let [rise_per_gap, gap_per_aside] = shares(cosine, sine);
            self.rise_per_gap.0[k] = rise_per_gap;
            self.gap_per_aside.0[k] = gap_per_aside;
            if !MOVES {
                continue;
            }
            let arm = sum(&arm_of_origin, &center);
            let sweep = sum(&frame.half_path, &product(&frame.half_turn, &arm));
            for i in 0..3 {
                self.sweep[i].0[k] = sweep[i];
            }
            // What points stray by along the axis while they turn.
            let own_across = product(&own_axis, &own_tangent);
            let turn = &frame.own_half_turn;
            self.stray_along_axis.0[k] = dot(turn, &own_across)
                .abs()
                .mul_add(along, dot(turn, &own_tangent).abs() * across);
            self.turning.0[k] = turning;
        }
    }
}

/// Of the gap to what faces features whose normals are in a cone: the share that lies along its axis at least, and the least gap for each metre across
/// the axis. 0 and 1 for a cone of a right angle or more, which says nothing of either. Without branches.
#[inline(always)]
pub(super) fn shares(cosine: f32, sine: f32) -> [f32; 2] {
    let narrow = (cosine > FOOT_SHARE) & (sine >= 0.0);
    let across = if narrow {
        smaller(sine + FOOT_SHARE, 1.0)
    } else {
        1.0
    };
    [if narrow { cosine - FOOT_SHARE } else { 0.0 }, 1.0 / across]
}
