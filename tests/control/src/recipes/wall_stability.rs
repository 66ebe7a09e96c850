//! R15: the stiffness at which a disturbance of a wall begins to grow, by simulation, against the eigenvalues.
//!
//! | symbol | name in code | unit  | meaning                                            |
//! |--------|--------------|-------|----------------------------------------------------|
//! | b      | `damping`    | N s/m | of the device                                      |
//! | B      | `virtual_damping` | N s/m | of the wall                                   |
//! | t_d    | `delay`      | s     | of the force                                       |
//! | K_crit |              | N/m   | above it 1 mm grows over 2 s, below it dies away   |
//!
//! The simulation knows nothing of the eigenvalues: the search begins with a bracket that holds every case.

use std::time::Duration;

use god_object::{Pose, Vector6};
use taut_plant::stability::SampledLoop;
use taut_plant::{Hand, HandPreset, MinJerkPath, Motors, Plant};

use crate::Row;
use crate::closed_loop::{ClosedLoop, PERIOD, grip};
use crate::wall_table::{CRITICAL, CRITICAL_LIGHT, DELAYS};
use crate::walls::{both_sides_of_x, contacts, cube, linear, stops_about_z};

/// How near simulation and eigenvalues must be.
const TOLERANCE: f64 = 0.02;
/// How near the eigenvalues must be to the printed table: its rounding.
const PRINTED: f64 = 1e-3;
/// The disturbance, m or rad.
const DISTURBANCE: f64 = 1e-3;
/// Ticks of a run: 2 s.
const TICKS: u32 = 2000;
/// A disturbance that has grown this much need not be followed further.
const GROWN: f64 = 100.0;
/// Softest and stiffest wall of the search, N/m (of 1 kg).
const SEARCH: [f64; 2] = [20.0, 500_000.0];
/// Relative width at which the search ends.
const SEARCH_WIDTH: f64 = 1e-3;

/// One case of the sweep.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// b of the device, N s/m.
    pub damping: f64,
    /// B of the wall, N s/m.
    pub virtual_damping: f64,
    /// t_d, s.
    pub delay: f64,
    /// T, s.
    pub period: f64,
    /// Who holds the device.
    pub hand: HandPreset,
}

impl Case {
    /// K_crit of the sampled loop by its eigenvalues, N/m.
    pub fn by_eigenvalues(&self) -> f64 {
        let device = grip(self.damping);
        SampledLoop {
            mass: device.mass,
            damping: self.damping,
            delay: self.delay,
            virtual_damping: self.virtual_damping,
            ..SampledLoop::at_period(self.period)
        }
        .held_along(&Hand::from(self.hand))
        .critical_stiffness()
    }

    /// K_crit by simulation with the real coupling, N/m.
    pub fn by_simulation(&self) -> f64 {
        critical(|stiffness| self.grows(stiffness))
    }

    /// Whether 1 mm grows over 2 s.
    fn grows(&self, stiffness: f64) -> bool {
        let settings = linear(stiffness);
        let set = contacts(&settings, &both_sides_of_x());
        let mut run = ClosedLoop::new(&cube(), &settings, set, self.plant());
        run.plant
            .place(Pose::translation(DISTURBANCE, 0.0, 0.0), Vector6::zeros());
        run.period = Duration::from_secs_f64(self.period);
        run.virtual_damping = Vector6::x() * self.virtual_damping;
        let mass = 0.2 + Hand::from(self.hand).mass;
        let frequency = (stiffness / mass).sqrt();
        grows(&mut run, 0, frequency)
    }

    fn plant(&self) -> Plant {
        let path = MinJerkPath::hold(Pose::identity());
        Plant::new(grip(self.damping), self.hand.into(), path)
            .with_motors(Motors {
                delay: Duration::from_secs_f64(self.delay),
                lag: Duration::ZERO,
            })
            .with_longest_step(PERIOD)
    }
}

/// Whether the disturbance along `axis` grows between the first and the last part of a run. `frequency` (rad/s) weighs the velocity.
fn grows(run: &mut ClosedLoop, axis: usize, frequency: f64) -> bool {
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    for tick in 0..TICKS {
        run.tick();
        let place = if axis < 3 {
            run.plant.pose().translation.vector[axis]
        } else {
            run.plant.pose().rotation.scaled_axis()[axis - 3]
        };
        let size = place.hypot(run.plant.velocity()[axis] / frequency);
        if size.is_nan() || size > GROWN * DISTURBANCE {
            return true;
        }
        match tick {
            200..700 => early = early.max(size),
            1500.. => late = late.max(size),
            _ => {}
        }
    }
    late > early
}

/// The boundary between what dies away and what grows, by bisection.
fn critical(grows: impl Fn(f64) -> bool) -> f64 {
    let [mut calm, mut wild] = SEARCH;
    while wild / calm > 1.0 + SEARCH_WIDTH {
        let middle = (calm * wild).sqrt();
        if grows(middle) {
            wild = middle;
        } else {
            calm = middle;
        }
    }
    (calm * wild).sqrt()
}

/// A wall that holds the body about z: the torque's loop, N m/rad.
fn about_z(delay: f64) -> (f64, f64) {
    let device = grip(1.0);
    let world = cube();
    let inertia = world.body.inertia[(2, 2)];
    let simulated = critical(|stiffness| {
        let settings = linear(stiffness);
        let set = contacts(&settings, &stops_about_z());
        let plant = Plant::new(device, Hand::RELEASED, MinJerkPath::hold(Pose::identity()))
            .with_motors(Motors {
                delay: Duration::from_secs_f64(delay),
                lag: Duration::ZERO,
            })
            .with_longest_step(PERIOD);
        let mut run = ClosedLoop::new(&world, &settings, set, plant);
        let turned = Pose::rotation(nalgebra::Vector3::z() * DISTURBANCE);
        run.plant.place(turned, Vector6::zeros());
        let frequency = (stiffness * inertia / device.rotational_inertia).sqrt();
        grows(&mut run, 5, frequency)
    });
    let exact = SampledLoop {
        mass: device.rotational_inertia,
        damping: device.rotational_damping.z,
        delay,
        ..SampledLoop::at_period(PERIOD.as_secs_f64())
    };
    (simulated * inertia, exact.critical_stiffness())
}

/// The printed table, the light hand's, every hand, and the rotation.
#[must_use]
pub fn run() -> Vec<Row> {
    let mut rows = Vec::new();
    let period = PERIOD.as_secs_f64();
    let mut printed = 0.0_f64;
    for (damping, virtual_damping, table) in CRITICAL {
        for (delay, table) in DELAYS.into_iter().zip(table) {
            let case = Case {
                damping,
                virtual_damping,
                delay,
                period,
                hand: HandPreset::Released,
            };
            printed = printed.max((case.by_eigenvalues() / table - 1.0).abs());
            rows.push(Row::within(
                format!("b {damping}, B {virtual_damping}, {} ms", delay * 1e3),
                case.by_simulation(),
                table,
                TOLERANCE,
                "N/m",
            ));
        }
    }
    for (delay, table) in CRITICAL_LIGHT {
        let case = Case {
            damping: 1.0,
            virtual_damping: 0.0,
            delay,
            period,
            hand: HandPreset::Light,
        };
        printed = printed.max((case.by_eigenvalues() / table - 1.0).abs());
        let name = format!("b 1, B 0, {} ms, light hand", delay * 1e3);
        rows.push(Row::within(
            name,
            case.by_simulation(),
            table,
            TOLERANCE,
            "N/m",
        ));
    }
    rows.push(Row::at_most(
        "eigenvalues against the printed table",
        printed,
        PRINTED,
        "",
    ));
    rows.push(sweep());
    for delay in [0.0, 1e-3] {
        let (simulated, exact) = about_z(delay);
        let name = format!("about z, {} ms", delay * 1e3);
        rows.push(Row::within(name, simulated, exact, TOLERANCE, "N m/rad"));
    }
    rows
}

/// Every hand with every delay, at the ends of both dampings, against the eigenvalues.
fn sweep() -> Row {
    let mut worst = 0.0_f64;
    let mut cases = 0;
    for (_, hand) in HandPreset::NAMED {
        for (damping, virtual_damping) in [(0.5, 0.0), (0.5, 10.0), (2.0, 2.0), (5.0, 10.0)] {
            for delay in DELAYS {
                let case = Case {
                    damping,
                    virtual_damping,
                    delay,
                    period: PERIOD.as_secs_f64(),
                    hand,
                };
                let ratio = case.by_simulation() / case.by_eigenvalues();
                worst = worst.max((ratio - 1.0).abs());
                cases += 1;
            }
        }
    }
    let name = format!("largest deviation from the eigenvalues, {cases} cases with every hand");
    Row::at_most(name, worst, TOLERANCE, "")
}
