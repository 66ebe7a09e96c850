//! Dense meshes, a hand that slides, and a clock of CPU time: support of examples that measure.
#![allow(dead_code, reason = "each user takes its own part")]

use std::collections::HashMap;

use god_object::Pose;
use god_object::nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use rustix::time::{ClockId, clock_gettime};

/// Vertices and triangles.
pub(crate) type Soup = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// CPU time that this thread has used, us: what others run on the machine does not count.
pub(crate) fn thread_cpu_us() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

/// A small generator with a fixed sequence (xorshift).
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// In [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In [-1, 1).
    pub(crate) fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.signed(), self.signed(), self.signed())
    }
}

/// Each triangle in four by the middles of its sides; the new vertices leave their sides along the mean normal by a smooth
/// wave and by rough noise of `ROUGHNESS` of the side's length. The old vertices stay.
pub(crate) fn subdivided(soup: &Soup, times: u32) -> Soup {
    const ROUGHNESS: f64 = 0.03;
    const WAVE: f64 = 0.02;
    const WAVE_LENGTH: f64 = 4e-3;
    let (mut vertices, mut triangles) = soup.clone();
    for level in 0..times {
        let random = &mut Random::new(u64::from(level) + 1);
        let mut normals = vec![Vector3::zeros(); vertices.len()];
        for t in &triangles {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let doubled = (b - a).cross(&(c - a));
            t.iter().for_each(|v| normals[*v as usize] += doubled);
        }
        let mut middles = HashMap::with_capacity(triangles.len() * 3 / 2);
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for &[a, b, c] in &triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (vertices[i as usize], vertices[j as usize]);
                    let normal = (normals[i as usize] + normals[j as usize])
                        .try_normalize(0.0)
                        .unwrap_or_default();
                    let m = god_object::nalgebra::center(&p, &q);
                    let wave = m.coords.map(|x| (x / WAVE_LENGTH).sin()).sum() / 3.0;
                    let out = (WAVE * wave + ROUGHNESS * random.signed()) * (q - p).norm();
                    vertices.push(m + normal * out);
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (vertices, triangles)
}

/// A hand that presses a body towards the origin and slides it around, a step at a time.
pub(crate) struct Hand {
    pub(crate) pose: Pose,
    random: Random,
    axis: Vector3<f64>,
    turn: Vector3<f64>,
    /// Shortest and longest step, m.
    step: [f64; 2],
}

impl Hand {
    /// Shortest and longest step unless others are given, m; greatest rotation in a step, rad; how deep it presses, m.
    const STEP: [f64; 2] = [0.5e-3, 3e-3];
    const TURN: f64 = 0.5_f64.to_radians();
    const DEPTH: [f64; 2] = [1e-3, 3e-3];
    /// The hand does not turn further from the body than this, rad: a hand feels the torque.
    const TWIST: f64 = 3.0_f64.to_radians();

    pub(crate) fn new(pose: Pose, seed: u64) -> Self {
        Self::with_steps(pose, seed, Self::STEP)
    }

    pub(crate) fn with_steps(pose: Pose, seed: u64, step: [f64; 2]) -> Self {
        Self {
            pose,
            random: Random::new(seed),
            axis: Vector3::y(),
            turn: Vector3::zeros(),
            step,
        }
    }

    /// The next pose of the device, given where the body is.
    pub(crate) fn next(&mut self, body: &Pose) -> Pose {
        let between = |[low, high]: [f64; 2], u: f64| low + (high - low) * u;
        let length = between(self.step, self.random.unit());
        let depth = between(Self::DEPTH, self.random.unit());
        // A direction of sliding and an axis of turning that wander.
        self.axis = (self.axis + self.random.vector() * 0.1).normalize();
        self.turn = self.turn * 0.95 + self.random.vector() * 0.3;
        let inwards = -body.translation.vector.normalize();
        let tangent = self
            .axis
            .cross(&inwards)
            .try_normalize(1e-3)
            .unwrap_or_else(Vector3::x);
        let goal = body.translation.vector + inwards * depth + tangent * (2.0 * length);
        let way = goal - self.pose.translation.vector;
        let step = way * (length / way.norm());

        let behind = self.pose.rotation.rotation_to(&body.rotation);
        let spin = if behind.angle() > Self::TWIST {
            behind.scaled_axis()
        } else {
            self.turn
        };
        let angle = Self::TURN * self.random.unit();
        let rotation = Unit::try_new(spin, 1e-9).map_or_else(UnitQuaternion::identity, |axis| {
            UnitQuaternion::from_axis_angle(&axis, angle)
        });
        self.pose = Pose::from_parts(
            (self.pose.translation.vector + step).into(),
            rotation * self.pose.rotation,
        );
        self.pose
    }
}

/// Prints percentiles of `times`, us.
pub(crate) fn report(name: &str, times: &mut [f64]) {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "{name:>28}: p50 {:8.1}  p99 {:8.1}  p99.9 {:8.1}  max {:8.1} us",
        at(0.5),
        at(0.99),
        at(0.999),
        at(1.0)
    );
}
