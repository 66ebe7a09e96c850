//! Shows a made-up session, to look at the picture and the plots without a server.
//!
//! A peg is pushed into a hole and pulled out again; the device sinks into the walls, the god-object does not.
//!
//! ```text
//! cargo run -p taut-monitor --example show -- --seconds 60 --record show.rrd
//! ```

use std::net::IpAddr;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use taut_monitor::{
    BodyRole, LogLevel, LoopTime, Monitor, MonitorBody, MonitorOptions, MonitorSample,
    MonitorScene, MonitorScreen, MonitorSender, Pose, ShownContact,
};

/// Samples per second.
const RATE_HZ: f64 = 60.0;
/// One push and pull, seconds.
const CYCLE_S: f64 = 6.0;
/// Half widths of peg and hole, half length of the peg, outer half width of the block, metres.
const PEG: f64 = 0.0148;
const HOLE: f64 = 0.0152;
const PEG_LENGTH: f64 = 0.05;
const BLOCK: f64 = 0.05;
/// Stiffness between device and god-object, N/m.
const STIFFNESS: f64 = 1000.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (options, seconds) = arguments()?;
    let (monitor, mut sender) = Monitor::start(&options, scene())?;
    println!("web page:  {}", monitor.address().unwrap_or("not served"));
    println!(
        "rerun:     {}",
        monitor.stream_address().unwrap_or("not served")
    );

    let start = Instant::now();
    let mut in_contact = false;
    let mut penetrations_said = false;
    for index in 0u64.. {
        let time = index as f64 / RATE_HZ;
        if time > seconds {
            break;
        }
        std::thread::sleep(Duration::from_secs_f64(time).saturating_sub(start.elapsed()));
        let sample = sample_at(time, index);
        let touches = sample.contacts.total() > 0;
        if touches != in_contact {
            let text = if touches { "contact" } else { "free" };
            sender.log(sample.session_time_ns, LogLevel::Info, text);
            in_contact = touches;
        }
        warn_once(&mut sender, &sample, &mut penetrations_said);
        sender.offer(sample);
    }
    println!("{:?}", monitor.stop()?);
    Ok(())
}

/// A force beyond what the hand should feel is worth a line.
fn warn_once(sender: &mut MonitorSender, sample: &MonitorSample, said: &mut bool) {
    let strong = sample.wrench.fixed_rows::<3>(0).norm() > 8.0;
    if strong && !*said {
        let text = "the force reached 8 N";
        sender.log(sample.session_time_ns, LogLevel::Warn, text);
        *said = true;
    }
}

fn arguments() -> Result<(MonitorOptions, f64), Box<dyn std::error::Error>> {
    let mut options = MonitorOptions::default();
    let mut seconds = 30.0;
    let mut words = std::env::args().skip(1);
    while let Some(key) = words.next() {
        let value = words.next().ok_or_else(|| format!("{key} needs a value"))?;
        match key.as_str() {
            "--seconds" => seconds = value.parse()?,
            "--record" => options.record = Some(PathBuf::from(value)),
            "--bind" => options.bind = value.parse::<IpAddr>()?,
            "--grpc-port" => options.grpc_port = value.parse()?,
            "--web-port" => options.web_port = value.parse()?,
            _ => return Err(format!("unknown option {key}").into()),
        }
    }
    Ok((options, seconds))
}

fn scene() -> MonitorScene {
    let mut peg = Shape::default();
    peg.add_box([-PEG, -PEG_LENGTH, -PEG], [PEG, PEG_LENGTH, PEG]);
    let mut block = Shape::default();
    block.add_box([-BLOCK, 0.0, HOLE], [BLOCK, 0.06, BLOCK]);
    block.add_box([-BLOCK, 0.0, -BLOCK], [BLOCK, 0.06, -HOLE]);
    block.add_box([-BLOCK, 0.0, -HOLE], [-HOLE, 0.06, HOLE]);
    block.add_box([HOLE, 0.0, -HOLE], [BLOCK, 0.06, HOLE]);
    let screen = |name: &str, corners: [[f64; 3]; 4]| MonitorScreen {
        name: name.into(),
        corners: corners.map(Point3::from),
    };
    MonitorScene {
        bodies: vec![
            peg.body("peg", BodyRole::GodObject),
            block.body("block with hole", BodyRole::Obstacle),
        ],
        screens: vec![
            screen(
                "vertical",
                [
                    [-0.7, 0.3, 0.0],
                    [0.7, 0.3, 0.0],
                    [0.7, 0.3, 1.0],
                    [-0.7, 0.3, 1.0],
                ],
            ),
            screen(
                "horizontal",
                [
                    [-0.7, -0.7, -0.1],
                    [0.7, -0.7, -0.1],
                    [0.7, 0.3, -0.1],
                    [-0.7, 0.3, -0.1],
                ],
            ),
        ],
        head: Some(Isometry3::translation(0.0, -0.5, 0.45)),
        ..MonitorScene::new("peg in a hole, made up")
    }
}

/// The peg at `time`: along y into the hole, the device off the axis by more than the clearance.
fn sample_at(time: f64, index: u64) -> MonitorSample {
    let phase = std::f64::consts::TAU * time / CYCLE_S;
    let depth = -0.06 + 0.045 * (1.0 - phase.cos());
    let sideways = 0.006 * (2.3 * phase).sin();
    let lift = 0.005 * (1.7 * phase).cos();
    let inside = depth + PEG_LENGTH > 0.0;
    let clearance = HOLE - PEG;
    let bound = |x: f64| {
        if inside {
            x.clamp(-clearance, clearance)
        } else {
            x
        }
    };
    let tilt = UnitQuaternion::from_euler_angles(0.0, 0.15 * phase.sin(), 0.05 * phase.cos());
    let device_pose = Pose::from_parts(Translation3::new(sideways, depth, lift), tilt);
    let god_object_rotation = if inside {
        UnitQuaternion::identity()
    } else {
        tilt
    };
    let god_object_pose = Pose::from_parts(
        Translation3::new(bound(sideways), depth, bound(lift)),
        god_object_rotation,
    );

    let mut sample = MonitorSample::at((time * 1e9) as u64);
    let offset = god_object_pose.translation.vector - device_pose.translation.vector;
    let turn = god_object_rotation
        .rotation_to(&tilt)
        .inverse()
        .scaled_axis();
    let (force, torque) = (STIFFNESS * offset, 2.0 * turn);
    sample.god_object_pose = god_object_pose;
    sample.device_pose = device_pose;
    sample.wrench = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
    sample.gap_min = if inside { 0.0 } else { -(depth + PEG_LENGTH) };
    let mut touch = |along: f64, axis: usize, push: f64| {
        let mut normal = Vector3::zeros();
        normal[axis] = push.signum();
        let mut point = Point3::new(0.0, along, 0.0);
        point[axis] = -HOLE * push.signum();
        sample.contacts.push(ShownContact {
            point,
            normal,
            gap: 0.0,
        });
    };
    if inside {
        let tip = depth + PEG_LENGTH;
        for (axis, push) in [(0, force.x), (2, force.z)] {
            if push.abs() > 0.1 {
                touch(0.0, axis, push);
                touch(tip.min(0.06), axis, push);
            }
        }
    }

    // Loop times with a repeatable jitter.
    let jitter = |scale: f32, salt: u64| {
        let hash = (index ^ salt).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
        scale * hash as f32 / (1 << 24) as f32
    };
    let loop_time = |base: f32, scale: f32, salt: u64| LoopTime {
        last_us: base + jitter(scale, salt),
        p99_us: base + 0.97 * scale,
        longest_us: base + scale,
    };
    sample.haptics_period = loop_time(995.0, 12.0, 1);
    sample.god_object_update = loop_time(420.0, 300.0, 2);
    sample.force_update = loop_time(18.0, 9.0, 3);
    sample.constraint_age_us = 500.0 + jitter(700.0, 4);
    sample.packets_sent = (time * 180.0) as u64;
    sample.packets_received = (time * 30.0) as u64;
    sample.clients = 2;
    sample
}

/// A triangle mesh made of boxes.
#[derive(Default)]
struct Shape {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    fn add_box(&mut self, least: [f64; 3], most: [f64; 3]) {
        let first = self.vertices.len() as u32;
        for corner in 0..8 {
            let pick = |axis: usize| {
                let upper = corner >> axis & 1 == 1;
                (if upper { most[axis] } else { least[axis] }) as f32
            };
            self.vertices.push([pick(0), pick(1), pick(2)]);
        }
        // Corner numbers are x + 2 y + 4 z; quads counter-clockwise from outside.
        const QUADS: [[u32; 4]; 6] = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        for [a, b, c, d] in QUADS.map(|quad| quad.map(|corner| first + corner)) {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    fn body(self, name: &str, role: BodyRole) -> MonitorBody {
        MonitorBody {
            name: name.into(),
            vertices: self.vertices,
            normals: None,
            triangles: self.triangles,
            colour: None,
            role,
            pose: Pose::identity(),
        }
    }
}
