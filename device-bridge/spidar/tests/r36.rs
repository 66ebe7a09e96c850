//! Faults of a string device: motor dead, one string miscalibrated, slack, infeasible wrench, turned too far, near a motor.

mod support;

use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use support::{Random, all, apart, motion, reach};
use taut_spidar::{
    Encoders, ForwardKinematics, Geometry, MotorState, Pose, ResidualMonitor, SimulatedStrings,
    StringFault, StringHardware, StringLosses, StringMatrix, TensionSettings, TensionSolver,
    TensionStatus,
};

/// N; N m over G counts like N.
fn six(force: Vector3<f64>, torque: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

/// Size with torque over G.
fn size(wrench: &Vector6<f64>, arm: f64) -> f64 {
    (wrench.fixed_rows::<3>(0).norm_squared()
        + wrench.fixed_rows::<3>(3).norm_squared() / (arm * arm))
        .sqrt()
}

fn solver(geometry: &Geometry) -> TensionSolver {
    TensionSolver::new(geometry, TensionSettings::default())
}

#[test]
fn a_wrench_outside_the_feasible_set_keeps_its_direction_and_is_flagged() {
    for geometry in all() {
        let mut solver = solver(&geometry);
        let mut random = Random(11);
        let mut scaled = 0;
        for _ in 0..1000 {
            let pose = random.pose(0.5 * reach(&geometry), 0.2);
            let strings = StringMatrix::at(&geometry, &pose);
            let force = random.direction() * (4.0 * geometry.tension_max);
            let torque = random.in_ball() * (geometry.tension_max * geometry.arm());
            let wrench = six(force, torque);
            let answer = solver.distribute(&strings, &wrench);
            assert_ne!(answer.status, TensionStatus::Rendered);
            if answer.status != TensionStatus::Scaled {
                continue; // the zero wrench itself is at the edge here
            }
            scaled += 1;
            let off = size(&(answer.wrench - answer.scale * wrench), geometry.arm());
            let kept = answer.scale * size(&wrench, geometry.arm());
            assert!(
                off <= 1e-3 * kept + 1e-3,
                "{}: {off} N of {kept} N",
                geometry.name
            );
            // Largest: a hundredth more cannot be rendered.
            let more = wrench * (1.01 * answer.scale);
            let bigger = solver.feasible_scale(&strings, &more);
            assert!(bigger.is_some_and(|scale| scale < 0.995), "{bigger:?}");
        }
        assert!(scaled > 800, "{}: {scaled}", geometry.name);
    }
}

#[test]
fn with_a_dead_motor_the_nearest_wrench_is_rendered_and_flagged() {
    for geometry in all() {
        let mut random = Random(12);
        for dead in 0..8 {
            let mut solver = solver(&geometry);
            solver.set_motor(dead, MotorState::Dead);
            let (mut exact, mut flagged) = (0, 0);
            for _ in 0..200 {
                let strings =
                    StringMatrix::at(&geometry, &random.pose(0.5 * reach(&geometry), 0.2));
                let wrench = six(
                    random.in_ball() * (0.2 * geometry.tension_max),
                    random.in_ball() * (0.05 * geometry.tension_max * geometry.arm()),
                );
                let answer = solver.distribute(&strings, &wrench);
                assert_eq!(answer.tensions[dead], 0.0);
                assert!(answer.kkt_residual < 1e-10);
                let off = size(&(answer.wrench - wrench), geometry.arm());
                if answer.status == TensionStatus::Rendered {
                    exact += 1;
                    assert!(off <= 1e-3 * size(&wrench, geometry.arm()) + 1e-4);
                } else {
                    flagged += 1;
                    assert!(off > 0.0);
                }
            }
            assert!(
                exact > 0 && flagged > 0,
                "{}: {exact} {flagged}",
                geometry.name
            );
        }
    }
}

#[test]
fn a_motor_of_unknown_pull_states_what_it_may_add() {
    for geometry in all() {
        let mut solver = solver(&geometry);
        solver.set_motor(3, MotorState::Unknown);
        let strings = StringMatrix::at(&geometry, &Pose::identity());
        let answer = solver.distribute(&strings, &Vector6::zeros());
        assert_eq!(answer.uncertainty, geometry.tension_max);
        assert_eq!(answer.tensions[3], 0.0);
    }
}

#[test]
fn a_millimetre_on_one_string_is_caught_and_the_string_is_named() {
    for geometry in all() {
        for bad in 0..8 {
            let start = motion(0.0, reach(&geometry), 0.5);
            let mut strings = SimulatedStrings::new(&geometry, StringLosses::default(), start);
            let Ok(reading) = strings.read_counts(Duration::ZERO) else {
                panic!("simulated strings answer");
            };
            let encoders = Encoders::calibrated(&geometry, &start, &reading.counts);
            let mut kinematics = ForwardKinematics::new(&geometry);
            let mut monitor = ResidualMonitor::new();
            kinematics.start_at(start);
            let (mut alarmed, mut named) = (None, None);
            for tick in 0..3000_u32 {
                let now = Duration::from_millis(tick.into());
                if tick == 1000 {
                    strings.slip(bad, 1e-3);
                }
                let pose = motion(now.as_secs_f64(), reach(&geometry), 0.5);
                strings.advance(now, pose);
                let Ok(reading) = strings.read_counts(now) else {
                    panic!("simulated strings answer");
                };
                let answer = kinematics.solve(&encoders.lengths(&reading.counts));
                let Ok(answer) = answer else {
                    panic!("{}: {answer:?}", geometry.name);
                };
                let consistency = monitor.step(&answer);
                if consistency.alarm {
                    alarmed.get_or_insert(tick);
                }
                // The estimate sharpens as the grip moves on.
                if let Some(culprit) = consistency.culprit() {
                    assert_eq!(culprit, bad, "{}", geometry.name);
                    let error = consistency.suspect.map_or(0.0, |suspect| suspect.error);
                    let allowed = if tick < 2500 { 0.3e-3 } else { 0.1e-3 };
                    assert!((error - 1e-3).abs() < allowed, "{error}");
                    named.get_or_insert(tick);
                }
            }
            println!(
                "{} string {bad}: alarm {alarmed:?}, named {named:?}",
                geometry.name
            );
            assert!(
                alarmed.is_some_and(|tick| tick < 1100),
                "{}: {alarmed:?}",
                geometry.name
            );
            assert!(named.is_some(), "{} string {bad}", geometry.name);
        }
    }
}

#[test]
fn a_slack_string_shows_and_the_others_still_give_the_pose() {
    for geometry in all() {
        let start = Pose::identity();
        let mut strings =
            SimulatedStrings::new(&geometry, StringLosses::default(), start).measuring_tensions();
        let Ok(reading) = strings.read_counts(Duration::ZERO) else {
            panic!("simulated strings answer");
        };
        let encoders = Encoders::calibrated(&geometry, &start, &reading.counts);
        let mut kinematics = ForwardKinematics::new(&geometry);
        strings.set_dead(0, true);
        // Towards motor 0: its string is not wound up.
        let towards = (geometry.motors[0].coords).normalize() * 3e-3;
        for tick in 1..=200_u32 {
            let share = f64::from(tick) / 200.0;
            strings.advance(
                Duration::from_millis(tick.into()),
                Pose::from_parts((towards * share).into(), start.rotation),
            );
        }
        let Ok(reading) = strings.read_counts(Duration::from_millis(200)) else {
            panic!("simulated strings answer");
        };
        assert!(
            reading
                .tensions
                .is_some_and(|tensions| tensions[0] < geometry.tension_min)
        );
        let lengths = encoders.lengths(&reading.counts);
        // With the slack string the lengths disagree ...
        let Ok(with) = kinematics.solve(&lengths) else {
            panic!("{}: a pose", geometry.name);
        };
        assert!(
            ResidualMonitor::new().step(&with).alarm,
            "{}",
            geometry.name
        );
        // ... and without it the pose is right.
        kinematics.use_string(0, false);
        let Ok(without) = kinematics.solve(&lengths) else {
            panic!("{}: a pose", geometry.name);
        };
        let (distance, angle) = apart(&without.frame_from_grip, strings.pose());
        let count = geometry.metres_per_count[0].abs();
        assert!(
            distance < 5.0 * count && angle < 5.0 * count / geometry.arm(),
            "{}: {distance} m {angle}",
            geometry.name
        );
        assert!(without.disagreement() < 3.0 * count);
        // Five strings are too few.
        kinematics.use_string(1, false);
        kinematics.use_string(2, false);
        let few = kinematics.solve(&lengths).err();
        assert_eq!(few, Some(StringFault::TooFewStrings(5)));
    }
}

#[test]
fn a_grip_turned_beyond_a_right_angle_is_a_fault() {
    for geometry in all() {
        let mut kinematics = ForwardKinematics::new(&geometry);
        let mut fault = None;
        for tick in 0..=200_u32 {
            let angle = f64::from(tick).to_radians() * 0.6;
            let pose = Pose::new(
                Vector3::zeros(),
                Vector3::new(0.2, 0.9, 0.1).normalize() * angle,
            );
            match kinematics.solve(&geometry.lengths(&pose)) {
                Ok(answer) => {
                    assert!(
                        angle <= std::f64::consts::FRAC_PI_2 + 1e-9,
                        "{} {angle}",
                        geometry.name
                    );
                    assert!(apart(&answer.frame_from_grip, &pose).1 < 1e-6);
                }
                Err(found) => {
                    fault = Some((angle, found));
                    break;
                }
            }
        }
        let Some((angle, found)) = fault else {
            panic!("{}: no fault", geometry.name);
        };
        println!("{}: {found} at {:.1}", geometry.name, angle.to_degrees());
        assert!(
            angle > 1.5,
            "{}: a fault only near a right angle: {angle}",
            geometry.name
        );
    }
}

#[test]
fn a_grip_near_a_motor_is_a_fault() {
    for geometry in all() {
        // The hole of the grip moves to motor 5.
        let to = geometry.motors[5] - geometry.grips[5];
        let mut kinematics = ForwardKinematics::new(&geometry);
        let mut fault = None;
        for tick in 0..=1000_u32 {
            let pose = Pose::from_parts(
                (to * (f64::from(tick) / 1000.0)).into(),
                Pose::identity().rotation,
            );
            let lengths = geometry.lengths(&pose);
            if let Err(found) = kinematics.solve(&lengths) {
                fault = Some((lengths[5], found));
                break;
            }
        }
        let Some((length, found)) = fault else {
            panic!("{}: no fault", geometry.name);
        };
        println!("{}: {found}", geometry.name);
        assert!(
            matches!(found, StringFault::NearMotor { string: 5, .. }),
            "{found:?}"
        );
        assert!((0.008..=0.010).contains(&length), "{length}");
    }
}

#[test]
fn what_is_not_a_number_is_a_fault_and_pulls_no_harder_than_pretension() {
    for geometry in all() {
        let mut kinematics = ForwardKinematics::new(&geometry);
        let mut lengths = geometry.lengths(&Pose::identity());
        lengths[4] = f64::NAN;
        assert_eq!(
            kinematics.solve(&lengths).err(),
            Some(StringFault::NotFinite(4))
        );
        // The next good sample works again.
        lengths[4] = lengths[0];
        assert!(
            kinematics
                .solve(&geometry.lengths(&Pose::identity()))
                .is_ok()
        );

        let strings = StringMatrix::at(&geometry, &Pose::identity());
        let answer = solver(&geometry).distribute(&strings, &(Vector6::x() * f64::NAN));
        assert_eq!(answer.status, TensionStatus::NotFinite);
        assert_eq!(answer.tensions, [geometry.tension_min; 8]);
    }
}

#[test]
fn at_rest_the_alarm_is_raised_but_no_innocent_string_is_named() {
    for geometry in all() {
        let mut random = Random(31);
        for bad in 0..8 {
            for pose in [Pose::identity(), random.pose(reach(&geometry), 0.5)] {
                let mut lengths = geometry.lengths(&pose);
                lengths[bad] += 1e-3;
                let mut kinematics = ForwardKinematics::new(&geometry);
                let mut monitor = ResidualMonitor::new();
                for _ in 0..500 {
                    let Ok(answer) = kinematics.solve(&lengths) else {
                        panic!("{}: a pose of the workspace", geometry.name);
                    };
                    let consistency = monitor.step(&answer);
                    let culprit = consistency.culprit();
                    assert!(
                        culprit.is_none_or(|culprit| culprit == bad),
                        "{} string {bad}: {consistency:?}",
                        geometry.name
                    );
                    assert!(consistency.alarm || pose != Pose::identity());
                }
            }
        }
    }
}
