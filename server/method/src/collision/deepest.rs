//! Pairs of volumes in the order of how far motions leave them apart: what is violated first, the deepest before all.

use super::bands::{BANDS, Bands, ByBand, OUT_OF_QUESTION, Order, band_of};
use super::beyond::Beyond;
use super::descent::Opened;
use super::displacements::Motions;
use super::facing_volumes::Side;
use super::single::larger;
use super::still_pair::StillPair;
use super::turned::TurnedNodes;
use super::work::Work;
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_tree::{Child, WideTree};

/// Nodes of each tree of which it is kept what the motions do there.
const KEPT: usize = 256;
/// Share of a known distance that single precision may have got wrong.
const KNOWN_ROUNDING: f32 = 1e-5;
/// Marks a place where none is kept.
const NO_NODE: u32 = u32::MAX;

/// The band of a signed share: what is deepest comes first, what is farthest last. Without branches, as [`band_of`].
#[inline(always)]
fn signed_band_of(share: f32) -> u32 {
    const ALL: u32 = BANDS as u32;
    let band = band_of(share.abs());
    if share < 0.0 {
        ALL - 1 - band
    } else {
        ALL + band
    }
}

/// Calls `visit` for the pairs of triangles, (body, obstacle), within the margin that some of the motions may bring below `target`, m: those first that
/// end up deepest, to a band. Pairs nearer than `known_within` (m) are known: only what may bring one below the target that is as far apart is looked
/// at. The motions are given as the body and as the obstacle sees them. Stops when `visit` returns false, and where there is no room for pairs of
/// volumes that wait.
pub(crate) fn for_deepest_triangle_pairs(
    still: &StillPair<'_>,
    (motions, known_within, target): ([&Motions; 2], f32, f32),
    (bands, turned): (&mut Bands, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    let order = Deepest {
        body: Along::of(motions[0], still.trees.0, still.endless[0]),
        obstacle: Along::of(motions[1], still.trees.1, still.endless[1]),
        margin: still.margin as f32,
        known_within: known_within * (1.0 - KNOWN_ROUNDING),
        target,
    };
    still.volumes.processor.dispatch(ByBand {
        still,
        bands,
        turned,
        work,
        wanted,
        order,
        visit,
    });
}

/// By how far motions leave them apart at least.
struct Deepest<'a> {
    body: Along<'a>,
    obstacle: Along<'a>,
    /// m.
    margin: f32,
    known_within: f32,
    target: f32,
}

/// What motions do along the normals of one tree's volumes, as that tree sees them. A node is met again and again: the last ones are kept.
struct Along<'a> {
    motions: &'a Motions,
    tree: &'a WideTree,
    /// No ball holds what the tree's volume holds.
    endless: bool,
    nodes: [u32; KEPT],
    least: [Lanes; KEPT],
}

impl<'a> Along<'a> {
    fn of(motions: &'a Motions, tree: &'a WideTree, endless: bool) -> Self {
        Self {
            motions,
            tree,
            endless,
            nodes: [NO_NODE; KEPT],
            least: [Lanes::splat(0.0); KEPT],
        }
    }

    /// The least for each volume of the node that holds `child`, m.
    #[inline(always)]
    fn least(&mut self, child: Child) -> &Lanes {
        let node = child / LANES as u32;
        let place = node as usize % KEPT;
        if self.nodes[place] != node {
            self.nodes[place] = node;
            self.least[place] = if self.endless {
                Lanes::splat(f32::NEG_INFINITY)
            } else {
                self.motions.least_along(self.tree.node(node))
            };
        }
        &self.least[place]
    }
}

impl Deepest<'_> {
    /// The band of a pair that is apart by so much more than the margin, where the motions carry either's volume by these along its normals at least, m.
    #[inline(always)]
    fn band_of(&self, by: f32, [of_one, of_other]: [f32; 2]) -> u32 {
        let gap = larger(self.margin + by, self.known_within);
        let short = gap + larger(of_one, of_other) - self.target;
        let signed = signed_band_of(short * (1.0 / self.margin));
        if short > 0.0 { OUT_OF_QUESTION } else { signed } // in question for NaN
    }
}

impl Order for Deepest<'_> {
    #[inline(always)]
    fn band(&mut self, (a, b): (Child, Child), by: f32) -> u32 {
        if by > 0.0 {
            return OUT_OF_QUESTION;
        }
        let of_body = self.body.least(a).0[a as usize % LANES];
        let of_obstacle = self.obstacle.least(b).0[b as usize % LANES];
        self.band_of(by, [of_body, of_obstacle])
    }

    #[inline(always)]
    fn bands(&mut self, opened: &Opened<Beyond>) -> [u32; LANES] {
        let (eight, one) = match opened.side {
            Side::Body => (&mut self.body, &mut self.obstacle),
            Side::Obstacle => (&mut self.obstacle, &mut self.body),
        };
        let of_eight = *eight.least(opened.first);
        let of_one = one.least(opened.other).0[opened.other as usize % LANES];
        let mut bands = [0; LANES];
        for (k, band) in bands.iter_mut().enumerate() {
            *band = self.band_of(opened.found.by.0[k], [of_one, of_eight.0[k]]);
        }
        bands
    }
}
