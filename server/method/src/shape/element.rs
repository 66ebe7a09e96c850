//! Points and segments that may touch: vertices and edges of meshes, spheres, ends and sides of capsules.
//!
//! | symbol | name in code | unit | meaning                                                       |
//! |--------|--------------|------|---------------------------------------------------------------|
//! | n      | `normal`     | –    | unit, from the second element to the first                    |
//! | x, y   | `on_first`, `on_second` | m | points on the first and on the second surface          |
//! | g      | `gap`        | m    | `n.(x - y)`                                                   |
//! | rho    | `round`      | m    | radius of the ball swept over the element; 0 on a mesh        |
//!
//! Two elements make a row where n lies in the normal cone of the second and -n in that of the first, as for meshes. Ball radii only
//! shorten the gap: normals are exact, there are no facets.

use nalgebra::{Point3, Vector3};

use crate::constraint::{
    Feature, LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE, covers_ball, is_in_edge_cone,
    is_in_vertex_cone, is_over,
};
use crate::geometry::Mesh;
use crate::geometry::distance::barycentric;

/// Segments at a smaller angle are parallel, as its sine: their ends stand for them.
const PARALLEL_SINE: f64 = 1e-6;

/// The outward directions in which an element is a local maximum of its surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Cone<'a> {
    /// All: a sphere; or all that are met: the side of a capsule, across its axis.
    Any,
    /// The half space of this outward direction: the end of a capsule.
    End(Vector3<f64>),
    /// A vertex of a mesh whose frame is the common one.
    Vertex(&'a Mesh, u32),
    /// An edge of such a mesh.
    Edge(&'a Mesh, u32),
}

impl Cone<'_> {
    /// Whether a unit direction lies in the cone, to `tolerance`, rad.
    pub(super) fn holds(&self, direction: &Vector3<f64>, tolerance: f64) -> bool {
        match self {
            Self::Any => true,
            Self::End(outward) => outward.dot(direction) >= -tolerance,
            Self::Vertex(mesh, v) => is_in_vertex_cone(mesh, *v, direction, tolerance),
            Self::Edge(mesh, e) => is_in_edge_cone(mesh, *e, direction, tolerance),
        }
    }
}

/// What a point or a segment is besides its place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skin<'a> {
    /// Radius of the ball swept over it, m.
    pub(super) round: f64,
    pub(super) cone: Cone<'a>,
    pub(super) feature: Feature,
}

/// A point with a ball around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knob<'a> {
    pub(super) at: Point3<f64>,
    pub(super) skin: Skin<'a>,
}

/// A segment with a ball swept over it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rod<'a> {
    pub(super) ends: [Point3<f64>; 2],
    pub(super) skin: Skin<'a>,
}

impl Skin<'_> {
    /// The row of points `x` of this and `y` of the other along `normal`, where that lies in both cones to the tilts, rad.
    fn row(
        &self,
        other: &Self,
        [x, y]: [Point3<f64>; 2],
        normal: Vector3<f64>,
        tilts: [f64; 2],
    ) -> Option<Row> {
        let facing = self.cone.holds(&-normal, tilts[0]) && other.cone.holds(&normal, tilts[1]);
        let features = [self.feature, other.feature];
        facing.then(|| Row::between(features, [x, y], [self.round, other.round], normal))
    }
}

/// What becomes a contact. In the common frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) features: [Feature; 2],
    pub(super) on_first: Point3<f64>,
    pub(super) on_second: Point3<f64>,
    /// Unit, from the second to the first.
    pub(super) normal: Vector3<f64>,
    pub(super) gap: f64,
}

impl Row {
    /// With first and second exchanged.
    pub(super) fn reversed(self) -> Self {
        Self {
            features: [self.features[1], self.features[0]],
            on_first: self.on_second,
            on_second: self.on_first,
            normal: -self.normal,
            gap: self.gap,
        }
    }

    /// The row of two points on the cores, `gap` between them along `normal`, less the balls.
    pub(super) fn between(
        features: [Feature; 2],
        [x, y]: [Point3<f64>; 2],
        [round_x, round_y]: [f64; 2],
        normal: Vector3<f64>,
    ) -> Self {
        Self {
            features,
            on_first: x - normal * round_x,
            on_second: y + normal * round_y,
            normal,
            gap: normal.dot(&(x - y)) - round_x - round_y,
        }
    }
}

/// Two points.
pub(super) fn knob_knob(a: &Knob, b: &Knob) -> Option<Row> {
    let normal = (a.at - b.at).try_normalize(f64::MIN_POSITIVE)?;
    let tilts = [NORMAL_CONE_TOLERANCE; 2];
    a.skin.row(&b.skin, [a.at, b.at], normal, tilts)
}

/// A point over the inside of a segment. Points are let in before the body tilts onto them.
pub(super) fn knob_rod(a: &Knob, b: &Rod) -> Option<Row> {
    let along = b.ends[1] - b.ends[0];
    let share = along.dot(&(a.at - b.ends[0])) / along.norm_squared();
    if !(0.0..=1.0).contains(&share) {
        return None;
    }
    let foot = b.ends[0] + along * share;
    let normal = (a.at - foot).try_normalize(f64::MIN_POSITIVE)?;
    let tilts = [LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE];
    a.skin.row(&b.skin, [a.at, foot], normal, tilts)
}

/// Two segments that cross.
pub(super) fn rod_rod(a: &Rod, b: &Rod) -> Option<Row> {
    let (u, v, r) = (
        a.ends[1] - a.ends[0],
        b.ends[1] - b.ends[0],
        a.ends[0] - b.ends[0],
    );
    let (s, t) = crossing(&u, &v, &r)?;
    let inside = (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t);
    if !inside {
        return None;
    }
    let (x, y) = (a.ends[0] + u * s, b.ends[0] + v * t);
    let cross = u.cross(&v);
    let unit = cross / cross.norm();
    let normal = if unit.dot(&(x - y)) < 0.0 {
        -unit
    } else {
        unit
    };
    a.skin.row(&b.skin, [x, y], normal, [LOOK_AHEAD_TILT; 2])
}

/// Fractions along two lines, `u` and `v` from points `r` apart, where they are nearest; `None` when they are parallel.
fn crossing(u: &Vector3<f64>, v: &Vector3<f64>, r: &Vector3<f64>) -> Option<(f64, f64)> {
    let (a, e, b) = (u.norm_squared(), v.norm_squared(), u.dot(v));
    let denominator = a * e - b * b;
    let crosses = denominator > PARALLEL_SINE * PARALLEL_SINE * a * e; // false for NaN
    let (c, f) = (u.dot(r), v.dot(r));
    crosses.then(|| ((b * f - c * e) / denominator, (a * f - b * c) / denominator))
}

/// A point over a face.
pub(super) fn knob_face(a: &Knob, mesh: &Mesh, t: u32) -> Option<Row> {
    let (corners, normal) = (mesh.corners(t), *mesh.face_normal(t));
    let height = normal.dot(&(a.at - corners[0]));
    if !is_over(&a.at, &corners, &normal, height) || !a.skin.cone.holds(&-normal, LOOK_AHEAD_TILT) {
        return None;
    }
    Some(row_over_face(a, t, &normal, height))
}

/// A ball past the end of a face, where the rows of the faces that it is over imply that of this one ([`covers_ball`]), and at most `within` from its
/// plane, m.
pub(super) fn knob_past_face(a: &Knob, mesh: &Mesh, t: u32, within: f64) -> Option<Row> {
    let (corners, normal) = (mesh.corners(t), *mesh.face_normal(t));
    let height = normal.dot(&(a.at - corners[0]));
    let gap = height - a.skin.round;
    let past = a.skin.round > 0.0
        && gap >= 0.0
        && gap <= within // false for NaN
        && a.skin.cone.holds(&-normal, LOOK_AHEAD_TILT)
        && covers_ball(mesh, t, &a.at);
    past.then(|| row_over_face(a, t, &normal, height))
}

/// The row of a point `height` (m) above the plane of triangle `t`.
fn row_over_face(a: &Knob, t: u32, normal: &Vector3<f64>, height: f64) -> Row {
    Row::between(
        [a.skin.feature, Feature::Face(t)],
        [a.at, a.at - normal * height],
        [a.skin.round, 0.0],
        *normal,
    )
}

/// A point over a half-space.
pub(super) fn knob_plane(a: &Knob, normal: &Vector3<f64>, point: &Point3<f64>) -> Option<Row> {
    let plane = Skin {
        round: 0.0,
        cone: Cone::Any,
        feature: Feature::Whole,
    };
    let foot = a.at - normal * normal.dot(&(a.at - point));
    let tilts = [LOOK_AHEAD_TILT; 2];
    a.skin.row(&plane, [a.at, foot], *normal, tilts)
}

/// Weights of the corners of triangle `t` at a point of it.
pub(super) fn weights(mesh: &Mesh, t: u32, at: &Point3<f64>) -> [f64; 3] {
    barycentric(at, &mesh.corners(t), mesh.face_normal(t))
}
