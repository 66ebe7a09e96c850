//! Pairs of volumes in the order of how far motions leave them apart: what is violated first, the deepest before all.

use super::bands::{BANDS, Bands, ByBand, OUT_OF_QUESTION, Order, band_of};
use super::beyond::Beyond;
use super::descent::Opened;
use super::displacements::Motions;
use super::facing_volumes::{FacingVolumes, Side};
use super::single::larger;
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

/// Calls `visit` for the pairs of triangles, (body, obstacle), within `margin`, m, that some of the motions may bring below `target`, m: those first that
/// end up deepest, to a band. Pairs nearer than `known_within` (m) are known: only what may bring one below the target that is as far apart is looked
/// at. The motions are given as the body and as the obstacle sees them. Stops when `visit` returns false, and where there is no room for pairs of
/// volumes that wait.
pub(crate) fn for_deepest_triangle_pairs(
    trees: (&WideTree, &WideTree),
    (volumes, margin): (&FacingVolumes, f64),
    (motions, known_within, target): ([&Motions; 2], f32, f32),
    (bands, turned): (&mut Bands, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    let order = Deepest {
        body: Along::of(motions[0], trees.0),
        obstacle: Along::of(motions[1], trees.1),
        margin: margin as f32,
        known_within: known_within * (1.0 - KNOWN_ROUNDING),
        target,
    };
    volumes.processor.dispatch(ByBand {
        trees,
        volumes,
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
    nodes: [u32; KEPT],
    least: [Lanes; KEPT],
}

impl<'a> Along<'a> {
    fn of(motions: &'a Motions, tree: &'a WideTree) -> Self {
        Self {
            motions,
            tree,
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
            self.least[place] = self.motions.least_along(self.tree.node(node));
        }
        &self.least[place]
    }
}

impl Order for Deepest<'_> {
    #[inline(always)]
    fn bands(&mut self, opened: &Opened<Beyond>) -> [u32; LANES] {
        let (eight, one) = match opened.side {
            Side::Body => (&mut self.body, &mut self.obstacle),
            Side::Obstacle => (&mut self.obstacle, &mut self.body),
        };
        let of_eight = eight.least(opened.first);
        let of_one = one.least(opened.other).0[opened.other as usize % LANES];
        let (margin, known_within, scale) = (self.margin, self.known_within, 1.0 / self.margin);
        let mut bands = [0; LANES];
        for (k, band) in bands.iter_mut().enumerate() {
            let gap = larger(margin + opened.found.by.0[k], known_within);
            let short = gap + larger(of_one, of_eight.0[k]) - self.target;
            let signed = signed_band_of(short * scale);
            let out_of_question = short > 0.0; // false for NaN
            *band = if out_of_question {
                OUT_OF_QUESTION
            } else {
                signed
            };
        }
        bands
    }
}
