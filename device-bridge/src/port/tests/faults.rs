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

struct Episode {
    fault: Fault,
    begun: Duration,
    newtons: f64,
    /// There was a fault of the device before it, or from its first tick on.
    after_fault: bool,
}

/// What holds of the force, N, or the torque, N m.
#[derive(Clone, Copy)]
struct Bounds {
    most: f64,
    /// What a write may change unexplained, and by what the motion explains.
    own: f64,
    explained: f64,
}

/// A port and what its inputs were.
struct Trial {
    stage: Stage,
    /// Of the set that each command comes from.
    age: Duration,
    bounds: [Bounds; 2],
    /// When the newest good sample came, and what the newest good command comes from.
    good_sample: Duration,
    good_command: Duration,
    before: Vector6<f64>,
    last_pose: Option<Pose>,
    /// For how long the pose has been the same.
    stood: Duration,
}

impl Trial {
    fn new(settings: SafetySettings, speed: f64, age: Duration) -> Self {
        let mut stage = Stage::new(settings);
        stage.speed = speed;
        let _ = stage.good(force(5.0));
        stage.port.ask_to_arm();
        stage.good_for(ms(600), force(5.0));
        let period = settings.period.as_secs_f64();
        let bounds = [(20.0, 500.0, 1000.0), (0.5, 50.0, 100.0)].map(|(most, rate, stiffness)| {
            let own = rate * period.min(0.002);
            let explained = (1.5 * stiffness * speed * period).min(4.0 * own);
            Bounds {
                most,
                own,
                explained,
            }
        });
        Self {
            age,
            bounds,
            good_sample: stage.now,
            good_command: stage.now,
            before: *stage.port.rendered(),
            last_pose: Some(sample_at(stage.now, speed).pose),
            stood: Duration::ZERO,
            stage,
        }
    }

    /// What comes next from the device and from whoever commands.
    fn inputs(&mut self, episode: &Episode) -> (Answer, Command) {
        let (now, speed) = (self.stage.now + self.stage.period, self.stage.speed);
        let mut sample = sample_at(now, speed);
        let wrench = Vector6::new(episode.newtons, 3.0, 0.0, 0.0, 0.3, 0.0);
        let mut command = Command::on_set(now - self.age, wrench);
        match episode.fault {
            Fault::Origin => sample.pose = Pose::identity(),
            Fault::Frozen => sample.pose = sample_at(episode.begun, speed).pose,
            Fault::Nan => sample.pose = Pose::translation(f64::NAN, 0.0, 0.0),
            Fault::Jump => sample.pose = Pose::translation(9.0, 0.0, 0.0),
            Fault::TimeBack => sample.time -= ms(300),
            Fault::Unplugged => {
                let age = now - episode.begun;
                return (Err(DeviceFault::Lost { age }), command);
            }
            Fault::WrenchNan => command.wrench[3] = f64::NAN,
            Fault::CommandsStop => command.origin = self.good_command,
            Fault::ConstraintsStop => command.constraint_age = now - episode.begun,
            Fault::CommandsAhead => command.origin = now + ms(50),
            Fault::Paused => command.paused = true,
            Fault::Disarm => self.stage.port.ask_to_disarm(),
            Fault::None => {}
        }
        (Ok(sample), command)
    }

    /// Whether the port has to take this pose.
    fn is_good(&mut self, pose: Option<Pose>, episode: &Episode) -> bool {
        let moved = pose != self.last_pose;
        self.last_pose = pose;
        self.stood += self.stage.period;
        if moved {
            self.stood = Duration::ZERO;
        }
        match episode.fault {
            // A device that has stood somewhere else for long enough is there.
            Fault::Origin | Fault::Jump => self.stood > ms(100),
            // It froze when it moved last. One that stands still after another fault rests: where it froze before, it comes back somewhere else.
            Fault::Frozen => {
                moved || episode.after_fault && self.stage.now > episode.begun + ms(100)
            }
            Fault::Nan | Fault::TimeBack | Fault::Unplugged => false,
            _ => true,
        }
    }

    fn tick(&mut self, episode: &mut Episode) -> Result<(), TestCaseError> {
        let (answer, command) = self.inputs(episode);
        let sample_is_good = self.is_good(answer.map(|sample| sample.pose).ok(), episode);
        let is_first = self.stage.now == episode.begun;
        let report = self.stage.tick(answer, Some(command));
        episode.after_fault |= is_first && self.stage.port.fault().is_some();
        if sample_is_good {
            self.good_sample = self.stage.now;
        }
        match episode.fault {
            Fault::WrenchNan | Fault::CommandsStop | Fault::CommandsAhead => {}
            _ => self.good_command = self.stage.now - self.age,
        }
        self.assert_promises(&report, episode)
    }

    fn assert_promises(
        &mut self,
        report: &TickReport,
        episode: &Episode,
    ) -> Result<(), TestCaseError> {
        let felt = report.wrench;
        prop_assert!(felt.iter().all(|x| x.is_finite()));
        for (start, bounds) in [0, 3].into_iter().zip(self.bounds) {
            let part = |wrench: Vector6<f64>| wrench.fixed_rows::<3>(start).norm();
            prop_assert!(part(felt) <= bounds.most * (1.0 + 1e-12));
            // Motion explains nothing of a force that comes, is held or goes away.
            let armed = report.state == ArmingState::Armed;
            let most = bounds.own + if armed { bounds.explained } else { 0.0 };
            prop_assert!(part(felt - self.before) <= most * (1.0 + 1e-9));
        }
        let (fault, now) = (episode.fault, self.stage.now);
        let silent = now - self.good_sample.min(self.good_command);
        if silent >= SafetySettings::ZERO_AFTER {
            prop_assert_eq!(felt, Vector6::zeros(), "{:?} for {:?}", fault, silent);
        }
        let wished = matches!(fault, Fault::Paused | Fault::Disarm);
        if wished && now - episode.begun >= SafetySettings::ZERO_AFTER {
            prop_assert_eq!(felt, Vector6::zeros(), "{:?}", fault);
        }
        self.before = felt;
        Ok(())
    }
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
        let mut trial = Trial::new(settings, speed, ms(age_ms));
        let mut after_fault = false;
        for (fault, duration_ms, newtons) in sequence {
            let begun = trial.stage.now;
            let mut episode = Episode { fault, begun, newtons, after_fault };
            while trial.stage.now < begun + ms(duration_ms) {
                trial.tick(&mut episode)?;
            }
            after_fault = trial.stage.port.fault().is_some();
        }
    }
}
