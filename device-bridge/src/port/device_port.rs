//! One tick between a loop and its device: everything in, everything out.

use std::time::Duration;

use nalgebra::{Point3, Vector6};

use super::arming::{Arming, ArmingState, CommandSource, Situation};
use super::buttons::Buttons;
use super::clamp::{Limited, clamp};
use super::energy::EnergyObserver;
use super::event::{EdgeDetector, EventKind, Events, TickEvents, kind_of_fault};
use super::gone::Gone;
use super::motion::Motion;
use super::passivity::PassivityController;
use super::settings::SafetySettings;
use super::slew::SlewLimit;
use super::validation::{SampleCheck, Verdict, at_rest};
use super::watchdog::{Command, Freshness, Missing, freshness};
use crate::device::{Device, DeviceFault, DeviceInfo, DeviceSample, Felt, Pose};

/// What the device says in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The newest sample that may be trusted; at the start the start pose at rest. Its velocity is zero while a fault lasts.
    pub sample: DeviceSample,
    /// Why there is no newer one.
    pub fault: Option<DeviceFault>,
    /// What the hand felt at this reading, where the device tells: see [`Device::felt`].
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
    /// What the hand feels of it: the same, unless the device knows better.
    pub felt: Vector6<f64>,
    /// Where the port stands.
    pub state: ArmingState,
    /// Whether there is force, or will be without being asked for as soon as all is in order again.
    pub gives: bool,
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
    motion: Motion,
    energy: EnergyObserver,
    spells: Spells,
    tick_events: TickEvents,
    last_tick: Option<Duration>,
    /// The loop ended in good order after the last tick, the force led down: what passes until the next tick is a pause, no stall.
    released: bool,
    sample: DeviceSample,
    /// When the newest good sample was seen.
    last_good: Option<Duration>,
    fault: Option<DeviceFault>,
    /// Energy given out since the last sample, J.
    work: f64,
    /// The newest command that may be rendered, and the reading of the device that it comes from.
    held: Vector6<f64>,
    held_origin: Option<Duration>,
    /// Origin of the newest command, and when there was news of it.
    last_command: Option<Duration>,
    last_news: Duration,
    arm_asked: bool,
    disarm_asked: bool,
    buttons: Buttons,
}

/// What is told when it begins.
#[derive(Clone, Copy, Debug, Default)]
struct Spells {
    not_finite: EdgeDetector,
    stale: [EdgeDetector; 3],
    force: EdgeDetector,
    torque: EdgeDetector,
    force_slew: EdgeDetector,
    torque_slew: EdgeDetector,
    passivity: EdgeDetector,
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
        let mut settings = settings.for_device(device.as_ref());
        if info.actuated_degrees_of_freedom == 0 {
            // A trace may stop dead: nobody feels it.
            settings.validation.frozen_after = Duration::ZERO;
        }
        Self {
            check: SampleCheck::new(settings.validation, reference_point, settings.period),
            arming: Arming::new(&settings),
            controller: PassivityController::new(settings.passivity, settings.contact),
            slew: SlewLimit::new(&settings),
            motion: Motion::default(),
            energy: EnergyObserver::new(reference_point),
            spells: Spells::default(),
            tick_events: TickEvents::default(),
            last_tick: None,
            released: false,
            sample: at_rest(start),
            last_good: None,
            fault: None,
            work: 0.0,
            held: Vector6::zeros(),
            held_origin: None,
            last_command: None,
            last_news: Duration::ZERO,
            arm_asked: false,
            disarm_asked: false,
            buttons: Buttons::new(settings.dead_man, settings.arm_button),
            device,
            settings,
        }
    }

    /// What the device is.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// The device alone, for another port; it renders no force from here on.
    #[must_use]
    pub fn into_device(mut self) -> Box<dyn Device> {
        self.say_last_word();
        let gone = Gone::instead_of(self.device.info());
        std::mem::replace(&mut self.device, gone)
    }

    fn say_last_word(&mut self) {
        if *self.slew.rendered() != Vector6::zeros() {
            let now = self.last_tick.unwrap_or_default();
            self.device.write(now, &Vector6::zeros());
        }
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

    /// CPU time of the device's driver in the last tick, where it is measured.
    #[must_use]
    pub fn computing_time(&self) -> Option<Duration> {
        self.device.computing_time()
    }

    /// The wrench on the hand since the last write, N and N m.
    #[must_use]
    pub fn rendered(&self) -> &Vector6<f64> {
        self.slew.rendered()
    }

    /// When the device was read for what the force of now comes from, on the clock of the ticks; `None` before the first command.
    #[must_use]
    pub fn origin(&self) -> Option<Duration> {
        self.held_origin
    }

    /// Asks for force, as a person does; the next tick grants or refuses it.
    pub fn ask_to_arm(&mut self) {
        self.arm_asked = true;
    }

    /// Asks for no force: it fades from the next tick on, until somebody arms again.
    pub fn ask_to_disarm(&mut self) {
        self.disarm_asked = true;
    }

    /// The commands come by another way from now on: the force ramps in from zero again, unless a person has to arm first.
    pub fn restart(&mut self, source: CommandSource) {
        self.last_command = None;
        self.held = Vector6::zeros();
        self.controller.restart();
        self.arming.restart(source);
    }

    /// One period: reads the device, asks `command` for the newest command (`None` before the first), makes it safe, writes it.
    pub fn tick(
        &mut self,
        now: Duration,
        command: impl FnOnce(&Reading) -> Option<Command>,
    ) -> TickReport {
        self.tick_events.begin_tick(now);
        let passed = now.saturating_sub(self.last_tick.unwrap_or(now));
        self.last_tick = Some(now);
        let paused = std::mem::take(&mut self.released);
        if passed > self.settings.hold && !paused {
            self.tick_events
                .tell(EventKind::PortStalled, passed.as_secs_f64());
        }
        self.motion.fade(passed);
        self.begin_where_the_device_is();
        let reading = self.sense(now);
        let command = command(&reading);
        if let Some(command) = &command {
            let commanded = command.wrench + command.external;
            self.controller
                .grant(command.obstacle_work, &commanded, self.energy.held());
        }
        let wrench = self.render(now, passed, command);
        self.device
            .comes_from(self.held_origin, self.controller.obstacle_work());
        self.device.write(now, &wrench);
        // The device's own word is what does the work.
        let felt = self.device.felt().map_or(wrench, |felt| felt.wrench);
        self.energy.hold(&felt);
        TickReport {
            reading,
            wrench,
            felt,
            state: self.arming.state(),
            gives: self.arming.gives(),
            events: *self.tick_events.events(),
        }
    }

    /// Lets the force come down by one period's share without reading the device; whether it is zero. For the end of a
    /// loop: call it once per period until it is true.
    pub fn release_step(&mut self, now: Duration) -> bool {
        self.begin_where_the_device_is();
        let wrench = self.slew.step(now, &Vector6::zeros(), 0.0).wrench;
        self.device.write(now, &wrench);
        self.energy.hold(&wrench);
        self.arming.restart(CommandSource::Same);
        self.released = wrench == Vector6::zeros();
        self.released
    }

    /// Where the driver has let go the hand feels nothing, and the next write is a step from there.
    fn begin_where_the_device_is(&mut self) {
        if self.device.let_go() {
            self.slew.let_go();
            self.energy.hold(&Vector6::zeros());
        }
    }

    fn sense(&mut self, now: Duration) -> Reading {
        let reading = self.device.read(now);
        let verdict = match self.check.judge(now, reading) {
            // A driver that gives its last sample for ever has lost its device too.
            Verdict::Same => match self.last_good.map(|seen| now.saturating_sub(seen)) {
                Some(age) if age > self.settings.longest_silence() => {
                    Verdict::Bad(DeviceFault::Lost { age })
                }
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
                self.motion.follow(
                    sample.time,
                    self.energy.travel(),
                    self.settings.period,
                    self.settings.contact.radius_of_gyration,
                );
                if self.fault.take().is_some() {
                    self.tick_events.tell(EventKind::DeviceBack, 0.0);
                }
            }
            Verdict::Same => {}
            Verdict::Bad(fault) => {
                self.sample.velocity = Vector6::zeros();
                self.energy.skip();
                self.motion.forget();
                if let DeviceFault::Lost { age } = fault {
                    // What was lost is older than its last arrival.
                    let good = now.saturating_sub(age);
                    self.last_good = self.last_good.map(|seen| seen.min(good));
                }
                if self.fault.is_none() {
                    let (kind, value) = kind_of_fault(&fault);
                    self.tick_events.tell(kind, value);
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
            self.tick_events.tell(kind, 0.0);
        }
        if let Some(wrench) = taken
            && !self.arming.keeps_last_wrench()
        {
            self.held = wrench;
            self.held_origin = self.last_command;
        }
        let gain = self.arming.gain();
        // Limited first too: a huge command would turn infinite, and a small share of it would be none of its limit.
        let settings = &self.settings;
        // What is held while a command is stale holds nothing from outside: that goes on to fade by its own age.
        let external = command.map_or_else(Vector6::zeros, |command| command.external);
        let asked = if is_finite(&external) {
            self.held + external
        } else {
            self.held
        };
        let limited = clamp(&asked, settings.max_force, settings.max_torque);
        let shared = limited.wrench * gain;
        let damping = self.controller.step(
            self.work,
            self.energy.travel(),
            self.motion.span().as_secs_f64(),
            passed.as_secs_f64(),
            &shared,
        );
        let damped = self.controller.within_reserve(&shared) + damping.wrench * gain;
        let safe = clamp(&damped, settings.max_force, settings.max_torque).wrench;
        // A force that comes, goes away or is held is led by the port: only one in full answers the motion.
        let speed = match self.arming.state() {
            ArmingState::Armed => self.motion.speed(),
            _ => 0.0,
        };
        let slewed = self.slew.step(now, &safe, speed);

        self.tell_limits(now, &limited, &slewed, damping.debt);
        slewed.wrench
    }

    fn tell_limits(&mut self, now: Duration, limited: &Limited, slewed: &Limited, debt: f64) {
        let felt = self.arming.gain() > 0.0;
        // A force that comes or goes away is slow on purpose; why it does is told by itself.
        let armed = self.arming.state() == ArmingState::Armed;
        let spells = &mut self.spells;
        let acting = [
            (
                &mut spells.force,
                EventKind::ForceLimited,
                limited.force_asked.filter(|_| felt),
            ),
            (
                &mut spells.torque,
                EventKind::TorqueLimited,
                // A device without torque is told of once, at its start.
                limited
                    .torque_asked
                    .filter(|_| felt && self.settings.max_torque > 0.0),
            ),
            (
                &mut spells.force_slew,
                EventKind::ForceSlewLimited,
                slewed.force_asked.filter(|_| armed),
            ),
            (
                &mut spells.torque_slew,
                EventKind::TorqueSlewLimited,
                slewed.torque_asked.filter(|_| armed),
            ),
            (
                &mut spells.passivity,
                EventKind::PassivityActs,
                (debt > 0.0).then_some(debt),
            ),
        ];
        for (detector, kind, value) in acting {
            if detector.begins(now, value.is_some()) {
                self.tick_events.tell(kind, value.unwrap_or(0.0));
            }
        }
    }

    /// What is wrong in this tick, and the wrench of the command if it may be taken.
    fn situation(
        &mut self,
        now: Duration,
        command: Option<Command>,
    ) -> (Situation, Option<Vector6<f64>>) {
        let finite = command
            .is_none_or(|command| is_finite(&command.wrench) && is_finite(&command.external));
        if self.spells.not_finite.begins(now, !finite) {
            self.tick_events.tell(EventKind::WrenchNotFinite, 0.0);
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
                let (detector, kind) = match missing {
                    Missing::Command => (0, EventKind::ForceStale),
                    Missing::Constraints => (1, EventKind::ConstraintsStale),
                    Missing::NotOnClock => (2, EventKind::CommandNotOnClock),
                };
                stale_since = Some(since);
                if missing == Missing::NotOnClock {
                    taken = None;
                    // It says nothing, so the last one that said something may have grown too old before.
                    let too_old = |made: Duration| made.saturating_add(self.settings.hold);
                    stale_since = Some(
                        self.last_command
                            .map_or(since, |made| since.min(too_old(made))),
                    );
                }
                let begins = self.spells.stale[detector].begins(now, true);
                if begins && !self.arming.state().is_off() {
                    self.tick_events.tell(kind, age.as_secs_f64());
                }
            }
            Some(_) => {}
            None => stale_since = Some(now),
        }

        if let Some(command) = command.filter(|_| taken.is_some()) {
            let origin = Some(command.origin.min(now));
            if self.last_command != origin {
                self.last_news = now;
            }
            self.last_command = origin;
        }
        let late_command = now.saturating_sub(self.last_news) > self.settings.late();
        // The force is as old as the older of the two that it rests on.
        let newest = |seen: Option<Duration>| seen.unwrap_or(now);
        let is_fault = self.fault.is_some() || !finite;
        let fault_since = is_fault.then(|| newest(self.last_good).min(newest(self.last_command)));
        let late_sample = self
            .last_good
            .is_some_and(|seen| now.saturating_sub(seen) > self.settings.late());
        let down = self.last_good.map(|_| self.sample.buttons);
        let (held, pressed) = self.buttons.step(down);
        let situation = Situation {
            fault_since,
            stale_since,
            late: late_sample || late_command,
            paused: command.is_some_and(|command| command.paused),
            commanded: command.is_some() && self.last_good.is_some(),
            held,
            asked: std::mem::take(&mut self.arm_asked) || pressed,
            disarm: std::mem::take(&mut self.disarm_asked),
        };
        (situation, taken)
    }
}

fn is_finite(wrench: &Vector6<f64>) -> bool {
    wrench.iter().all(|x| x.is_finite())
}

impl Drop for DevicePort {
    /// The last word to the device, whatever ends the port: a loop that broke down and could not lead the force down leaves none all the same.
    fn drop(&mut self) {
        self.say_last_word();
    }
}
