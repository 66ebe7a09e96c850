//! When there is force: by itself, or when a person asks for it.

use super::*;

#[test]
fn the_force_ramps_in_by_itself_or_when_somebody_asks() {
    let mut stage = Stage::new(SafetySettings::default());
    for tick in 0..=500 {
        let felt = stage.good(force(10.0)).wrench[0];
        assert!(
            (felt - 10.0 * f64::from(tick) / 500.0).abs() < 1e-9,
            "{tick}: {felt}"
        );
    }
    assert_eq!(stage.kinds(), [EventKind::Arming, EventKind::Armed]);

    let mut stage = Stage::new(manual());
    for _ in 0..1000 {
        assert_eq!(stage.good(force(10.0)).wrench, Vector6::zeros());
    }
    assert_eq!(stage.port.state(), ArmingState::Disarmed);
    stage.port.ask_to_arm();
    for _ in 0..=501 {
        let _ = stage.good(force(10.0));
    }
    assert_eq!(stage.port.rendered(), &force(10.0));
}

#[test]
fn nobody_arms_a_device_that_is_not_in_order() {
    let mut stage = Stage::new(manual());
    stage.port.ask_to_arm();
    let _ = stage.tick(Err(DeviceFault::NotStarted), None);
    stage.good_for(ms(500), force(10.0));
    assert_eq!(
        stage.kinds(),
        [
            EventKind::DeviceNotStarted,
            EventKind::ArmRefused,
            EventKind::DeviceBack
        ]
    );
    assert_eq!(stage.port.rendered(), &Vector6::zeros());
}

#[test]
fn a_fault_waits_for_a_person_where_that_is_wanted() {
    let mut stage = Stage::armed_by_a_person();
    let mut jump = sample(stage.now + TICK);
    jump.pose.translation.vector.x += 0.2;
    let _ = stage.tick(Ok(jump), Some(Command::fresh(stage.now, force(10.0))));
    stage.good_for(ms(1000), force(10.0));
    assert_eq!(stage.port.state(), ArmingState::Faulted);
    assert_eq!(
        stage.kinds(),
        [
            EventKind::DeviceTeleported,
            EventKind::DeviceBack,
            EventKind::RearmNeeded
        ]
    );
    assert!(
        (stage.events[0].value - 200.2).abs() < 0.1,
        "{}",
        stage.events[0]
    );
    stage.port.ask_to_arm();
    let _ = stage.good(force(10.0));
    assert_eq!(stage.port.state(), ArmingState::Arming);
}

#[test]
fn the_dead_mans_button_is_the_force() {
    let settings = SafetySettings {
        dead_man: Some(2),
        ..manual()
    };
    let mut stage = Stage::new(settings);
    let mut run = |ticks, buttons| (stage.held(ticks, buttons), stage.port.state());
    // What is held at the start was not pressed.
    assert_eq!(run(700, 0b100), (0.0, ArmingState::Disarmed));
    assert_eq!(run(10, 0), (0.0, ArmingState::Disarmed));
    assert_eq!(run(10, 0b011), (0.0, ArmingState::Disarmed));
    assert_eq!(run(700, 0b100), (10.0, ArmingState::Armed));
    assert!(run(50, 0).0 < 10.0);
    assert_eq!(run(60, 0), (0.0, ArmingState::Disarmed));
    assert_eq!(run(700, 0b110), (10.0, ArmingState::Armed));
    assert!(stage.kinds().contains(&EventKind::DeadManReleased));
}

#[test]
fn who_disarms_is_asked_before_there_is_force_again() {
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    stage.port.ask_to_disarm();
    stage.good_for(ms(1000), force(10.0));
    assert_eq!(stage.port.rendered(), &Vector6::zeros());
    assert_eq!(stage.kinds(), [EventKind::Disarmed]);
    stage.port.ask_to_arm();
    stage.good_for(ms(600), force(10.0));
    assert_eq!(stage.port.rendered(), &force(10.0));
}

#[test]
fn a_pause_of_whoever_commands_fades_and_what_comes_after_it_ramps_in() {
    let automatic = Stage::armed(SafetySettings::default(), force(10.0));
    for mut stage in [automatic, Stage::armed_by_a_person()] {
        let mut paused_for = |time: u64| {
            for _ in 0..time {
                let now = stage.now + stage.period;
                let command = Command {
                    paused: true,
                    ..Command::fresh(now, force(10.0))
                };
                let _ = stage.tick(Ok(sample(now)), Some(command));
            }
            stage.port.rendered().x
        };
        assert!((paused_for(48) - 5.0).abs() < 0.2);
        assert_eq!(paused_for(52), 0.0);
        assert_eq!(paused_for(1500), 0.0);
        stage.good_for(ms(250), force(10.0));
        assert!((stage.port.rendered().x - 5.0).abs() < 0.2);
        stage.good_for(ms(300), force(10.0));
        assert_eq!(stage.port.rendered(), &force(10.0));
        assert_eq!(stage.kinds(), [EventKind::Arming, EventKind::Armed]);
    }
}

#[test]
fn after_an_outage_a_person_arms() {
    for (silence, comes_back) in [(ms(900), true), (ms(1100), false), (ms(5000), false)] {
        let mut stage = Stage::armed_by_a_person();
        stage.silent_for(silence, force(10.0));
        stage.good_for(ms(1500), force(10.0));
        let felt = stage.port.rendered()[0];
        assert_eq!(felt == 10.0, comes_back, "{felt} N after {silence:?}");
        if comes_back {
            continue;
        }
        assert_eq!(
            stage.kinds(),
            [EventKind::ForceStale, EventKind::RearmNeeded]
        );
        assert_eq!((felt, stage.port.state()), (0.0, ArmingState::Disarmed));
        stage.port.ask_to_arm();
        stage.good_for(ms(700), force(10.0));
        assert_eq!(stage.port.rendered(), &force(10.0));
    }
    // Automatic stays automatic.
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    stage.silent_for(ms(5000), force(10.0));
    stage.good_for(ms(700), force(10.0));
    assert_eq!(stage.port.rendered(), &force(10.0));
}

#[test]
fn a_port_that_nobody_called_for_long_asks_a_person() {
    let mut stage = Stage::armed_by_a_person();
    stage.now += ms(2000);
    stage.good_for(ms(1500), force(10.0));
    assert_eq!(stage.port.rendered(), &Vector6::zeros());
    assert!(
        stage.kinds().contains(&EventKind::RearmNeeded),
        "{:?}",
        stage.events
    );
}

#[test]
fn another_process_that_commands_is_armed_by_a_person_at_once() {
    for (source, comes_back) in [(CommandSource::Same, true), (CommandSource::Other, false)] {
        let mut stage = Stage::armed_by_a_person();
        stage.port.restart(source);
        stage.good_for(ms(1500), force(10.0));
        assert_eq!(
            *stage.port.rendered() == force(10.0),
            comes_back,
            "{source:?}"
        );
        assert_eq!(stage.kinds().contains(&EventKind::RearmNeeded), !comes_back);
    }
    let mut stage = Stage::armed(SafetySettings::default(), force(10.0));
    stage.port.restart(CommandSource::Other);
    stage.good_for(ms(1500), force(10.0));
    assert_eq!(stage.port.rendered(), &force(10.0));
}
