//! What wrenches the strings of one pose can render: the nearest one, and the largest along a direction.
//!
//! Z is the set of scaled wrenches `A t` within the bounds, see [`crate::tension`]. It is convex, so the way from its nearest point to a
//! target outside is the normal of a plane that Z lies behind.

use crate::STRINGS;
use crate::box_program::{Bounds, BoxAnswer, BoxProgram, Side};

/// Most cutting planes of one search for the scale.
const MAX_CUTS: u32 = 12;
/// A wrench is in Z if it is this near, relative to itself. Small, because tensions near the edge of Z may change two hundred
/// times as much as the wrench.
const RELATIVE_NEARNESS: f64 = 1e-6;
/// The same, absolute, N: above what the regularisation adds, a thousandth of what a finger feels.
pub(crate) const NEARNESS: f64 = 2e-5;
/// What a search along a ray leaves for the next one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub(crate) sides: [Side; STRINGS],
    /// Normal of the last cutting plane, of any length.
    normal: [f64; 6],
}

impl Ray {
    pub(crate) const UNKNOWN: Self = Self {
        sides: [Side::Lower; STRINGS],
        normal: [0.0; 6],
    };
}

/// One pose's problem.
pub(crate) struct Search {
    pub(crate) program: BoxProgram,
    pub(crate) bounds: Bounds,
    pub(crate) factorisations: u32,
}

impl Search {
    /// The nearest point of Z to `target`, with the lowest tensions that render it. `sides` is a guess and becomes the answer's.
    pub(crate) fn nearest(&mut self, target: &[f64; 6], sides: &mut [Side; STRINGS]) -> BoxAnswer {
        let found = self
            .program
            .solve(target, &self.bounds.lower, &self.bounds, sides);
        self.factorisations += found.factorisations;
        if found.solved {
            *sides = found.sides;
        }
        found
    }

    /// The largest alpha in [0, 1] with `alpha f` in Z; `None` if the ray misses Z. `ray` only saves time.
    ///
    /// Never less than the true one: `n . z <= support(n)` on Z for every n, exact or not, so that each cut is valid.
    pub(crate) fn largest_scale(&mut self, f: &[f64; 6], ray: &mut Ray) -> Option<f64> {
        // The last search's normal is a good first cut.
        let first = self.support(&ray.normal) / dot(&ray.normal, f);
        let cuts = dot(&ray.normal, f) > 0.0 && (0.0..1.0).contains(&first);
        let mut alpha = if cuts { first } else { 1.0 };
        for _ in 0..MAX_CUTS {
            let target = f.map(|f| alpha * f);
            let found = self.nearest(&target, &mut ray.sides);
            let normal: [f64; 6] = std::array::from_fn(|k| target[k] - found.image[k]);
            if norm(&normal) <= nearness(&target) {
                break;
            }
            let (along, support) = (dot(&normal, f), self.support(&normal));
            let separated = alpha * along > support; // false for NaN
            if !separated {
                break; // what is left is rounding
            }
            if along <= 0.0 || support < 0.0 {
                return None;
            }
            ray.normal = normal;
            alpha = support / along;
        }
        Some(alpha)
    }

    /// The largest `n . z` over z in Z.
    fn support(&self, normal: &[f64; 6]) -> f64 {
        (0..STRINGS)
            .map(|i| {
                let along = self.program.along(normal, i);
                (along * self.bounds.lower[i]).max(along * self.bounds.upper[i])
            })
            .sum()
    }
}

/// How near a wrench must be to count as one of Z, N.
pub(crate) fn nearness(f: &[f64; 6]) -> f64 {
    NEARNESS + RELATIVE_NEARNESS * norm(f)
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (0..6).map(|k| a[k] * b[k]).sum()
}

pub(crate) fn norm(f: &[f64; 6]) -> f64 {
    dot(f, f).sqrt()
}

pub(crate) fn distance(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    (0..6)
        .map(|k| (a[k] - b[k]) * (a[k] - b[k]))
        .sum::<f64>()
        .sqrt()
}
