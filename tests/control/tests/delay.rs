//! A delay that grows slowly to two seconds: what the hand is given stays what it is given without, and nothing is felt of what is 120 ms old.

use std::time::Duration;

use taut_bridge::EventKind;
use taut_control_tests::delay::{Course, Growth, Rubbing, ZERO_AFTER, run};
use taut_control_tests::edge::Mode;

/// What may be given beyond what is given without delay, J.
const MORE: f64 = 0.02;
const DURATION: Duration = Duration::from_secs(19);

/// A millisecond more at first, twice that after 1.5 s, 2 s after 16 s.
fn growing(up: bool, down: bool) -> Growth {
    Growth {
        begin: Duration::from_secs(2),
        ways: [up, down],
        course: Course::Doubling(Duration::from_millis(1500)),
        most: Duration::from_secs(2),
    }
}

fn keeps_its_promise(name: &str, rubbing: &Rubbing, mode: Mode) {
    let usual = run(rubbing, mode, Growth::NONE, DURATION);
    println!(
        "{name} {}: {:.2} mJ without delay",
        mode.name(),
        usual.given * 1e3
    );
    assert!(usual.largest[1] > 1.0, "{usual:?}");
    assert!(!usual.told.contains(&EventKind::ForceStale), "{usual:?}");
    for (ways, growth) in [
        ("both", growing(true, true)),
        ("up", growing(true, false)),
        ("down", growing(false, true)),
    ] {
        let attacked = run(rubbing, mode, growth, DURATION);
        println!(
            "{name} {} {ways}: {:.2} mJ, {:.2} N, felt of data up to {} ms old",
            mode.name(),
            attacked.given * 1e3,
            attacked.largest[1],
            attacked.oldest.as_millis()
        );
        assert!(attacked.age_at_end > Duration::from_secs(1), "{attacked:?}");
        assert!(attacked.largest[0] > 1.0, "there was a force: {attacked:?}");
        assert!(attacked.given <= usual.given + MORE, "{ways}: {attacked:?}");
        assert!(attacked.oldest < ZERO_AFTER, "{ways}: {attacked:?}");
        assert!(
            attacked.told.contains(&EventKind::ForceStale),
            "{attacked:?}"
        );
    }
}

#[test]
fn a_shipped_force_on_a_wall() {
    keeps_its_promise("wall", &Rubbing::on_wall(), Mode::Shipped);
}

#[test]
fn a_shipped_force_on_a_dome() {
    keeps_its_promise("dome", &Rubbing::over_dome(), Mode::Shipped);
}

#[test]
fn a_force_beside_the_device_on_a_wall() {
    keeps_its_promise("wall", &Rubbing::on_wall(), Mode::Edge);
}

#[test]
fn a_force_beside_the_device_on_a_dome() {
    keeps_its_promise("dome", &Rubbing::over_dome(), Mode::Edge);
}

#[test]
#[ignore]
fn explore() {
    let dome = Rubbing::over_dome();
    let wall = Rubbing::on_wall();
    for (name, rubbing) in [("dome", &dome), ("wall", &wall)] {
        for mode in [Mode::Edge] {
            let usual = run(rubbing, mode, Growth::NONE, Duration::from_secs(7));
            println!("{name} {} none {:.2}", mode.name(), usual.given * 1e3);
            for (ways_name, ways) in [("up", [true, false]), ("down", [false, true]), ("both", [true, true])] {
                for slope in [0.05, 0.1, 0.2, 0.5, 1.0] {
                    for most in [75, 150] {
                        let mut worst = (0.0, 0, 0.0);
                        for phase in 0..10 {
                            let begin = Duration::from_millis(2000 + 200 * phase);
                            let growth = Growth { begin, ways, course: Course::Steady(slope), most: Duration::from_millis(most) };
                            let out = run(rubbing, mode, growth, Duration::from_secs(8));
                            assert!(out.oldest < ZERO_AFTER);
                            if out.given > worst.0 { worst = (out.given, phase, out.largest[1]); }
                        }
                        println!("{name} {} {ways_name} {slope} {most}: {:.2} mJ phase {} force {:.1}", mode.name(), worst.0 * 1e3, worst.1, worst.2);
                    }
                }
            }
        }
    }
}
