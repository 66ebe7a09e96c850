//! Motions along which bodies are known to be apart, from one search to the next.
//!
//! A search that begins where the last one ended need not look again whether the surfaces cross.

use arrayvec::ArrayVec;

use super::motion::{Placement, RelativeMotion};

/// Motions remembered: one for each obstacle of a scene with no more, the latest otherwise.
const MAX_MOTIONS: usize = 16;
/// A body that is off a known place by less than this share of the gap there is apart, too.
const SHARE_OF_GAP: f64 = 0.5;

/// The latest motions, newest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownApart {
    motions: ArrayVec<Known, MAX_MOTIONS>,
}

#[derive(Clone, Copy, Debug)]
struct Known {
    /// Identities of body and obstacle.
    key: [u64; 2],
    motion: RelativeMotion,
    /// Up to here the bodies are apart by `gap`, m.
    until: f64,
    gap: f64,
}

impl KnownApart {
    /// Remembers that two meshes stay apart by `gap`, m, up to the time `until`.
    pub(super) fn remember(
        &mut self,
        key: [u64; 2],
        motion: &RelativeMotion,
        until: f64,
        gap: f64,
    ) {
        let same = self.motions.iter().position(|m| m.key == key);
        if let Some(index) = same.or(self.motions.is_full().then_some(MAX_MOTIONS - 1)) {
            self.motions.remove(index);
        }
        let motion = *motion;
        self.motions.insert(
            0,
            Known {
                key,
                motion,
                until,
                gap,
            },
        );
    }

    /// Whether the meshes are known to be apart with the body there; `radius` bounds the distance of its points from G, m.
    pub(super) fn knows(&self, key: [u64; 2], body: &Placement, radius: f64) -> bool {
        self.motions.iter().any(|known| {
            known.key == key && {
                let times = [known.until, known.motion.time_nearest(body), 0.0];
                times.iter().any(|time| {
                    let off = known
                        .motion
                        .at(time.clamp(0.0, known.until))
                        .distance_to(body, radius);
                    off < SHARE_OF_GAP * known.gap // false for NaN
                })
            }
        })
    }
}
