//! A wrench from outside between the server, which judges and passes it on, and the bridge, which judges it again and adds it beside the device.
//!
//! Its age counts from the time that its source told, on the bridge's own estimate of session time, and as if that were late by all that source and bridge
//! may be off by. So a delay on either way makes it older and never younger: forces that were on their way for long are felt less or not at all.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `made`       | s    | when the value was measured, on the clock of the ticks |
//! | `known`      | –    | number of the newest value of this session |

use std::time::Duration;

use god_object::nalgebra::UnitQuaternion;
use god_object::spatial::{Pose, Vector6};
use taut_link::proto::force::{FORCE_IN_BODY, FORCE_NONE};
use taut_link::proto::{ForceSample, PassedForce, SessionTime};

use crate::external::{
    ExternalWrench, ExternalWrenchSettings, ExternalWrenchStatistics, JudgedWrench, NewestWrench,
    SentWrench, WrenchAxes, WrenchReader,
};
use crate::port::SafetySettings;

/// What the server sends; `None` says that nothing is to be felt.
#[must_use]
pub fn pass_on(judged: Option<&JudgedWrench>) -> PassedForce {
    let ns = |time: Duration| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
    let nothing = PassedForce {
        sample: ForceSample {
            sample_time_ns: 0,
            clock_uncertainty_ns: 0,
            index: 0,
            wrench: [0.0; 6],
        },
        hold_ns: 0,
        ramp_out_ns: 0,
        flags: FORCE_NONE,
    };
    judged.map_or(nothing, |judged| PassedForce {
        sample: ForceSample {
            sample_time_ns: ns(judged.made),
            clock_uncertainty_ns: ns(judged.uncertainty),
            index: judged.count,
            wrench: judged.wrench.into(),
        },
        hold_ns: ns(judged.settings.hold),
        ramp_out_ns: ns(judged.settings.ramp_out),
        flags: match judged.settings.axes {
            WrenchAxes::Body => FORCE_IN_BODY,
            WrenchAxes::Fixed(_) => 0,
        },
    })
}

/// What comes from the server, as the bridge adds it. No allocation after `new`.
pub struct PassedWrench {
    input: triple_buffer::Input<NewestWrench>,
    external: ExternalWrench,
    known: u64,
    /// The bridge's own, which the server can only shorten.
    limits: ExternalWrenchSettings,
}

impl PassedWrench {
    /// Nothing is felt until the first value. Limits and times are at most those of the port.
    #[must_use]
    pub fn new(port: &SafetySettings) -> Self {
        let limits = ExternalWrenchSettings {
            axes: WrenchAxes::Fixed(UnitQuaternion::identity()),
            max_force: port.max_force,
            max_torque: port.max_torque,
            hold: port.hold,
            ramp_out: port.ramp_out,
            ramp_in: port.ramp_in,
        };
        let (input, output) = triple_buffer::triple_buffer(&NewestWrench::default());
        Self {
            input,
            external: ExternalWrench::new(WrenchReader::Local(output), limits),
            known: 0,
            limits,
        }
    }

    /// What became of the values.
    #[must_use]
    pub fn statistics(&self) -> &ExternalWrenchStatistics {
        self.external.counters()
    }

    /// Forgets the last session: another server counts from its own beginning.
    pub fn restart(&mut self) {
        self.known = 0;
        let _ = self.stop();
    }

    /// Nothing is felt until another value comes, which ramps in.
    pub fn stop(&mut self) -> Vector6 {
        self.external.stop()
    }

    /// Takes the newest that came, again and again until there is a newer one. Without session time nothing is known of its age, and it is left alone.
    pub fn take(&mut self, passed: &PassedForce, now: Duration, session: Option<SessionTime>) {
        if passed.flags & FORCE_NONE != 0 {
            let _ = self.stop();
            return;
        }
        let sample = &passed.sample;
        let Some(session) = session.filter(|_| sample.index > self.known) else {
            return;
        };
        self.known = sample.index;
        let ns = Duration::from_nanos;
        let made = now
            .saturating_add(ns(sample.sample_time_ns))
            .saturating_sub(ns(session.ns));
        self.external.set_settings(ExternalWrenchSettings {
            axes: if passed.flags & FORCE_IN_BODY != 0 {
                WrenchAxes::Body
            } else {
                self.limits.axes
            },
            hold: self.limits.hold.min(ns(passed.hold_ns)),
            ramp_out: self.limits.ramp_out.min(ns(passed.ramp_out_ns)),
            ..self.limits
        });
        let sent = SentWrench {
            wrench: sample.wrench.into(),
            made: (sample.sample_time_ns > 0).then_some(made),
            uncertainty: ns(sample.clock_uncertainty_ns).saturating_add(ns(session.uncertainty_ns)),
            received: now,
            sender: 0,
            index: sample.index,
        };
        self.input.write(NewestWrench {
            sent: Some(sent),
            spoiled: Duration::ZERO,
        });
    }

    /// What is felt of it at `now`, N and N m, scene axes; `body` is the body in the hand. Call it once a tick.
    pub fn tick(&mut self, now: Duration, body: &Pose) -> Vector6 {
        self.external.tick(now, body)
    }
}
