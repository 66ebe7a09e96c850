//! Samples of the shared data to rerun.
//!
//! Everything is told in the scene's own frame: screens and head are brought there from the workbench.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::Pose;
use taut_bridge::realtime::sleep_until;
use taut_monitor::{
    BodyRole, LogLevel, LoopTime, Monitor, MonitorBody, MonitorError, MonitorOptions,
    MonitorSample, MonitorScene, MonitorScreen, MonitorSender, MovingObstacles, ShownContact,
};
use taut_proto::scene::ScreenDescription;

use super::events::EventLog;
use super::{MonitorPicture, MonitorSettings, MonitorSources, NetworkCounts, Severity};
use crate::loops::shell::spawn;
use crate::shared::clock::nanoseconds;
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;
use crate::shared::timing::{Histogram, HistogramWindow};

/// Time between two samples: 50 a second, smooth curves and a light load.
const SAMPLE_PERIOD: Duration = Duration::from_millis(20);
/// Samples over which a percentile is taken: one second.
const WINDOW_SAMPLES: u32 = 50;

/// The thread that feeds the monitor, and the monitor.
#[derive(Debug)]
pub struct MonitorFeed {
    monitor: Monitor,
    thread: JoinHandle<()>,
}

impl MonitorFeed {
    /// Whether this build has a monitor.
    pub const BUILT_IN: bool = true;

    /// Starts to serve and record, and to feed it until the end is asked for.
    pub fn start(
        settings: &MonitorSettings,
        picture: &MonitorPicture,
        sources: MonitorSources,
        network: Arc<NetworkCounts>,
        shutdown: &Shutdown,
    ) -> Result<Self, Failure> {
        let options = MonitorOptions {
            bind: settings.bind,
            grpc_port: settings.grpc_port,
            web_port: settings.web_port,
            record: settings.record.clone(),
            memory_limit_bytes: settings.memory_limit_bytes,
            serve: settings.serve,
        };
        let frame = SceneFrame::of(picture);
        let scene = monitor_scene(picture, &frame);
        let (monitor, sender) = Monitor::start(&options, scene).map_err(failure)?;
        let asked = shutdown.clone();
        let obstacles = picture.world.obstacles.iter();
        let names = obstacles.map(|obstacle| obstacle.name.clone());
        let events = EventLog::new(names, picture.rest_distance);
        let thread = spawn("monitor feed", shutdown, move || {
            feed(sources, sender, events, &network, &frame, &asked);
        })
        .map_err(Failure::failed)?;
        Ok(Self { monitor, thread })
    }

    /// The web page that opens the stream.
    pub fn address(&self) -> Option<&str> {
        self.monitor.address()
    }

    /// The stream's own address.
    pub fn stream_address(&self) -> Option<&str> {
        self.monitor.stream_address()
    }

    /// The file to which it is written.
    pub fn recording(&self) -> Option<&Path> {
        self.monitor.recording()
    }

    /// Shows a line at the newest session time; never waits.
    pub fn log(&self, severity: Severity, line: &str) {
        self.monitor.log(level(severity), line);
    }

    /// Ends it, after the end was asked for; how many samples were dropped.
    pub fn stop(self) -> Result<u64, Failure> {
        self.thread
            .join()
            .map_err(|_| Failure::failed("the thread that feeds the monitor broke down"))?;
        Ok(self.monitor.stop().map_err(failure)?.samples_dropped)
    }
}

fn level(severity: Severity) -> LogLevel {
    match severity {
        Severity::Info => LogLevel::Info,
        Severity::Warning => LogLevel::Warn,
        Severity::Error => LogLevel::Error,
    }
}

fn failure(error: MonitorError) -> Failure {
    match error {
        MonitorError::Thread(_) | MonitorError::ThreadLost | MonitorError::Rerun { .. } => {
            Failure::failed(error)
        }
        _ => Failure::bad_input(error),
    }
}

/// Brings what stands on the workbench into the scene.
#[derive(Clone, Copy, Debug)]
struct SceneFrame {
    scene_from_workbench: Pose,
    /// Size in the simulation over size on the workbench.
    shrink: f64,
}

impl SceneFrame {
    fn of(picture: &MonitorPicture) -> Self {
        Self {
            scene_from_workbench: picture.workbench_from_scene.inverse(),
            shrink: picture.display_scale.recip(),
        }
    }

    fn point(&self, in_workbench: &[f64; 3]) -> Point3<f64> {
        (self.scene_from_workbench * Point3::from(*in_workbench)) * self.shrink
    }

    fn pose(&self, in_workbench: &Pose) -> Pose {
        let mut pose = self.scene_from_workbench * in_workbench;
        pose.translation.vector *= self.shrink;
        pose
    }
}

fn monitor_scene(picture: &MonitorPicture, frame: &SceneFrame) -> MonitorScene {
    let world = &picture.world;
    let mut scene = MonitorScene::new(&picture.name);
    let mut colours = picture.colours.iter().copied();
    let mut body = |name: &str, mesh: &god_object::Mesh, role, pose: &Pose| {
        scene.bodies.push(MonitorBody {
            name: name.to_owned(),
            vertices: mesh
                .vertices()
                .iter()
                .map(|v| [v.x as f32, v.y as f32, v.z as f32])
                .collect(),
            triangles: mesh.triangles().to_vec(),
            colour: colours.next().flatten(),
            role,
            pose: *pose,
        });
    };
    body(
        "god-object",
        &world.body.mesh,
        BodyRole::GodObject,
        &picture.start,
    );
    for (index, obstacle) in world.obstacles.iter().enumerate() {
        let role = if picture.moving.contains(&index) {
            BodyRole::MovingObstacle
        } else {
            BodyRole::Obstacle
        };
        body(&obstacle.name, &obstacle.mesh, role, &obstacle.pose);
    }
    scene.screens = picture
        .screens
        .iter()
        .map(|screen| outline(screen, frame))
        .collect();
    scene.head = Some(frame.pose(&picture.head));
    scene.head_size = frame.shrink;
    scene.reference_point = world.body.reference_point;
    scene.up = frame.scene_from_workbench.rotation * Vector3::z();
    scene
}

fn outline(screen: &ScreenDescription, frame: &SceneFrame) -> MonitorScreen {
    let [lower_left, lower_right, upper_left] =
        [screen.lower_left, screen.lower_right, screen.upper_left]
            .map(|corner| frame.point(&corner));
    let upper_right = lower_right + (upper_left - lower_left);
    MonitorScreen {
        name: screen.name.to_string(),
        corners: [lower_left, lower_right, upper_right, upper_left],
    }
}

fn feed(
    mut sources: MonitorSources,
    mut sender: MonitorSender,
    mut events: EventLog,
    network: &NetworkCounts,
    frame: &SceneFrame,
    shutdown: &Shutdown,
) {
    let mut times = LoopTimes::default();
    let mut deadline = sources.clock.now();
    while !shutdown.is_asked() {
        deadline = sources.clock.now().max(deadline + SAMPLE_PERIOD);
        sleep_until(sources.clock.monotonic(deadline));
        let mut sample = sample(&mut sources, frame);
        times.follow(&sources, &mut sample);
        for tick in sources.felt.take() {
            let age_us = tick.constraint_age.as_secs_f32() * 1e6;
            sample.between.add(&tick.wrench, age_us);
        }
        sample.packets_sent = network.packets_sent.load(Ordering::Relaxed);
        sample.packets_received = network.packets_received.load(Ordering::Relaxed);
        sample.clients = network.clients.load(Ordering::Relaxed);
        // What finds no room is counted by the queue.
        sender.offer(sample);
        let now = sources.clock.now();
        let contacts = sources.shared.contacts.held();
        events.follow(now, contacts, &sources.statistics, |severity, line| {
            sender.log(nanoseconds(now), level(severity), line);
        });
    }
}

fn sample(sources: &mut MonitorSources, frame: &SceneFrame) -> MonitorSample {
    let now = sources.clock.now();
    let device = *sources.shared.device.newest();
    let wrench = *sources.shared.wrench.newest();
    let contacts = sources.shared.contacts.newest();
    let gap_min = contacts.set.gap_min;
    let mut moving = MovingObstacles::default();
    for place in &contacts.moving {
        // There is room for as many as a session has.
        moving.push(place.obstacle, place.pose);
    }
    let head = &mut sources.head;
    let head_pose = head.moves().then(|| frame.pose(&head.pose(now)));
    MonitorSample {
        god_object_pose: contacts.set.god_object_pose,
        moving,
        device_pose: device.pose,
        head_pose,
        wrench: device.felt.map_or(wrench.wrench, |felt| felt.wrench),
        contacts: contacts
            .set
            .constraints
            .iter()
            .map(|c| ShownContact {
                point: c.point,
                normal: c.normal,
            })
            .collect(),
        // Nothing near is no gap to plot.
        gap_min: if gap_min.is_finite() {
            gap_min
        } else {
            f64::NAN
        },
        constraint_age_us: wrench.constraint_age.as_secs_f32() * 1e6,
        penetrations: sources
            .statistics
            .checks
            .penetrations
            .load(Ordering::Relaxed),
        ..MonitorSample::at(nanoseconds(now))
    }
}

/// Newest and recent p99 of the three loops.
#[derive(Default)]
struct LoopTimes {
    samples: u32,
    windows: [HistogramWindow; 3],
    p99_us: [f32; 3],
    /// Between two samples.
    between: [HistogramWindow; 3],
}

impl LoopTimes {
    fn follow(&mut self, sources: &MonitorSources, sample: &mut MonitorSample) {
        let statistics = &sources.statistics;
        let histograms: [&Histogram; 3] = [
            &statistics.haptics.period,
            &statistics.god_object.update,
            &statistics.coupling.force,
        ];
        if self.samples.is_multiple_of(WINDOW_SAMPLES) {
            for ((window, histogram), p99) in self
                .windows
                .iter_mut()
                .zip(histograms)
                .zip(&mut self.p99_us)
            {
                *p99 = window.advance_us(histogram).p99 as f32;
            }
        }
        self.samples = self.samples.wrapping_add(1);
        let mut longest_us = [0.0; 3];
        for ((window, histogram), longest) in
            self.between.iter_mut().zip(histograms).zip(&mut longest_us)
        {
            *longest = window.advance_us(histogram).max as f32;
        }
        let loop_time = |index: usize| LoopTime {
            last_us: histograms[index].newest_time().as_secs_f32() * 1e6,
            p99_us: self.p99_us[index],
            longest_us: longest_us[index],
        };
        sample.haptics_period = loop_time(0);
        sample.god_object_update = loop_time(1);
        sample.force_update = loop_time(2);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_is_shrunk_as_the_screens_are() {
        let built = taut_scene::Scene::named_or_file("peg-in-a-hole").and_then(|s| s.build());
        let picture = MonitorPicture {
            name: "a magnified scene".to_owned(),
            world: Arc::new(built.expect("a shipped scene").world),
            moving: Vec::new(),
            start: Pose::identity(),
            screens: Vec::new(),
            workbench_from_scene: Pose::translation(0.0, -0.45, 0.25),
            display_scale: 5.0,
            head: Pose::translation(0.0, -1.45, 0.25),
            rest_distance: 1e-5,
            colours: Vec::new(),
        };
        let scene = monitor_scene(&picture, &SceneFrame::of(&picture));
        let away = scene.head.expect("a head").translation.vector.norm();
        assert!((away - 0.2).abs() < 1e-12 && (scene.head_size - 0.2).abs() < 1e-12);
    }
}
