//! Pose from lengths: convergence, singular grips, twist.

use std::time::Duration;

use crate::support::{Random, all, apart, motion, reach, shipped};
use nalgebra::{Point3, Vector6};
use proptest::prelude::*;
use taut_spidar::{
    DISAGREEMENT, Encoders, ForwardKinematics, Geometry, LengthRates, PerString, Pose, StringFault,
};

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn every_pose_of_the_workspace_is_found_from_the_centre(seed in 1_u64..) {
        let mut random = Random(seed);
        for geometry in all() {
            let pose = random.pose(0.5 * geometry.half_width(), 0.7);
            let answer = ForwardKinematics::new(&geometry).solve(&geometry.lengths(&pose));
            let Ok(answer) = answer else {
                return Err(TestCaseError::fail(format!("{}: {answer:?}", geometry.name)));
            };
            let (distance, angle) = apart(&answer.frame_from_grip, &pose);
            prop_assert!(distance < 1e-9 && angle < 1e-8, "{distance} {angle}");
            // Eight lengths, six unknowns.
            let redundancy: f64 = answer.leverage.iter().sum();
            prop_assert!((redundancy - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn from_too_far_away_a_wrong_pose_shows_by_its_disagreement(seed in 1_u64..) {
        let mut random = Random(seed);
        for geometry in all() {
            let pose = random.pose(0.8 * geometry.half_width(), 1.3);
            if let Ok(answer) = ForwardKinematics::new(&geometry).solve(&geometry.lengths(&pose)) {
                let (distance, angle) = apart(&answer.frame_from_grip, &pose);
                let right = distance < 1e-9 && angle < 1e-8;
                prop_assert!(right || answer.disagreement() > DISAGREEMENT, "{distance} {angle}");
            }
        }
    }

    #[test]
    fn the_pose_is_the_best_fit_of_lengths_that_disagree(seed in 1_u64..) {
        let mut random = Random(seed);
        for geometry in all() {
            let pose = random.pose(reach(&geometry), 0.5);
            let noise: PerString = std::array::from_fn(|_| 2e-4 * random.signed());
            let exact = geometry.lengths(&pose);
            let lengths = std::array::from_fn(|i| exact[i] + noise[i]);
            let mut kinematics = ForwardKinematics::new(&geometry);
            let Ok(answer) = kinematics.solve(&lengths) else {
                return Err(TestCaseError::fail("no pose"));
            };
            let cost = |pose: &Pose| -> f64 {
                let l = geometry.lengths(pose);
                (0..8).map(|i| (l[i] - lengths[i]) * (l[i] - lengths[i])).sum()
            };
            let best = cost(&answer.frame_from_grip);
            prop_assert!((best.sqrt() - answer.disagreement()).abs() < 1e-9);
            for _ in 0..20 {
                let nudge = random.pose(1e-5, 1e-5 / geometry.arm());
                let turned = nudge.rotation * answer.frame_from_grip.rotation;
                let place = answer.frame_from_grip.translation.vector + nudge.translation.vector;
                prop_assert!(cost(&Pose::from_parts(place.into(), turned)) >= best);
            }
        }
    }
}

#[test]
fn a_warm_start_takes_three_steps_at_one_kilohertz() {
    for geometry in all() {
        let mut kinematics = ForwardKinematics::new(&geometry);
        kinematics.start_at(motion(0.0, reach(&geometry), 0.5));
        for tick in 0..1000_u32 {
            let lengths = geometry.lengths(&motion(f64::from(tick) * 1e-3, reach(&geometry), 0.5));
            let Ok(answer) = kinematics.solve(&lengths) else {
                panic!("{}: a pose of the workspace", geometry.name);
            };
            assert!(
                answer.steps <= 3,
                "{}: {} steps",
                geometry.name,
                answer.steps
            );
        }
    }
}

#[test]
fn a_grip_without_a_second_lever_is_singular() {
    let mut geometry = shipped("wb");
    // All holes on one line: nothing sees the rotation about it.
    geometry.grips =
        std::array::from_fn(|i| Point3::new(if i % 2 == 0 { 0.06 } else { -0.06 }, 0.0, 0.0));
    let found = ForwardKinematics::new(&geometry).solve(&geometry.lengths(&Pose::identity()));
    assert_eq!(found.err(), Some(StringFault::Singular));
}

#[test]
fn lengths_of_no_pose_end_in_a_fault_or_a_large_disagreement() {
    for geometry in all() {
        let mut kinematics = ForwardKinematics::new(&geometry);
        let lengths = std::array::from_fn(|i| if i < 4 { 10.0 } else { 1e-3 });
        match kinematics.solve(&lengths) {
            Err(_) => {}
            Ok(answer) => assert!(answer.disagreement() > 1.0),
        }
        // The next good lengths are solved all the same.
        let pose = motion(0.1, reach(&geometry), 0.4);
        let Ok(answer) = kinematics.solve(&geometry.lengths(&pose)) else {
            panic!("{}: a pose of the workspace", geometry.name);
        };
        assert!(apart(&answer.frame_from_grip, &pose).0 < 1e-9);
    }
}

#[test]
fn the_twist_follows_the_motion_through_the_counts() {
    for geometry in all() {
        let mut kinematics = ForwardKinematics::new(&geometry);
        let mut rates = LengthRates::new(&geometry.metres_per_count);
        let pose = |time: f64| motion(time, reach(&geometry), 0.5);
        let encoders = Encoders::calibrated(&geometry, &Pose::identity(), &[0; 8]);
        let (mut square, mut count) = (Vector6::<f64>::zeros(), 0.0);
        for tick in 0..1000_u32 {
            let time = f64::from(tick) * 1e-3;
            let lengths = counted(&geometry, &encoders, &pose(time));
            let Ok(answer) = kinematics.solve(&lengths) else {
                panic!("{}: a pose of the workspace", geometry.name);
            };
            let twist = answer.twist(&rates.step(Duration::from_millis(tick.into()), &lengths));
            if tick > 20 {
                let (before, after) = (pose(time - 1e-5), pose(time + 1e-5));
                let v = (after.translation.vector - before.translation.vector) / 2e-5;
                let omega = (after.rotation * before.rotation.inverse()).scaled_axis() / 2e-5;
                let truth = Vector6::new(v.x, v.y, v.z, omega.x, omega.y, omega.z);
                square += (twist - truth).map(|x| x * x);
                count += 1.0;
            }
        }
        let rms = square.map(|x: f64| (x / count).sqrt());
        println!(
            "{}: rms error {:.4} m/s, {:.3} rad/s",
            geometry.name,
            rms.fixed_rows::<3>(0).max(),
            rms.fixed_rows::<3>(3).max()
        );
        // 1 to 3 Hz. A window's lag grows with the acceleration, which grows with the device.
        let allowed = 0.02 + 0.05 * reach(&geometry);
        assert!(rms.fixed_rows::<3>(0).max() < allowed, "{}", geometry.name);
        assert!(
            rms.fixed_rows::<3>(3).max() * geometry.arm() < allowed,
            "{}",
            geometry.name
        );
    }
}

/// Lengths as the encoders see them: whole counts.
fn counted(geometry: &Geometry, encoders: &Encoders, pose: &Pose) -> PerString {
    let zero = encoders.lengths(&[0; 8]);
    let lengths = geometry.lengths(pose);
    let counts = std::array::from_fn(|i| {
        let metres = geometry.metres_per_count[i];
        ((lengths[i] - zero[i]) / metres + 0.5).floor() as i32
    });
    encoders.lengths(&counts)
}
