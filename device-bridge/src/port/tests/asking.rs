//! Who asks for force while the last one is still on its way down.

use super::*;

#[test]
fn what_is_asked_on_the_way_down_is_granted_at_its_end() {
    let mut stage = Stage::asked_on_the_way_down();
    let mut before = stage.port.rendered()[0];
    while stage.port.state() == ArmingState::Fading {
        let felt = stage.good(force(10.0)).wrench[0];
        assert!(felt <= before, "{felt} N after {before} N");
        before = felt;
    }
    assert_eq!((before, stage.port.state()), (0.0, ArmingState::Arming));
    stage.good_for(ms(600), force(10.0));
    assert_eq!(stage.port.rendered(), &force(10.0));
    assert_eq!(
        stage.kinds(),
        [EventKind::Disarmed, EventKind::Arming, EventKind::Armed]
    );
}

#[test]
fn a_dead_mans_button_pressed_again_at_once_brings_the_force_back() {
    let settings = SafetySettings {
        dead_man: Some(2),
        ..manual()
    };
    // Pressed again until the end, or for a moment.
    for (again, felt) in [(700, 10.0), (20, 0.0)] {
        let mut stage = Stage::new(settings);
        stage.held(10, 0);
        assert_eq!(stage.held(700, 0b100), 10.0);
        assert!(stage.held(30, 0) > 5.0);
        stage.held(again, 0b100);
        assert_eq!(stage.held(700 - again, 0), felt, "again for {again} ms");
        let told = stage.kinds().split_off(2);
        let expected: &[EventKind] = if felt > 0.0 {
            &[
                EventKind::DeadManReleased,
                EventKind::Arming,
                EventKind::Armed,
            ]
        } else {
            &[EventKind::DeadManReleased, EventKind::DeadManReleased]
        };
        assert_eq!(told, expected);
    }
}

#[test]
fn what_is_asked_before_a_fault_or_a_stall_is_refused() {
    for stalls in [false, true] {
        let mut stage = Stage::asked_on_the_way_down();
        stage.good_for(ms(10), force(10.0));
        assert_eq!(stage.kinds(), [EventKind::Disarmed]);
        if stalls {
            stage.now += ms(2000);
        } else {
            let fresh = Command::fresh(stage.now + TICK, force(10.0));
            let _ = stage.tick(Err(DeviceFault::NotFinite), Some(fresh));
        }
        stage.good_for(ms(1500), force(10.0));
        assert_eq!(stage.port.rendered(), &Vector6::zeros());
        assert!(
            stage.kinds().contains(&EventKind::ArmRefused),
            "{:?}",
            stage.events
        );
    }
}

#[test]
fn what_is_asked_before_somebody_else_commands_is_refused() {
    for source in [CommandSource::Same, CommandSource::Other] {
        let mut stage = Stage::asked_on_the_way_down();
        stage.good_for(ms(10), force(10.0));
        stage.port.restart(source);
        stage.good_for(ms(1500), force(10.0));
        assert_eq!(stage.port.rendered(), &Vector6::zeros());
        assert_eq!(stage.kinds(), [EventKind::Disarmed, EventKind::ArmRefused]);
    }
}
