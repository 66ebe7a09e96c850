//! Constraint adaptation: a violated new constraint enters gradually, so that the force does not jump.
//!
//! | symbol    | name in code            | unit | meaning                                                  |
//! |-----------|-------------------------|------|----------------------------------------------------------|
//! | d_k       | `violation_at_entry`    | m    | `J_k (a_u + c)` when the constraint first appeared       |
//! | c         | `Coupling::correction`  | m, rad | `a_c - a_u` of the step before: zero without contact   |
//! | b_k       | `bound`                 | m    | where the constraint belongs                             |
//! | f_k(t)    | [`AdaptationState::bound`] | m | bound in force at time t, rising from d_k to b_k         |
//! | Delta-t   | `Adaptation::duration`  | s    | time of the rise                                         |
//! | epsilon   | `Adaptation::threshold` | m    | only `d_k - b_k <= epsilon` is smoothed                  |
//!
//! A constraint that is known by its features keeps its progress when the set is replaced. The paper enters from `J_k a_u`, so that a
//! body that slides from one triangle to the next loses its force for Delta-t, although nothing is new but the features; c
//! enters from what the force of the step before already upholds.
//! Source: Ortega et al. 2007, Section 5, Figure 6.

use crate::constraint::{FeaturePair, NonPenetrationConstraint};
use crate::settings::Adaptation;

/// One constraint on its way in.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ramp {
    features: FeaturePair,
    violation_at_entry: f64,
    start: f64,
}

/// Which constraints are known and which are still on their way in. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct AdaptationState {
    adaptation: Adaptation,
    sequence: Option<u64>,
    known: Vec<FeaturePair>,
    arrivals: Vec<FeaturePair>,
    /// In ascending order of their features.
    ramps: Vec<Ramp>,
}

impl AdaptationState {
    /// State for sets of at most `capacity` rows.
    pub(crate) fn new(adaptation: Adaptation, capacity: usize) -> Self {
        Self {
            adaptation,
            sequence: None,
            known: Vec::with_capacity(capacity),
            arrivals: Vec::with_capacity(capacity),
            ramps: Vec::with_capacity(capacity),
        }
    }

    /// Takes note of a set: rows that were not in the one before become arrivals, rows gone are forgotten.
    ///
    /// `rows` are in ascending order of their features. The first set after `new` has no arrivals.
    pub(crate) fn observe(&mut self, sequence: u64, rows: &[NonPenetrationConstraint]) {
        if self.sequence == Some(sequence) {
            self.arrivals.clear();
            return;
        }
        self.arrivals.clear();
        if self.sequence.is_some() {
            let room = self.arrivals.capacity();
            let new = rows.iter().map(|row| row.features);
            let known = &self.known;
            self.arrivals
                .extend(new.filter(|f| known.binary_search(f).is_err()).take(room));
        }
        self.known.clear();
        let room = self.known.capacity();
        self.known
            .extend(rows.iter().map(|row| row.features).take(room));
        let known = &self.known;
        self.ramps
            .retain(|ramp| known.binary_search(&ramp.features).is_ok());
        self.sequence = Some(sequence);
    }

    /// The bound in force now for one row: `bound` itself, or less while the row is on its way in.
    ///
    /// `reached` is `J_k (a_u + c)` at the present device pose, `time` in seconds never runs back.
    pub(crate) fn bound(
        &mut self,
        time: f64,
        features: FeaturePair,
        bound: f64,
        reached: f64,
    ) -> f64 {
        let position = self
            .ramps
            .binary_search_by_key(&features, |ramp| ramp.features);
        let ramp = match position {
            Ok(known) => self.ramps[known],
            Err(place) => {
                let enters = self.arrivals.binary_search(&features).is_ok()
                    && reached - bound <= self.adaptation.threshold
                    && self.ramps.len() < self.ramps.capacity();
                if !enters {
                    return bound;
                }
                let ramp = Ramp {
                    features,
                    violation_at_entry: reached,
                    start: time,
                };
                self.ramps.insert(place, ramp);
                ramp
            }
        };
        let progress = ((time - ramp.start) / self.adaptation.duration).clamp(0.0, 1.0);
        let on_its_way = progress < 1.0; // false for NaN: a broken clock lets the constraint in at once
        if !on_its_way {
            return bound;
        }
        let entering = ramp.violation_at_entry + (bound - ramp.violation_at_entry) * progress;
        entering.min(bound)
    }

    /// Forgets ramps that have arrived.
    pub(crate) fn retire(&mut self, time: f64) {
        let duration = self.adaptation.duration;
        self.ramps.retain(|ramp| time - ramp.start < duration);
    }
}
