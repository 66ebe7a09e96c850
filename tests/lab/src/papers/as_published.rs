//! Ortega et al. 2007: no penetration, nothing along a hole or a plane, times, and constraints that rise.

use super::{Figure, TINY, figure};
use crate::clock::{self, Charge, TICK, Tick};
use crate::costs;
use crate::cpu_time::quantile;
use crate::measure::Measure;
use crate::measured::{Measured, judged};
use crate::method::{Method, PUBLISHED_SHARE, Tuning};
use crate::outcome::Outcome;
use crate::recipe::Recipe;

/// Of the haptic loop, Hz.
const RATE: u32 = 1000;
/// Slow enough for a wall to be found late, Hz.
const SLOW_RATE: u32 = 70;
/// Of recipe R12: m, m, m/s.
const RADIUS: f64 = 0.02;
const DEEP: f64 = 3e-3;
const SPEED: f64 = 0.2;
/// Most that may act along a hole, N.
const AXIAL_FORCE: f64 = 1e-6;

/// Of the paper's method, where no more than `most` is published.
fn at_most(
    of: &str,
    source: &'static str,
    published: &str,
    here: f64,
    most: f64,
    unit: &'static str,
) -> Figure {
    figure(
        (Method::Paper, source),
        of,
        published,
        here,
        [0.0, most],
        unit,
    )
}

/// `peg`: in its hole, as in the paper's figure 11; `plane`: its figure 13.
pub(super) fn figures(peg: &Recipe, plane: &Recipe) -> Vec<Figure> {
    let [in_hole, on_plane] = [peg, plane].map(|recipe| Outcome::of(recipe, Method::Paper, RATE));
    let along = in_hole.measured.phases.iter().map(|phase| phase.probes[0]);
    let cost = costs::of(peg, Method::Paper, in_hole.tuning, RATE);
    let [update, force] = cost.map_or([f64::NAN; 2], |cost| [1e-3 * cost.update[2], cost.force]);
    vec![
        at_most(
            "poses at which peg (288 triangles) and box meet, R18",
            "Ortega et al. 2007, section 4",
            "none",
            in_hole.worst(Measure::Intersections),
            0.0,
            "",
        ),
        at_most(
            "force along the hole while the peg is pushed about in it, R18",
            "the same, figure 11",
            "0 N",
            along.fold(0.0, f64::max),
            AXIAL_FORCE,
            "N",
        ),
        at_most(
            "force along a plane over that across it, R02",
            "the same, figure 13",
            "0",
            on_plane.worst(Measure::Friction),
            TINY,
            "",
        ),
        at_most(
            "a force in the hole, median of costs.csv",
            "the same, on a computer of 2006",
            "below 25 us",
            force,
            25.0,
            "us",
        ),
        at_most(
            "an update in the hole, 99th percentile of costs.csv",
            "the same, on a computer of 2006",
            "below 10 ms",
            update,
            10.0,
            "ms",
        ),
    ]
}

/// The paper's other scene. Times are of this run.
pub(super) fn bunnies(bunnies: &Recipe) -> Vec<Figure> {
    let tuning = Tuning::Default;
    let mut method = Method::Paper.start(&bunnies.scene, 1.0 / f64::from(RATE), tuning);
    let charge = &mut Charge::WholePeriod;
    let run = clock::run(method.as_mut(), bunnies, RATE, 0.5, charge);
    let meets = |tick: &&Tick| bunnies.checker().penetrated(&tick.body).is_some();
    let checked = run.ticks.iter().step_by(bunnies.check_every as usize);
    let source = "the same, on a computer of 2006";
    vec![
        at_most(
            "poses at which two bunnies of 27,000 triangles meet, R27",
            "Ortega et al. 2007, section 4",
            "none",
            checked.filter(meets).count() as f64,
            0.0,
            "",
        ),
        at_most(
            "a force there, median",
            source,
            "below 12.5 us",
            quantile(&run.force_us, 0.5),
            12.5,
            "us",
        ),
        at_most(
            "an update there, 99th percentile",
            source,
            "below 15 ms",
            1e-3 * quantile(&run.update_us, 0.99),
            15.0,
            "ms",
        ),
    ]
}

/// What its steps come to: each update goes a share k = `k_s` (1 - d / R) of the angle that is left, for a device that is d behind the surface, and
/// a force is of a pose 1.5 periods old: (1 / k + 1 / 2) v / (R f). A contact that is lost on the way costs more than that.
pub(super) fn behind(cylinder: &Recipe) -> Figure {
    let tuning = Tuning::Touching(400.0);
    let start = || Method::Paper.start(&cylinder.scene, 1.0 / f64::from(RATE), tuning);
    let measured = Measured::of(cylinder, RATE, &judged(1), None, start);
    let share = PUBLISHED_SHARE * (1.0 - DEEP / RADIUS);
    let behind = ((1.0 / share + 0.5) * SPEED / (RADIUS * f64::from(RATE))).to_degrees();
    figure(
        (Method::Paper, "not published, it follows from the steps"),
        format!("the force's lag on a cylinder of 20 mm, 0.2 m/s, {RATE} Hz, {tuning}, R12"),
        format!("{behind:.2} degrees"),
        measured.worst(Measure::DirectionP95),
        [0.98, 1.02].map(|slack| slack * behind),
        "degrees",
    )
}

/// A constraint that is d behind when it is found rises over a time, so that the force does not jump.
pub(super) fn adapted(late: &Recipe) -> Figure {
    let period = 1.0 / f64::from(SLOW_RATE);
    let start = || Method::PaperAdapted.start(&late.scene, period, Tuning::Default);
    let measured = Measured::of(late, SLOW_RATE, &judged(late.phases), None, start);
    let adaptation = late.scene.settings.adaptation.expect("it is by default");
    let depth = measured.worst(Measure::FirstForceDepth);
    let rising = depth / adaptation.duration + late.scene.speed;
    let most = late.scene.stiffness() * rising * TICK;
    figure(
        (
            Method::PaperAdapted,
            "Ortega et al. 2007, section 5, figure 6",
        ),
        format!(
            "largest step of the force, wall found {:.1} mm late at {SLOW_RATE} Hz, R11",
            1e3 * depth
        ),
        format!("at most {most:.3} N/ms, by the time of rising"),
        measured.worst(Measure::Step),
        [0.0, most * (1.0 + TINY)],
        "N/ms",
    )
}
