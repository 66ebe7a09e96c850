//! What collides: a tree whose leaves are convex pieces.
//!
//! A piece is a triangle, a segment or a point, with a ball or a disc swept over it. A mesh has its triangles; a primitive is a tree of one leaf. The
//! half-space is the special case: it has no extent, and so a leaf that is made for each search, as large as this looks.

use nalgebra::{Point3, Vector3};

use crate::geometry::volume::Volume;
use crate::geometry::wide_tree::WideTree;
use crate::geometry::{Mesh, Primitive, across, unit_axis};
use crate::spatial::Pose;
use crate::world::{Body, Obstacle};

/// What a half-space reaches along its boundary, m: more than the motions that are searched.
const ENDLESS: f64 = 1e17;

/// A mesh, or the primitive that stands for it.
#[derive(Clone, Copy, Debug)]
pub enum Collider<'a> {
    /// Its triangles.
    Mesh(&'a Mesh),
    /// A solid.
    Primitive(&'a Primitive),
}

impl<'a> From<&'a Mesh> for Collider<'a> {
    fn from(mesh: &'a Mesh) -> Self {
        Self::Mesh(mesh)
    }
}

impl<'a> From<&'a Body> for Collider<'a> {
    fn from(body: &'a Body) -> Self {
        (body.primitive.as_ref()).map_or(Self::Mesh(&body.mesh), Self::Primitive)
    }
}

impl<'a> From<&'a Obstacle> for Collider<'a> {
    fn from(obstacle: &'a Obstacle) -> Self {
        (obstacle.primitive.as_ref()).map_or(Self::Mesh(&obstacle.mesh), Self::Primitive)
    }
}

/// A disc that is swept along its axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// m.
    pub(super) radius: f64,
    /// Unit.
    pub(super) axis: Vector3<f64>,
}

/// What is swept over the pieces of a body and an obstacle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swept {
    /// Radii of the balls of both together, m.
    pub(super) round: f64,
    /// Of the body and of the obstacle, each in its own frame.
    pub(super) discs: [Option<Disc>; 2],
    /// The obstacle is a half-space: it is bounded along its normal alone.
    pub(super) half_space: bool,
    /// Both are meshes.
    pub(super) nothing: bool,
}

impl Swept {
    pub(super) fn of(body: &Collider<'_>, obstacle: &Collider<'_>) -> Self {
        Self {
            round: body.round() + obstacle.round(),
            discs: [body.disc(), obstacle.disc()],
            half_space: obstacle.is_half_space(),
            nothing: matches!((body, obstacle), (Collider::Mesh(_), Collider::Mesh(_))),
        }
    }

    /// Whether points, segments and triangles with balls are all there is.
    #[inline]
    pub(super) fn has_only_balls(&self) -> bool {
        self.discs[0].is_none() && self.discs[1].is_none() && !self.half_space
    }
}

/// Bound on how far a body is from an obstacle at least, m, with its reference point at `center`, world, and however it is turned.
pub(crate) fn distance_at_least(
    body: &Body,
    center: &Point3<f64>,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
) -> f64 {
    let center = obstacle_pose.inverse_transform_point(center);
    let radius = Collider::from(body).radius_about(&body.reference_point);
    Collider::from(obstacle).distance(&center) - radius
}

impl Collider<'_> {
    /// Largest coordinate, m: rounding is relative to it. For a half-space, of its point.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.reach(),
            Self::Primitive(Primitive::Plane { point, .. }) => point.coords.amax(),
            Self::Primitive(primitive) => primitive.radius_about(&Point3::origin()),
        }
    }

    /// Least distance from a point, m, by its box where it is a mesh.
    pub(crate) fn distance(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.box_distance(point),
            Self::Primitive(primitive) => primitive.nearest(point).distance,
        }
    }

    /// A ball that it lies in: centre and radius, m.
    pub(super) fn ball(&self) -> (Point3<f64>, f64) {
        let primitive = match self {
            Self::Mesh(mesh) => {
                let all = &mesh.tree().nodes()[0];
                return (all.center, all.radius);
            }
            Self::Primitive(primitive) => primitive,
        };
        let middle = match primitive {
            Primitive::Sphere { center, .. } => *center,
            Primitive::Capsule { ends, .. } | Primitive::Cylinder { ends, .. } => {
                nalgebra::center(&ends[0], &ends[1])
            }
            Primitive::Plane { point, .. } => *point,
        };
        (middle, primitive.radius_about(&middle))
    }

    /// Bound on the distance of any point from `point`, m.
    pub(crate) fn radius_about(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.radius_bound_about(point),
            Self::Primitive(primitive) => primitive.radius_about(point),
        }
    }

    /// Number of its pieces.
    pub(super) fn pieces(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.triangles().len(),
            Self::Primitive(_) => 1,
        }
    }

    /// Corners of piece `t`, of which the last is repeated, and the outward normal of a triangle or a half-space; NaN for others.
    #[inline]
    pub(super) fn piece(&self, t: u32) -> ([Point3<f64>; 3], Vector3<f64>) {
        match self {
            Self::Mesh(mesh) => (mesh.corners(t), *mesh.face_normal(t)),
            Self::Primitive(primitive) => {
                let none = Vector3::repeat(f64::NAN);
                match primitive {
                    Primitive::Sphere { center, .. } => ([*center; 3], none),
                    Primitive::Capsule { ends: [p, q], .. }
                    | Primitive::Cylinder { ends: [p, q], .. } => ([*p, *q, *q], none),
                    Primitive::Plane { normal, point } => ([*point; 3], *normal),
                }
            }
        }
    }

    /// Its tree: a mesh's own, or `leaf`, which becomes that of a primitive. A half-space is made to reach `size` (m) about `center`, its frame, and has
    /// its one normal where what `faces` it is asked for; other primitives, and all where it is what crosses them, have normals all ways.
    pub(super) fn tree<'t>(
        &'t self,
        leaf: &'t mut WideTree,
        (center, size): (&Point3<f64>, f64),
        faces: bool,
    ) -> &'t WideTree {
        let primitive = match self {
            Self::Mesh(mesh) => return mesh.wide_tree(),
            Self::Primitive(primitive) => primitive,
        };
        let (mut middle, mut radius) = self.ball();
        // Axes of the slab and of the strip; the slab's middle and half its thickness; half the strip's sides; half those of the box.
        let (axes, slab, strip, half) = match primitive {
            Primitive::Sphere { radius, .. } => {
                let axes = [Vector3::z(), Vector3::x()];
                let half = Vector3::repeat(*radius);
                (axes, [0.0, *radius], [*radius; 2], half)
            }
            Primitive::Capsule { ends, radius } | Primitive::Cylinder { ends, radius } => {
                let axis = unit_axis(ends);
                let half_length = 0.5 * (ends[1] - ends[0]).norm();
                let (past, sideways) = match primitive {
                    Primitive::Capsule { .. } => (*radius, Vector3::repeat(1.0)),
                    _ => (0.0, axis.map(|x| (1.0 - x * x).max(0.0).sqrt())),
                };
                let half = axis.abs() * half_length + sideways * *radius;
                let axes = [across(&axis), axis];
                (axes, [0.0, *radius], [half_length + past, *radius], half)
            }
            Primitive::Plane { normal, point } => {
                let height = normal.dot(&(center - point));
                let depth = height.abs() + size;
                let (axes, endless) = ([*normal, across(normal)], Vector3::repeat(ENDLESS));
                (middle, radius) = (center - normal * height, depth);
                (axes, [-depth, depth], [ENDLESS; 2], endless)
            }
        };
        let mut volume = Volume::of_piece(&middle, axes, slab, strip, half, radius);
        if self.is_half_space() {
            // No larger than any body, for the lengths that intervals are measured by.
            volume.radius = 0.0;
            // It is a face: corners meet it.
            volume.owned = 0;
            if faces {
                (volume.cosine, volume.sine) = (1.0, 0.0);
            }
        }
        leaf.hold(middle, radius, &volume);
        leaf
    }

    fn round(&self) -> f64 {
        match self {
            Self::Primitive(
                Primitive::Sphere { radius, .. } | Primitive::Capsule { radius, .. },
            ) => *radius,
            _ => 0.0,
        }
    }

    fn disc(&self) -> Option<Disc> {
        match self {
            Self::Primitive(Primitive::Cylinder { ends, radius }) => Some(Disc {
                radius: *radius,
                axis: unit_axis(ends),
            }),
            _ => None,
        }
    }

    pub(super) fn is_half_space(&self) -> bool {
        matches!(self, Self::Primitive(Primitive::Plane { .. }))
    }
}
