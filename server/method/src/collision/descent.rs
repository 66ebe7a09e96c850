//! Descent of two wide trees together: the thicker of two volumes is opened, and those of its eight that may come near go on.

use super::beyond::beyond;
use super::facing_volumes::{FacingVolumes, Side};
use super::turned::TurnedNodes;
use super::windows::{Window, windows};
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
        open_pair(trees, volumes, turned, (a, b), |(a, b), _| {
            if wanted(body.owned(a), obstacle.owned(b)) {
                stack.push((a, b));
            }
        });
    }
}

/// Opens the thicker of two volumes at rest that are not both triangles, and hands on its children that face the other: with how much farther
/// than the margin they are apart at least, m, not above zero.
#[inline]
pub(super) fn open_pair(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
    mut found: impl FnMut((Child, Child), f32),
) {
    match opened((body, obstacle), (a, b)) {
        Some((Side::Body, node)) => {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            let beyond = beyond(volumes, one, b as usize % LANES, body.node(node));
            for_each_lane(near(&beyond), |lane| {
                found(
                    (node * LANES as u32 + lane, b),
                    beyond.0[lane as usize % LANES],
                );
            });
        }
        Some((Side::Obstacle, node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            let beyond = beyond(volumes, one, a as usize % LANES, obstacle.node(node));
            for_each_lane(near(&beyond), |lane| {
                found(
                    (a, node * LANES as u32 + lane),
                    beyond.0[lane as usize % LANES],
                );
            });
        }
        None => found((a, b), 0.0),
    }
}

/// The same of volumes in motion: hands on the children that come near the other in a window of their interval, and when they do.
#[inline]
pub(super) fn open_moving_pair<const TIMED: bool>(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
    window: Window,
    mut found: impl FnMut((Child, Child), Window),
) {
    match opened((body, obstacle), (a, b)) {
        Some((Side::Body, node)) => {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            let lane = b as usize % LANES;
            let met = windows::<false, TIMED>(volumes, one, lane, body.node(node), window);
            for_each_lane(met.meeting(), |lane| {
                found((node * LANES as u32 + lane, b), met.of(lane));
            });
        }
        Some((Side::Obstacle, node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            let lane = a as usize % LANES;
            let met = windows::<true, TIMED>(volumes, one, lane, obstacle.node(node), window);
            for_each_lane(met.meeting(), |lane| {
                found((a, node * LANES as u32 + lane), met.of(lane));
            });
        }
        None => found((a, b), window),
    }
}

/// Which of two volumes is to be opened, and the node below it; `None` for two triangles.
#[inline(always)]
fn opened((body, obstacle): (&WideTree, &WideTree), (a, b): (Child, Child)) -> Option<(Side, u32)> {
    match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), Below::Triangle(_)) => Some((Side::Body, node)),
        (Below::Node(node), _) if body.thickness(a) > obstacle.thickness(b) => {
            Some((Side::Body, node))
        }
        (_, Below::Node(node)) => Some((Side::Obstacle, node)),
        (Below::Triangle(_), Below::Triangle(_)) => None,
    }
}

#[inline(always)]
fn for_each_lane(mut mask: u32, mut each: impl FnMut(u32)) {
    while mask != 0 {
        each(mask.trailing_zeros());
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
