//! The damping on a hand whose device measures less often than the port ticks.

use super::*;

/// A hand at 0.2 m/s that the force pushes on has been given energy without end, so the damping is all that it may be: 20 N s/m, 4 of 10 N.
#[test]
fn damping_keeps_its_cap_where_the_device_measures_less_often() {
    for ticks in 1..=5 {
        let settings = SafetySettings {
            period: TICK / ticks,
            passivity: PassivitySettings {
                mode: Passivity::Control,
                max_debt: 10.0, // nothing but the damping takes any
                ..PassivitySettings::default()
            },
            ..SafetySettings::default()
        };
        let mut stage = Stage::new(settings);
        let mut measured = stage.now;
        let mut felt = 0.0;
        for tick in 0..700 * ticks {
            let now = stage.now + stage.period;
            if tick % ticks == 0 {
                measured = now;
            }
            let command = Command::fresh(now, force(10.0));
            felt = stage.tick(Ok(sample(measured)), Some(command)).wrench[0];
            assert!(felt >= 0.0, "{felt} N, a sample in {ticks} ticks");
        }
        assert_eq!(stage.port.state(), ArmingState::Armed, "{:?}", stage.events);
        assert!(
            (felt - 6.0).abs() < 1e-6,
            "{felt} N, a sample in {ticks} ticks"
        );
    }
}
