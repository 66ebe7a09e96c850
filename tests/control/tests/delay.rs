//! A delay that grows slowly to two seconds: what the hand is given stays what it is given without, and nothing is felt of what is 120 ms old.

use std::time::Duration;

use taut_bridge::EventKind;
use taut_control_tests::delay::{Course, Growth, Rubbing, ZERO_AFTER, run};
use taut_control_tests::edge::Mode;
use taut_control_tests::edge_scenes::Task;

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

/// Delays that grow by the same share of each second from none to more than anything is felt of, begun in several places of the hand's path.
fn keeps_its_promise_at_any_slope(name: &str, rubbing: &Rubbing, begins_ms: &[u64]) {
    let usual = run(rubbing, Mode::Edge, Growth::NONE, Duration::from_secs(6));
    assert!(usual.largest[1] > 1.0, "{usual:?}");
    let mut worst = (f64::NEG_INFINITY, String::new());
    for (way, ways) in [
        ("both", [true, true]),
        ("up", [true, false]),
        ("down", [false, true]),
    ] {
        for slope in [0.05, 0.1, 0.2, 0.5, 1.0] {
            for begin in begins_ms.iter().copied().map(Duration::from_millis) {
                let growth = Growth {
                    begin,
                    ways,
                    course: Course::Steady(slope),
                    most: 2 * ZERO_AFTER,
                };
                // Then everything is too old to be felt.
                let until = begin + ZERO_AFTER.div_f64(slope);
                let attacked = run(rubbing, Mode::Edge, growth, until);
                let case = format!("{way}, {slope} s/s from {begin:?} on");
                assert!(attacked.oldest < ZERO_AFTER, "{case}: {attacked:?}");
                let more = attacked.given - usual.given;
                if more > worst.0 {
                    worst = (more, case);
                }
            }
        }
    }
    let (more, case) = worst;
    println!(
        "{name}: at most {:+.2} mJ on {:.2}: {case}",
        more * 1e3,
        usual.given * 1e3
    );
    assert!(more <= MORE, "{more} J: {case}");
}

#[test]
fn a_steadily_slower_network_and_a_wall() {
    keeps_its_promise_at_any_slope("wall", &Rubbing::on_wall(), &[2000, 2800, 3600]);
}

#[test]
fn a_steadily_slower_network_and_a_dome() {
    keeps_its_promise_at_any_slope("dome", &Rubbing::over_dome(), &[2000, 3000, 3600]);
}

#[test]
fn a_steadily_slower_network_and_a_corner() {
    let corner = Rubbing::once(Task::corner());
    keeps_its_promise_at_any_slope("corner", &corner, &[300, 1000, 1600]);
}
