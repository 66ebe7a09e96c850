//! Descent of two wide trees together: the thicker of two volumes is opened, and those of its eight that may come near go on.

use super::beyond::{NOTHING, THE_EIGHT, THE_ONE, beyond};
use super::facing_volumes::{FacingVolumes, Side};
use super::turned::TurnedNodes;
use super::work::Work;
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_tree::{Below, Child, ROOT, WideTree};

/// Pairs that a descent holds: each level of either tree adds seven, and there are fewer levels than in the binary trees.
pub(crate) const WIDE_STACK_CAPACITY: usize = 2 * (LANES - 1) * crate::geometry::MAX_DEPTH + 1;

/// Calls `visit` for every pair of triangles, (body, obstacle), whose volumes may come near and face each other all the way
/// down; stops when it returns false. Pairs of volumes that own features `wanted` refuses, (body, obstacle), are not opened.
pub(crate) fn for_facing_triangle_pairs(
    trees: (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    (stack, turned): (&mut Vec<(Child, Child)>, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    mut visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    let (body, obstacle) = trees;
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
        open_pair::<false>(trees, volumes, turned, (a, b), |(a, b), _| {
            if wanted(body.owned(a), obstacle.owned(b)) {
                stack.push((a, b));
            }
        });
    }
}

/// Opens the thicker of two volumes that are not both triangles, and hands on its children that face the other: with how much farther
/// than the margin they are apart at least, m, not above zero.
#[inline]
pub(super) fn open_pair<const MOVES: bool>(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
    mut found: impl FnMut((Child, Child), f32),
) {
    match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), below)
            if matches!(below, Below::Triangle(_)) || body.thickness(a) > obstacle.thickness(b) =>
        {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            let (lane, eight) = (b as usize % LANES, body.node(node));
            let beyond = if MOVES {
                beyond::<THE_EIGHT>(volumes, one, lane, eight)
            } else {
                beyond::<NOTHING>(volumes, one, lane, eight)
            };
            for_each_child(node, &beyond, |child, beyond| found((child, b), beyond));
        }
        (_, Below::Node(node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            let (lane, eight) = (a as usize % LANES, obstacle.node(node));
            let beyond = if MOVES {
                beyond::<THE_ONE>(volumes, one, lane, eight)
            } else {
                beyond::<NOTHING>(volumes, one, lane, eight)
            };
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
        each(node * LANES as u32 + lane, beyond.0[lane as usize % LANES]);
        mask &= mask - 1;
    }
}

/// Which lanes are not beyond the margin: a bit each.
#[inline(always)]
fn near(beyond: &Lanes) -> u32 {
    let mut bits = [0_u32; LANES];
    for (k, (bit, lane)) in bits.iter_mut().zip(&beyond.0).enumerate() {
        let off = *lane > 0.0; // false for NaN
        *bit = if off { 0 } else { 1 << k };
    }
    bits.iter().fold(0, |mask, bit| mask | bit)
}
