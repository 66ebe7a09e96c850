//! A window of the plots: what many samples become, without a peak of any being lost.

use crate::sample::{Envelope, MonitorSample, felt};

/// Length of a window, ns: ten points a second in every plot.
pub(crate) const WINDOW_NS: u64 = 100_000_000;

/// The samples of one window.
#[derive(Clone, Copy)]
pub(crate) struct Window {
    /// The newest sample; the point in time at which the window stands.
    pub(crate) last: MonitorSample,
    pub(crate) envelope: Envelope,
    /// Longest time of each loop: haptics, god-object, force, us.
    pub(crate) longest_us: [f32; 3],
    /// Most contacts at a time.
    pub(crate) contacts: u32,
    /// Smallest gap, m; NaN where none is known.
    pub(crate) gap: f64,
}

impl Window {
    fn of(sample: &MonitorSample) -> Window {
        let mut window = Window {
            last: *sample,
            envelope: Envelope::default(),
            longest_us: [0.0; 3],
            contacts: 0,
            gap: f64::NAN,
        };
        window.add(sample);
        window
    }

    fn add(&mut self, sample: &MonitorSample) {
        self.last = *sample;
        self.envelope.add(&sample.wrench, sample.constraint_age_us);
        self.envelope.join(&sample.between);
        let loops = loop_times(sample);
        for (longest, time) in self.longest_us.iter_mut().zip(loops) {
            *longest = longest.max(time.last_us).max(time.longest_us);
        }
        self.contacts = self.contacts.max(sample.contacts.total());
        self.gap = self.gap.min(sample.gap_min); // NaN: the other
    }

    /// Newest, least and largest of the force's (0) or the torque's (1) components and norm.
    pub(crate) fn felt(&self, which: usize) -> impl Iterator<Item = f64> + '_ {
        let newest = &felt(&self.last.wrench)[4 * which..4 * which + 4];
        let ranges = self.envelope.of(which);
        let numbers: Vec<f64> = newest
            .iter()
            .copied()
            .chain(ranges.iter().map(|range| range.0))
            .chain(ranges.iter().map(|range| range.1))
            .collect();
        numbers.into_iter()
    }
}

/// Haptics, god-object, force.
pub(crate) fn loop_times(sample: &MonitorSample) -> [crate::LoopTime; 3] {
    [
        sample.haptics_period,
        sample.god_object_update,
        sample.force_update,
    ]
}

/// Puts samples into windows by their time.
#[derive(Default)]
pub(crate) struct Windows {
    open: Option<Window>,
}

impl Windows {
    /// Takes a sample; the window before, if this one begins another.
    pub(crate) fn add(&mut self, sample: &MonitorSample) -> Option<Window> {
        let number = |sample: &MonitorSample| sample.session_time_ns / WINDOW_NS;
        match &mut self.open {
            Some(window) if number(&window.last) == number(sample) => {
                window.add(sample);
                None
            }
            open => open.replace(Window::of(sample)),
        }
    }

    /// The window that is not full yet.
    pub(crate) fn finish(&mut self) -> Option<Window> {
        self.open.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn a_peak_of_a_millisecond_stays_in_its_window() {
        let mut windows = Windows::default();
        let mut shut = Vec::new();
        for index in 0..15 {
            let mut sample = MonitorSample::at(20_000_000 * index);
            sample.wrench = Vector6::new(0.0, 0.0, 3.0, 0.0, 0.1, 0.0);
            sample.haptics_period.last_us = 1000.0;
            for tick in 0..20 {
                let is_peak = (index, tick) == (7, 4);
                let force = if is_peak { -9.0 } else { 3.0 };
                let wrench = Vector6::new(0.0, 0.0, force, 0.0, 0.1, 0.0);
                sample
                    .between
                    .add(&wrench, if is_peak { 4000.0 } else { 900.0 });
            }
            if index == 8 {
                sample.haptics_period.longest_us = 2500.0;
            }
            // A number that is none hides nothing.
            sample.between.add(&Vector6::repeat(f64::NAN), f32::NAN);
            shut.extend(windows.add(&sample));
        }
        shut.extend(windows.finish());
        assert_eq!(shut.len(), 3);
        let force: Vec<Vec<f64>> = shut.iter().map(|window| window.felt(0).collect()).collect();
        // Fx Fy Fz |F| newest, then least, then largest.
        assert_eq!(
            force[0],
            [0.0, 0.0, 3.0, 3.0, 0.0, 0.0, 3.0, 3.0, 0.0, 0.0, 3.0, 3.0]
        );
        assert_eq!(
            force[1],
            [0.0, 0.0, 3.0, 3.0, 0.0, 0.0, -9.0, 3.0, 0.0, 0.0, 3.0, 9.0]
        );
        assert_eq!(force[2], force[0]);
        let ages: Vec<f32> = shut
            .iter()
            .map(|window| window.envelope.oldest_constraints_us())
            .collect();
        assert_eq!(ages, [900.0, 4000.0, 900.0]);
        assert_eq!(shut[1].longest_us[0], 2500.0);
    }
}
