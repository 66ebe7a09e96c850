//! Strings whose grip is in a simulated hand: a string-driven device in closed loop without hardware.
//!
//! ```text
//!   true pose ─► lengths ─► counts            tensions ─► lag, saturation, friction ─► wrench on the grip
//!       ▲         (SimulatedStrings)                         (SimulatedStrings)              │
//!       └───────────────────────── hand, inertia, damping (Plant) ◄──────────────────────────┘
//! ```
//!
//! Strings and plant advance on a fixed grid of 0.1 ms from the first call on, so a reading lies less than one step before `now`,
//! and the same sequence of calls gives the same bytes. On that grid the pull of the strings is held; the motors' lag lies between
//! command and pull, in [`SimulatedStrings`], so the plant's own motors are ideal.

use std::time::Duration;

use nalgebra::{Matrix6, Point3, Vector3, Vector6};
use taut_plant::{
    Grip, Hand, MinJerkPath, Plant, StringAnchors, Tremor, is_finite, stack, string_inertia,
};
use taut_spidar::{
    Geometry, PerString, Reading, STRINGS, SimulatedStrings, StringFault, StringHardware,
    StringLosses,
};

use crate::device::Pose;
use crate::devices::spidar::SpidarPlacement;
use crate::placement::{at_point, off_point};

/// Grid of the simulation: a tenth of a 1 kHz tick.
const STEP: Duration = Duration::from_micros(100);
/// Most that is simulated in one call. After a longer silence the hand's time has stood still.
const LONGEST_SILENCE: Duration = Duration::from_secs(1);

/// Simulated encoders and motors, and the hand that holds their grip.
#[derive(Clone, Debug)]
pub struct HeldStrings {
    strings: SimulatedStrings,
    plant: Plant,
    placement: SpidarPlacement,
    /// Time of the first call.
    epoch: Option<Duration>,
    /// Time since `epoch` on the grid, simulated or skipped.
    elapsed: Duration,
}

impl HeldStrings {
    /// A grip at rest where `path` begins; all counters are zero with the grip at the centre of the frame, not turned. `path` holds
    /// poses of the body's own frame in the world; its time 0 is the first call.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        losses: StringLosses,
        placement: SpidarPlacement,
        hand: Hand,
        path: MinJerkPath,
        tremor: Option<Tremor>,
    ) -> Self {
        let path = path.map(|pose| at_point(pose, &placement.reference_point));
        let grip = string_grip(geometry, &placement);
        let plant = Plant::new(grip, hand, path);
        Self {
            strings: SimulatedStrings::new(geometry, losses, Pose::identity()),
            plant: match tremor {
                Some(tremor) => plant.with_tremor(tremor),
                None => plant,
            },
            placement,
            epoch: None,
            elapsed: Duration::ZERO,
        }
    }

    /// Replaces the hand, such as by [`Hand::RELEASED`]; pose and velocity go on.
    pub fn set_hand(&mut self, hand: Hand) {
        self.plant.set_hand(hand);
    }

    /// Where the held body truly is, world from body.
    #[must_use]
    pub fn true_pose(&self) -> Pose {
        off_point(self.plant.pose(), &self.placement.reference_point)
    }

    /// What truly moves the hand: N and N m at G, world axes.
    #[must_use]
    pub fn true_wrench(&self) -> &Vector6<f64> {
        self.plant.rendered_wrench()
    }

    /// Simulates the whole steps that fit before `now`.
    fn advance(&mut self, now: Duration) {
        let epoch = *self.epoch.get_or_insert(now);
        let passed = now.saturating_sub(epoch).as_nanos();
        let grid = Duration::from_nanos((passed - passed % STEP.as_nanos()) as u64);
        let skipped = grid
            .saturating_sub(self.elapsed)
            .saturating_sub(LONGEST_SILENCE);
        self.elapsed += skipped;
        while self.elapsed < grid {
            let pull = self.pull();
            self.plant.command(&pull);
            self.plant.advance(self.plant.time() + STEP);
            self.elapsed += STEP;
            self.strings.advance(self.elapsed, self.frame_from_grip());
        }
        if self.elapsed == Duration::ZERO {
            // The hand has taken the grip from the centre to where its path begins.
            self.strings.advance(Duration::ZERO, self.frame_from_grip());
        }
    }

    fn frame_from_grip(&self) -> Pose {
        let placement = &self.placement;
        placement.world_from_frame.inverse() * self.true_pose() * placement.grip_from_body.inverse()
    }

    /// The strings' wrench on the grip at G, world axes.
    fn pull(&self) -> Vector6<f64> {
        let about_centre = self.strings.wrench();
        let turn = self.placement.world_from_frame.rotation;
        let force: Vector3<f64> = turn * about_centre.fixed_rows::<3>(0);
        let torque: Vector3<f64> = turn * about_centre.fixed_rows::<3>(3);
        let centre = self.true_pose() * self.placement.grip_from_body.inverse() * Point3::origin();
        let lever = centre.coords - self.plant.pose().translation.vector;
        stack(&force, &(torque + lever.cross(&force)))
    }
}

impl StringHardware for HeldStrings {
    fn read_counts(&mut self, now: Duration) -> Result<Reading, StringFault> {
        self.advance(now);
        if !is_finite(self.plant.pose()) {
            return Err(StringFault::Hardware);
        }
        let reading = self.strings.read_counts(self.elapsed)?;
        Ok(Reading {
            time: self.epoch.unwrap_or(now) + self.elapsed,
            ..reading
        })
    }

    fn write_tensions(&mut self, now: Duration, tensions: &PerString) {
        self.advance(now);
        self.strings.write_tensions(self.elapsed, tensions);
    }
}

/// The grip of a geometry as the plant takes it: a ball with the geometry's damping, the motors' inertia at the centre of the frame,
/// and no limit of its own, since the strings have theirs.
#[must_use]
pub fn string_grip(geometry: &Geometry, placement: &SpidarPlacement) -> Grip {
    Grip {
        string_inertia: motor_inertia(geometry, placement),
        ..Grip::ball(geometry.grip_mass, geometry.arm(), geometry.grip_damping)
    }
}

/// What motors and drums add at G, with the grip at the centre of the frame.
fn motor_inertia(geometry: &Geometry, placement: &SpidarPlacement) -> Matrix6<f64> {
    let body = placement.world_from_frame * placement.grip_from_body;
    let at_g = at_point(&body, &placement.reference_point);
    let from_grip = at_g.inverse() * placement.world_from_frame;
    let anchors: [StringAnchors; STRINGS] = std::array::from_fn(|i| StringAnchors {
        motor: placement.world_from_frame * geometry.motors[i],
        grip: from_grip * geometry.grips[i],
    });
    string_inertia(
        &anchors,
        &at_g,
        geometry.motor_inertia,
        geometry.drum_radius,
    )
}
