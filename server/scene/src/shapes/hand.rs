//! A hand that holds something between thumb and index finger: to be seen, not to be felt.
//!
//! Bones with skin around them: cones with round ends, joined smoothly, and the surface on which the distance to them is 0. The wrist ends in a cuff.
//! Positions are those of a right hand 0.19 m long, in its own frame: wrist at the origin, fingers along y, the back of the hand up.

use std::array;

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use crate::lattice::{Samples, Site};
use crate::mesh_file::RawMesh;
use crate::simplify::reduced;

/// Length of the hand that is described here, wrist to the tip of the middle finger, m.
const LENGTH: f64 = 0.19;
/// Pitch of the lattice on which the distance is known, m.
const PITCH: f64 = 0.005;
/// How far from bones their skin may be, m.
const MARGIN: f64 = 0.03;
/// How far the skin that is drawn may be from where it is, m: the lattice makes three times the triangles that this needs.
const SIMPLIFY_ERROR: f32 = 1e-4;
/// How far bones of one finger, and those of the palm, melt into each other, m.
const SOFT: f64 = 0.004;
const PALM_SOFT: f64 = 0.016;
/// The hand as it holds, against its own frame: fingers down, wrist up and back.
const PITCH_DOWN: f64 = 0.55;

/// A finger that bends.
struct Finger {
    /// Its first joint.
    root: Point,
    /// Of its bones, m: near the means of adults.
    lengths: [f64; 3],
    /// How far each is bent against the one before, degrees: two fingers hold, and two rest.
    bends: [f64; 3],
    /// Sideways, degrees.
    spread: f64,
    /// Over that of the index finger.
    thickness: f64,
}

/// Index finger to little finger.
const FINGERS: [Finger; 4] = [
    Finger {
        root: [-0.027, 0.092, 0.000],
        lengths: [0.044, 0.026, 0.020],
        bends: [46.0, 52.0, 16.0],
        spread: -1.0,
        thickness: 1.0,
    },
    Finger {
        root: [-0.005, 0.096, 0.003],
        lengths: [0.048, 0.030, 0.021],
        bends: [50.0, 52.0, 18.0],
        spread: 1.0,
        thickness: 1.03,
    },
    Finger {
        root: [0.016, 0.091, 0.001],
        lengths: [0.044, 0.028, 0.021],
        bends: [60.0, 58.0, 24.0],
        spread: 5.0,
        thickness: 0.97,
    },
    Finger {
        root: [0.034, 0.081, -0.004],
        lengths: [0.035, 0.020, 0.018],
        bends: [62.0, 62.0, 28.0],
        spread: 10.0,
        thickness: 0.84,
    },
];
/// Radii at the joints of an index finger and at its tip, m.
const FINGER_RADII: [f64; 4] = [0.0108, 0.0094, 0.0083, 0.0070];
/// Joints of the thumb from its root to its tip, with radii, m.
const THUMB: [(Point, f64); 4] = [
    ([-0.022, 0.022, -0.010], 0.0165),
    ([-0.041, 0.047, -0.036], 0.0125),
    ([-0.040, 0.071, -0.058], 0.0104),
    ([-0.034, 0.090, -0.074], 0.0080),
];
/// Bones of palm, wrist and forearm: ends with radii, m.
const PALM: [[(Point, f64); 2]; 7] = [
    [
        ([-0.016, 0.006, 0.000], 0.0165),
        ([-0.027, 0.092, 0.000], 0.0112),
    ],
    [
        ([-0.006, 0.006, 0.001], 0.0170),
        ([-0.005, 0.096, 0.003], 0.0116),
    ],
    [
        ([0.006, 0.006, 0.001], 0.0170),
        ([0.016, 0.091, 0.001], 0.0112),
    ],
    [
        ([0.014, 0.004, -0.001], 0.0160),
        ([0.034, 0.081, -0.004], 0.0100),
    ],
    [
        ([0.020, 0.020, -0.008], 0.0150),
        ([0.031, 0.062, -0.009], 0.0120),
    ],
    [
        ([-0.012, 0.010, 0.000], 0.0175),
        ([-0.014, -0.075, 0.002], 0.0215),
    ],
    [
        ([0.012, 0.010, 0.000], 0.0175),
        ([0.014, -0.075, 0.002], 0.0215),
    ],
];
/// The cuff: where along the forearm its middle is, half its length, radius, the rounding of its edges, m, and its width over its height.
const CUFF: (f64, f64, f64, f64, f64) = (-0.088, 0.036, 0.0285, 0.005, 1.35);

type Point = [f64; 3];

/// A cone with round ends, m.
#[derive(Clone, Copy)]
struct Bone {
    ends: [Point3<f64>; 2],
    radii: [f64; 2],
}

impl Bone {
    fn new([a, b]: [(Point, f64); 2]) -> Self {
        Self {
            ends: [a.0, b.0].map(Point3::from),
            radii: [a.1, b.1],
        }
    }

    /// From its skin, negative within: to the ball of the nearest point of its axis, which is a little more than to the cone.
    fn distance(&self, p: &Point3<f64>) -> f64 {
        let along = self.ends[1] - self.ends[0];
        let share = ((p - self.ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        let radius = self.radii[0] + share * (self.radii[1] - self.radii[0]);
        (p - (self.ends[0] + along * share)).norm() - radius
    }
}

/// Skin over bones: `fingers` each by themselves, on a `palm` that is one.
struct Skin {
    fingers: Vec<[Bone; 3]>,
    palm: Vec<Bone>,
}

impl Skin {
    fn new() -> Self {
        let mut fingers: Vec<[Bone; 3]> = FINGERS.iter().map(finger).collect();
        fingers.push(array::from_fn(|k| Bone::new([THUMB[k], THUMB[k + 1]])));
        Self {
            fingers,
            palm: PALM.map(Bone::new).to_vec(),
        }
    }

    fn bones(&self) -> impl Iterator<Item = &Bone> {
        self.fingers.iter().flatten().chain(&self.palm)
    }

    fn distance(&self, p: &Point3<f64>) -> f64 {
        let melt = |soft: f64| move |a: f64, b: f64| smaller(a, b, soft);
        let of = |bones: &[Bone], soft: f64| {
            let all = bones.iter().map(|bone| bone.distance(p));
            all.reduce(melt(soft)).unwrap_or(f64::INFINITY)
        };
        // Fingers melt with the palm, and not with each other: those that touch stay two.
        let palm = of(&self.palm, PALM_SOFT);
        let joined = self
            .fingers
            .iter()
            .map(|finger| smaller(of(finger, SOFT), palm, 2.0 * SOFT));
        joined.fold(palm, f64::min)
    }
}

/// The smaller of two distances, rounded where they are nearly the same.
fn smaller(a: f64, b: f64, soft: f64) -> f64 {
    let near = (soft - (a - b).abs()).max(0.0) / soft;
    a.min(b) - near * near * soft / 4.0
}

fn finger(finger: &Finger) -> [Bone; 3] {
    let (mut from, mut bend) = (Point3::from(finger.root), 0.0_f64);
    let across = finger.spread.to_radians().sin();
    array::from_fn(|k| {
        bend += finger.bends[k].to_radians();
        let way = Vector3::new(across, bend.cos(), -bend.sin()).normalize();
        let to = from + way * finger.lengths[k];
        let radii = [k, k + 1].map(|joint| FINGER_RADII[joint] * finger.thickness);
        let bone = Bone {
            ends: [from, to],
            radii,
        };
        from = to;
        bone
    })
}

fn cuff(p: &Point3<f64>) -> f64 {
    let (middle, half, radius, edge, wide) = CUFF;
    let out = (p.x / wide).hypot(p.z - 0.002) - (radius - edge);
    let beyond = (p.y - middle).abs() - (half - edge);
    out.max(beyond).min(0.0) + out.max(0.0).hypot(beyond.max(0.0)) - edge
}

/// Where thumb and index finger meet.
fn grip(skin: &Skin) -> Point3<f64> {
    let tip = |finger: usize| skin.fingers[finger][2].ends[1];
    nalgebra::center(&tip(0), &tip(FINGERS.len()))
}

/// A hand of this length, m, and how many of its triangles, the first ones, are skin; the others are cuff.
///
/// Its frame: thumb and index finger meet at the origin; the fingers point down, along -z, and away, along y, the arm comes from -y.
pub(crate) fn hand(length: f64, is_left: bool) -> (RawMesh, usize) {
    let skin = Skin::new();
    let ends = skin.bones().flat_map(|bone| bone.ends);
    let mut hand = surface(ends, |p| skin.distance(p));
    let of_skin = hand.triangles.len();
    let (middle, half, radius, _, wide) = CUFF;
    let corners = [-1.0, 1.0]
        .map(|side| Point3::new(side * radius * wide, middle + side * half, side * radius));
    let cuff = surface(corners, cuff);
    let first = hand.vertices.len() as u32;
    hand.vertices.extend(cuff.vertices);
    hand.triangles
        .extend(cuff.triangles.iter().map(|t| t.map(|v| v + first)));
    let (origin, scale) = (grip(&skin), length / LENGTH);
    let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(-Vector3::x()), PITCH_DOWN);
    for vertex in &mut hand.vertices {
        let mut held = turn * (*vertex - origin);
        held.x *= if is_left { -1.0 } else { 1.0 };
        *vertex = Point3::from(held * scale);
    }
    if is_left {
        hand.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    (hand, of_skin)
}

/// Where a distance is 0, in the box around some points; its vertices are brought there from the lattice's edges.
fn surface(
    around: impl IntoIterator<Item = Point3<f64>>,
    distance: impl Fn(&Point3<f64>) -> f64,
) -> RawMesh {
    let half = PITCH / 2.0;
    let place = |site: Site| Point3::from(site.map(|c| f64::from(c) * half));
    let (mut low, mut high) = ([i32::MAX; 3], [i32::MIN; 3]);
    for p in around {
        for axis in 0..3 {
            low[axis] = low[axis].min(((p[axis] - MARGIN) / half).floor() as i32);
            high[axis] = high[axis].max(((p[axis] + MARGIN) / half).ceil() as i32);
        }
    }
    let samples = Samples::of_box(low, high, 0.05 * PITCH, |site| distance(&place(site)));
    let mut mesh = samples.surface(place);
    let step = 1e-5;
    for vertex in &mut mesh.vertices {
        let ways = [Vector3::x(), Vector3::y(), Vector3::z()];
        let slope = Vector3::from(
            ways.map(|way| distance(&(*vertex + way * step)) - distance(&(*vertex - way * step))),
        ) / (2.0 * step);
        let steep = slope.norm_squared().max(0.25);
        *vertex -= slope * (distance(vertex) / steep);
    }
    reduced(&mesh.vertices, &mesh.triangles, SIMPLIFY_ERROR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_closed_as_long_as_is_said_and_holds_its_origin() {
        for (length, is_left) in [(0.19, false), (0.05, true)] {
            let (hand, of_skin) = hand(length, is_left);
            assert!(hand.triangles.len() < 15_000, "{}", hand.triangles.len());
            assert!(of_skin < hand.triangles.len());
            let scale = length / LENGTH;
            let near = |p: &Point3<f64>| p.coords.norm() / scale;
            let nearest = hand.vertices.iter().map(near).fold(f64::INFINITY, f64::min);
            // The tips are a thing of some millimetres apart.
            assert!((0.0005..0.008).contains(&nearest), "{nearest}");
            let mesh = god_object::Mesh::new(hand.vertices.clone(), hand.triangles.clone());
            let mesh = mesh.expect("a closed surface");
            let volume = god_object::geometry::mass_properties(&mesh).volume / scale.powi(3);
            assert!((3e-4..9e-4).contains(&volume), "{volume} m^3");
        }
    }

    #[test]
    fn a_left_hand_is_a_right_hand_in_a_mirror() {
        let [(right, _), (left, _)] = [false, true].map(|is_left| hand(LENGTH, is_left));
        for (a, b) in right.vertices.iter().zip(&left.vertices) {
            assert_eq!([a.x, a.y, a.z], [-b.x, b.y, b.z]);
        }
        // The thumb of a right hand whose back is up and whose fingers point away is on the left.
        let (low, high) = right.bounds().expect("vertices");
        assert!(-low.x < high.x, "{low} {high}");
    }
}
