//! Times the two computations of a string device's loop: `cargo run --release -p taut-spidar --example tension_timing`.
//!
//! A hand moves at 1 kHz in each shipped device and gets forces: a moderate wrench inside the feasible set, one that leaves it
//! again and again, the same with the grip turned so far that for most of the time not even zero wrench can be rendered, and unrelated poses
//! and wrenches, where nothing of the last answer helps. Thread CPU time, each
//! tick timed once, over all ticks; `reading the clock` is what an empty measurement shows. What a session's own path costs is
//! shown by the program's example `string_device_cost`.
#![allow(
    clippy::disallowed_methods,
    reason = "a measurement needs a clock; the model itself has none"
)]

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use rustix::time::{ClockId, clock_gettime};
use taut_spidar::{
    ForwardKinematics, Geometry, Pose, StringMatrix, TensionSettings, TensionSolver, TensionStatus,
};

const TICKS: u32 = 100_000;
/// A rotation at which the shipped devices mostly cannot hold all strings taut without a wrench, rad.
const TURNED_FAR: f64 = 0.9;

fn main() {
    let mut empty: Vec<f64> = (0..TICKS).map(|_| timed(|| ()).1).collect();
    report("reading the clock", &mut empty, "");
    for name in Geometry::shipped_names() {
        let Some(geometry) = Geometry::shipped(name) else {
            continue;
        };
        forward(&geometry);
        let small = 0.1 * geometry.tension_max;
        distribution(&geometry, "inside", TICKS, |tick| {
            (motion(&geometry, tick), wrench(&geometry, tick, small))
        });
        let large = geometry.tension_max;
        distribution(&geometry, "in and out", TICKS, |tick| {
            (motion(&geometry, tick), wrench(&geometry, tick, large))
        });
        distribution(&geometry, "turned far", TICKS, |tick| {
            let mut pose = motion(&geometry, tick);
            pose.append_rotation_wrt_center_mut(&UnitQuaternion::from_scaled_axis(
                TURNED_FAR * Vector3::new(0.6, 0.0, 0.8),
            ));
            (pose, wrench(&geometry, tick, small))
        });
        distribution(&geometry, "unrelated", TICKS, |tick| {
            let jump = tick.wrapping_mul(2_654_435_761) >> 8;
            (
                motion(&geometry, jump),
                wrench(&geometry, jump ^ 0x55_5555, large),
            )
        });
    }
}

fn forward(geometry: &Geometry) {
    let mut kinematics = ForwardKinematics::new(geometry);
    let (mut times, mut steps) = (Vec::new(), 0);
    for tick in 0..TICKS {
        let lengths = geometry.lengths(&motion(geometry, tick));
        let (answer, time) = timed(|| kinematics.solve(&lengths));
        times.push(time);
        steps += answer.map_or(0, |answer| answer.steps);
    }
    let note = format!("{:.2} steps each", f64::from(steps) / f64::from(TICKS));
    report(&format!("{} pose", geometry.name), &mut times, &note);
}

fn distribution(
    geometry: &Geometry,
    what: &str,
    ticks: u32,
    at: impl Fn(u32) -> (Pose, Vector6<f64>),
) {
    let mut solver = TensionSolver::new(geometry, TensionSettings::default());
    let mut times = Vec::new();
    let (mut rendered, mut scaled, mut factorisations, mut most) = (0_u32, 0_u32, 0, 0);
    for tick in 0..ticks {
        let (pose, wrench) = at(tick);
        let strings = StringMatrix::at(geometry, &pose);
        let (answer, time) = timed(|| solver.distribute(&strings, &wrench));
        times.push(time);
        rendered += u32::from(answer.status == TensionStatus::Rendered);
        scaled += u32::from(answer.status == TensionStatus::Scaled);
        factorisations += answer.factorisations;
        most = most.max(answer.factorisations);
    }
    let note = format!(
        "{:.0} % rendered fully, {:.0} % scaled, {:.2} factorisations each, at most {most}",
        100.0 * f64::from(rendered) / f64::from(ticks),
        100.0 * f64::from(scaled) / f64::from(ticks),
        f64::from(factorisations) / f64::from(ticks)
    );
    report(
        &format!("{} tensions, {what}", geometry.name),
        &mut times,
        &note,
    );
}

/// The hand: sines of 1 to 3 Hz within a third of the frame and 0.35 rad.
fn motion(geometry: &Geometry, tick: u32) -> Pose {
    let time = f64::from(tick) * 1e-3;
    let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time + phase).sin();
    let reach = geometry.half_width() / 3.0 / 3_f64.sqrt();
    Pose::new(
        reach * Vector3::new(wave(1.0, 0.3), wave(1.7, 1.1), wave(2.3, 2.0)),
        0.2 * Vector3::new(wave(1.3, 0.0), wave(2.9, 0.7), wave(2.1, 1.9)),
    )
}

fn wrench(geometry: &Geometry, tick: u32, force: f64) -> Vector6<f64> {
    let time = f64::from(tick) * 1e-3;
    let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time + phase).sin();
    let torque = 0.3 * force * geometry.arm();
    Vector6::new(
        force * wave(2.0, 0.0),
        force * wave(3.1, 0.4),
        force * wave(1.3, 0.9),
        torque * wave(2.7, 1.0),
        torque * wave(1.9, 2.0),
        torque * wave(3.3, 0.2),
    )
}

/// The result of `work` and its thread CPU time, us.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let now = || {
        let time = clock_gettime(ClockId::ThreadCPUTime);
        time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
    };
    let start = now();
    let result = std::hint::black_box(work());
    (result, now() - start)
}

fn report(name: &str, times: &mut [f64], note: &str) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "{name:30} p50 {:6.2}  p99 {:6.2}  p99.9 {:6.2}  max {:7.2} us   {note}",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}
