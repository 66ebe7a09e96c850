//! What pose and tensions of a string-driven device cost along the demo's own path, and in which case.
//!
//! `cargo run --release -p taut --no-default-features --example string_device_cost [strings] [seconds]`
//!
//! The demo's scene, the three loops of a session and a simulated device with strings (`wb`, 60 s), ticked one after the other under a
//! virtual clock: what the computation itself costs, without the sleep between two ticks.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use god_object::nalgebra::UnitQuaternion;
use god_object::{GodObject, Vector6};
use taut::loops::realtime::thread_cpu_time;
use taut::loops::wiring::WiredLoops;
use taut::shared::timing::{Histogram, distribution_of};
use taut_bridge::{
    Device, DeviceFault, DeviceInfo, DeviceSample, Felt, Hand, HeldStrings, MinJerkPath,
    SafetySettings, SpidarDevice, ViaPoint, simulated_spidar, string_geometry,
};
use taut_scene::{BuiltScene, Scene};
use taut_spidar::TensionStatus;

/// The demo's.
const SCENE: &str = "peg-in-a-hole";

/// One write to the strings.
struct Tick {
    pose_us: f64,
    tensions_us: f64,
    status: TensionStatus,
    factorisations: u32,
}

/// The device, and what its writes cost.
struct Watched {
    device: SpidarDevice<HeldStrings>,
    ticks: Arc<Mutex<Vec<Tick>>>,
}

impl Device for Watched {
    fn info(&self) -> &DeviceInfo {
        self.device.info()
    }

    fn read(&mut self, now: Duration) -> Result<DeviceSample, DeviceFault> {
        self.device.read(now)
    }

    fn write(&mut self, now: Duration, wrench: &Vector6) {
        self.device.write(now, wrench);
        let (pose, tensions) = self.device.computing_times();
        let Some(answer) = self.device.tensions() else {
            return;
        };
        let us = |time: Duration| time.as_secs_f64() * 1e6;
        let tick = Tick {
            pose_us: us(pose),
            tensions_us: us(tensions),
            status: answer.status,
            factorisations: answer.factorisations,
        };
        let mut ticks = self.ticks.lock().unwrap_or_else(PoisonError::into_inner);
        ticks.push(tick);
    }

    fn felt(&self) -> Option<Felt> {
        self.device.felt()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let strings = arguments.next().unwrap_or_else(|| "wb".to_owned());
    let seconds: u32 = arguments.next().map_or(Ok(60), |text| text.parse())?;

    let scene = Scene::named_or_file(SCENE)?.build()?;
    let ticks = Arc::new(Mutex::new(Vec::with_capacity(1000 * seconds as usize)));
    let device = Watched {
        device: held_strings(&strings, &scene)?.with_clock(thread_cpu_time),
        ticks: ticks.clone(),
    };
    let world = Arc::new(scene.world);
    let god_object = GodObject::new(world.clone(), scene.settings, scene.start)?;
    let mut loops = WiredLoops::new(
        &world,
        &scene.settings,
        god_object,
        Box::new(device),
        SafetySettings::default(),
        None,
    )
    .with_motions(scene.motions, Duration::ZERO);
    for tick in 1..=1000 * u64::from(seconds) {
        let now = Duration::from_millis(tick);
        loops.haptics.tick(now);
        loops.coupling.tick(now);
        loops.god_object.tick(|| now);
    }

    show_ticks(&ticks.lock().unwrap_or_else(PoisonError::into_inner));
    show_largest("force (coupling)", &loops.coupling.statistics().force);
    Ok(())
}

/// The strings in the scene's simulated hand.
fn held_strings(
    strings: &str,
    scene: &BuiltScene,
) -> Result<SpidarDevice<HeldStrings>, Box<dyn std::error::Error>> {
    let hand = scene.hand.as_ref().ok_or("the scene has no hand")?;
    let via = hand.path.samples().iter().map(|sample| ViaPoint {
        time_s: sample.time,
        pose: sample.pose,
    });
    let made = simulated_spidar(
        string_geometry(strings)?,
        UnitQuaternion::identity(),
        scene.reference_point(),
        Hand::FIRM,
        MinJerkPath::new(via.collect(), hand.repeat)?,
        None,
    )?;
    if let Some(warning) = &made.warning {
        println!("{warning}");
    }
    Ok(made.device)
}

fn show_ticks(ticks: &[Tick]) {
    let clock = Histogram::default();
    for _ in ticks {
        let before = thread_cpu_time();
        clock.record_time(thread_cpu_time().saturating_sub(before));
    }
    let empty = clock.distribution_us();
    println!(
        "reading the clock            p50 {:6.2}  p99 {:6.2}  p99.9 {:6.2} us",
        empty.p50, empty.p99, empty.p999
    );
    show("pose", ticks, |_| true, |tick| tick.pose_us);
    for status in [
        TensionStatus::Rendered,
        TensionStatus::Scaled,
        TensionStatus::Nearest,
        TensionStatus::NotFinite,
    ] {
        let of = |tick: &Tick| tick.status == status;
        show(&format!("tensions, {status:?}"), ticks, of, |tick| {
            tick.tensions_us
        });
        show(&format!("factorisations, {status:?}"), ticks, of, |tick| {
            f64::from(tick.factorisations)
        });
    }
    show(
        "pose and tensions",
        ticks,
        |_| true,
        |tick| tick.pose_us + tick.tensions_us,
    );
}

fn show(what: &str, ticks: &[Tick], of: impl Fn(&Tick) -> bool, value: impl Fn(&Tick) -> f64) {
    let values: Vec<f64> = ticks.iter().filter(|tick| of(tick)).map(value).collect();
    if values.is_empty() {
        return;
    }
    let seen = distribution_of(&values);
    println!(
        "{what:28} p50 {:6.2}  p99 {:6.2}  p99.9 {:6.2}  max {:7.2}   {:.1} % of the ticks",
        seen.p50,
        seen.p99,
        seen.p999,
        seen.max,
        100.0 * values.len() as f64 / ticks.len() as f64
    );
}

fn show_largest(what: &str, histogram: &Histogram) {
    let seen = histogram.distribution_us();
    println!(
        "{what:28} p50 {:6.2}  p99 {:6.2}  p99.9 {:6.2}  max {:7.2}",
        seen.p50, seen.p99, seen.p999, seen.max
    );
}
