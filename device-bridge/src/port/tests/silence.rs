//! Inputs that are old, the same again, ahead of the clock or no numbers: the force is held, fades, and is gone in time.

use super::*;

#[test]
fn silence_is_held_for_20_ms_then_gone_before_120_ms_and_ramps_in_again_by_itself() {
    // Also where a person has to arm after a fault: silence is none.
    let mut stage = Stage::armed_by_a_person();
    let last = stage.now;
    let mut before = 10.0;
    for age in 1..=300 {
        let felt = stage.felt_of(last);
        match age {
            0..=20 => assert_eq!(felt, 10.0),
            21..115 => assert!(felt < before && felt > 0.0),
            _ => assert_eq!(felt, 0.0),
        }
        assert!(
            before - felt <= 10.0 / 95.0 + 1e-9,
            "step of {} N",
            before - felt
        );
        before = felt;
    }
    assert_eq!(stage.kinds(), [EventKind::ForceStale]);
    stage.good_for(ms(600), force(10.0));
    assert_eq!(
        stage.kinds(),
        [EventKind::ForceStale, EventKind::Arming, EventKind::Armed]
    );
}

#[test]
fn what_falls_for_a_wish_is_gone_as_early_as_what_falls_for_its_age() {
    for (disarmed, lost) in [(true, false), (true, true), (false, false), (false, true)] {
        let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
        // In full until 75 ms, and nothing newer comes.
        let origin = stage.now + stage.period - ms(74);
        for tick in 0..200 {
            if tick == 0 && disarmed {
                stage.port.ask_to_disarm();
            }
            let now = stage.now + stage.period;
            let answer = match tick {
                1.. if lost => Err(DeviceFault::NotFinite),
                _ => Ok(sample(now)),
            };
            let command = Command {
                paused: !disarmed,
                ..Command::on_set(origin, force(10.0))
            };
            let felt = stage.tick(answer, Some(command)).wrench.norm();
            assert!(tick > 0 || felt > 9.0, "{felt} N at first");
            let age = now - origin;
            assert!(
                felt == 0.0 || age < SafetySettings::ZERO_AFTER,
                "{felt} N at {age:?}, disarmed: {disarmed}, lost: {lost}"
            );
        }
    }
}

#[test]
fn nan_holds_the_last_force_and_lets_it_fade() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    for age in 1..=300 {
        let broken = Vector6::new(1.0, 2.0, 3.0, 0.0, f64::NAN, 0.0);
        let felt = stage.good(broken).wrench[0];
        assert!(felt <= 10.0 && felt.is_finite());
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::WrenchNotFinite]);
}

#[test]
fn a_driver_that_repeats_itself_has_lost_its_device() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = sample(stage.now);
    for age in 1..=200 {
        let now = stage.now + TICK;
        let felt = stage
            .tick(Ok(last), Some(Command::fresh(now, force(10.0))))
            .wrench[0];
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::DeviceLost]);
}

#[test]
fn commands_ahead_of_the_clock_prolong_no_silence() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    let last = stage.now;
    for age in 1..=200 {
        let ahead = stage.now + TICK + ms(50);
        let felt = stage.felt_of(if age <= 20 { last } else { ahead });
        assert_eq!(felt == 0.0, ms(age) >= GONE, "{felt} N at {age} ms");
    }
    assert_eq!(stage.kinds(), [EventKind::CommandNotOnClock]);
}
