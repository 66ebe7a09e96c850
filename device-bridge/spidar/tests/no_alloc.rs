//! What runs in the loop of a string device never allocates, faults included.

use std::time::Duration;

use crate::support::{all, motion, reach};
use assert_no_alloc::assert_no_alloc;
use nalgebra::Vector6;
use taut_spidar::{
    Encoders, ForwardKinematics, LengthRates, MotorState, Pose, ResidualMonitor, SimulatedStrings,
    StringHardware, StringLosses, StringMatrix, TensionSettings, TensionSolver,
};

#[test]
fn a_loop_of_a_string_device_does_not_allocate() {
    for geometry in all() {
        let mut strings = SimulatedStrings::new(
            &geometry,
            StringLosses {
                coulomb: 0.05,
                loss: 0.02,
            },
            Pose::identity(),
        );
        let encoders = Encoders::calibrated(&geometry, &Pose::identity(), &[0; 8]);
        let mut kinematics = ForwardKinematics::new(&geometry);
        let mut monitor = ResidualMonitor::new();
        let mut rates = LengthRates::new(&geometry.metres_per_count);
        let mut solver = TensionSolver::new(&geometry, TensionSettings::default());
        let (mut good, mut bad, mut alarms) = (0, 0, 0);
        assert_no_alloc(|| {
            for tick in 0..3000_u32 {
                let now = Duration::from_millis(tick.into());
                // Too far at the end: faults, too.
                let far = if tick < 2000 { 1.0 } else { 4.0 };
                strings.advance(now, motion(now.as_secs_f64(), reach(&geometry), far * 0.5));
                if tick == 1000 {
                    strings.slip(2, 2e-3);
                }
                if tick == 1500 {
                    strings.set_dead(1, true);
                    solver.set_motor(1, MotorState::Dead);
                    kinematics.use_string(1, false);
                }
                let Ok(reading) = strings.read_counts(now) else {
                    continue;
                };
                let mut lengths = encoders.lengths(&reading.counts);
                if tick % 500 == 499 {
                    lengths[0] = f64::NAN;
                }
                let Ok(answer) = kinematics.solve(&lengths) else {
                    bad += 1;
                    continue;
                };
                good += 1;
                alarms += u32::from(monitor.step(&answer).alarm);
                let twist = answer.twist(&rates.step(now, &lengths));
                let force = f64::from(tick) * 0.02;
                let wrench = Vector6::new(force, -force, 0.1, 0.0, 0.01, 0.0) - twist * 0.1;
                let tensions = solver.distribute(
                    &StringMatrix::at(&geometry, &answer.frame_from_grip),
                    &wrench,
                );
                strings.write_tensions(now, &tensions.tensions);
            }
        });
        assert!(
            good > 2000 && bad > 0 && alarms > 0,
            "{good} {bad} {alarms}"
        );
    }
}
