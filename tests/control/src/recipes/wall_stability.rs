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
use taut_plant::{Hand, HandPreset};

use crate::Row;
use crate::closed_loop::{ClosedLoop, PERIOD, critical_stiffness, grip, held};
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

/// The published table of critical stiffness, 0.2 kg, 1 kHz, nobody holds the device: delays of its columns, s.
const DELAYS: [f64; 4] = [0.0, 0.5e-3, 1e-3, 2e-3];
/// Damping of the device and of the wall, N s/m; critical stiffness at each delay, N/m.
const CRITICAL: [(f64, f64, [f64; 4]); 6] = [
    (1.0, 0.0, [2002.0, 1001.0, 668.0, 401.0]),
    (1.0, 2.0, [5945.0, 2973.0, 1981.0, 1186.0]),
    (1.0, 5.0, [11714.0, 5857.0, 3895.0, 2321.0]),
    (1.0, 10.0, [20947.0, 10466.0, 6936.0, 4097.0]),
    (5.0, 0.0, [10042.0, 5026.0, 3356.0, 2021.0]),
    (5.0, 5.0, [19594.0, 9805.0, 6530.0, 3905.0]),
];
/// With a light hand (and 1 N s/m of the device): delay, s; critical stiffness, N/m.
const CRITICAL_LIGHT: [(f64, f64); 2] = [(0.0, 10_024.0), (1e-3, 3347.0)];

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
    /// 1 N s/m, 1 kHz, a tick of delay, nobody holds.
    pub const STANDARD: Self = Self {
        damping: 1.0,
        virtual_damping: 0.0,
        delay: 1e-3,
        period: 1e-3,
        hand: HandPreset::Released,
    };

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
        critical_stiffness(SEARCH, SEARCH_WIDTH, |stiffness| self.grows(stiffness))
    }

    /// Whether 1 mm grows over 2 s.
    fn grows(&self, stiffness: f64) -> bool {
        let settings = linear(stiffness);
        let set = contacts(&settings, &both_sides_of_x());
        let device = grip(self.damping);
        let plant = held(device, self.hand.into(), Pose::identity(), self.delay);
        let mut run = ClosedLoop::new(&cube(), &settings, set, plant);
        run.plant
            .place(Pose::translation(DISTURBANCE, 0.0, 0.0), Vector6::zeros());
        run.period = Duration::from_secs_f64(self.period);
        run.virtual_damping = Vector6::x() * self.virtual_damping;
        let mass = 0.2 + Hand::from(self.hand).mass;
        let frequency = (stiffness / mass).sqrt();
        grows(&mut run, 0, frequency)
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

/// A wall that holds the body about z: the torque's loop, N m/rad.
fn about_z(delay: f64) -> (f64, f64) {
    let device = grip(1.0);
    let world = cube();
    let inertia = world.body.inertia[(2, 2)];
    let simulated = critical_stiffness(SEARCH, SEARCH_WIDTH, |stiffness| {
        let settings = linear(stiffness);
        let set = contacts(&settings, &stops_about_z());
        let plant = held(device, Hand::RELEASED, Pose::identity(), delay);
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
pub(crate) fn run() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut printed = 0.0_f64;
    for (damping, virtual_damping, table) in CRITICAL {
        for (delay, table) in DELAYS.into_iter().zip(table) {
            let case = Case {
                damping,
                virtual_damping,
                delay,
                ..Case::STANDARD
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
            delay,
            hand: HandPreset::Light,
            ..Case::STANDARD
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
                    hand,
                    ..Case::STANDARD
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
