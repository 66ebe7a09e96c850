//! When sets arrive: rows of obstacles that move go on with them until the next.

/// The time of the present set, and between it and the one before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arrival {
    /// When the present set was published or, where that is not known, first seen, s.
    time: f64,
    /// Time between the present set and the one before, s.
    period: f64,
}

impl Arrival {
    /// Takes note of a new set and of its time, s.
    pub(super) fn observe(&mut self, time: f64) {
        *self = Self {
            time,
            period: time - self.time,
        };
    }

    /// How much of an update's time has passed since the set came, in [0, 1]: 0 where it cannot be known.
    pub(super) fn share_of_an_update(&self, time: f64) -> f64 {
        let share = (time - self.time) / self.period;
        let known = self.period > 0.0 && share > 0.0; // false for NaN
        if known { share.min(1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::Arrival;

    #[test]
    fn the_share_grows_to_one_and_is_none_where_it_cannot_be_known() {
        let mut arrival = Arrival::default();
        assert_eq!(arrival.share_of_an_update(0.0), 0.0);
        arrival.observe(1.0);
        arrival.observe(1.5);
        assert_eq!(arrival.share_of_an_update(1.25), 0.0);
        assert_eq!(arrival.share_of_an_update(1.75), 0.5);
        assert_eq!(arrival.share_of_an_update(9.0), 1.0);
        assert_eq!(arrival.share_of_an_update(f64::NAN), 0.0);
        arrival.observe(1.5);
        assert_eq!(arrival.share_of_an_update(2.0), 0.0);
    }
}
