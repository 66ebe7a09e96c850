//! Whatever goes wrong, one thing after another: the promises of the port hold.

use proptest::prelude::*;

use super::*;

/// One of the things that go wrong, for some ticks.
#[derive(Clone, Copy, Debug)]
enum Fault {
    Origin,
    Frozen,
    Nan,
    Jump,
    TimeBack,
    Unplugged,
    WrenchNan,
    CommandsStop,
    ConstraintsStop,
    CommandsAhead,
    Paused,
    Disarm,
    None,
}

fn faults() -> impl Strategy<Value = Vec<(Fault, u64, f64)>> {
    let fault = prop_oneof![
        Just(Fault::Origin),
        Just(Fault::Frozen),
        Just(Fault::Nan),
        Just(Fault::Jump),
        Just(Fault::TimeBack),
        Just(Fault::Unplugged),
        Just(Fault::WrenchNan),
        Just(Fault::CommandsStop),
        Just(Fault::ConstraintsStop),
        Just(Fault::CommandsAhead),
        Just(Fault::Paused),
        Just(Fault::Disarm),
        Just(Fault::None),
    ];
    prop::collection::vec((fault, 1_u64..200, -30.0..30.0_f64), 1..12)
}

proptest! {
    #[test]
    fn whatever_goes_wrong_the_force_changes_slowly_and_is_gone_in_time(
        sequence in faults(),
        automatic in any::<bool>(),
        rate_hz in prop::sample::select(vec![100_u32, 300, 1000, 4000]),
        speed in 0.2..1.0_f64,
        // A set that waited for a network this long is rendered in full.
        age_ms in 0_u64..75,
    ) {
        let settings = SafetySettings {
            period: Duration::from_secs(1) / rate_hz,
            rearm: if automatic { Rearm::Automatic } else { Rearm::Manual },
            ..SafetySettings::default()
        };
        let mut stage = Stage::new(settings);
        stage.speed = speed;
        let sample = |now| sample_at(now, speed);
        let _ = stage.good(force(5.0));
        stage.port.ask_to_arm();
        stage.good_for(ms(600), force(5.0));
        // What a write may change: unexplained, and what the motion explains; N and N m.
        let period = settings.period.as_secs_f64();
        let (own, own_torque) = (500.0 * period.min(0.002), 50.0 * period.min(0.002));
        let explained = (1.5 * 1000.0 * speed * period).min(4.0 * own);
        let explained_torque = (1.5 * 100.0 * speed * period).min(4.0 * own_torque);
        // When the newest good sample came, and what the newest good command comes from.
        let age = ms(age_ms);
        let (mut good_sample, mut good_command) = (stage.now, stage.now);
        let mut before = *stage.port.rendered();
        let mut last_pose = Some(sample(stage.now).pose);
        // For how long the pose has been the same.
        let mut stood = Duration::ZERO;
        let mut after_fault = false;
        for (fault, duration_ms, newtons) in sequence {
            let begun = stage.now;
            let mut jumped = false;
            let mut is_first = true;
            while stage.now < begun + ms(duration_ms) {
                let now = stage.now + settings.period;
                let mut answer = Ok(sample(now));
                let mut command = Command::on_set(now - age, Vector6::new(newtons, 3.0, 0.0, 0.0, 0.3, 0.0));
                let (mut sample_is_good, mut command_is_good) = (true, true);
                match fault {
                    Fault::Origin => answer = Ok(DeviceSample { pose: Pose::identity(), ..sample(now) }),
                    Fault::Frozen => answer = Ok(DeviceSample { time: now, ..sample(begun) }),
                    Fault::Nan => answer = Ok(DeviceSample { pose: Pose::translation(f64::NAN, 0.0, 0.0), ..sample(now) }),
                    Fault::Jump => answer = Ok(DeviceSample { pose: Pose::translation(9.0, 0.0, 0.0), ..sample(now) }),
                    Fault::TimeBack => answer = Ok(DeviceSample { time: now - ms(300), ..sample(now) }),
                    Fault::Unplugged => answer = Err(DeviceFault::Lost { age: now - begun }),
                    Fault::WrenchNan => command.wrench[3] = f64::NAN,
                    Fault::CommandsStop => command.origin = good_command,
                    Fault::ConstraintsStop => command.constraint_age = now - begun,
                    Fault::CommandsAhead => command.origin = now + ms(50),
                    Fault::Paused => command.paused = true,
                    Fault::Disarm => stage.port.ask_to_disarm(),
                    Fault::None => {}
                }
                if matches!(fault, Fault::Origin | Fault::Frozen | Fault::Nan | Fault::Jump | Fault::TimeBack | Fault::Unplugged) {
                    sample_is_good = false;
                }
                if matches!(fault, Fault::WrenchNan | Fault::CommandsStop | Fault::CommandsAhead) {
                    command_is_good = false;
                }
                let pose = answer.map(|sample| sample.pose).ok();
                stood = if pose == last_pose { stood + settings.period } else { Duration::ZERO };
                // A device that has stood somewhere else for long enough is there, and one that stands still after another fault rests: where it froze
                // before, it comes back somewhere else.
                let stands = match fault {
                    Fault::Origin | Fault::Jump => stood > ms(100),
                    Fault::Frozen => (after_fault || jumped) && stage.now > begun + ms(100),
                    _ => false,
                };
                if stands {
                    sample_is_good = true;
                }
                // What stands still froze when it moved last.
                if matches!(fault, Fault::Frozen) && pose != last_pose {
                    sample_is_good = true;
                }
                last_pose = pose;
                let report = stage.tick(answer, Some(command));
                jumped |= is_first && stage.port.fault().is_some();
                is_first = false;
                if sample_is_good {
                    good_sample = stage.now;
                }
                if command_is_good {
                    good_command = stage.now - age;
                }
                let felt = report.wrench;
                prop_assert!(felt.iter().all(|x| x.is_finite()));
                let part = |wrench: &Vector6<f64>, start: usize| wrench.fixed_rows::<3>(start).norm();
                prop_assert!(part(&felt, 0) <= 20.0 * (1.0 + 1e-12));
                prop_assert!(part(&felt, 3) <= 0.5 * (1.0 + 1e-12));
                // Motion explains nothing of a force that comes, is held or goes away.
                let answers = report.state == ArmingState::Armed;
                let (more, more_torque) = if answers { (explained, explained_torque) } else { (0.0, 0.0) };
                prop_assert!(part(&(felt - before), 0) <= (own + more) * (1.0 + 1e-9));
                prop_assert!(part(&(felt - before), 3) <= (own_torque + more_torque) * (1.0 + 1e-9));
                let silent = stage.now - good_sample.min(good_command);
                if silent >= SafetySettings::ZERO_AFTER {
                    prop_assert_eq!(felt, Vector6::zeros(), "{:?} for {:?}", fault, silent);
                }
                let wished = matches!(fault, Fault::Paused | Fault::Disarm);
                if wished && stage.now - begun >= SafetySettings::ZERO_AFTER {
                    prop_assert_eq!(felt, Vector6::zeros(), "{:?}", fault);
                }
                before = felt;
            }
            after_fault = stage.port.fault().is_some();
        }
    }
}
