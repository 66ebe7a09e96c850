//! Constraint adaptation: a violated new constraint enters gradually, so that the force does not jump.
//!
//! | symbol    | name in code            | unit | meaning                                                  |
//! |-----------|-------------------------|------|----------------------------------------------------------|
//! | d_k       | `violation_at_entry`    | m    | `J_k (a_u + c)` when the constraint first appeared       |
//! | c         | `Coupling::correction`  | m, rad | `a_c - a_u` of the step before: zero without contact   |
//! | b_k       | `bound`                 | m    | where the constraint belongs                             |
//! | f_k(t)    | [`Ramp::bound`]         | m    | bound in force at time t, rising from d_k to b_k         |
//! | Delta-t   | `Adaptation::duration`  | s    | time of the rise                                         |
//! | epsilon   | `Adaptation::threshold` | m    | only `d_k - b_k <= k_s epsilon` is smoothed              |
//!
//! A constraint that is known by its features keeps its progress when the set is replaced. The paper enters from `J_k a_u`, so that a
//! body that slides from one triangle to the next loses its force for Delta-t, although nothing is new but the features; c
//! enters from what the force of the step before already upholds. The paper compares what is left of the way after the share k_s; here epsilon is the
//! depth of the device, so that the force at which a constraint is let in does not depend on k_s.
//! Source: Ortega et al. 2007, Section 5, Figure 6.

use crate::known_rows::KnownRows;
use crate::settings::Adaptation;

/// One constraint on its way in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ramp {
    row: u32,
    violation_at_entry: f64,
    start: f64,
}

impl Ramp {
    /// The bound in force at `time`, on the way to `bound`; `None` on arrival.
    fn bound(&self, time: f64, duration: f64, bound: f64) -> Option<f64> {
        let progress = ((time - self.start) / duration).clamp(0.0, 1.0);
        let on_its_way = progress < 1.0; // false for NaN: a broken clock lets the constraint in at once
        let entering = self.violation_at_entry + (bound - self.violation_at_entry) * progress;
        on_its_way.then(|| entering.min(bound))
    }
}

/// Which constraints are still on their way in. No allocation after `new`; no work where there are none.
#[derive(Clone, Debug)]
pub(crate) struct AdaptationState {
    adaptation: Adaptation,
    /// Share of the way to the device that an acceleration is, k_s.
    share: f64,
    /// Rows of the present set that no step has seen yet.
    arrivals: Vec<u32>,
    ramps: Vec<Ramp>,
}

impl AdaptationState {
    /// State for sets of at most `capacity` rows, where accelerations are a `share` of the way to the device.
    pub(crate) fn new(adaptation: Adaptation, share: f64, capacity: usize) -> Self {
        Self {
            adaptation,
            share,
            arrivals: Vec::with_capacity(capacity),
            ramps: Vec::with_capacity(capacity),
        }
    }

    /// Takes note of a new set: constraints on their way in follow their rows, those gone are forgotten.
    pub(crate) fn observe(&mut self, known: &KnownRows) {
        self.ramps.retain_mut(|ramp| {
            let place = known.place_of(ramp.row);
            ramp.row = place.unwrap_or(ramp.row);
            place.is_some()
        });
        self.arrivals.clear();
        let room = self.arrivals.capacity();
        self.arrivals
            .extend(known.arrivals().iter().copied().take(room));
    }

    /// Whether [`AdaptationState::step`] has nothing to do until the next set.
    #[inline]
    pub(crate) fn is_idle(&self) -> bool {
        self.arrivals.is_empty() && self.ramps.is_empty()
    }

    /// Tells `set_bound` the bound in force of every row that is on its way in, and that of a row on its arrival.
    ///
    /// `bound_of` a row is where it belongs, `reached_by` a row is `J_k (a_u + c)` at the present device pose.
    /// `time` in seconds never runs back.
    pub(crate) fn step(
        &mut self,
        time: f64,
        bound_of: impl Fn(usize) -> f64,
        reached_by: impl Fn(usize) -> f64,
        mut set_bound: impl FnMut(usize, f64),
    ) {
        for row in self.arrivals.drain(..) {
            let reached = reached_by(row as usize);
            let enters = reached - bound_of(row as usize) <= self.share * self.adaptation.threshold
                && self.ramps.len() < self.ramps.capacity();
            if enters {
                self.ramps.push(Ramp {
                    row,
                    violation_at_entry: reached,
                    start: time,
                });
            }
        }
        let duration = self.adaptation.duration;
        self.ramps.retain(|ramp| {
            let bound = bound_of(ramp.row as usize);
            let in_force = ramp.bound(time, duration, bound);
            set_bound(ramp.row as usize, in_force.unwrap_or(bound));
            in_force.is_some()
        });
    }
}
