//! Pairs of volumes in the order of how far apart they are at least: nearest first, to a band.
//!
//! | symbol | name in code | unit | meaning                                                                     |
//! |--------|--------------|------|-----------------------------------------------------------------------------|
//! | D      | `margin`     | m    | pairs farther apart than this are of no interest                            |
//! | d      |              | m    | least distance of a pair of volumes, by separating axes; 0 where they overlap |
//! | k      | `band`       | –    | 0 for d below `D / 2^(K - 1)`; each band after that ends at twice the distance |
//!
//! A search that is given up has then looked at every pair of triangles nearer than the lower edge of its band. What lies below a
//! volume is no nearer than the volume: it goes into its band or a later one.

use pulp::{Simd, WithSimd};

use super::beyond::Beyond;
use super::buckets::Buckets;
use super::descent::{AT_ONCE, AtRest, Opened, open};
use super::still_pair::StillPair;
use super::turned::TurnedNodes;
use super::work::Work;
use crate::geometry::lanes::LANES;
use crate::geometry::wide_tree::{Below, Child, ROOT};

/// Number of bands, K. The first is a two-thousandth of the margin wide. More of them would leave the trees' nodes in an order that the cache
/// does not like.
pub(super) const BANDS: usize = 12;
/// Pairs that wait at a time. One that finds no room ends the search there.
const CAPACITY: usize = 1 << 15;
/// Share of a band's edge that single precision may have got wrong.
const EDGE_ROUNDING: f64 = 1e-5;
/// Bands of a search by clearance: as many for what is violated, the deepest first.
const SIGNED_BANDS: usize = 2 * BANDS;
/// The band of what is left out.
pub(super) const OUT_OF_QUESTION: u32 = SIGNED_BANDS as u32;

/// Pairs of volumes that wait, by band.
pub(crate) type Bands = Buckets<(Child, Child), 1, CAPACITY>;

/// The distance from which on band `band` begins, m: no more than that.
fn edge(band: usize, margin: f64) -> f64 {
    if band == 0 {
        return 0.0;
    }
    margin * (1.0 - EDGE_ROUNDING) / f64::from(1_u32 << (BANDS - band))
}

/// The band of a share `d / D`; NaN is near. Without branches: the compiler makes vectors of eight.
#[inline(always)]
pub(super) fn band_of(share: f32) -> u32 {
    const LAST: u32 = BANDS as u32 - 1;
    // The exponent of the number says how often the margin is halved.
    let exponent = share.max(f32::MIN_POSITIVE).to_bits() >> 23;
    let band = exponent.max(126 - LAST) - (126 - LAST);
    band.min(LAST)
}

/// Calls `visit` for the pairs of triangles, (body, obstacle), whose volumes may come within the margin and face each other all the way down,
/// nearest first to a band; stops when it returns false. Pairs of volumes that own features `wanted` refuses are not opened.
///
/// Returns the distance, m, within which every such pair was visited: the margin unless stopped.
pub(crate) fn for_nearest_triangle_pairs(
    still: &StillPair<'_>,
    (bands, turned): (&mut Bands, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    visit: impl FnMut(u32, u32, &mut Work) -> bool,
) -> f64 {
    let order = Nearest {
        scale: (1.0 / still.margin) as f32,
    };
    let stopped_in = still.volumes.processor.dispatch(ByBand {
        still,
        bands,
        turned,
        work,
        wanted,
        order,
        visit,
    });
    stopped_in.map_or(still.margin, |band| edge(band, still.margin))
}

/// In which band each pair of volumes is that was opened; [`OUT_OF_QUESTION`] leaves a pair out. No closure: it is to be compiled with the vectors of the
/// search that it is part of.
pub(super) trait Order {
    fn bands(&mut self, opened: &Opened<Beyond>) -> [u32; LANES];

    /// In which band one pair is that is apart by so much more than the margin, m, which says more than the volumes do.
    fn band(&mut self, pair: (Child, Child), by: f32) -> u32;
}

/// A search that visits pairs of triangles in the order of their bands. The answer is the band in which it ended because `visit` returned false or there was no room.
pub(super) struct ByBand<'a, W, O, V> {
    pub(super) still: &'a StillPair<'a>,
    pub(super) bands: &'a mut Bands,
    pub(super) turned: &'a mut TurnedNodes,
    pub(super) work: &'a mut Work,
    pub(super) wanted: W,
    pub(super) order: O,
    pub(super) visit: V,
}

/// The whole search with the vectors that the processor has: a call for each pair of volumes would cost as much as what it tells.
impl<W, O, V> WithSimd for ByBand<'_, W, O, V>
where
    W: Fn(u8, u8) -> bool,
    O: Order,
    V: FnMut(u32, u32, &mut Work) -> bool,
{
    type Output = Option<usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<usize> {
        let Self {
            still,
            bands,
            turned,
            work,
            wanted,
            mut order,
            mut visit,
        } = self;
        let (trees, volumes) = (still.trees, &still.volumes);
        let (body, obstacle) = trees;
        bands.clear();
        let mut room = bands.push(0, (ROOT, ROOT));
        let mut opened = [(Opened::nothing(Beyond::NONE), [OUT_OF_QUESTION; LANES]); AT_ONCE];
        loop {
            // Of one band.
            let (mut band, mut count) = (SIGNED_BANDS, 0);
            while count < AT_ONCE
                && let Some((earliest, (a, b))) = bands.pop(band)
            {
                band = earliest;
                // Not before its turn: most that wait never have one.
                if !wanted(body.owned(a), obstacle.owned(b)) {
                    continue;
                }
                if let Some(by) = still.beyond_primitive((a, b)) {
                    let own = order.band((a, b), by as f32) as usize;
                    if own > band {
                        // Out of the question, or later.
                        room &= own >= SIGNED_BANDS || bands.push(own, (a, b));
                        continue;
                    }
                }
                if let (Below::Triangle(t), Below::Triangle(s)) = (body.below(a), obstacle.below(b))
                {
                    work.triangle_pairs += 1;
                    if !visit(t, s, work) {
                        return Some(band);
                    }
                    continue;
                }
                work.node_pairs += 1;
                let (pair, own) = &mut opened[count];
                *pair = open(&AtRest, trees, volumes, turned, (a, b));
                *own = order.bands(pair);
                count += 1;
            }
            if band == SIGNED_BANDS {
                return None;
            }
            // Turned round, so that what was opened first is gone on with first. Across a band instead of down into it, a search that is given up ends
            // with leaves all over the surface: forces between conforming parts were then off by up to 27 instead of 4 %.
            for (pair, own) in opened[..count].iter().rev() {
                pair.for_each(pair.found.near, |pair, lane| {
                    let own = own[lane as usize % LANES] as usize;
                    if own < SIGNED_BANDS {
                        room &= bands.push(own.max(band), pair);
                    }
                });
            }
            if !room {
                return Some(band);
            }
        }
    }
}

/// By how far apart they are at least.
struct Nearest {
    /// One over the margin, 1/m.
    scale: f32,
}

impl Order for Nearest {
    #[inline(always)]
    fn band(&mut self, _: (Child, Child), by: f32) -> u32 {
        if by > 0.0 {
            OUT_OF_QUESTION
        } else {
            band_of(1.0 + by * self.scale) // near for NaN
        }
    }

    #[inline(always)]
    fn bands(&mut self, opened: &Opened<Beyond>) -> [u32; LANES] {
        let mut bands = [0; LANES];
        for (k, band) in bands.iter_mut().enumerate() {
            *band = band_of(1.0 + opened.found.by.0[k] * self.scale);
        }
        bands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_begin_at_touch_and_end_at_the_margin() {
        assert_eq!(edge(0, 2.0), 0.0);
        assert!(edge(BANDS, 2.0) < 2.0 && edge(BANDS, 2.0) > 1.9999);
        for share in [0.0, 1e-9, 1e-4, 0.1, 0.25, 0.499, 0.5, 0.99, -1.0, f32::NAN] {
            let band = band_of(share) as usize;
            let d = f64::from(share.max(0.0)) * 2.0;
            assert!(edge(band, 2.0) <= d && band < BANDS, "{share}");
            assert!(
                band + 1 == BANDS || d < edge(band + 1, 2.0) * 1.001,
                "{share}"
            );
        }
    }
}
