//! `taut replay`: the very same method code on a device trace, under a virtual clock; no network, no threads.
//!
//! What happens in a row: [`taut_scene::Runner`].
//! Everything is a function of scene, trace and options, so the same input gives the same bytes; only the columns of `--timings` are of this machine.

pub mod recorded;

use std::io::{self, IsTerminal};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::{Pose, angular, at_reference_point, linear, pose_difference};
use god_object::surface::EnergyObserver;
use god_object::{Settings, StartError, StepReport, World};
use indicatif::ProgressBar;
use taut_scene::{
    BuiltMotion, DeviceTrace, FidelityPlan, FinishedFile, Onlooker, ReplayRow, ReplayWriter,
    Runner, Scene,
};

use crate::cli::{MethodChoice, ReplayArgs};
use crate::loops::fidelity::FidelityWatch;
use crate::loops::realtime::thread_cpu_time;
use crate::report::{ReplayReport, WorkReport};
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;
use crate::shared::timing::distribution_of;

/// A replay that takes longer shows its progress.
const SILENT_TIME: Duration = Duration::from_secs(2);

/// `taut replay`: the trace through the scene, the answer into a file. Nothing is left of a replay that does not end.
pub fn run(args: &ReplayArgs) -> Result<ReplayReport, Failure> {
    let (Some(scene), Some(trace), Some(out)) = (&args.scene, &args.trace, &args.out) else {
        return Err(Failure::bad_input(
            "a replay needs --scene, --trace and --out, or --recording",
        ));
    };
    let named = [Path::new(scene), trace.as_path()];
    let scene = Scene::named_or_file(scene)?.with_overrides(&args.overrides)?;
    let trace = DeviceTrace::load(trace)?;
    let built = scene.build()?;
    let files = scene.files()?;
    let mut settings = built.settings;
    if let Some(solver) = args.solver {
        settings.solver = solver.into();
    }
    if let Some(microseconds) = args.budget_us {
        settings.work_budget = Some(microseconds);
    }
    let MethodChoice::GodObject = args.method;
    let mut replay = Replay::new(
        Arc::new(built.world),
        settings,
        built.start,
        args.god_object_rate
            .or(built.fidelity.as_ref().map(|plan| plan.update_rate_hz)),
    )?
    .with_motions(built.motions);
    if let Some(mut plan) = built.fidelity {
        if let Some(rate) = args.god_object_rate {
            plan.use_update_rate(rate, "--god-object-rate");
        }
        plan.lines().iter().for_each(|line| taut_log::say(line));
        replay = replay.with_fidelity(plan);
    }

    let interrupted = Shutdown::by_signals()?;
    let cannot_write = |error: io::Error| {
        Failure::BadInput(format!(
            "{}: the answer cannot be written ({error}); check the path, its permissions and the free space",
            out.display()
        ))
    };
    let of_scene = files.iter().map(|(_, found)| found.as_path());
    let inputs: Vec<&Path> = named.into_iter().chain(of_scene).collect();
    let file = FinishedFile::create(out, &inputs).map_err(cannot_write)?;
    let mut writer = ReplayWriter::new(file, args.timings).map_err(cannot_write)?;
    write_answers(&mut replay, &trace, &mut writer, &interrupted).map_err(cannot_write)?;
    if interrupted.is_asked() {
        return Err(Failure::Failed(format!(
            "the replay was interrupted, and {} was not written",
            out.display()
        )));
    }
    writer
        .finish()
        .and_then(FinishedFile::finish)
        .map_err(cannot_write)?;
    Ok(replay.report())
}

fn write_answers(
    replay: &mut Replay,
    trace: &DeviceTrace,
    writer: &mut ReplayWriter<FinishedFile>,
    interrupted: &Shutdown,
) -> io::Result<()> {
    let started = Instant::now();
    let mut progress = None;
    for (done, sample) in trace.samples().iter().enumerate() {
        if interrupted.is_asked() {
            break;
        }
        writer.write(&replay.row(sample.time, &sample.pose))?;
        if progress.is_none() && started.elapsed() > SILENT_TIME && io::stderr().is_terminal() {
            progress = Some(ProgressBar::new(trace.samples().len() as u64));
        }
        if let Some(bar) = &progress {
            bar.set_position(done as u64 + 1);
        }
    }
    if let Some(bar) = progress {
        bar.finish_and_clear();
    }
    Ok(())
}

/// The two loops of the method under a virtual clock, and what they were measured to do.
#[derive(Debug)]
pub struct Replay {
    runner: Runner,
    reference_point: Point3<f64>,
    energy: EnergyObserver,
    last_force: Option<Vector3<f64>>,
    fidelity: Option<(FidelityPlan, FidelityWatch)>,
    /// The device at the row before.
    last_row: Option<(f64, Pose)>,
    /// Speed and turn rate of the device at this row, m/s and rad/s.
    rates: [f64; 2],
    measured: Measured,
}

/// Everything that the report sums up.
#[derive(Debug, Default)]
struct Measured {
    update_us: Vec<f64>,
    force_us: Vec<f64>,
    contacts: Vec<f64>,
    active: Vec<f64>,
    gap_min: f64,
    report: ReplayReport,
}

impl Replay {
    /// The scene at its start. `god_object_rate` in Hz; `None` updates once per row.
    pub fn new(
        world: Arc<World>,
        settings: Settings,
        start: Pose,
        god_object_rate: Option<f64>,
    ) -> Result<Self, StartError> {
        let reference_point = world.body.reference_point;
        Ok(Self {
            runner: Runner::new(world, settings, start, god_object_rate)?,
            reference_point,
            energy: EnergyObserver::new(),
            last_force: None,
            fidelity: None,
            last_row: None,
            rates: [0.0; 2],
            measured: Measured {
                gap_min: f64::INFINITY,
                ..Measured::default()
            },
        })
    }

    /// The same with obstacles that move, from the first row on.
    #[must_use]
    pub fn with_motions(mut self, motions: Vec<BuiltMotion>) -> Self {
        self.runner = self.runner.with_motions(motions);
        self
    }

    /// The same with the budget of the scene's fidelity watched.
    #[must_use]
    pub fn with_fidelity(mut self, plan: FidelityPlan) -> Self {
        let watch = FidelityWatch::new(&plan);
        self.fidelity = Some((plan, watch));
        self
    }

    /// One row of the trace: the device is at `device_pose` at `time`, s; times never run back.
    pub fn row(&mut self, time: f64, device_pose: &Pose) -> ReplayRow {
        if let Some((before, pose)) = self.last_row.replace((time, *device_pose))
            && time > before
        {
            let way = pose_difference(device_pose, &pose, &Vector3::zeros());
            self.rates = [linear(&way).norm(), angular(&way).norm()].map(|w| w / (time - before));
        }
        let mut watch = Watch {
            measured: &mut self.measured,
            fidelity: self.fidelity.as_ref().map(|(_, watch)| watch),
            rates: self.rates,
        };
        let answer = self.runner.row(time, device_pose, &mut watch);
        let device = at_reference_point(device_pose, &self.reference_point);
        self.energy.grant(self.runner.coupling().obstacle_work());
        self.energy.arrive(&device);
        self.energy.hold(&device, &answer.wrench);
        self.observe(&answer);
        answer
    }

    fn observe(&mut self, answer: &ReplayRow) {
        let force = linear(&answer.wrench);
        let report = &mut self.measured.report;
        report.steps += 1;
        report.kkt_max = report.kkt_max.max(answer.kkt);
        report.max_force_n = report.max_force_n.max(force.norm());
        if let Some(last) = self.last_force.replace(force) {
            report.max_force_step_n = report.max_force_step_n.max((force - last).norm());
        }
        self.measured.gap_min = self.measured.gap_min.min(answer.gap_min);
        self.measured.force_us.push(answer.timings_us.1);
        self.measured.contacts.push(answer.contacts as f64);
        self.measured.active.push(answer.active as f64);
    }

    /// What was measured so far.
    pub fn report(&self) -> ReplayReport {
        ReplayReport {
            update_us: distribution_of(&self.measured.update_us),
            force_us: distribution_of(&self.measured.force_us),
            contacts: distribution_of(&self.measured.contacts),
            active: distribution_of(&self.measured.active),
            gap_min_m: self
                .measured
                .gap_min
                .is_finite()
                .then_some(self.measured.gap_min),
            energy_injected_j: self.energy.highest(),
            energy_from_obstacles_j: self.runner.coupling().obstacle_work(),
            energy_generated_j: self.energy.generated(),
            fidelity: self
                .fidelity
                .as_ref()
                .map(|(plan, watch)| watch.report(plan)),
            ..self.measured.report.clone()
        }
    }
}

/// The clock of the steps, and where their reports go.
struct Watch<'a> {
    measured: &'a mut Measured,
    fidelity: Option<&'a FidelityWatch>,
    rates: [f64; 2],
}

impl Onlooker for Watch<'_> {
    fn now(&self) -> Duration {
        thread_cpu_time()
    }

    fn updated(&mut self, report: &StepReport, took: Duration) {
        self.measured.update(report, took);
        if let Some(watch) = self.fidelity {
            watch.look(took, self.rates[0], self.rates[1]);
        }
    }
}

impl Measured {
    fn update(&mut self, step: &StepReport, took: Duration) {
        self.update_us.push(microseconds(took));
        self.report.solver_fallbacks += u64::from(step.solver_fallbacks);
        self.report.obstacle_blocked_updates += u64::from(step.obstacles_blocked > 0);
        self.report.stops_without_force += u64::from(step.stopped_without_row);
        let work = &mut self.report.work;
        *work = WorkReport {
            node_pairs: work.node_pairs + step.work.node_pairs,
            triangle_pairs: work.triangle_pairs + step.work.triangle_pairs,
            feature_pairs: work.feature_pairs + step.work.feature_pairs,
            advancement_steps: work.advancement_steps + step.work.advancement_steps,
            projections: work.projections + step.work.projections,
        };
    }
}

fn microseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}
