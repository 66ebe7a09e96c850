//! Memory and latency of the rerun stream over a long session: `cargo run -p taut-monitor --example hours -- [MINUTES] [LIMIT_MIB]`, default 30 and 256.
//!
//! A session's stream with as much in it as there is room for: 43 plotted lines, the seven numbers of 15 poses and the three of the force's arrow are
//! 151 series; four contacts are drawn beside them. A second process reads all of it as a viewer does. Printed: memory of the first as it goes, its slope over the last third, and how old a message's newest sample was when the second had it.

use std::error::Error;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use taut_monitor::{
    BodyRole, MAX_MOVING_OBSTACLES, Monitor, MonitorBody, MonitorOptions, MonitorSample,
    MonitorScene, ShownContact, observe_times,
};

/// As a session's: 50 a second.
const SAMPLE_PERIOD: Duration = Duration::from_millis(20);

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let text: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match *text {
        ["--observe", seconds, stream] => observe(seconds.parse()?, stream),
        [] => session(30.0, 256),
        [minutes] => session(minutes.parse()?, 256),
        [minutes, limit_mib] => session(minutes.parse()?, limit_mib.parse()?),
        _ => Err("hours [MINUTES] [LIMIT_MIB]".into()),
    }
}

/// Session time, the same in both processes.
fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as u64)
}

fn session(minutes: f64, limit_mib: u64) -> Result<(), Box<dyn Error>> {
    let duration = Duration::from_secs_f64(60.0 * minutes);
    let options = MonitorOptions {
        grpc_port: 0,
        web_port: 0,
        memory_limit_bytes: limit_mib << 20,
        ..MonitorOptions::default()
    };
    let (monitor, mut sender) = Monitor::start(&options, scene())?;
    let mut observer = Command::new(std::env::current_exe()?)
        .args(["--observe", &duration.as_secs().to_string()])
        .args(monitor.stream_address())
        .stdout(Stdio::inherit())
        .spawn()?;

    println!("a history of {limit_mib} MiB, {minutes} minutes");
    let start = Instant::now();
    let mut memory: Vec<(f64, f64)> = Vec::new(); // s, MiB
    let mut next_line = Duration::ZERO;
    let mut next = start;
    while start.elapsed() < duration {
        next = (next + SAMPLE_PERIOD).max(Instant::now());
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
        sender.offer(sample(start.elapsed().as_secs_f64()));
        if start.elapsed() >= next_line {
            memory.push((start.elapsed().as_secs_f64(), resident_mib()?));
            next_line += duration / 60;
            if let [.., (seconds, mib)] = *memory
                && memory.len() % 4 == 1
            {
                println!("{seconds:6.0} s {mib:7.1} MiB");
            }
        }
    }
    let third = &memory[memory.len() * 2 / 3..];
    println!(
        "{:6.0} s {:7.1} MiB; in the last third {:+.2} MiB a minute",
        start.elapsed().as_secs_f64(),
        resident_mib()?,
        60.0 * slope(third)
    );
    println!("{:?}", monitor.stop()?);
    observer.wait()?;
    Ok(())
}

/// A god-object and all the moving obstacles whose places a sample carries.
fn scene() -> MonitorScene {
    let body = |name: String, role| MonitorBody {
        name,
        vertices: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        colour: None,
        role,
        pose: Isometry3::identity(),
    };
    let obstacle = |k| body(format!("obstacle {k}"), BodyRole::MovingObstacle);
    let mut scene = MonitorScene::new("hours");
    scene.bodies = vec![body("god-object".into(), BodyRole::GodObject)];
    scene.bodies.extend((0..MAX_MOVING_OBSTACLES).map(obstacle));
    scene
}

/// A hand that moves, obstacles that move, four contacts, a force of every tick.
fn sample(t: f64) -> MonitorSample {
    let mut sample = MonitorSample::at(now_ns());
    sample.god_object_pose = Isometry3::translation(t.sin(), t.cos(), 0.2);
    sample.device_pose = Isometry3::translation(t.sin(), t.cos(), 0.19);
    sample.head_pose = Some(Isometry3::translation(0.1 * t.sin(), -0.5, 0.5));
    for tick in 0..20 {
        let t = t - 1e-3 * f64::from(tick);
        sample.wrench = Vector6::new((9.0 * t).sin(), t.cos(), 3.0, 0.0, 0.1, t.sin());
        sample
            .between
            .add(&sample.wrench, (900.0 + 100.0 * t.sin()) as f32);
    }
    for k in 0..MAX_MOVING_OBSTACLES as u16 {
        let turn = Vector3::z() * (t + f64::from(k));
        sample
            .moving
            .push(k, Isometry3::new(Vector3::x() * f64::from(k), turn));
    }
    sample.gap_min = 1e-4 * t.sin().abs();
    for k in 0..4 {
        sample.contacts.push(ShownContact {
            point: Point3::new((f64::from(k) * t).sin(), f64::from(k), t.cos()),
            normal: Vector3::z(),
        });
    }
    sample
}

fn resident_mib() -> Result<f64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kib: f64 = line
        .and_then(|line| line.split_whitespace().next())
        .ok_or("no VmRSS")?
        .parse()?;
    Ok(kib / 1024.0)
}

/// Of the straight line nearest to these points.
fn slope(points: &[(f64, f64)]) -> f64 {
    let mean =
        |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let along: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let across: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    along / across
}

fn observe(seconds: u64, stream: &str) -> Result<(), Box<dyn Error>> {
    let joined = now_ns();
    let mut ages = Vec::new(); // ms, of the messages that bring something newer: the past comes later
    observe_times(stream, Duration::from_secs(seconds), |newest| {
        if newest > joined {
            let age_ns = now_ns().saturating_sub(newest) as f64;
            ages.push((age_ns * 1e-6) as f32);
        }
    })?;
    ages.sort_by(f32::total_cmp);
    let Some(largest) = ages.last() else {
        return Err("nothing was read".into());
    };
    let at = |share: f64| ages[(share * (ages.len() - 1) as f64) as usize];
    println!(
        "age of the newest sample at its arrival: p50 {:.1}, p99 {:.1}, p99.9 {:.1}, largest {largest:.1} ms of {} messages",
        at(0.5),
        at(0.99),
        at(0.999),
        ages.len()
    );
    Ok(())
}
