//! One volume of the one wide tree against eight of the other: can surfaces inside come near, facing each other?
//!
//! | symbol | name in code   | unit | meaning                                                                         |
//! |--------|----------------|------|---------------------------------------------------------------------------------|
//! | d      | `apart`        | m    | from the centre of one of the eight to that of the single volume                |
//! | s      | `sweep`        | m    | path of the body's volume in half the interval, to first order                  |
//! | theta  | `angle`        | rad  | rotation in half the interval                                                   |
//! | a, a'  | `axis`         | –    | axes of the slabs; a' is turned round, so that a.a' is 1 where they face each other |
//! | u      |                | –    | half a unit in the last place of 1 in single precision, 2^-24                   |
//!
//! In tau, halves of the interval from its middle, the body's volume is at its place there and `s tau` from it at other times, but for at
//! most `theta rho` because the arms of its points differ, and at most `theta^2 |r| / 2` because the path is curved. Seen along
//! its own axis a, with sides t and b = a x t of half lengths d and e, the arms make less: with the turn w,
//! `|w.b| d + |w.t| e`, and along any other axis by `theta rho` times the chord between the two more. Along each side of the boxes and each axis of
//! a slab, the volumes are within the margin only while `|n.(d + s tau)|` is within that and their extents: a window of tau. They come within the
//! margin only while all windows are open ([`windows`](super::windows)); and no
//! features inside them face each other when no normal of the one, turned by at most theta, is opposite to one of the other:
//! when the angle between a and a' exceeds the sum of the cones.
//!
//! At rest more is known: what faces over a distance g lies along a normal, so within the cone of either volume. Seen along its axis it
//! is at least g times the cone's cosine in front, and across the axis at most g times its sine aside. So what lies aside bounds g from below, as
//! boxes and slabs do, and how high the volumes reach bounds it from above: where no g is left nothing faces.
//!
//! **Rounding** is relative to the volumes, not to the meshes: a gap of micrometres on a part of a metre is told from none. Centres are taken from the
//! origins of their nodes, and how far these are apart is worked out in double precision. Let R be the radius of the volume that a node is below, and rho
//! that of one of the eight or of the single volume. A centre that is turned comes with 12 u R; the sums that lead from it to the other with 4 u |d|, 4 u R
//! of its own node and 6 u R of the other; the product of d with a unit axis with another 10 u |d|. Extents of the volume that is turned come with 31 (its
//! axes), 9 (cosines), 7 (sums), 8 (axes and tangents that are unit and square only to rounding) and 10 u rho (middles); those of the other with less. The
//! ends of a window come with 4 u of what they are quotients of, at most 8 u rho. Where a coordinate of d is more than twice the reach of both boxes, these
//! are apart; otherwise |d| is at most 6 rho of the one and 4 rho of the other: 157 u rho and 16 u R in all. Each volume is built wider by 160 u rho
//! and 16 u R on all its sides, and so along every axis ([`volume`](crate::geometry::volume)). What the motion adds comes with at most 160 u of its path,
//! its turn's and the margin. Cosines come with less than 24 u, squares of chords with twice that.
//!
//! Source: Gottschalk, Lin, Manocha 1996 (separating axes); Larsson and Akenine-Moller 2009 (slab along a direction); the
//! facing of cones as in normal-cone hierarchies, Johnson and Cohen 2001.

use nalgebra::{Matrix3, Vector3};

use pulp::Arch;

use super::motion::{Placement, RelativeMotion};
use super::turned::TurnedNodes;
use crate::geometry::wide_tree::{Child, WideTree};

/// Half a unit in the last place of 1 in single precision.
const HALF_UNIT: f64 = 0.5 * f32::EPSILON as f64;
/// Rounding of what a motion and the margin add, relative to them; of coordinates in double precision; and of a cosine: see the file's head.
const LENGTH_ROUNDING: f64 = 160.0 * HALF_UNIT;
const DOUBLE_ROUNDING: f64 = 64.0 * f64::EPSILON;
pub(super) const COSINE_ROUNDING: f32 = 24.0 * HALF_UNIT as f32;
pub(super) const CHORD_ROUNDING: f32 = 2.0 * COSINE_ROUNDING;
/// More than any length that a search may meet, m; squares of such lengths are finite in single precision.
const MOST_STRAY: f64 = 1e18;
/// Cones are widened by this, rad: the rounding of normals on their way to a direction, far below it.
const CONE_WIDENING: f64 = 1e-6;

/// Whose volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    /// Those of the body.
    Body = 0,
    /// Those of the obstacle.
    Obstacle = 1,
}

/// Tests volumes of a body against volumes of an obstacle over an interval of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacingVolumes {
    /// Tells these volumes from others.
    pub(super) serial: u32,
    /// The vector instructions that the processor has.
    pub(super) processor: Arch,
    frames: [Frame; 2],
    moves: bool,
    /// By how much the path of any point of the body is curved in half the interval at most, m.
    curved: f32,
    /// Bound on half the path of any point of the body, m.
    longest_half_sweep: f32,
    /// What volumes stray by, all over the body, and rounding, m: without the margin and with it.
    pub(super) bare_stray: f32,
    pub(super) stray: f32,
    pub(super) margin: f32,
    /// Cosine and sine of what cones are widened by.
    pub(super) turn: [f32; 2],
}

/// What half an interval adds to the way between a volume at rest and one of the other tree, m and rad.
pub(super) struct Added {
    sweep: Vector3<f64>,
    path: f64,
    angle: f64,
    arm: f64,
    /// Of the origin of the body's tree from its straight path, with the margin and rounding.
    stray: f64,
}

impl Added {
    /// Along a unit direction, for points within `radius` (m): to first order, and what is left of the second, the frame's turn included.
    pub(super) fn along(&self, n: &Vector3<f64>, radius: f64) -> f64 {
        let (path, angle) = (self.path, self.angle);
        let bent = radius + path + 0.5 * angle * (self.arm + radius + path);
        n.dot(&self.sweep).abs() + angle * bent + self.stray
    }
}

/// How the volumes of one tree get into the other tree's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) rotation: [[f32; 3]; 3],
    pub(super) rotation_abs: [[f32; 3]; 3],
    /// The same, and the origin of this tree from that of the other, other axes, m, in double precision: for the origins of nodes.
    pub(super) turn: Matrix3<f64>,
    pub(super) offset: Vector3<f64>,
    /// Half the path of the origin of the body's tree, m, half the rotation and its angle: other axes; zero for the obstacle, which rests.
    pub(super) half_path: [f32; 3],
    pub(super) half_turn: [f32; 3],
    pub(super) angle: f32,
    /// The same in the body's own axes.
    own_half_path: [f32; 3],
    pub(super) own_half_turn: [f32; 3],
}

impl FacingVolumes {
    /// Over `[from, to]`; volumes count as meeting within `margin`, m.
    pub(crate) fn over(
        trees: (&WideTree, &WideTree),
        motion: &RelativeMotion,
        [from, to]: [f64; 2],
        margin: f64,
        turned: &mut TurnedNodes,
    ) -> Self {
        let half = 0.5 * (to - from);
        let placement = motion.at(0.5 * (from + to));
        let volumes = Self::new(
            trees,
            &placement,
            [motion.velocity * half, motion.spin * half],
            margin,
            CONE_WIDENING,
            turned,
        );
        Self {
            moves: true,
            ..volumes
        }
    }

    /// At rest; volumes count as meeting within `margin`, m, and as facing within `tilt`, rad.
    pub(crate) fn still(
        trees: (&WideTree, &WideTree),
        placement: &Placement,
        margin: f64,
        tilt: f64,
        turned: &mut TurnedNodes,
    ) -> Self {
        Self::new(
            trees,
            placement,
            [Vector3::zeros(); 2],
            margin,
            tilt + CONE_WIDENING,
            turned,
        )
    }

    fn new(
        (body, obstacle): (&WideTree, &WideTree),
        placement: &Placement,
        [half_path, half_turn]: [Vector3<f64>; 2],
        margin: f64,
        widening: f64,
        turned: &mut TurnedNodes,
    ) -> Self {
        let rotation = &placement.rotation;
        let origin = placement.point(&body.origin).coords;
        let offset = origin - obstacle.origin.coords;
        let angle = half_turn.norm();
        let path = half_path + half_turn.cross(&(origin - placement.center));
        let arm = (origin - placement.center).norm() + body.reach;
        let reach = body.reach + obstacle.reach + offset.norm();
        let curved = 0.5 * angle * angle * arm;
        let added = path.norm() + angle * body.reach + curved + margin;
        let bare_stray = curved + LENGTH_ROUNDING * added + DOUBLE_ROUNDING * reach;
        let turn = (angle + widening).min(std::f64::consts::PI);
        let to_body = |v: &Vector3<f64>| vector(&rotation.tr_mul(v));
        let of_body = Frame {
            rotation: single(rotation),
            rotation_abs: single(&rotation.abs()),
            turn: *rotation,
            offset,
            half_path: vector(&path),
            half_turn: vector(&half_turn),
            angle: angle as f32,
            own_half_path: to_body(&path),
            own_half_turn: to_body(&half_turn),
        };
        let of_obstacle = Frame {
            rotation: single(&rotation.transpose()),
            rotation_abs: single(&rotation.abs().transpose()),
            turn: rotation.transpose(),
            offset: rotation.tr_mul(&-offset),
            half_path: [0.0; 3],
            half_turn: [0.0; 3],
            angle: 0.0,
            own_half_path: [0.0; 3],
            own_half_turn: [0.0; 3],
        };
        // Infinite, it would make lanes without a child NaN, and so near.
        let bare_stray = bare_stray.min(MOST_STRAY);
        Self {
            serial: turned.next_serial(),
            processor: turned.processor(),
            frames: [of_body, of_obstacle],
            moves: false,
            curved: curved as f32,
            longest_half_sweep: (path.norm() + 2.0 * angle * body.reach) as f32,
            bare_stray: bare_stray as f32,
            stray: (bare_stray + margin) as f32,
            margin: margin as f32,
            turn: [turn.cos() as f32, turn.sin() as f32],
        }
    }

    /// Whether they are of an interval of a motion, though it may be none.
    #[inline(always)]
    pub(super) fn moves(&self) -> bool {
        self.moves
    }

    #[inline(always)]
    pub(super) fn frame(&self, side: Side) -> &Frame {
        &self.frames[side as usize]
    }

    /// Half the path of the origin of the body's tree, m, half the rotation and its angle, in the body's axes.
    #[inline(always)]
    pub(super) fn path_in_body_axes(&self) -> (&[f32; 3], &[f32; 3], f32) {
        let body = &self.frames[Side::Body as usize];
        (&body.own_half_path, &body.own_half_turn, body.angle)
    }

    /// A point of one tree, from its origin, in the middle of the interval: from the origin of the other tree and in its axes, m; and what the interval adds.
    pub(super) fn seen_by_other(&self, side: Side, point: &Vector3<f64>) -> (Vector3<f64>, Added) {
        let frame = self.frame(side);
        let turned = frame.turn * point;
        let at = turned + frame.offset;
        let body = self.frame(Side::Body);
        let wide = |v: &[f32; 3]| Vector3::from(v.map(f64::from));
        // From the origin of the body's tree, about which the path is.
        let (path, spin, arm) = match side {
            Side::Body => (wide(&body.half_path), wide(&body.half_turn), turned),
            Side::Obstacle => (wide(&body.own_half_path), wide(&body.own_half_turn), at),
        };
        let added = Added {
            sweep: path + spin.cross(&arm),
            path: path.norm(),
            angle: f64::from(body.angle),
            arm: arm.norm(),
            stray: f64::from(self.stray),
        };
        (at, added)
    }

    /// Whether points of the body may move by more than `length` (m) in half the interval.
    #[inline]
    pub(crate) fn sweeps_more_than(&self, length: f32) -> bool {
        self.longest_half_sweep > length
    }

    /// Whether points of a volume of the body leave the straight path of its centre by more than `length` (m) in half the interval.
    #[inline]
    pub(crate) fn strays_more_than(&self, length: f32, tree: &WideTree, child: Child) -> bool {
        let angle = self.frame(Side::Body).angle;
        angle * tree.radius(child) + self.curved > length
    }

    /// Cosine and sine of a cone that is widened by the rotation; a cone of all directions stays one.
    #[inline(always)]
    pub(super) fn widened(&self, cosine: f32, sine: f32) -> (f32, f32) {
        let [cos, sin] = self.turn;
        let wide = sine.mul_add(cos, cosine * sin);
        if wide > 0.0 {
            (cosine.mul_add(cos, -(sine * sin)), wide)
        } else {
            (-1.0, 0.0)
        }
    }
}

fn single(m: &Matrix3<f64>) -> [[f32; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)] as f32))
}

fn vector(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}
