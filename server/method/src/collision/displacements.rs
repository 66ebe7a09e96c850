//! How far small motions of a body carry it along the normals of the volumes of a tree, at least.
//!
//! | symbol | name in code | unit | meaning                                                     |
//! |--------|--------------|------|-------------------------------------------------------------|
//! | a, w   |              | m, – | displacement of the centre G and rotation vector             |
//! | y      |              | m    | contact point, in the volume                                 |
//! | n      |              | –    | normal of a contact there, in the volume's cone              |
//! | v      |              | m    | `a + w x (y - G)`: a row's `J a` is `n.v`                     |
//!
//! The volume is the obstacle's; or the body's, where the motion is turned round, as the normal is: it is the obstacle that comes, and `n.v` is the same,
//! since the points of a contact lie along n. Both bounds hold, so the greater does. The rim of a hole has normals all over a quarter of a turn: what
//! slides past its edge is known from the side of the peg.
//!
//! With c the centre of the volume's ball and r its radius, `n.v >= n.v_c - |w| r`; and over a cone about m of half-angle theta the least `n.v_c`
//! is `|v_c| cos(alpha + theta)`, alpha the angle of m and v_c, or `-|v_c|` where that reaches over pi.

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::facing_volumes::Side;
use super::single::{dot, product, smaller, sum};
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_node::WideNode;
use crate::geometry::wide_tree::WideTree;
use crate::spatial::{Pose, Vector6, angular, linear};

/// Most motions of one search: where a device is and where it goes on to, and as far as it reaches from there along and about each axis.
pub(crate) const MAX_MOTIONS: usize = 14;
/// Rounding in single precision of what a motion does, per size of the motion: some tens of half units in the last place.
const ROUNDING: f32 = 64.0 * f32::EPSILON;

/// One motion in the frame of the tree, its coordinates from the tree's origin.
#[derive(Clone, Copy, Debug)]
struct Small {
    /// What the tree's origin does, m.
    at_origin: [f32; 3],
    spin: [f32; 3],
    angle: f32,
    rounding: f32,
}

/// Motions of a body, linear, as the volumes of a tree see them.
#[derive(Clone, Debug)]
pub(crate) struct Motions {
    all: ArrayVec<Small, MAX_MOTIONS>,
    /// The one normal that contacts have, out of the tree's side: opposite is a half-space.
    only_normal: Option<[f32; 3]>,
    /// Cosine and sine of what cones are widened by.
    turn: [f32; 2],
}

impl Motions {
    /// The first [`MAX_MOTIONS`] of the motions of G, world axes, as that side sees them whose tree is at `pose`; normals may leave the cones by `tilt`, rad.
    pub(crate) fn seen_by(
        side: Side,
        (tree, pose): (&WideTree, &Pose),
        motions: &[Vector6],
        center: &Point3<f64>,
        tilt: f64,
    ) -> Self {
        let sign = match side {
            Side::Body => -1.0,
            Side::Obstacle => 1.0,
        };
        let into = pose.rotation.inverse();
        let center = pose.inverse_transform_point(center);
        let small = |motion: &Vector6| {
            let spin: Vector3<f64> = into * angular(motion) * sign;
            let at_origin = into * linear(motion) * sign + spin.cross(&(tree.origin - center));
            let size = at_origin.norm() + spin.norm() * tree.reach;
            Small {
                at_origin: at_origin.map(|x| x as f32).into(),
                spin: spin.map(|x| x as f32).into(),
                angle: spin.norm() as f32,
                rounding: ROUNDING * size as f32,
            }
        };
        Self {
            all: motions.iter().take(MAX_MOTIONS).map(small).collect(),
            only_normal: None,
            turn: [tilt.cos() as f32, tilt.sin() as f32],
        }
    }

    /// The same where contacts have one normal alone, out of that side, in its tree's axes.
    pub(crate) fn along(self, normal: &Vector3<f64>) -> Self {
        Self {
            only_normal: Some(normal.map(|x| x as f32).into()),
            ..self
        }
    }

    /// Least that any of the motions carries a point of the body along a normal in each volume of a node, m.
    ///
    /// One loop over the lanes, without branches: the compiler makes vectors of it, of those that its caller was compiled for.
    #[inline(always)]
    pub(super) fn least_along(&self, node: &WideNode) -> Lanes {
        if let Some(normal) = &self.only_normal {
            return self.least_along_normal(node, normal);
        }
        let [cos, sin] = self.turn;
        let mut least = Lanes::splat(f32::INFINITY);
        for motion in &self.all {
            // In the middle of the node, and what is added to it at the centre of a child.
            let middle = sum(&motion.at_origin, &product(&motion.spin, &node.origin));
            for k in 0..LANES {
                let lane = |v: &[Lanes; 3]| [v[0].0[k], v[1].0[k], v[2].0[k]];
                let (center, axis) = (lane(&node.center), lane(&node.axis));
                let cosine = node.cosine.0[k].mul_add(cos, -(node.sine.0[k] * sin));
                let sine = node.sine.0[k].mul_add(cos, node.cosine.0[k] * sin);
                let v = sum(&middle, &product(&motion.spin, &center));
                let (along, squared) = (dot(&axis, &v), dot(&v, &v));
                let length = squared.sqrt();
                let across = (squared - along * along).max(0.0).sqrt();
                let within = (sine >= 0.0) & (along > -length * cosine); // false for NaN
                let in_cone = if within {
                    along.mul_add(cosine, -(across * sine))
                } else {
                    -length
                };
                let turning = motion.angle * node.radius.0[k];
                least.0[k] = smaller(in_cone - turning - motion.rounding, least.0[k]);
            }
        }
        least
    }

    /// The same along one normal.
    #[inline(always)]
    fn least_along_normal(&self, node: &WideNode, normal: &[f32; 3]) -> Lanes {
        let mut least = Lanes::splat(f32::INFINITY);
        for motion in &self.all {
            let middle = sum(&motion.at_origin, &product(&motion.spin, &node.origin));
            for k in 0..LANES {
                let center = [0, 1, 2].map(|i| node.center[i].0[k]);
                let v = sum(&middle, &product(&motion.spin, &center));
                let turning = motion.angle * node.radius.0[k];
                least.0[k] = smaller(dot(normal, &v) - turning - motion.rounding, least.0[k]);
            }
        }
        least
    }
}
