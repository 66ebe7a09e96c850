//! Truth from outside: contact forces that were measured of a person's hand, and what a method renders for the same motion.
//!
//! The device is where a spring between it and the measured pose carries the measured wrench, so a method that finds the
//! same contacts renders the same wrench. A soft spring leads deep into the contour, where only a method with a memory finds back; a stiff one leaves
//! a depth near the millimetre to which the pose is known. So each method has the stiffness, and the tuning, that serve it best in a trial that is
//! not judged ([`choose`]). Depth is not known, so sizes are not compared:
//!
//! | measure  | unit | meaning                                                                                                      |
//! |----------|------|--------------------------------------------------------------------------------------------------------------|
//! | angle    | deg  | between the rendered and the measured force                                                                  |
//! | residual | –    | what is left of the measured wrench beside the best multiple of the rendered one, over its norm; moments over 30 mm |
//!
//! Counted are instants at which the pose was measured and the tool moved. Data, licence and provenance: `tests/data/measured`. There is no friction in the renderer, and some in
//! the rollers. Every update takes its whole period.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use god_object::spatial::{angular, linear};
use god_object::{Body, Pose, Settings, Vector6};
use nalgebra::{Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use taut_method_tests::solids::{mesh, obstacle, world};
use taut_scene::read_mesh;

use crate::clock::{self, Charge, TICK};
use crate::cpu_time::quantile;
use crate::method::{Method, Scene, Tuning};
use crate::recipe::Recipe;

/// The trials that are judged.
pub const TRIALS: [&str; 8] = ["a_1", "a_2", "b_1", "b_2", "d_1", "d_2", "e_1", "e_2"];
/// Most that the data's conversion found fair for a frictionless renderer at 200 N/m: angle, degrees, and residual; median, 90th and 99th percentile.
pub const TARGETS: [[f64; 3]; 2] = [[2.0, 3.4, 5.2], [0.038, 0.066, 0.12]];
/// Of the targets.
pub const SHARES: [f64; 3] = [0.5, 0.9, 0.99];
/// Stiffnesses of the spring to choose from, N/m: the device is 0.1 m to 1 mm in the contour.
pub const STIFFNESSES: [f64; 5] = [200.0, 600.0, 2e3, 6e3, 2e4];
/// The trial by which choices are made; it is not judged.
pub const TRIAL_FOR_CHOICE: &str = "c_1";
/// Radius of gyration of the body, m: its inertia is free, and a light one would have to be turned far to carry the moment.
const GYRATION: f64 = 0.1;
/// Length that moments are divided by, m.
const ARM: f64 = 0.03;
/// Forces and torques are not limited: N, N m.
const NO_LIMIT: f64 = 1e3;
/// The device comes down from here along the first force, m, in this time, and waits for as long, s.
const ABOVE: f64 = 0.03;
const COMING: f64 = 0.3;
/// Slower than this the tool stands, m/s, and its rollers may carry force along the surface.
const STANDING: f64 = 0.01;
/// Updates a second, Hz.
const RATE: u32 = 1000;

/// An instant at which the pose was measured.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time: f64,
    pose: Pose,
    wrench: Vector6,
    moving: bool,
}

/// What is chosen for a method.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// Of the spring between hand and tool, N/m.
    pub stiffness: f64,
    /// Of the method.
    pub tuning: Tuning,
}

/// One trial for one method.
#[derive(Clone, Debug)]
pub struct Replayed {
    /// Which.
    pub trial: String,
    /// What its contour was registered by.
    pub registered_by: String,
    /// Who.
    pub method: Method,
    /// With what.
    pub choice: Choice,
    /// At each counted instant, degrees; no force is 180.
    pub angles: Vec<f64>,
    /// At each counted instant; no force is 1.
    pub residuals: Vec<f64>,
}

/// Where the data are: in this repository.
pub fn directory() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../data/measured")
}

/// The choice with the least 90th percentile of the angle in the trial that is not judged, then the least median: of every tuning with every stiffness.
pub fn choose(method: Method) -> Result<Choice, Box<dyn Error>> {
    let mut best: Option<([f64; 2], Choice)> = None;
    for tuning in method.tunings() {
        for stiffness in STIFFNESSES {
            let choice = Choice { stiffness, tuning };
            let replayed = replay(TRIAL_FOR_CHOICE, method, choice)?;
            let found = [0.9, 0.5].map(|share| quantile(&replayed.angles, share));
            eprintln!(
                "{}: {stiffness} N/m, {tuning:?}: {:.1} / {:.1} degrees",
                method.name(),
                found[1],
                found[0]
            );
            if best.is_none_or(|(least, _)| found < least) {
                best = Some((found, choice));
            }
        }
    }
    best.map(|(_, choice)| choice)
        .ok_or_else(|| format!("{}: nothing to choose from", method.name()).into())
}

/// Replays a trial through a method.
pub fn replay(trial: &str, method: Method, choice: Choice) -> Result<Replayed, Box<dyn Error>> {
    let (registered_by, contour) = registration(trial)?;
    let samples = samples(trial)?;
    let recipe = recipe(trial, contour, &samples, choice.stiffness)?;
    let mut replayer = method.start(&recipe.scene, 1.0 / f64::from(RATE), choice.tuning);
    let charge = &mut Charge::WholePeriod;
    let run = clock::run(replayer.as_mut(), &recipe, RATE, 0.5, charge);
    let mut replayed = Replayed {
        trial: trial.to_owned(),
        registered_by,
        method,
        choice,
        angles: Vec::new(),
        residuals: Vec::new(),
    };
    for sample in samples.iter().filter(|sample| sample.moving) {
        let tick = ((sample.time - samples[0].time + 2.0 * COMING) / TICK).round() as usize;
        let Some(tick) = run.ticks.get(tick) else {
            continue;
        };
        let (rendered, right) = (linear(&tick.wrench), linear(&sample.wrench));
        let touching = rendered.norm() > f64::EPSILON;
        let angle = if touching {
            rendered.angle(&right).to_degrees()
        } else {
            180.0
        };
        replayed.angles.push(angle);
        let scaled = |w: &Vector6| {
            let moment = angular(w) / ARM;
            Vector6::from_iterator(linear(w).iter().chain(moment.iter()).copied())
        };
        let (rendered, right) = (scaled(&tick.wrench), scaled(&sample.wrench));
        let multiple = (rendered.dot(&right) / rendered.norm_squared()).max(0.0);
        let left = if touching {
            right - rendered * multiple
        } else {
            right
        };
        replayed.residuals.push(left.norm() / right.norm());
    }
    Ok(replayed)
}

/// As CSV, a row for each trial and method, and one for all trials of a method.
pub fn csv(all: &[Replayed]) -> String {
    let mut text = String::from(
        "trial,registered_by,method,stiffness,instants,angle_p50_deg,angle_p90_deg,angle_p99_deg,\
         residual_p50,residual_p90,residual_p99,within_targets\n",
    );
    let mut row = |trial: &str, by: &str, (method, choice): (Method, Choice), of: [&[f64]; 2]| {
        let found = percentiles(of);
        let [a, r] = found;
        let _ = writeln!(
            text,
            "{trial},{by},{},{},{},{:.3},{:.3},{:.3},{:.4},{:.4},{:.4},{}",
            method.name(),
            choice.stiffness,
            of[0].len(),
            a[0],
            a[1],
            a[2],
            r[0],
            r[1],
            r[2],
            within_targets(&found)
        );
    };
    for one in all {
        let of = [one.angles.as_slice(), &one.residuals];
        row(&one.trial, &one.registered_by, (one.method, one.choice), of);
    }
    for method in Method::ALL {
        let its = || all.iter().filter(|one| one.method == method);
        let angles: Vec<f64> = its().flat_map(|one| one.angles.iter().copied()).collect();
        let residuals: Vec<f64> = its()
            .flat_map(|one| one.residuals.iter().copied())
            .collect();
        if let Some(one) = its().next() {
            row("all", "", (method, one.choice), [&angles, &residuals]);
        }
    }
    text
}

/// Of angles and residuals.
pub fn percentiles(of: [&[f64]; 2]) -> [[f64; 3]; 2] {
    of.map(|values| SHARES.map(|share| quantile(values, share)))
}

/// Whether every percentile is within its target.
#[must_use]
pub fn within_targets(found: &[[f64; 3]; 2]) -> bool {
    let both = found.iter().flatten().zip(TARGETS.iter().flatten());
    both.into_iter().all(|(found, target)| found <= target)
}

fn pose(numbers: &[f64]) -> Pose {
    let turn = Quaternion::new(numbers[3], numbers[4], numbers[5], numbers[6]);
    Pose::from_parts(
        Translation3::new(numbers[0], numbers[1], numbers[2]),
        UnitQuaternion::from_quaternion(turn),
    )
}

/// What it was fitted to, and world from contour.
fn registration(trial: &str) -> Result<(String, Pose), Box<dyn Error>> {
    let rows = csv::Reader::from_path(directory().join("registration.csv"))?;
    for row in rows.into_deserialize() {
        let (of, by, place): (String, String, [f64; 7]) = row?;
        if of == trial {
            return Ok((by, pose(&place)));
        }
    }
    Err(format!("registration.csv: no trial {trial}").into())
}

fn samples(trial: &str) -> Result<Vec<Sample>, Box<dyn Error>> {
    let rows = csv::Reader::from_path(directory().join(format!("contour_{trial}.csv")))?;
    let mut samples = Vec::new();
    for row in rows.into_deserialize() {
        let row: [f64; 14] = row?;
        samples.push(Sample {
            time: row[0],
            pose: pose(&row[1..8]),
            wrench: Vector6::from_column_slice(&row[8..]),
            moving: false,
        });
    }
    for i in 1..samples.len() {
        let way = samples[i].pose.translation.vector - samples[i - 1].pose.translation.vector;
        let speed = way.norm() / (samples[i].time - samples[i - 1].time);
        samples[i].moving = speed > STANDING;
    }
    Ok(samples)
}

/// The scene, and the device over time: down to the first pose, a rest, and the trial.
fn recipe(
    trial: &str,
    contour: Pose,
    samples: &[Sample],
    stiffness: f64,
) -> Result<Recipe, Box<dyn Error>> {
    let (tool, _) = trial.split_once('_').ok_or("a trial is TOOL_NUMBER")?;
    let read = |name: String| read_mesh(&directory().join(name)).map(mesh);
    let body = Body {
        primitive: None,
        mass: 1.0,
        inertia: Matrix3::identity() * GYRATION.powi(2),
        reference_point: Point3::origin(),
        mesh: read(format!("rollers_{tool}.ply"))?,
    };
    let contour = obstacle("contour", read("contour.ply".into())?, contour);
    // Deep enough for the spring to carry the wrench.
    let pushed = |sample: &Sample| {
        let way = -linear(&sample.wrench) / stiffness;
        let turn = -angular(&sample.wrench) / (stiffness * GYRATION.powi(2));
        Pose::from_parts(
            Translation3::from(sample.pose.translation.vector + way),
            UnitQuaternion::from_scaled_axis(turn) * sample.pose.rotation,
        )
    };
    let times: Vec<f64> = samples.iter().map(|s| s.time - samples[0].time).collect();
    let devices: Vec<Pose> = samples.iter().map(pushed).collect();
    let out: Vector3<f64> = samples.iter().take(5).map(|s| linear(&s.wrench)).sum();
    let mut start = samples[0].pose;
    start.translation.vector += out * (ABOVE / out.norm());
    let duration = 2.0 * COMING + times[times.len() - 1];
    let between = |a: &Pose, b: &Pose, share: f64| {
        let turn = a.rotation.try_slerp(&b.rotation, share, f64::EPSILON);
        Pose::from_parts(
            Translation3::from(a.translation.vector.lerp(&b.translation.vector, share)),
            turn.unwrap_or(b.rotation),
        )
    };
    let device = move |time: f64| {
        if time < 2.0 * COMING {
            return between(&start, &devices[0], (time / COMING).min(1.0));
        }
        let time = time - 2.0 * COMING;
        let next = times
            .partition_point(|t| *t <= time)
            .clamp(1, times.len() - 1);
        let share = (time - times[next - 1]) / (times[next] - times[next - 1]);
        between(&devices[next - 1], &devices[next], share.clamp(0.0, 1.0))
    };
    let mut settings = Settings::for_size(0.06);
    settings.k_h = stiffness / settings.k_s;
    settings.force_limit = NO_LIMIT;
    settings.torque_limit = NO_LIMIT;
    let scene = Scene {
        world: world(body, [contour]),
        start,
        settings,
        speed: 0.5,
    };
    let name = ("measured", trial.to_owned());
    let about = "measured forces of a person's hand";
    Ok(Recipe::new(name, about, scene, duration, device))
}
