//! Each opponent on a scene of its own paper: what is published, and what it comes to here. `taut-lab papers` prints the table.
//!
//! Unless a recipe is named, a loop has time to spare: an update and a force every millisecond, both of the pose of then. The last rows of the
//! table say what no source that could be read establishes.

mod as_published;
mod damping;
mod linearised_penalty;
mod penalty;
mod point;
mod static_coupling;
mod two_rate_lcp;
mod virtual_coupling;

use std::fmt::Write as _;

use god_object::{Pose, Vector6};

use crate::clock::TICK;
use crate::method::{HapticMethod, Method};
use crate::recipes::{Extent, all, large_bunnies, named};

/// Half a side of cubes, and radius of balls, m.
const HALF: f64 = 0.005;
/// What is rounding beside forces of newtons and ways of millimetres.
const TINY: f64 = 1e-9;

/// What an opponent comes to where its paper says what it should.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Who.
    pub method: Method,
    /// Of what.
    pub of: String,
    /// Who says so.
    pub source: &'static str,
    /// What is published.
    pub published: String,
    /// What it comes to.
    pub here: f64,
    /// Least and most that is the published figure.
    pub within: [f64; 2],
    /// Of what it comes to.
    pub unit: &'static str,
}

impl Figure {
    /// Whether what is published is reached.
    #[must_use]
    pub fn reached(&self) -> bool {
        (self.within[0]..=self.within[1]).contains(&self.here) // false for NaN
    }
}

/// What no source that could be read says of an opponent.
const NOT_ESTABLISHED: [(&str, &str); 6] = [
    (
        "penalty",
        "the figures of McNeely et al. 1999 and 2006 (bound of stiffness, times, scenes): the papers could not be read",
    ),
    (
        "paper+adaptation",
        "the time over which a constraint rises in the paper's own runs",
    ),
    (
        "static coupling",
        "the figures of Barbic and James 2008 (points in a millisecond, stiffness, scenes): the paper could not be read beyond its abstract",
    ),
    (
        "linearised penalty",
        "the figures of Otaduy and Lin 2006 (times, masses, scenes): the paper could not be read beyond its abstract",
    ),
    (
        "two-rate LCP",
        "the figures of Duriez et al. 2006 and Saupin et al. 2008: the papers could not be read; parameters are those of SOFA's documentation",
    ),
    (
        "discrete",
        "it has no paper: it is this project's method without continuous detection; look-ahead and sub-steps are among its tunings",
    ),
];

/// Every figure.
pub fn figures() -> Vec<Figure> {
    let recipes = all(Extent::Quick);
    let recipe = |name, case| named(&recipes, name, case);
    let mut figures = point::figures(recipe("R09", "plate of 0.1 mm"));
    figures.extend(penalty::figures());
    figures.extend(virtual_coupling::figures());
    figures.extend(static_coupling::figures());
    figures.extend(linearised_penalty::figures());
    figures.extend(two_rate_lcp::figures());
    let peg = recipe("R18", "in the hole, clearance 0.5 mm");
    let plane = recipe("R02", "ball on a plane");
    figures.extend(as_published::figures(peg, plane));
    figures.extend(large_bunnies().iter().flat_map(as_published::bunnies));
    let cylinder = recipe("R12", "radius 20 mm, 0.2 m/s");
    figures.push(as_published::behind(cylinder));
    figures.push(as_published::adapted(recipe("R11", "0.3 m/s")));
    figures
}

/// As a table of Markdown.
pub fn table(figures: &[Figure]) -> String {
    let mut table = String::from(
        "| method | figure of its own paper | published | here | reached |\n| --- | --- | --- | --- | --- |\n",
    );
    for figure in figures {
        let here = match figure.here.abs() {
            small if small < TINY => "0".to_owned(),
            small if small < 1e-3 => format!("{small:.1e}"),
            _ => format!("{:.3}", figure.here),
        };
        let here = format!("{here} {}", figure.unit);
        let reached = if figure.reached() { "yes" } else { "**no**" };
        let _ = writeln!(
            table,
            "| {} | {} | {}: {} | {} | {reached} |",
            figure.method.name(),
            figure.of,
            figure.source,
            figure.published,
            here.trim_end(),
        );
    }
    for (method, what) in NOT_ESTABLISHED {
        let _ = writeln!(table, "| {method} | {what} | not established | | |");
    }
    table
}

/// What an opponent comes to of what somebody says of it.
fn figure(
    (method, source): (Method, &'static str),
    of: impl Into<String>,
    published: impl Into<String>,
    here: f64,
    within: [f64; 2],
    unit: &'static str,
) -> Figure {
    Figure {
        method,
        of: of.into(),
        source,
        published: published.into(),
        here,
        within,
        unit,
    }
}

/// Poses and forces of a method in a loop with time to spare, updated every so many ticks. `device`: its pose at a tick.
fn driven(
    method: &mut dyn HapticMethod,
    (ticks, every): (u32, u32),
    device: impl Fn(u32) -> Pose,
) -> Vec<(Pose, Vector6)> {
    let step = |tick: u32| {
        let time = f64::from(tick) * TICK;
        let pose = device(tick);
        if tick.is_multiple_of(every) {
            method.update(time, &pose);
            method.publish(time);
        }
        let force = method.force(time, &pose);
        (method.pose(), force)
    };
    (0..ticks).map(step).collect()
}

/// At a height, m.
fn at(height: f64) -> Pose {
    Pose::translation(0.0, 0.0, height)
}
