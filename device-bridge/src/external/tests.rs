use super::*;
use crate::ms;
use god_object::nalgebra::Vector3;
use triple_buffer::Input;

const X: f64 = 1.0;

fn settings() -> ExternalWrenchSettings {
    ExternalWrenchSettings {
        axes: WrenchAxes::Fixed(UnitQuaternion::identity()),
        max_force: 5.0,
        max_torque: 0.2,
        hold: ms(20),
        ramp_out: ms(95),
        ramp_in: Duration::ZERO,
    }
}

/// A source whose values come at once.
struct Bench {
    input: Input<NewestWrench>,
    external: ExternalWrench,
    newest: NewestWrench,
}

impl Bench {
    fn new(settings: ExternalWrenchSettings) -> Self {
        let (input, output) = triple_buffer::triple_buffer(&NewestWrench::default());
        Self {
            input,
            external: ExternalWrench::new(WrenchReader::Local(output), settings),
            newest: NewestWrench::default(),
        }
    }

    fn send(&mut self, made: Option<u64>, received: u64, wrench: Vector6) {
        let index = self.newest.sent.map_or(1, |sent| sent.index + 1);
        self.newest.sent = Some(SentWrench {
            wrench,
            made: made.map(ms),
            uncertainty: Duration::ZERO,
            received: ms(received),
            sender: 1,
            index,
        });
        self.input.write(self.newest);
    }

    fn push(&mut self, at: u64, force: f64) {
        self.send(Some(at), at, Vector6::x() * force);
    }

    fn at(&mut self, now: u64) -> Vector6 {
        self.external.tick(ms(now), &Pose::identity())
    }

    fn refused(&self, why: Refused) -> u64 {
        self.external.statistics.refused()[why as usize].1
    }
}

#[test]
fn a_value_is_felt_in_full_for_20_ms_fades_and_is_gone_115_ms_after_it_was_made() {
    let mut bench = Bench::new(settings());
    assert_eq!(bench.at(99), Vector6::zeros());
    bench.push(100, X);
    let felt: Vec<f64> = (100..240).map(|now| bench.at(now).x).collect();
    assert!(felt[..=20].iter().all(|x| *x == X), "{felt:?}");
    assert!(felt[21] < X && felt[114] > 0.0);
    assert!(felt[115..].iter().all(|x| *x == 0.0), "{felt:?}");
    for pair in felt.windows(2) {
        assert!(pair[0] - pair[1] <= X / 95.0 + 1e-12, "no step: {pair:?}");
    }
    assert!(!bench.external.statistics.is_felt());
    let largest = bench.external.statistics.largest_age();
    assert!(largest < ms(115), "{largest:?}");
}

#[test]
fn the_age_counts_from_the_senders_stamp_and_not_from_the_arrival() {
    let mut bench = Bench::new(settings());
    bench.send(Some(100), 160, Vector6::x());
    // 60 ms old: 40 of 95 are gone.
    assert!((bench.at(160).x - 55.0 / 95.0).abs() < 1e-12);
    assert_eq!(bench.at(215), Vector6::zeros());
    // What is known of its time only within 30 ms counts as 30 ms older.
    let mut unsure = Bench::new(settings());
    unsure.push(100, X);
    unsure.newest.sent = unsure.newest.sent.map(|sent| SentWrench {
        uncertainty: ms(30),
        ..sent
    });
    unsure.input.write(unsure.newest);
    assert!((unsure.at(100).x - 85.0 / 95.0).abs() < 1e-12);
}

#[test]
fn what_is_old_ahead_of_time_without_a_clock_or_gone_back_changes_nothing() {
    let mut bench = Bench::new(settings());
    bench.push(1000, X);
    assert_eq!(bench.at(1000).x, X);
    let other = Vector6::x() * -4.0;
    bench.send(Some(990), 1001, other);
    assert_eq!((bench.at(1001).x, bench.refused(Refused::WentBack)), (X, 1));
    bench.send(Some(1022), 1001, other);
    assert_eq!(
        (bench.at(1002).x, bench.refused(Refused::NotOnClock)),
        (X, 1)
    );
    bench.send(None, 1003, other);
    assert_eq!(
        (bench.at(1003).x, bench.refused(Refused::NotOnClock)),
        (X, 2)
    );
    bench.send(Some(885), 1004, other);
    assert_eq!((bench.at(1004).x, bench.refused(Refused::Old)), (X, 1));
    // A little ahead is a clock's error, and never younger than its arrival.
    bench.send(Some(1015), 1005, Vector6::x() * 2.0);
    assert_eq!(bench.at(1005).x, 2.0);
    assert_eq!(bench.at(1120), Vector6::zeros(), "115 ms after the arrival");
    assert_eq!(bench.external.statistics.taken(), 2);
}

#[test]
fn what_is_no_wrench_stops_the_force_until_a_later_value_comes() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::new(settings());
        bench.push(100, X);
        assert_eq!(bench.at(100).x, X);
        bench.push(101, bad);
        assert_eq!(bench.at(101), Vector6::zeros(), "{bad}");
        assert_eq!(bench.at(102), Vector6::zeros(), "{bad}");
        bench.push(103, X);
        assert_eq!(bench.at(103).x, X);
        assert_eq!(bench.refused(Refused::Spoiled), 1);
    }
    // The receiver tells of one that could not even be read, also where a good one came right behind it.
    let mut bench = Bench::new(settings());
    bench.push(100, X);
    assert_eq!(bench.at(100).x, X);
    bench.newest.spoiled = ms(101);
    bench.input.write(bench.newest);
    assert_eq!(bench.at(101), Vector6::zeros());
    bench.push(101, X);
    assert_eq!(
        bench.at(102),
        Vector6::zeros(),
        "at the same moment: not after it"
    );
    bench.push(103, X);
    assert_eq!(bench.at(103).x, X);
}

#[test]
fn what_is_no_wrench_ends_the_force_with_a_good_one_right_behind_it() {
    let mut bench = Bench::new(ExternalWrenchSettings {
        ramp_in: ms(500),
        ..settings()
    });
    let mut felt = 0.0;
    for now in 1..=600 {
        bench.push(now, X);
        felt = bench.at(now).x;
    }
    assert_eq!(felt, X);
    // Both come between two ticks.
    bench.newest.spoiled = ms(600) + Duration::from_micros(300);
    bench.push(601, X);
    assert_eq!(bench.at(601), Vector6::zeros());
    assert_eq!(bench.external.judged(), None, "nor is it passed on");
    assert_eq!(bench.refused(Refused::Spoiled), 1);
    bench.push(602, X);
    let again = bench.at(602).x;
    assert!(again > 0.0 && again <= 1.0 / 500.0 + 1e-12, "{again}");
}

#[test]
fn however_large_it_is_it_keeps_its_direction_and_its_limit() {
    let mut bench = Bench::new(settings());
    for (tick, size) in (1..).zip([1e3, 1e30, 1e300, f64::MAX]) {
        bench.send(
            Some(tick),
            tick,
            Vector6::new(3.0, 0.0, 4.0, 0.0, 1.0, 0.0) / 5.0 * size,
        );
        let felt = bench.at(tick);
        assert!(
            (linear(&felt) - Vector3::new(3.0, 0.0, 4.0)).norm() < 1e-12,
            "{felt}"
        );
        assert!(
            (angular(&felt) - Vector3::y() * 0.2).norm() < 1e-12,
            "{felt}"
        );
    }
}

#[test]
fn it_comes_in_by_the_ramp_at_the_start_and_after_every_silence() {
    let mut bench = Bench::new(ExternalWrenchSettings {
        ramp_in: ms(500),
        ..settings()
    });
    let mut last = 0.0;
    for now in 1..=2000 {
        // Silent from 1000 to 1300.
        if !(1000..1300).contains(&now) {
            bench.push(now, X);
        }
        let felt = bench.at(now).x;
        assert!(
            felt - last <= 1.0 / 500.0 + 1e-12,
            "{last} to {felt} at {now}"
        );
        last = felt;
        match now {
            400 => assert!((0.7..0.9).contains(&felt), "{felt}"),
            600..=999 | 1900.. => assert_eq!(felt, X),
            1116..=1299 => assert_eq!(felt, 0.0),
            _ => {}
        }
    }
    // A loop that stood still lets no more in than one that was a little late.
    let mut late = Bench::new(ExternalWrenchSettings {
        ramp_in: ms(500),
        ..settings()
    });
    late.push(1, X);
    let _ = late.at(1);
    late.push(1000, X);
    assert!(late.at(1000).x <= 0.04 + 1e-12);
}

#[test]
fn the_axes_are_those_of_the_workbench_or_of_the_body() {
    let quarter = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    let turned = Pose::from_parts(Default::default(), quarter);
    let near = |felt: Vector6, axis: Vector6| assert!((felt - axis).norm() < 1e-12, "{felt}");
    for (axes, felt) in [
        (WrenchAxes::Fixed(UnitQuaternion::identity()), Vector6::x()),
        (WrenchAxes::Fixed(quarter.inverse()), -Vector6::y()),
        (WrenchAxes::Body, Vector6::y()),
    ] {
        let mut bench = Bench::new(ExternalWrenchSettings { axes, ..settings() });
        bench.push(1, X);
        near(bench.external.tick(ms(1), &turned), felt);
    }
}
