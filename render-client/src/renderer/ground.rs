//! Bodies that are ground: the plate of a half-space, a table, a wall behind the scene.
//!
//! Ground takes shadows and casts none onto the bodies that it carries. Light is fitted to those bodies and not to the ground, however large it is.
//! Which bodies are ground follows from their form, because nodes get a half-space as a mesh like any other.

use nalgebra::{Point3, Vector3};

use super::frame::TO_KEY_LIGHT;
use super::god_object::workbench_from_mesh;
use crate::stage::{Bounds, Stage, StageBody, TriangleMesh};

/// Ground is larger than this many times all bodies that it carries. A smaller plate makes shadows at most this much coarser, and
/// keeps its whole shadow on the floor in turn.
const LARGER: f64 = 2.0;

/// A plate is at least this many times as wide as thick. What is lost of its shadow on the floor, beyond the map, is then narrow: a half-space's
/// plate is 10 times as wide, and a block must keep its shadow.
const FLAT: f64 = 5.0;

/// Light that ground of the very colour of a body on it sends back, over that of the body. Half of the light is a step of about 20 in CIE
/// lightness, which shows the outline of the body; shadows on it are still seen.
const DIMMED: f32 = 0.5;

/// What the ground of a stage is.
#[derive(Debug)]
pub(crate) struct Ground {
    /// For each obstacle: whether it is ground.
    is: Vec<bool>,
    /// For each obstacle: whether a body on it would be lost before it.
    dimmed: Vec<bool>,
}

impl Ground {
    /// The ground of a stage at its start. It stays ground where it moves: what it casts within the shadow map is always drawn.
    pub(crate) fn of(stage: &Stage, mesh_bounds: &[Bounds]) -> Self {
        let is = grounds(stage, mesh_bounds);
        let same = |ground: &StageBody| {
            let bodies = stage.obstacles.iter().zip(&is);
            let mut carried = bodies.filter(|(body, is)| !**is && body.opacity > 0.0);
            carried.any(|(body, _)| body.colour == ground.colour)
        };
        let bodies = stage.obstacles.iter().zip(&is);
        let dimmed = bodies.map(|(body, is)| *is && same(body)).collect();
        Self { is, dimmed }
    }

    /// Whether the obstacle at this place is ground.
    pub(crate) fn is(&self, place: usize) -> bool {
        self.is[place]
    }

    /// The obstacle at this place as it is drawn.
    pub(crate) fn shown(&self, place: usize, body: &StageBody) -> StageBody {
        let share = if self.dimmed[place] { DIMMED } else { 1.0 };
        StageBody {
            colour: body.colour.map(|part| share * part),
            ..*body
        }
    }

    /// The obstacles that are seen and no ground; the god-object where there are none.
    pub(crate) fn carried<'s>(&self, stage: &'s Stage) -> Vec<&'s StageBody> {
        let bodies = stage.obstacles.iter().zip(&self.is);
        let carried = bodies.filter(|(body, is)| !**is && body.opacity > 0.0);
        or_held(stage, carried.map(|(body, _)| body).collect())
    }
}

/// The obstacles that are seen; the god-object where there are none.
pub(crate) fn standing(stage: &Stage) -> Vec<&StageBody> {
    let seen = stage.obstacles.iter().filter(|body| body.opacity > 0.0);
    or_held(stage, seen.collect())
}

fn or_held<'s>(stage: &'s Stage, mut bodies: Vec<&'s StageBody>) -> Vec<&'s StageBody> {
    if bodies.is_empty() {
        bodies.push(&stage.god_object);
    }
    bodies
}

/// A sphere around some bodies at their start, workbench frame.
pub(crate) fn around(stage: &Stage, bodies: &[&StageBody], mesh_bounds: &[Bounds]) -> Bounds {
    let bounds = |body: &&StageBody| stage.body_bounds(body, &body.pose, &mesh_bounds[body.mesh]);
    let all = bodies.iter().map(bounds).reduce(|a, b| a.union(&b));
    all.unwrap_or(Bounds {
        center: Point3::origin(),
        radius: 0.0,
    })
}

/// Height of the lowest vertex of some bodies, in metres.
pub(crate) fn lowest_point(stage: &Stage, bodies: &[&StageBody]) -> f64 {
    let height = |body: &&StageBody| {
        let model = workbench_from_mesh(stage, body, &body.pose);
        let vertices = stage.meshes[body.mesh].vertices.iter();
        let heights =
            vertices.map(move |v| model.transform_point(&Point3::from(*v).cast::<f64>()).z);
        heights.fold(f64::INFINITY, f64::min)
    };
    let lowest = bodies.iter().map(height).fold(f64::INFINITY, f64::min);
    if lowest.is_finite() { lowest } else { 0.0 }
}

/// Whether each obstacle is ground: a plate, much larger than all smaller bodies together, with all of them in front of a face that the lamp
/// lights. Light that falls on them has not passed it, and a plate casts none of its shadow onto itself.
fn grounds(stage: &Stage, mesh_bounds: &[Bounds]) -> Vec<bool> {
    let bounds = |body: &StageBody| stage.body_bounds(body, &body.pose, &mesh_bounds[body.mesh]);
    let seen = stage.obstacles.iter().enumerate();
    let mut by_size: Vec<(usize, Bounds)> = seen
        .filter(|(_, body)| body.opacity > 0.0)
        .map(|(place, body)| (place, bounds(body)))
        .collect();
    by_size.sort_by(|(_, a), (_, b)| a.radius.total_cmp(&b.radius));
    let mut smaller = vec![bounds(&stage.god_object)];
    let mut found: Vec<(usize, Bounds)> = Vec::new();
    for (place, own) in by_size {
        let body = &stage.obstacles[place];
        let all = [smaller.clone(), found.iter().map(|(_, it)| *it).collect()].concat();
        if carries(stage, body, &own, &all) {
            // Smaller ground that lies on this casts its shadow onto it.
            smaller = all;
            found = vec![(place, own)];
        } else if carries(stage, body, &own, &smaller) {
            found.push((place, own)); // two walls of a room
        } else {
            // Smaller ground may cast its shadow onto this.
            found.clear();
            smaller = all;
            smaller.push(own);
        }
    }
    let mut is = vec![false; stage.obstacles.len()];
    found.iter().for_each(|(place, _)| is[*place] = true);
    is
}

/// Whether a body is a plate, much larger than others together, with their middles in front of one of its faces that the lamp lights.
fn carries(stage: &Stage, body: &StageBody, own: &Bounds, others: &[Bounds]) -> bool {
    let together = others.iter().copied().reduce(|a, b| a.union(&b));
    let Some((axis, low, high)) = as_plate(&stage.meshes[body.mesh]) else {
        return false;
    };
    let to_workbench = stage.workbench_from_scene * body.pose;
    let carries = |(sign, corner): (f64, Point3<f64>)| {
        let normal = to_workbench.isometry.rotation * (sign * Vector3::ith(axis, 1.0));
        let corner = to_workbench * body.place(&corner);
        let in_front = |other: &Bounds| (other.center - corner).dot(&normal) > 0.0;
        normal.dot(&TO_KEY_LIGHT) > 0.0 && others.iter().all(in_front)
    };
    together.is_some_and(|all| own.radius > LARGER * all.radius)
        && [(-1.0, low), (1.0, high)].into_iter().any(carries)
}

/// The axis across a plate, and its lowest and highest corner: a mesh that is a flat box along its axes, with all vertices at corners.
fn as_plate(mesh: &TriangleMesh) -> Option<(usize, Point3<f64>, Point3<f64>)> {
    let (low, high) = mesh.corners();
    let at_corner = |v: &[f32; 3]| {
        let point = Point3::from(*v).cast::<f64>();
        (0..3).all(|axis| point[axis] == low[axis] || point[axis] == high[axis])
    };
    let size = high - low;
    let across = size.imin();
    let flat = (0..3).all(|axis| axis == across || size[axis] >= FLAT * size[across]);
    let is_plate = flat && !mesh.triangles.is_empty() && mesh.vertices.iter().all(at_corner);
    is_plate.then_some((across, low, high))
}
