//! A wrench from outside (a robot's sensor, a simulation) on its way to the hand: judged, limited, and gone when it is old.
//!
//! What comes out is added to the contact's wrench before the device port, so every promise of the port holds of the sum. Where the device is behind a bridge
//! the server judges it and passes it on, and the bridge judges it again by its own clock and adds it: [`crate::edge::PassedWrench`].
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `made`       | s    | when a value was measured, session time, at the earliest that its sender's clock allows |
//! | `hold`       | s    | age up to which it is felt in full |
//! | `ramp_out`   | s    | time in which it then fades; the same ramp as the port's own |
//! | `gain`       | –    | share that is felt: falls with the age at once, rises by the port's ramp-in |
//!
//! A value that is no number or out of its range stops the force; what is old, repeated, out of order or ahead of time changes nothing. Pure: times are
//! arguments. A tick neither allocates nor waits.

mod statistics;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use god_object::nalgebra::UnitQuaternion;
use god_object::spatial::{Pose, Vector6, angular, linear, six};
use taut_link::ForceOutput;

use crate::port::{fade_share, within_limits};

pub use statistics::{ExternalWrenchStatistics, Refused};

/// Most that the time of a value may be ahead of its arrival: clocks that agree differ by far less.
const MAX_AHEAD: Duration = Duration::from_millis(20);

/// The axes that values are given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WrenchAxes {
    /// Fixed ones: scene from these.
    Fixed(UnitQuaternion<f64>),
    /// Those of the body in the hand.
    Body,
}

/// What is let through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExternalWrenchSettings {
    /// Axes of the values.
    pub axes: WrenchAxes,
    /// Largest norm of the force, N.
    pub max_force: f64,
    /// Largest norm of the torque, N m.
    pub max_torque: f64,
    /// Age up to which a value is felt in full.
    pub hold: Duration,
    /// Time in which it then fades.
    pub ramp_out: Duration,
    /// Time from nothing to all of it.
    pub ramp_in: Duration,
}

/// A value as its receiver hands it on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentWrench {
    /// Force then torque, N and N m; finite.
    pub wrench: Vector6,
    /// When it was measured, session time; `None` where the sender's clock is not known.
    pub made: Option<Duration>,
    /// By how much `made` may be too late, because the clocks are not known better.
    pub uncertainty: Duration,
    /// When it came, session time.
    pub received: Duration,
    /// Who sent it: numbers of one sender go up.
    pub sender: u64,
    /// Counts the values of one sender.
    pub index: u64,
}

/// The newest that a receiver knows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NewestWrench {
    /// The newest value; `None` before the first.
    pub sent: Option<SentWrench>,
    /// Session time at which something came that is no wrench; zero for never.
    pub spoiled: Duration,
}

/// The value that is felt now, for who adds it elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JudgedWrench {
    /// Limited; N and N m. In the body's axes with [`WrenchAxes::Body`], else the scene's.
    pub wrench: Vector6,
    /// When it was measured, session time, as its sender told.
    pub made: Duration,
    /// By how much that may be too late.
    pub uncertainty: Duration,
    /// Counts the values that were taken.
    pub count: u64,
    /// How it is to be felt.
    pub settings: ExternalWrenchSettings,
}

/// Where values come from: a reading end that never waits.
pub enum WrenchReader {
    /// The sealed datagrams of a force source.
    Link(ForceOutput),
    /// Another receiver of this process.
    Local(triple_buffer::Output<NewestWrench>),
}

impl WrenchReader {
    /// The newest, if anything came since the last call.
    fn news(&mut self) -> Option<NewestWrench> {
        match self {
            Self::Local(output) => output.update().then(|| *output.output_buffer()),
            Self::Link(output) => {
                if !output.update() {
                    return None;
                }
                let input = (*output.output_buffer())?;
                let ns = Duration::from_nanos;
                let sent = input.sample.map(|sample| SentWrench {
                    wrench: Vector6::from(sample.wrench),
                    made: (sample.sample_time_ns > 0).then(|| ns(sample.sample_time_ns)),
                    uncertainty: ns(sample.clock_uncertainty_ns),
                    received: ns(input.received_ns),
                    sender: u64::from(input.session),
                    index: sample.index,
                });
                Some(NewestWrench {
                    sent,
                    spoiled: ns(input.spoiled_ns),
                })
            }
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Taken {
    wrench: Vector6,
    /// Its time as it was told, and at the earliest: the age counts from the latter.
    stated: Duration,
    made: Duration,
    sender: u64,
}

/// A wrench from outside, as the haptics loop adds it.
pub struct ExternalWrench {
    reader: WrenchReader,
    settings: ExternalWrenchSettings,
    newest: Option<Taken>,
    spoiled: Duration,
    gain: f64,
    last_tick: Option<Duration>,
    statistics: Arc<ExternalWrenchStatistics>,
}

impl ExternalWrench {
    /// Nothing is felt until the first value.
    #[must_use]
    pub fn new(reader: WrenchReader, settings: ExternalWrenchSettings) -> Self {
        Self {
            reader,
            settings,
            newest: None,
            spoiled: Duration::ZERO,
            gain: 0.0,
            last_tick: None,
            statistics: Arc::default(),
        }
    }

    /// The same with counters that a receiver holds already.
    #[must_use]
    pub fn with_statistics(mut self, statistics: Arc<ExternalWrenchStatistics>) -> Self {
        self.statistics = statistics;
        self
    }

    /// The counters that this writes.
    #[must_use]
    pub fn statistics(&self) -> Arc<ExternalWrenchStatistics> {
        self.statistics.clone()
    }

    /// Nothing is felt until another value comes, which ramps in.
    pub(crate) fn stop(&mut self) -> Vector6 {
        let _ = self.reader.news();
        (self.newest, self.gain) = (None, 0.0);
        self.statistics.tell(None, &Vector6::zeros());
        Vector6::zeros()
    }

    pub(crate) fn counters(&self) -> &ExternalWrenchStatistics {
        &self.statistics
    }

    pub(crate) fn set_settings(&mut self, settings: ExternalWrenchSettings) {
        self.settings = settings;
    }

    /// The value that the last tick felt; `None` where it felt none.
    #[must_use]
    pub fn judged(&self) -> Option<JudgedWrench> {
        let newest = self.newest.filter(|_| self.statistics.is_felt())?;
        let settings = self.settings;
        let limited = within_limits(&newest.wrench, settings.max_force, settings.max_torque);
        Some(JudgedWrench {
            wrench: match settings.axes {
                WrenchAxes::Fixed(turn) => turned(&turn, &limited),
                WrenchAxes::Body => limited,
            },
            made: newest.stated,
            uncertainty: newest.stated.saturating_sub(newest.made),
            count: self.statistics.taken(),
            settings,
        })
    }

    /// What is added to the contact's wrench at session time `now`, N and N m, scene axes; `body` is the body in the hand. Call it once a period.
    pub fn tick(&mut self, now: Duration, body: &Pose) -> Vector6 {
        let passed = now.saturating_sub(self.last_tick.replace(now).unwrap_or(now));
        if let Some(news) = self.reader.news() {
            self.take(&news);
        }
        let settings = &self.settings;
        let Some(Taken { wrench, made, .. }) = self.newest else {
            self.gain = 0.0;
            self.statistics.tell(None, &Vector6::zeros());
            return Vector6::zeros();
        };
        let age = now.saturating_sub(made);
        let by_age = fade_share(age.saturating_sub(settings.hold), settings.ramp_out);
        // A stall of the caller lets nothing in at once.
        let risen = passed.min(settings.hold).as_secs_f64() / settings.ramp_in.as_secs_f64();
        let risen = if risen.is_finite() { risen } else { 1.0 }; // no ramp-in
        self.gain = (self.gain + risen).min(by_age);
        let limited = within_limits(&wrench, settings.max_force, settings.max_torque);
        let turn = match settings.axes {
            WrenchAxes::Fixed(turn) => turn,
            WrenchAxes::Body => body.rotation,
        };
        let added = turned(&turn, &limited) * self.gain;
        self.statistics.tell((by_age > 0.0).then_some(age), &added);
        added
    }

    fn take(&mut self, news: &NewestWrench) {
        if news.spoiled > self.spoiled {
            self.spoiled = news.spoiled;
            self.newest = None;
            self.statistics.refuse(Refused::Spoiled);
            // A good one may have come right behind it, within this tick: the force ends all the same, and the next one ramps in.
            return;
        }
        // What came before the spoiled one is not felt again.
        let Some(sent) = news.sent.filter(|sent| sent.received > self.spoiled) else {
            return;
        };
        match self.judge(&sent) {
            Ok(taken) => {
                self.newest = Some(taken);
                self.statistics.taken.fetch_add(1, Ordering::Relaxed);
            }
            Err(why) => {
                if why == Refused::Spoiled {
                    self.newest = None;
                }
                self.statistics.refuse(why);
            }
        }
    }

    fn judge(&self, sent: &SentWrench) -> Result<Taken, Refused> {
        let finite = sent.wrench.iter().all(|x| x.is_finite());
        let made = sent.made.ok_or(Refused::NotOnClock)?;
        if !finite {
            return Err(Refused::Spoiled);
        }
        if made > sent.received + MAX_AHEAD {
            return Err(Refused::NotOnClock);
        }
        let earliest = made.saturating_sub(sent.uncertainty).min(sent.received);
        if sent.received - earliest > self.settings.hold + self.settings.ramp_out {
            return Err(Refused::Old);
        }
        if let Some(newest) = self.newest
            && newest.sender == sent.sender
            && made < newest.stated
        {
            return Err(Refused::WentBack);
        }
        Ok(Taken {
            wrench: sent.wrench,
            stated: made,
            made: earliest,
            sender: sent.sender,
        })
    }
}

/// The wrench in the axes that `turn` leads to.
fn turned(turn: &UnitQuaternion<f64>, wrench: &Vector6) -> Vector6 {
    six(&(turn * linear(wrench)), &(turn * angular(wrench)))
}

#[cfg(test)]
mod tests;
