//! Bodies, obstacles, motions and lines that several recipes share.

use god_object::{Body, Mesh, Obstacle, Pose, Primitive, Vector6};
use nalgebra::{Point3, Vector3};
use taut_method_tests::solids::{body, mesh, obstacle};
use taut_scene::RawMesh;
use taut_scene::shapes::{cuboid, sphere};

use crate::clock::{TICK, Tick};
use crate::measure::{Measure, largest};
use crate::method::{Method, Scene};
use crate::recipe::{Line, Lines, Recipe};

/// Deepest penetration that passes, m.
const PENETRATION: f64 = 1e-6;
/// The force of a device that moves at a speed may change this much faster than that of a spring.
const STEP_SLACK: f64 = 1.5;

/// An exact sphere of 1 kg.
pub(crate) fn ball(radius: f64) -> Body {
    Body {
        primitive: Some(Primitive::Sphere {
            center: Point3::origin(),
            radius,
        }),
        ..body(mesh(sphere(radius, 2)))
    }
}

/// A cube of 1 kg.
pub(crate) fn cube(half: f64) -> Body {
    body(cube_mesh(half))
}

/// Its mesh.
pub(super) fn cube_mesh(half: f64) -> Mesh {
    mesh(cuboid([half; 3]))
}

/// A box along the axes between two corners.
pub(crate) fn block(name: &str, low: Point3<f64>, high: Point3<f64>) -> Obstacle {
    let (half, middle) = ((high - low) * 0.5, nalgebra::center(&low, &high));
    let pose = Pose::from(middle.coords);
    obstacle(name, mesh(cuboid([half.x, half.y, half.z])), pose)
}

/// A large block whose upper face is z = 0.
pub(crate) fn ground() -> Obstacle {
    block(
        "ground",
        Point3::new(-0.3, -0.3, -0.1),
        Point3::new(0.3, 0.3, 0.0),
    )
}

/// A force alone, N.
pub(crate) fn force(x: f64, y: f64, z: f64) -> Vector6 {
    Vector6::new(x, y, z, 0.0, 0.0, 0.0)
}

/// What every recipe asks: no penetration, nothing that is not a number.
pub(super) fn sound() -> Vec<Line> {
    vec![
        Measure::Penetration.at_most(PENETRATION),
        Measure::Intersections.at_most(0.0),
        Measure::NotFinite.at_most(0.0),
    ]
}

/// That, and what the recipe asks itself at a rate, Hz.
pub(super) fn sound_and<L: IntoIterator<Item = Line>>(
    own: impl Fn(u32) -> L + Send + Sync + 'static,
) -> Lines {
    Box::new(move |rate| sound().into_iter().chain(own(rate)).collect())
}

/// Where the ideal does not jump, the force does not: the device moves at `speed`, m/s.
pub(super) fn smooth(stiffness: f64, speed: f64) -> Line {
    Measure::Step.at_most(STEP_SLACK * stiffness * speed * TICK)
}

/// For how long after a contact has ended the planes of the last set may still push, s: two updates on their way and one that is used.
pub(super) fn ghost_time(k_s: f64, rate: u32) -> f64 {
    (1.0 / k_s + 1.0) / f64::from(rate)
}

/// From place to place, each leg at its speed.
#[derive(Clone, Debug)]
pub(super) struct Path {
    /// Time of arrival, s, and place, m.
    stops: Vec<(f64, Vector3<f64>)>,
}

impl Path {
    pub(super) fn from(place: Vector3<f64>) -> Self {
        Self {
            stops: vec![(0.0, place)],
        }
    }

    fn last(&self) -> (f64, Vector3<f64>) {
        self.stops[self.stops.len() - 1]
    }

    /// In a straight line, m/s.
    pub(super) fn to(mut self, place: Vector3<f64>, speed: f64) -> Self {
        let (time, from) = self.last();
        self.stops
            .push((time + (place - from).norm() / speed, place));
        self
    }

    /// Stays, s.
    pub(super) fn hold(mut self, duration: f64) -> Self {
        let (time, place) = self.last();
        self.stops.push((time + duration, place));
        self
    }

    /// s.
    pub(super) fn duration(&self) -> f64 {
        self.last().0
    }

    /// Where it is, m.
    pub(super) fn at(&self, time: f64) -> Vector3<f64> {
        for leg in self.stops.windows(2) {
            let ((begin, from), (end, to)) = (leg[0], leg[1]);
            if time < end {
                let share = ((time - begin) / (end - begin)).clamp(0.0, 1.0);
                return from + (to - from) * share;
            }
        }
        self.last().1
    }

    /// As a pose.
    pub(super) fn pose(&self, time: f64) -> Pose {
        Pose::from(self.at(time))
    }
}

/// A recipe without a right answer, lines or probes yet, whose device goes along a path.
pub(super) fn along(
    case: (&'static str, String),
    about: &'static str,
    scene: Scene,
    path: Path,
) -> Recipe {
    let duration = path.duration();
    Recipe::new(case, about, scene, duration, move |time| path.pose(time))
}

/// Why the god-object of three degrees of freedom has no part in a recipe that turns its body.
pub(super) fn turns(method: Method) -> Option<&'static str> {
    (method == Method::Point).then_some("its body does not turn")
}

/// Why only this project's method has a part in a recipe.
pub(super) fn ours_alone(method: Method, reason: &'static str) -> Option<&'static str> {
    let ours = matches!(method, Method::Ours | Method::OursByDefault);
    (!ours).then_some(reason)
}

/// Why a method has no part in a recipe that shades its force.
pub(super) fn does_not_shade(method: Method) -> Option<&'static str> {
    match method {
        Method::Paper | Method::PaperAdapted => None,
        _ => ours_alone(method, "it has no force shading"),
    }
}

/// The largest of a number of the ticks from `begin` on, s.
pub(super) fn largest_from(
    begin: f64,
    value: impl Fn(&Tick) -> f64 + Send + Sync + 'static,
) -> impl Fn(&[Tick]) -> f64 + Send + Sync + 'static {
    move |ticks| {
        let late = ticks.iter().filter(|tick| tick.time >= begin);
        largest(late.map(&value))
    }
}

/// A convex outline in x and z, anticlockwise seen against y, drawn out to `half` on both sides along y.
pub(super) fn drawn_out(outline: &[[f64; 2]], half: f64) -> Mesh {
    let count = outline.len() as u32;
    let mut raw = RawMesh::default();
    for y in [-half, half] {
        let corners = outline.iter().map(|[x, z]| Point3::new(*x, y, *z));
        raw.vertices.extend(corners);
    }
    for i in 0..count {
        let (a, b) = (i, (i + 1) % count);
        raw.triangles
            .extend([[a, b, b + count], [a, b + count, a + count]]);
    }
    for i in 1..count - 1 {
        raw.triangles
            .extend([[0, i + 1, i], [count, count + i, count + i + 1]]);
    }
    // Seen against y, x to the right and z up turn clockwise about y: whichever way is outward.
    Mesh::new(raw.vertices.clone(), raw.triangles.clone()).unwrap_or_else(|_| {
        raw.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh(raw)
    })
}
