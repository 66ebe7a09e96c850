//! What this machine adds to a computation that is always the same: a control for the times in a session's report.
//!
//! `cargo run --release -p taut --no-default-features --example control_loop -- [seconds] [--awake] [--by-phase]`
//!
//! Beside a running session, or alone, a thread of the haptics loop's class wakes at 1 kHz and computes one pose and one set of tensions from
//! the same lengths and the same wrench every time: the same instructions on the same data. What then differs between two ticks
//! is the machine's: cold caches after the sleep, interrupts within the measured span (their time counts as the thread's where the kernel does
//! not account for it apart), a host that took the core away. A second span computes the same again at once, with warm caches. With `--awake`
//! idle cores are kept awake, as a session does. With `--by-phase` the thread takes turns of half a second at several places of the monotonic clock's
//! millisecond, and prints each apart: the kernel's own tick is at one of them.

use std::time::Duration;

use god_object::Vector6;
use god_object::nalgebra::Vector3;
use taut::loops::realtime::thread_cpu_time;
use taut::shared::timing::Histogram;
use taut_bridge::realtime::{
    CLEAR_OF_KERNEL_TICK, first_on_beat, keep_cores_awake, lock_memory, monotonic_now,
    request_fifo, sleep_until,
};
use taut_link::Distribution;
use taut_spidar::{
    ForwardKinematics, Geometry, PerString, Pose, StringMatrix, TensionAnswer, TensionSettings,
    TensionSolver,
};

/// Of the haptics loop.
const PRIORITY: u8 = 80;
const PERIOD: Duration = Duration::from_millis(1);
/// Ticks of one turn.
const TURN: u32 = 500;
/// Places of the millisecond for `--by-phase`, us; the kernel's tick is at 0.
const PHASES_US: [u64; 10] = [0, 50, 150, 250, 400, 550, 700, 850, 950, 975];

/// What is computed in every tick.
struct Computation {
    geometry: Geometry,
    kinematics: ForwardKinematics,
    solver: TensionSolver,
    pose: Pose,
    /// Where it was a millisecond ago, at 0.1 m/s: as many steps as in a session.
    before: Pose,
    lengths: PerString,
    wrench: Vector6,
}

impl Computation {
    fn new() -> Result<Self, &'static str> {
        let geometry = Geometry::shipped("wb").ok_or("wb is shipped")?;
        // Turned so far that zero wrench cannot be rendered: the dear case.
        let pose = Pose::new(
            Vector3::new(0.05, -0.03, 0.02),
            Vector3::new(0.5, 0.3, -0.4),
        );
        Ok(Self {
            kinematics: ForwardKinematics::new(&geometry),
            solver: TensionSolver::new(&geometry, TensionSettings::default()),
            pose,
            before: Pose::from_parts(
                (pose.translation.vector - Vector3::new(1e-4, 0.0, 0.0)).into(),
                pose.rotation,
            ),
            lengths: geometry.lengths(&pose),
            wrench: Vector6::new(1.0, -2.0, 0.5, 0.02, 0.01, -0.03),
            geometry,
        })
    }

    fn answer(&mut self) -> TensionAnswer {
        self.kinematics.start_at(self.before);
        let strings = self.kinematics.solve(&self.lengths).map_or_else(
            |_| StringMatrix::at(&self.geometry, &self.pose),
            |answer| answer.strings,
        );
        self.solver.distribute(&strings, &self.wrench)
    }
}

/// What one place of the millisecond saw.
#[derive(Default)]
struct Seen {
    cold: Histogram,
    warm: Histogram,
    wall: Histogram,
    late: Histogram,
    misses: u32,
}

impl Seen {
    fn take_turn(&mut self, phase: Duration, computation: &mut Computation) {
        let mut deadline = first_on_beat(monotonic_now(), PERIOD, phase);
        for _ in 0..TURN {
            sleep_until(deadline);
            let woken = monotonic_now();
            let before = thread_cpu_time();
            let first = std::hint::black_box(computation.answer());
            let between = thread_cpu_time();
            let done = monotonic_now();
            let second = std::hint::black_box(computation.answer());
            let after = thread_cpu_time();
            assert_eq!(first.tensions, second.tensions);
            self.cold.record_time(between.saturating_sub(before));
            self.warm.record_time(after.saturating_sub(between));
            self.wall.record_time(done.saturating_sub(woken));
            self.late.record_time(woken.saturating_sub(deadline));
            deadline += PERIOD;
            if done > deadline {
                self.misses += 1;
                deadline = first_on_beat(done, PERIOD, phase);
            }
        }
    }

    fn print(&self, phase: Duration) {
        println!(
            "due {:.3} ms after the millisecond, deadlines missed: {}",
            phase.as_secs_f64() * 1e3,
            self.misses
        );
        show("CPU, after the sleep", &self.cold.distribution_us());
        show("CPU, again at once", &self.warm.distribution_us());
        show("elapsed, after the sleep", &self.wall.distribution_us());
        show("woken late by", &self.late.distribution_us());
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut seconds = 60;
    let mut awake = None;
    let mut phases = vec![CLEAR_OF_KERNEL_TICK];
    for argument in std::env::args().skip(1) {
        if argument == "--awake" {
            let (grant, held) = keep_cores_awake();
            println!("{grant}");
            awake = held;
        } else if argument == "--by-phase" {
            phases = PHASES_US.map(Duration::from_micros).to_vec();
        } else {
            seconds = argument.parse()?;
        }
    }
    println!("{}", lock_memory());
    println!("{}", request_fifo(PRIORITY));
    println!("load of the machine: {}", first_line("/proc/loadavg"));

    let mut computation = Computation::new()?;
    println!(
        "each tick: {:?}, {} factorisations",
        computation.answer().status,
        computation.answer().factorisations
    );
    let mut seen: Vec<Seen> = phases.iter().map(|_| Seen::default()).collect();
    for turn in 0..1000 * seconds / TURN {
        let which = turn as usize % phases.len();
        seen[which].take_turn(phases[which], &mut computation);
    }
    drop(awake);
    for (phase, seen) in phases.iter().zip(&seen) {
        seen.print(*phase);
    }
    println!("load of the machine: {}", first_line("/proc/loadavg"));
    for line in std::fs::read_to_string("/proc/thread-self/status")?.lines() {
        if line.contains("ctxt_switches") {
            println!("{line}");
        }
    }
    Ok(())
}

fn first_line(path: &str) -> String {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().next().unwrap_or("not known").to_owned()
}

fn show(what: &str, seen: &Distribution) {
    println!(
        "{what:26} p50 {:6.2}  p99 {:6.2}  p99.9 {:7.2}  max {:8.2} us",
        seen.p50, seen.p99, seen.p999, seen.max
    );
}
