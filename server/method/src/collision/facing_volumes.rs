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
//! At the middle of the interval the body's volume is at its place; at other times of the interval it strays from there
//! by `s`, by at most `theta rho` more because the arms of its points differ, and by at most `theta^2 |r| / 2` because
//! the path is curved. Seen along its own axis a, with sides t and b = a x t of half lengths d and e, the arms make less: with the turn w,
//! `|w.b| d + |w.t| e`, and along any other axis by `theta rho` times the chord between the two more. The volumes do not come
//! within the margin when that and their extents leave them apart along a side of the boxes or along the axis of a slab; and no
//! features inside them face each other when no normal of the one, turned by at most theta, is opposite to one of the other:
//! when the angle between a and a' exceeds the sum of the cones.
//!
//! At rest more is known: what faces over a distance g lies along a normal, so within the cone of either volume. Seen along its axis it
//! is in front, and across the axis at most `g` times the sine of the cone aside: the tangents of a volume are axes of separation with a
//! margin that is narrow where the surface is smooth.
//!
//! **Rounding.** Let L be the reach of both meshes about their origins, the distance of the origins and the path together. A
//! coordinate of d comes with at most 10 u L (the rotation's rounding, its product and three sums), its product with a
//! unit axis with 27 u L, the extents with 13 (cosine of the slabs), 26 (sides), 6 (axes and tangents that are unit and square
//! only to rounding), 19 (sweep), 5 (what arms make of it) and 13 u L (the other middle), sums with 9 u L: less than 128 u L,
//! which the margin is widened by. Cosines come with less than 24 u, squares of chords with twice that.
//!
//! Source: Gottschalk, Lin, Manocha 1996 (separating axes); Larsson and Akenine-Moller 2009 (slab along a direction); the
//! facing of cones as in normal-cone hierarchies, Johnson and Cohen 2001.

use nalgebra::{Matrix3, Vector3};

use super::motion::{Placement, RelativeMotion};
use super::work::Work;
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::volume::Volume;
use crate::geometry::wide_tree::{Below, Child, ROOT, WideNode, WideTree};

/// Half a unit in the last place of 1 in single precision.
const HALF_UNIT: f64 = 0.5 * f32::EPSILON as f64;
/// Rounding of a separation relative to the reach L, and of a cosine: see the file's head.
const LENGTH_ROUNDING: f64 = 128.0 * HALF_UNIT;
const COSINE_ROUNDING: f32 = 24.0 * HALF_UNIT as f32;
const CHORD_ROUNDING: f32 = 2.0 * COSINE_ROUNDING;
/// Cones are widened by this, rad: the rounding of normals on their way to a direction, far below it.
const CONE_WIDENING: f64 = 1e-6;
/// Feet may lie outside their faces by this share of the gap, twice the tolerance of the collection, and sines come with rounding.
const FOOT_SHARE: f32 = 2e-4;
/// Pairs that a descent holds: each level of either tree adds seven, and there are fewer levels than in the binary trees.
pub(crate) const WIDE_STACK_CAPACITY: usize = 2 * (LANES - 1) * crate::geometry::MAX_DEPTH + 1;

/// Tests volumes of a body against volumes of an obstacle over an interval of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacingVolumes {
    /// Obstacle from body axes at the middle of the interval.
    rotation: [[f32; 3]; 3],
    rotation_abs: [[f32; 3]; 3],
    /// Origin of the body's tree, from that of the obstacle's, obstacle axes, m.
    offset: [f32; 3],
    /// Origin of the obstacle's tree, from that of the body's, body axes, m.
    offset_back: [f32; 3],
    /// Half the path of the origin of the body's tree, and half the rotation: obstacle axes, body axes.
    half_path: [[f32; 3]; 2],
    half_turn: [[f32; 3]; 2],
    angle: f32,
    /// Bound on half the path of any point of the body, m.
    longest_half_sweep: f32,
    /// What volumes stray by, all over the body, and rounding, m: without the margin and with it.
    bare_stray: f32,
    stray: f32,
    margin: f32,
    /// Cosine and sine of what cones are widened by.
    turn: [f32; 2],
}

/// One volume, ready to be tested against eight of the other tree, in that tree's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Against {
    center: [f32; 3],
    half: [f32; 3],
    axis: [f32; 3],
    /// Of the volume's box: tangent and its product with the axis, and half the sides.
    tangents: [[f32; 3]; 2],
    sides: [f32; 2],
    middle: f32,
    slab: f32,
    cosine: f32,
    sine: f32,
    sweep: [f32; 3],
    spin: [f32; 3],
    bare_stray: f32,
    stray: f32,
    /// Margin along the tangents of this volume, m: what faces its features is no farther aside.
    margin_aside: f32,
    margin: f32,
    /// Cosine and sine of what cones are widened by.
    turn: [f32; 2],
    /// Along sides of boxes: what the volume's points stray by more.
    stray_along_sides: f32,
    stray_along_axis: f32,
    /// Path of the volume's farthest point about its centre, and that of the eight, per radius.
    turning: f32,
    turning_per_radius: f32,
}

impl FacingVolumes {
    /// Over `[from, to]`; volumes count as meeting within `margin`, m.
    pub(crate) fn over(
        trees: (&WideTree, &WideTree),
        motion: &RelativeMotion,
        [from, to]: [f64; 2],
        margin: f64,
    ) -> Self {
        let half = 0.5 * (to - from);
        let placement = motion.at(0.5 * (from + to));
        Self::new(
            trees,
            &placement,
            [motion.velocity * half, motion.spin * half],
            margin,
            CONE_WIDENING,
        )
    }

    /// At rest; volumes count as meeting within `margin`, m, and as facing within `tilt`, rad.
    pub(crate) fn still(
        trees: (&WideTree, &WideTree),
        placement: &Placement,
        margin: f64,
        tilt: f64,
    ) -> Self {
        Self::new(
            trees,
            placement,
            [Vector3::zeros(); 2],
            margin,
            tilt + CONE_WIDENING,
        )
    }

    fn new(
        (body, obstacle): (&WideTree, &WideTree),
        placement: &Placement,
        [half_path, half_turn]: [Vector3<f64>; 2],
        margin: f64,
        widening: f64,
    ) -> Self {
        let rotation = &placement.rotation;
        let origin = placement.point(&body.origin).coords;
        let offset = origin - obstacle.origin.coords;
        let angle = half_turn.norm();
        let path = half_path + half_turn.cross(&(origin - placement.center));
        let arm = (origin - placement.center).norm() + body.reach;
        let reach = body.reach + obstacle.reach + offset.norm() + path.norm() + angle * body.reach;
        let bare_stray = 0.5 * angle * angle * arm + LENGTH_ROUNDING * reach;
        let turn = (angle + widening).min(std::f64::consts::PI);
        let to_body = |v: &Vector3<f64>| rotation.tr_mul(v);
        Self {
            rotation: single(rotation),
            rotation_abs: single(&rotation.abs()),
            offset: vector(&offset),
            offset_back: vector(&-to_body(&offset)),
            half_path: [vector(&path), vector(&to_body(&path))],
            half_turn: [vector(&half_turn), vector(&to_body(&half_turn))],
            angle: angle as f32,
            longest_half_sweep: (path.norm() + 2.0 * angle * body.reach) as f32,
            bare_stray: bare_stray as f32,
            stray: (bare_stray + margin) as f32,
            margin: margin as f32,
            turn: [turn.cos() as f32, turn.sin() as f32],
        }
    }

    /// Whether a volume of the body moves by more than `length` (m) in half the interval, to first order.
    #[inline]
    pub(crate) fn sweeps_more_than(&self, length: f32, tree: &WideTree, child: Child) -> bool {
        self.longest_half_sweep > length && {
            let body = tree.volume(child);
            let arm = apply(&self.rotation, &body.center);
            let sweep = sum(&self.half_path[0], &product(&self.half_turn[0], &arm));
            norm(&sweep) + self.angle * body.radius > length
        }
    }

    /// A volume of the body, to be tested against volumes of the obstacle.
    #[inline]
    pub(crate) fn of_body(&self, v: &Volume) -> Against {
        let arm = apply(&self.rotation, &v.center);
        let turned = |d: &[f32; 3]| apply(&self.rotation, d);
        let sweep = sum(&self.half_path[0], &product(&self.half_turn[0], &arm));
        let half = apply(&self.rotation_abs, &v.half);
        Against {
            center: sum(&arm, &self.offset),
            sweep,
            stray_along_sides: self.angle * v.radius,
            stray_along_axis: stray_along_axis(v, &self.half_turn[1]),
            turning: self.angle * v.radius,
            ..self.against(v, turned, half)
        }
    }

    /// A volume of the obstacle, to be tested against volumes of the body.
    #[inline]
    pub(crate) fn of_obstacle(&self, v: &Volume) -> Against {
        let turned = |d: &[f32; 3]| apply_transposed(&self.rotation, d);
        let half = apply_transposed(&self.rotation_abs, &v.half);
        Against {
            center: sum(&turned(&v.center), &self.offset_back),
            sweep: self.half_path[1],
            spin: self.half_turn[1],
            turning_per_radius: self.angle,
            ..self.against(v, turned, half)
        }
    }

    /// What is the same for both, at rest.
    #[inline(always)]
    fn against(
        &self,
        v: &Volume,
        turned: impl Fn(&[f32; 3]) -> [f32; 3],
        half: [f32; 3],
    ) -> Against {
        let (axis, tangent) = (turned(&v.axis), turned(&v.tangent));
        let tangents = [tangent, product(&axis, &tangent)];
        let sides = [
            scaled(&tangents[0], v.along),
            scaled(&tangents[1], v.across),
        ];
        // The box about the axis is the narrower one where the surface runs aslant.
        let thickness = v.middle.abs() + v.slab;
        let aslant = |i: usize| axis[i].abs() * thickness + sides[0][i].abs() + sides[1][i].abs();
        let (cosine, sine) = self.widened(v);
        Against {
            center: [0.0; 3],
            half: [0, 1, 2].map(|i| half[i].min(aslant(i))),
            axis: [-axis[0], -axis[1], -axis[2]],
            tangents,
            sides: [v.along, v.across],
            middle: -v.middle,
            slab: v.slab,
            cosine,
            sine,
            sweep: [0.0; 3],
            spin: [0.0; 3],
            bare_stray: self.bare_stray,
            stray: self.stray,
            margin_aside: self.margin * if cosine > 0.0 { aside(sine) } else { 1.0 },
            margin: self.margin,
            turn: self.turn,
            stray_along_sides: 0.0,
            stray_along_axis: 0.0,
            turning: 0.0,
            turning_per_radius: 0.0,
        }
    }

    /// Cosine and sine of a cone that is widened by the rotation; a cone of all directions stays one.
    #[inline]
    fn widened(&self, v: &Volume) -> (f32, f32) {
        let [cosine, sine] = self.turn;
        let wide = v.sine * cosine + v.cosine * sine;
        if wide > 0.0 {
            (v.cosine * cosine - v.sine * sine, wide)
        } else {
            (-1.0, 0.0)
        }
    }
}

impl Against {
    /// By how much more than the margin each of the eight is apart from this volume at least, m: infinite where they do not face, not above
    /// zero where they may come near. NaN is passed over: what has no other bound is near.
    ///
    /// One loop over the lanes, without branches: the compiler makes vectors of it.
    #[inline]
    fn beyond<const MOVES: bool>(&self, node: &WideNode) -> Lanes {
        let (n, q) = (node, self);
        let mut beyond = Lanes::splat(0.0);
        for k in 0..LANES {
            let c = [n.center[0].0[k], n.center[1].0[k], n.center[2].0[k]];
            let a = [n.axis[0].0[k], n.axis[1].0[k], n.axis[2].0[k]];
            let t = [n.tangent[0].0[k], n.tangent[1].0[k], n.tangent[2].0[k]];
            let b = product(&a, &t);
            let (slab, middle) = (n.slab.0[k], n.middle.0[k]);
            let (along, across) = (n.along.0[k], n.across.0[k]);
            let d = [q.center[0] - c[0], q.center[1] - c[1], q.center[2] - c[2]];
            let cosine = dot(&a, &q.axis);
            let (mut s, mut stray_x, mut stray_a) = ([0.0; 3], q.stray, q.stray);
            if MOVES {
                s = sum(&q.sweep, &product(&q.spin, &c));
                let turning = q.turning_per_radius * n.radius.0[k];
                stray_x += q.stray_along_sides + turning;
                // Seen along an axis, points stray by what the axes' own turn lets them; the axes differ by a chord.
                let chord = ((2.0 - 2.0 * cosine).max(0.0) + CHORD_ROUNDING).sqrt();
                stray_a += q.stray_along_axis
                    + dot(&q.spin, &b).abs() * along
                    + dot(&q.spin, &t).abs() * across
                    + chord * (q.turning + turning);
            }
            // Along the sides of the boxes.
            let off_x = d[0].abs() - (n.half[0].0[k] + q.half[0] + s[0].abs() + stray_x);
            let off_y = d[1].abs() - (n.half[1].0[k] + q.half[1] + s[1].abs() + stray_x);
            let off_z = d[2].abs() - (n.half[2].0[k] + q.half[2] + s[2].abs() + stray_x);
            // Along the axes of the eight, and along that of the one.
            let slant = cosine.abs();
            let height = dot(&a, &d) + cosine * q.middle - middle;
            let [u, v] = &q.tangents;
            let (on_u, on_v) = (dot(&a, u).abs(), dot(&a, v).abs());
            let sides = on_u * q.sides[0] + on_v * q.sides[1];
            let extent = slab + slant * q.slab + sides + dot(&a, &s).abs();
            let off_a = height.abs() - extent - stray_a;
            let behind_a = -height - extent - q.bare_stray;
            let height = dot(&q.axis, &d) + q.middle - cosine * middle;
            let (up_t, up_b) = (dot(&q.axis, &t), dot(&q.axis, &b));
            let sides = up_t.abs() * along + up_b.abs() * across;
            let extent = q.slab + slant * slab + sides + dot(&q.axis, &s).abs();
            let off_b = height.abs() - extent - stray_a;
            let behind_b = -height - extent - q.bare_stray;
            // Cones: the sum of two angles is above pi where its sine is not above zero.
            let [cos, sin] = [n.cosine.0[k], n.sine.0[k]];
            let narrow = sin * q.cosine + cos * q.sine > 0.0;
            let away = cosine < cos * q.cosine - sin * q.sine - COSINE_ROUNDING;
            let mut off = larger(larger(off_x, off_y), larger(off_z, larger(off_a, off_b)));
            let mut apart = narrow & away;
            if !MOVES {
                // What faces lies along a normal: in front, and as little aside as the cone is narrow.
                let [cos_w, sin_w] = q.turn;
                let (cos, sin) = (cos * cos_w - sin * sin_w, sin * cos_w + cos * sin_w);
                let narrow_a = (cos > 0.0) & (sin >= 0.0);
                let narrow_b = q.cosine > 0.0;
                apart |= (narrow_a & (behind_a > 0.0)) | (narrow_b & (behind_b > 0.0));
                let margin_a = q.margin * if narrow_a { aside(sin) } else { 1.0 };
                let (tu, tv, bu, bv) = (
                    dot(&t, u).abs(),
                    dot(&t, v).abs(),
                    dot(&b, u).abs(),
                    dot(&b, v).abs(),
                );
                let lateral_t = (dot(&t, &d) + up_t * q.middle).abs()
                    - (along + up_t.abs() * q.slab + tu * q.sides[0] + tv * q.sides[1])
                    - q.bare_stray;
                let lateral_b = (dot(&b, &d) + up_b * q.middle).abs()
                    - (across + up_b.abs() * q.slab + bu * q.sides[0] + bv * q.sides[1])
                    - q.bare_stray;
                let lateral_u = (dot(u, &d) - dot(&a, u) * middle).abs()
                    - (q.sides[0] + on_u * slab + tu * along + bu * across)
                    - q.bare_stray;
                let lateral_v = (dot(v, &d) - dot(&a, v) * middle).abs()
                    - (q.sides[1] + on_v * slab + tv * along + bv * across)
                    - q.bare_stray;
                let of_a = larger(lateral_t, lateral_b);
                let of_b = larger(lateral_u, lateral_v);
                apart |= (of_a > margin_a) | (of_b > q.margin_aside);
                off = larger(off, larger(of_a, of_b) - q.margin);
            }
            beyond.0[k] = if apart { f32::INFINITY } else { off };
        }
        beyond
    }
}

/// The share of a distance that may lie across the axis of a cone whose sine this is.
#[inline(always)]
fn aside(sine: f32) -> f32 {
    let share = sine + FOOT_SHARE;
    if share < 1.0 { share } else { 1.0 }
}

/// Which lanes are not beyond the margin: a bit each.
#[inline(always)]
fn near(beyond: &Lanes) -> u32 {
    let mut mask = 0;
    for (k, lane) in beyond.0.iter().enumerate() {
        let off = *lane > 0.0; // false for NaN
        mask |= u32::from(!off) << k;
    }
    mask
}

/// The larger of two; the second if the first is NaN.
#[inline(always)]
fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// What the points of a volume stray by from its centre along its axis while they turn, the turn in the mesh's axes.
#[inline(always)]
fn stray_along_axis(v: &Volume, turn: &[f32; 3]) -> f32 {
    let across = product(&v.axis, &v.tangent);
    dot(turn, &across).abs() * v.along + dot(turn, &v.tangent).abs() * v.across
}

/// Calls `visit` for every pair of triangles, (body, obstacle), whose volumes may come near and face each other all the way
/// down; stops when it returns false. Pairs of volumes that own features `wanted` refuses, (body, obstacle), are not opened.
pub(crate) fn for_facing_triangle_pairs(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    stack: &mut Vec<(Child, Child)>,
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    mut visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    stack.clear();
    stack.push((ROOT, ROOT));
    while let Some((a, b)) = stack.pop() {
        if let (Below::Triangle(t), Below::Triangle(s)) = (body.below(a), obstacle.below(b)) {
            work.triangle_pairs += 1;
            if !visit(t, s, work) {
                return;
            }
            continue;
        }
        work.node_pairs += 1;
        open_pair::<false>((body, obstacle), volumes, (a, b), |(a, b)| {
            if wanted(body.owned(a), obstacle.owned(b)) {
                stack.push((a, b));
            }
        });
    }
}

/// Opens the thicker of two volumes that are not both triangles, and hands on its children that face the other.
#[inline]
pub(crate) fn open_pair<const MOVES: bool>(
    trees: (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    pair: (Child, Child),
    mut found: impl FnMut((Child, Child)),
) {
    open_pair_with::<MOVES>(trees, volumes, pair, |pair, _| found(pair));
}

/// The same; each child comes with how much farther than the margin it is apart at least, m: not above zero.
#[inline]
pub(super) fn open_pair_with<const MOVES: bool>(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    (a, b): (Child, Child),
    mut found: impl FnMut((Child, Child), f32),
) {
    match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), below)
            if matches!(below, Below::Triangle(_)) || body.thickness(a) > obstacle.thickness(b) =>
        {
            let against = volumes.of_obstacle(obstacle.volume(b));
            let beyond = against.beyond::<MOVES>(body.node(node));
            for_each_child(node, &beyond, |child, beyond| found((child, b), beyond));
        }
        (_, Below::Node(node)) => {
            let against = volumes.of_body(body.volume(a));
            let beyond = against.beyond::<MOVES>(obstacle.node(node));
            for_each_child(node, &beyond, |child, beyond| found((a, child), beyond));
        }
        (_, Below::Triangle(_)) => found((a, b), 0.0),
    }
}

#[inline(always)]
fn for_each_child(node: u32, beyond: &Lanes, mut each: impl FnMut(Child, f32)) {
    let mut mask = near(beyond);
    while mask != 0 {
        let lane = mask.trailing_zeros();
        each(node * LANES as u32 + lane, beyond.0[lane as usize]);
        mask &= mask - 1;
    }
}

fn single(m: &Matrix3<f64>) -> [[f32; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[(i, j)] as f32))
}

fn vector(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

#[inline(always)]
fn apply(m: &[[f32; 3]; 3], v: &[f32; 3]) -> [f32; 3] {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline(always)]
fn apply_transposed(m: &[[f32; 3]; 3], v: &[f32; 3]) -> [f32; 3] {
    [
        m[0][0] * v[0] + m[1][0] * v[1] + m[2][0] * v[2],
        m[0][1] * v[0] + m[1][1] * v[1] + m[2][1] * v[2],
        m[0][2] * v[0] + m[1][2] * v[1] + m[2][2] * v[2],
    ]
}

#[inline(always)]
fn scaled(v: &[f32; 3], length: f32) -> [f32; 3] {
    [v[0] * length, v[1] * length, v[2] * length]
}

#[inline(always)]
fn sum(v: &[f32; 3], w: &[f32; 3]) -> [f32; 3] {
    [v[0] + w[0], v[1] + w[1], v[2] + w[2]]
}

#[inline(always)]
fn product(v: &[f32; 3], w: &[f32; 3]) -> [f32; 3] {
    [
        v[1] * w[2] - v[2] * w[1],
        v[2] * w[0] - v[0] * w[2],
        v[0] * w[1] - v[1] * w[0],
    ]
}

#[inline(always)]
fn dot(v: &[f32; 3], w: &[f32; 3]) -> f32 {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

#[inline(always)]
fn norm(v: &[f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}
