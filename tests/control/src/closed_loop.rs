//! Coupling, device and hand, tick by tick under a virtual clock.

use std::time::Duration;

use god_object::spatial::pose_difference;
use god_object::{ConstraintSet, Coupling, Pose, Settings, Vector6, World};
use nalgebra::Vector3;
use taut_plant::{Grip, Hand, MinJerkPath, Motors, Plant};

/// Period of the loop unless it says otherwise: 1 kHz.
pub const PERIOD: Duration = Duration::from_millis(1);

/// The device of the published stability figures: 0.2 kg, `damping` N s/m, motors without limit.
pub fn grip(damping: f64) -> Grip {
    Grip {
        damping: Vector3::repeat(damping),
        max_force: f64::INFINITY,
        max_torque: f64::INFINITY,
        ..Grip::workbench()
    }
}

/// A fixed constraint set, the coupling and a plant.
#[derive(Debug)]
pub struct ClosedLoop {
    /// Device and hand.
    pub plant: Plant,
    coupling: Coupling,
    set: ConstraintSet,
    /// Damping that the loop adds by a backward difference of what the encoders say, N s/m and N m s/rad.
    pub virtual_damping: Vector6,
    /// A force and a torque that push the device all the time, N and N m.
    pub push: Vector6,
    /// T.
    pub period: Duration,
    last: Option<Pose>,
    tick: u32,
}

/// What one tick measured and answered.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// What the encoders said.
    pub measured: Pose,
    /// The coupling's answer, with the loop's damping, without the push: N and N m.
    pub wrench: Vector6,
}

impl ClosedLoop {
    /// Begins at the plant's time 0.
    pub fn new(world: &World, settings: &Settings, set: ConstraintSet, plant: Plant) -> Self {
        Self {
            plant,
            coupling: Coupling::new(world, settings),
            set,
            virtual_damping: Vector6::zeros(),
            push: Vector6::zeros(),
            period: PERIOD,
            last: None,
            tick: 0,
        }
    }

    /// Samples the device, computes the wrench and commands it. The delay is the motors'.
    pub fn tick(&mut self) -> Answer {
        let now = self.period * self.tick;
        self.tick += 1;
        self.plant.advance(now);
        let measured = self.plant.measured_pose();
        let answer = self.coupling.step(now.as_secs_f64(), &measured, &self.set);
        let last = self.last.replace(measured).unwrap_or(measured);
        let moved = pose_difference(&measured, &last, &Vector3::zeros());
        let velocity = moved / self.period.as_secs_f64();
        let wrench = answer.wrench - self.virtual_damping.component_mul(&velocity);
        self.plant.command(&(wrench + self.push));
        Answer { measured, wrench }
    }
}

/// A hand that means to stay there, a device, and motors whose force comes so much later, s.
pub fn held(device: Grip, hand: Hand, there: Pose, delay: f64) -> Plant {
    Plant::new(device, hand, MinJerkPath::hold(there))
        .with_motors(Motors {
            delay: Duration::from_secs_f64(delay),
            lag: Duration::ZERO,
        })
        .with_longest_step(PERIOD)
}

/// The boundary between what dies away and what grows by bisection, between two stiffnesses and to a relative width.
pub fn critical_stiffness(
    [mut calm, mut wild]: [f64; 2],
    width: f64,
    grows: impl Fn(f64) -> bool,
) -> f64 {
    while wild / calm > 1.0 + width {
        let middle = (calm * wild).sqrt();
        if grows(middle) {
            wild = middle;
        } else {
            calm = middle;
        }
    }
    (calm * wild).sqrt()
}
