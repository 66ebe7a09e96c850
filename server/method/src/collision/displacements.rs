//! How far small motions of a body carry it along the normals of an obstacle's volume, at least.
//!
//! | symbol | name in code | unit | meaning                                                     |
//! |--------|--------------|------|-------------------------------------------------------------|
//! | a, w   |              | m, – | displacement of the centre G and rotation vector             |
//! | y      |              | m    | contact point on the obstacle, in the volume                 |
//! | n      |              | –    | normal of a contact there, in the volume's cone              |
//! | v      |              | m    | `a + w x (y - G)`: a row's `J a` is `n.v`                     |
//!
//! With c the centre of the volume's ball and r its radius, `n.v >= n.v_c - |w| r`; and over a cone about m of half-angle theta the least `n.v_c`
//! is `|v_c| cos(alpha + theta)`, alpha the angle of m and v_c, or `-|v_c|` where that reaches over pi.

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};
use pulp::{Arch, Simd, WithSimd};

use super::single::{dot, product, sum};
use crate::geometry::lanes::LANES;
use crate::geometry::wide_tree::{Child, WideTree};
use crate::spatial::{Vector6, angular, linear};

/// Most motions of one search: where a device is and where it goes on to, and as far as it reaches from there along and about each axis.
pub(crate) const MAX_MOTIONS: usize = 14;
/// Rounding in single precision of what a motion does, per size of the motion: some tens of half units in the last place.
const ROUNDING: f32 = 64.0 * f32::EPSILON;

/// One motion in the obstacle's frame, its coordinates from the tree's origin.
#[derive(Clone, Copy, Debug)]
struct Small {
    /// What the tree's origin does, m.
    at_origin: [f32; 3],
    spin: [f32; 3],
    angle: f32,
    rounding: f32,
}

/// Motions of a body, linear, as an obstacle sees them.
#[derive(Clone, Debug)]
pub(crate) struct Motions {
    all: ArrayVec<Small, MAX_MOTIONS>,
    /// Cosine and sine of what cones are widened by.
    turn: [f32; 2],
    processor: Arch,
}

/// What the motions do in one volume, with the instructions that the processor has.
struct LeastAlong<'a> {
    motions: &'a Motions,
    tree: &'a WideTree,
    child: Child,
}

impl WithSimd for LeastAlong<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        self.motions.least_along_by_loop(self.tree, self.child)
    }
}

impl Motions {
    /// Of the motions, with the first [`MAX_MOTIONS`] of which G and the vectors are in the obstacle's frame; normals may leave the cones by `tilt`, rad.
    pub(crate) fn new<'a>(
        motions: impl IntoIterator<Item = &'a Vector6>,
        center: &Point3<f64>,
        tree: &WideTree,
        tilt: f64,
    ) -> Self {
        let small = |motion: &Vector6| {
            let spin: Vector3<f64> = angular(motion);
            let at_origin = linear(motion) + spin.cross(&(tree.origin - center));
            let size = at_origin.norm() + spin.norm() * tree.reach;
            Small {
                at_origin: at_origin.map(|x| x as f32).into(),
                spin: spin.map(|x| x as f32).into(),
                angle: spin.norm() as f32,
                rounding: ROUNDING * size as f32,
            }
        };
        Self {
            all: motions.into_iter().take(MAX_MOTIONS).map(small).collect(),
            turn: [tilt.cos() as f32, tilt.sin() as f32],
            processor: Arch::new(),
        }
    }

    /// Least that any of the motions carries a point of the body along a normal in the volume, m.
    #[inline]
    pub(super) fn least_along(&self, tree: &WideTree, child: Child) -> f32 {
        self.processor.dispatch(LeastAlong {
            motions: self,
            tree,
            child,
        })
    }

    #[inline(always)]
    fn least_along_by_loop(&self, tree: &WideTree, child: Child) -> f32 {
        let (node, k) = (tree.node(child / LANES as u32), child as usize % LANES);
        let lane = |v: &[crate::geometry::lanes::Lanes; 3]| [v[0].0[k], v[1].0[k], v[2].0[k]];
        let (center, axis) = (sum(&node.origin, &lane(&node.center)), lane(&node.axis));
        let radius = node.radius.0[k];
        let [cos, sin] = self.turn;
        let (cosine, sine) = (
            node.cosine.0[k].mul_add(cos, -(node.sine.0[k] * sin)),
            node.sine.0[k].mul_add(cos, node.cosine.0[k] * sin),
        );
        let mut least = f32::INFINITY;
        for motion in &self.all {
            let v = sum(&motion.at_origin, &product(&motion.spin, &center));
            let (along, squared) = (dot(&axis, &v), dot(&v, &v));
            let length = squared.sqrt();
            let across = (squared - along * along).max(0.0).sqrt();
            let within = sine >= 0.0 && along > -length * cosine; // false for NaN
            let in_cone = if within {
                along.mul_add(cosine, -(across * sine))
            } else {
                -length
            };
            let this = in_cone - motion.angle * radius - motion.rounding;
            least = if this < least { this } else { least };
        }
        least
    }
}
