//! The device port: the one place through which every sample comes in and every wrench goes out.
//!
//! | stage of a tick | file | does |
//! |-----------------|------|------|
//! | validation      | [`validation`] | refuses samples that no hand makes |
//! | watchdog        | [`watchdog`] | finds out how old the inputs are |
//! | arming          | [`arming`] | whether there is force: ramps in, holds, ramps out |
//! | passivity       | [`passivity`] | damps energy away, on request |
//! | clamp           | [`clamp`] | limits the norms of force and torque |
//! | slew            | [`slew`] | limits their change, whatever the stages before have done |
//! | energy          | [`energy`] | measures the work done on the hand |
//!
//! [`DevicePort`] owns the device, so nothing else can write to it. **What holds of every write,** whatever device, network
//! and loops do: it is finite; its norms are within the limits; it differs from the last one by at most the slew rate
//! times one period; and it is zero from 120 ms (hold and ramp-out) after the last good input on. A port that is not called can
//! keep no promise: a device needs a watchdog of its own for that.
//!
//! Readings of the clock are arguments; a tick neither allocates nor waits.

mod arming;
mod clamp;
mod energy;
mod event;
mod passivity;
mod settings;
mod slew;
mod validation;
mod watchdog;

use std::time::Duration;

use nalgebra::{Point3, Vector6};

pub use arming::ArmingState;
pub use energy::EnergyObserver;
pub use event::{EventKind, Events, MAX_EVENTS_PER_TICK, SafetyEvent, kind_of_fault};
pub use passivity::{Passivity, PassivitySettings};
pub use settings::{Rearm, SafetySettings};
pub use validation::{UNIT_TOLERANCE, ValidationSettings};
pub use watchdog::Command;

use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Felt, Pose};
use arming::{Arming, Situation};
use event::Spell;
use passivity::PassivityController;
use slew::SlewLimit;
use validation::{SampleCheck, Verdict, at_rest};
use watchdog::{Freshness, Missing, freshness};

/// Buttons that a sample can tell of.
const BUTTONS: u32 = u16::BITS;

/// What the device says in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The newest sample that may be trusted; at the start the start pose at rest. Its velocity is zero while a fault lasts.
    pub sample: DeviceSample,
    /// Why there is no newer one.
    pub fault: Option<DeviceFault>,
    /// What the hand feels, where the device is far away and tells.
    pub felt: Option<Felt>,
}

/// What a tick did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct TickReport {
    /// What came in.
    pub reading: Reading,
    /// What went out: N, N m.
    pub wrench: Vector6<f64>,
    /// Where the port stands.
    pub state: ArmingState,
    /// What happened.
    pub events: Events,
}

/// A device behind all that keeps its forces safe. No allocation after `new`.
pub struct DevicePort {
    device: Box<dyn Device>,
    settings: SafetySettings,
    check: SampleCheck,
    arming: Arming,
    controller: PassivityController,
    slew: SlewLimit,
    energy: EnergyObserver,
    spells: Spells,
    events: Events,
    /// Events told so far.
    told: u64,
    last_tick: Option<Duration>,
    sample: DeviceSample,
    /// When the newest good sample was seen.
    last_good: Option<Duration>,
    fault: Option<DeviceFault>,
    /// Energy given out since the last sample, J.
    work: f64,
    /// The newest command that may be rendered, and when it was seen.
    held: Vector6<f64>,
    last_command: Option<Duration>,
    arm_asked: bool,
    disarm_asked: bool,
    buttons_before: Option<u16>,
}

/// What is told when it begins.
#[derive(Clone, Copy, Debug, Default)]
struct Spells {
    not_finite: Spell,
    stale: [Spell; 3],
    force: Spell,
    torque: Spell,
    force_slew: Spell,
    torque_slew: Spell,
    passivity: Spell,
}

impl DevicePort {
    /// A port without force. `reference_point` is G in the body's own frame; the device stands at `start` until it says
    /// otherwise. The limits are those of `settings`, of the device, and what can fade in time, whichever is smallest.
    #[must_use]
    pub fn new(
        device: Box<dyn Device>,
        settings: SafetySettings,
        reference_point: Point3<f64>,
        start: &Pose,
    ) -> Self {
        let info = device.info();
        let mut settings = settings.within(&info.limits).that_can_fade();
        if info.actuated_degrees_of_freedom == 0 {
            // A trace may stop dead: nobody feels it.
            settings.validation.frozen_after = Duration::ZERO;
        }
        Self {
            check: SampleCheck::new(settings.validation, reference_point, settings.period),
            arming: Arming::new(&settings),
            controller: PassivityController::new(settings.passivity),
            slew: SlewLimit::new(settings.force_rate, settings.torque_rate, settings.period),
            energy: EnergyObserver::new(reference_point),
            spells: Spells::default(),
            events: Events::default(),
            told: 0,
            last_tick: None,
            sample: at_rest(start),
            last_good: None,
            fault: None,
            work: 0.0,
            held: Vector6::zeros(),
            last_command: None,
            arm_asked: false,
            disarm_asked: false,
            buttons_before: None,
            device,
            settings,
        }
    }

    /// What the device is.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Limits and times in force.
    #[must_use]
    pub fn settings(&self) -> &SafetySettings {
        &self.settings
    }

    /// Where the port stands.
    #[must_use]
    pub fn state(&self) -> ArmingState {
        self.arming.state()
    }

    /// What the coupling did to the hand.
    #[must_use]
    pub fn energy(&self) -> &EnergyObserver {
        &self.energy
    }

    /// The fault that the device is in.
    #[must_use]
    pub fn fault(&self) -> Option<DeviceFault> {
        self.fault
    }

    /// The wrench on the hand since the last write, N and N m.
    #[must_use]
    pub fn rendered(&self) -> &Vector6<f64> {
        self.slew.rendered()
    }

    /// Asks for force, as a person does; the next tick grants or refuses it.
    pub fn ask_to_arm(&mut self) {
        self.arm_asked = true;
    }

    /// Asks for no force: it fades from the next tick on, until somebody arms again.
    pub fn ask_to_disarm(&mut self) {
        self.disarm_asked = true;
    }

    /// The commands come from somebody else from now on: the force ramps in from zero again.
    pub fn restart(&mut self) {
        self.last_command = None;
        self.held = Vector6::zeros();
        self.arming.restart();
    }

    /// One period: reads the device, asks `command` for the newest command (`None` before the first), makes it safe, writes it.
    pub fn tick(
        &mut self,
        now: Duration,
        command: impl FnOnce(&Reading) -> Option<Command>,
    ) -> TickReport {
        self.events = Events::default();
        let passed = now.saturating_sub(self.last_tick.unwrap_or(now));
        self.last_tick = Some(now);
        if passed > self.settings.hold {
            self.tell(now, EventKind::PortStalled, passed.as_secs_f64());
        }
        let reading = self.sense(now);
        let command = command(&reading);
        let wrench = self.render(now, passed, command);
        self.device.write(now, &wrench);
        // A bridge's own word is what does the work.
        self.energy
            .hold(&reading.felt.map_or(wrench, |felt| felt.wrench));
        TickReport {
            reading,
            wrench,
            state: self.arming.state(),
            events: self.events,
        }
    }

    /// Lets the force come down by one period's share without reading the device; whether it is zero. For the end of a
    /// loop: call it once per period until it is true.
    pub fn release_step(&mut self, now: Duration) -> bool {
        let wrench = self.slew.step(now, &Vector6::zeros()).wrench;
        self.device.write(now, &wrench);
        self.energy.hold(&wrench);
        self.arming.restart();
        wrench == Vector6::zeros()
    }

    /// Reads the device.
    fn sense(&mut self, now: Duration) -> Reading {
        let reading = self.device.read(now);
        let verdict = match self.check.judge(now, reading) {
            // A driver that gives its last sample for ever has lost its device too.
            Verdict::Same => match self.last_good.map(|seen| now.saturating_sub(seen)) {
                Some(age) if age > self.settings.hold => Verdict::Bad(DeviceFault::Lost { age }),
                _ => Verdict::Same,
            },
            verdict => verdict,
        };
        self.work = 0.0;
        match verdict {
            Verdict::Good(sample) => {
                self.sample = sample;
                if !self.check.is_suspect() {
                    self.last_good = Some(now);
                }
                self.work = self.energy.measure(&sample.pose);
                if self.fault.take().is_some() {
                    self.tell(now, EventKind::DeviceBack, 0.0);
                }
            }
            Verdict::Same => {}
            Verdict::Bad(fault) => {
                self.sample.velocity = Vector6::zeros();
                self.energy.skip();
                if self.fault.is_none() {
                    let (kind, value) = kind_of_fault(&fault);
                    self.tell(now, kind, value);
                }
                self.fault.get_or_insert(fault);
            }
        }
        Reading {
            sample: self.sample,
            fault: self.fault,
            felt: self.device.felt(),
        }
    }

    /// From a command to what may be written.
    fn render(
        &mut self,
        now: Duration,
        passed: Duration,
        command: Option<Command>,
    ) -> Vector6<f64> {
        let (situation, taken) = self.situation(now, command);
        let changes = self.arming.step(now, &self.settings, &situation);
        for kind in changes.into_iter().flatten() {
            self.tell(now, kind, 0.0);
        }
        if let Some(wrench) = taken
            && !self.arming.keeps_last_wrench()
        {
            self.held = wrench;
        }
        let gain = self.arming.gain();
        // Limited first too: a huge command would turn infinite, and a small share of it would be none of its limit.
        let settings = &self.settings;
        let limited = clamp::clamp(&self.held, settings.max_force, settings.max_torque);
        let shared = limited.wrench * gain;
        let damping = self.controller.step(
            self.work,
            self.energy.travel(),
            passed.as_secs_f64(),
            &shared,
        );
        let damped = shared + damping.wrench * gain;
        let safe = clamp::clamp(&damped, settings.max_force, settings.max_torque).wrench;
        let slewed = self.slew.step(now, &safe);

        let acts = gain > 0.0;
        let spells = &mut self.spells;
        let begins = [
            (
                spells
                    .force
                    .begins(now, acts && limited.force_asked.is_some()),
                EventKind::ForceLimited,
                limited.force_asked,
            ),
            (
                spells
                    .torque
                    .begins(now, acts && limited.torque_asked.is_some()),
                EventKind::TorqueLimited,
                limited.torque_asked,
            ),
            (
                spells.force_slew.begins(now, slewed.force_asked.is_some()),
                EventKind::ForceSlewLimited,
                slewed.force_asked,
            ),
            (
                spells
                    .torque_slew
                    .begins(now, slewed.torque_asked.is_some()),
                EventKind::TorqueSlewLimited,
                slewed.torque_asked,
            ),
            (
                spells.passivity.begins(now, damping.debt > 0.0),
                EventKind::PassivityActs,
                Some(damping.debt),
            ),
        ];
        for (begins, kind, value) in begins {
            if begins {
                self.tell(now, kind, value.unwrap_or(0.0));
            }
        }
        slewed.wrench
    }

    /// What is wrong in this tick, and the wrench of the command if it may be taken.
    fn situation(
        &mut self,
        now: Duration,
        command: Option<Command>,
    ) -> (Situation, Option<Vector6<f64>>) {
        let finite = command.is_none_or(|command| command.wrench.iter().all(|x| x.is_finite()));
        if self.spells.not_finite.begins(now, !finite) {
            self.tell(now, EventKind::WrenchNotFinite, 0.0);
        }
        let fresh = command.map(|command| freshness(now, &command, &self.settings));
        let mut taken = command.map(|command| command.wrench).filter(|_| finite);
        let mut stale_since = None;
        match fresh {
            Some(Freshness::Stale {
                missing,
                age,
                since,
            }) => {
                let (spell, kind) = match missing {
                    Missing::Command => (0, EventKind::ForceStale),
                    Missing::Constraints => (1, EventKind::ConstraintsStale),
                    Missing::NotOnClock => (2, EventKind::CommandNotOnClock),
                };
                if missing == Missing::NotOnClock {
                    taken = None;
                }
                stale_since = Some(since);
                let begins = self.spells.stale[spell].begins(now, true);
                if begins && !self.arming.state().is_off() {
                    self.tell(now, kind, age.as_secs_f64());
                }
            }
            Some(_) => {}
            None => stale_since = Some(now),
        }

        if taken.is_some() {
            self.last_command = command.map(|command| command.made.min(now));
        }
        // The force is as old as the older of the two that it rests on.
        let newest = |seen: Option<Duration>| seen.unwrap_or(now);
        let is_fault = self.fault.is_some() || !finite;
        let fault_since = is_fault.then(|| newest(self.last_good).min(newest(self.last_command)));
        let late_sample = self
            .last_good
            .is_some_and(|seen| now.saturating_sub(seen) > watchdog::LATE);
        let (held, pressed) = self.buttons();
        let situation = Situation {
            fault_since,
            stale_since,
            late: late_sample || fresh == Some(Freshness::Late),
            commanded: command.is_some() && self.last_good.is_some(),
            held,
            asked: std::mem::take(&mut self.arm_asked) || pressed,
            disarm: std::mem::take(&mut self.disarm_asked),
        };
        (situation, taken)
    }

    /// Whether the dead-man's button is held, and whether a button that arms was pressed just now.
    fn buttons(&mut self) -> (bool, bool) {
        if self.last_good.is_none() {
            return (self.settings.dead_man.is_none(), false);
        }
        let down = self.sample.buttons;
        // What is held at the start was not pressed.
        let pressed = down & !self.buttons_before.replace(down).unwrap_or(u16::MAX);
        let is_in =
            |buttons: u16, number: u8| u32::from(number) < BUTTONS && buttons >> number & 1 == 1;
        let settings = &self.settings;
        let held = settings.dead_man.is_none_or(|number| is_in(down, number));
        let arms = [settings.dead_man, settings.arm_button];
        (
            held,
            arms.into_iter()
                .flatten()
                .any(|number| is_in(pressed, number)),
        )
    }

    fn tell(&mut self, time: Duration, kind: EventKind, value: f64) {
        self.told += 1;
        self.events.push(SafetyEvent {
            number: self.told,
            time,
            kind,
            value,
        });
    }
}

#[cfg(test)]
mod tests;
