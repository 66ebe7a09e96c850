//! What of two convex pieces can touch: points, segments, faces and circles.
//!
//! | symbol | name in code | unit | meaning                                                       |
//! |--------|--------------|------|---------------------------------------------------------------|
//! | n      | `normal`     | –    | unit, from the second element to the first                    |
//! | x, y   | `on_first`, `on_second` | m | points on the first and on the second surface          |
//! | g      | `gap`        | m    | `n.(x - y)`                                                   |
//! | rho    | `round`      | m    | radius of the ball swept over the element; 0 on a mesh        |
//!
//! All in one frame, the obstacle's, until the contacts are handed out. Ball radii only shorten the gap: normals are exact, there are no facets.

use nalgebra::{Point3, Vector3};

use super::circle::Circle;
use super::cones::{is_in_edge_cone, is_in_vertex_cone, outward_of_edge};
use super::foot::is_over;
use super::piece::Triangle;
use super::reentrant::{covers_ball, covers_foot};
use super::{Contact, Feature, FeaturePair, NORMAL_CONE_TOLERANCE};
use crate::collision::Placement;
use crate::geometry::Mesh;
use crate::geometry::distance::barycentric;

/// The triangle of a contact on a primitive: none.
const NO_TRIANGLE: u32 = u32::MAX;

/// The frame of the body, or with none that of the obstacle, in which all is done.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame<'a>(pub(super) Option<&'a Placement>);

impl Frame<'_> {
    #[inline(always)]
    pub(super) fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.0.map_or(*p, |placement| placement.point(p))
    }

    #[inline(always)]
    pub(super) fn turn(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.0.map_or(*v, |placement| placement.rotation * v)
    }

    #[inline(always)]
    pub(super) fn turn_back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.0.map_or(*v, |placement| placement.rotation.tr_mul(v))
    }
}

/// A mesh and its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) frame: Frame<'a>,
}

/// The outward directions in which an element is a local maximum of its surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Cone<'a> {
    /// All: a sphere; or all that are met: the side of a capsule, across its axis.
    Any,
    /// The half space of this outward direction: the end of a capsule.
    End(Vector3<f64>),
    Vertex(Placed<'a>, u32),
    Edge(Placed<'a>, u32),
}

impl Cone<'_> {
    /// Whether a unit direction lies in the cone, to `tolerance`, rad.
    #[inline(always)]
    pub(super) fn holds(&self, direction: &Vector3<f64>, tolerance: f64) -> bool {
        match self {
            Self::Any => true,
            Self::End(outward) => outward.dot(direction) >= -tolerance,
            Self::Vertex(Placed { mesh, frame }, v) => {
                is_in_vertex_cone(mesh, *v, &frame.turn_back(direction), tolerance)
            }
            Self::Edge(Placed { mesh, frame }, e) => {
                is_in_edge_cone(mesh, *e, &frame.turn_back(direction), tolerance)
            }
        }
    }

    /// A direction inside, of any length; zero where none is better than others.
    #[inline(always)]
    pub(super) fn outward(&self) -> Vector3<f64> {
        match self {
            Self::Any => Vector3::zeros(),
            Self::End(outward) => *outward,
            Self::Vertex(Placed { mesh, frame }, v) => {
                let owner = mesh.vertex_owner(*v);
                owner.map_or(Vector3::zeros(), |t| frame.turn(mesh.face_normal(t)))
            }
            Self::Edge(Placed { mesh, frame }, e) => frame.turn(&outward_of_edge(mesh, *e)),
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
pub(super) struct Point<'a> {
    pub(super) at: Point3<f64>,
    pub(super) skin: Skin<'a>,
}

/// A segment with a ball swept over it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<'a> {
    pub(super) ends: [Point3<f64>; 2],
    pub(super) skin: Skin<'a>,
}

/// A part of a plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face<'a> {
    /// Unit, out of the solid.
    pub(super) normal: Vector3<f64>,
    /// A point of the plane.
    pub(super) point: Point3<f64>,
    pub(super) extent: Extent<'a>,
    pub(super) feature: Feature,
}

/// How far a face goes.
#[derive(Clone, Copy, Debug)]
pub(super) enum Extent<'a> {
    Triangle(&'a Triangle<'a>),
    /// About the point, m.
    Disc(f64),
    HalfSpace,
}

impl Face<'_> {
    /// Whether the foot of a point at this height lies in the face, to tolerance.
    #[inline(always)]
    pub(super) fn is_under(&self, p: &Point3<f64>, height: f64) -> bool {
        match self.extent {
            Extent::Triangle(triangle) => is_over(p, &triangle.corners, &self.normal, height),
            Extent::Disc(radius) => {
                let foot = p - self.normal * height;
                (foot - self.point).norm() <= radius * (1.0 + NORMAL_CONE_TOLERANCE)
            }
            Extent::HalfSpace => true,
        }
    }

    /// Whether the foot of a point lies past the end of the face where that goes on beneath the surface.
    #[inline(always)]
    pub(super) fn goes_on_under(&self, p: &Point3<f64>) -> bool {
        matches!(self.extent, Extent::Triangle(of) if covers_foot(of.placed.mesh, of.t, &of.back(p)))
    }

    /// The same of a ball about a point, where the rows of the faces that it is over imply that of this one.
    #[inline(always)]
    pub(super) fn goes_on_under_ball(&self, p: &Point3<f64>) -> bool {
        matches!(self.extent, Extent::Triangle(of) if covers_ball(of.placed.mesh, of.t, &of.back(p)))
    }
}

/// What can touch.
#[derive(Clone, Copy, Debug)]
pub(super) enum Element<'a> {
    Point(Point<'a>),
    Segment(Segment<'a>),
    Face(Face<'a>),
    Circle(Circle),
}

/// What becomes a contact.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) features: [Feature; 2],
    pub(super) on_first: Point3<f64>,
    pub(super) on_second: Point3<f64>,
    /// Unit, from the second to the first.
    pub(super) normal: Vector3<f64>,
    pub(super) gap: f64,
    /// Other rows imply it.
    pub(super) implied: bool,
}

impl Row {
    /// With first and second exchanged.
    #[inline(always)]
    pub(super) fn reversed(self) -> Self {
        Self {
            features: [self.features[1], self.features[0]],
            on_first: self.on_second,
            on_second: self.on_first,
            normal: -self.normal,
            ..self
        }
    }

    /// As a contact whose first is the body, with the triangle of the obstacle where that is a mesh.
    #[inline(always)]
    pub(super) fn contact(&self, obstacle: u16, on: Option<&Triangle>) -> Contact {
        let [on_body, on_obstacle] = self.features;
        let (obstacle_triangle, barycentric) = on.map_or((NO_TRIANGLE, [1.0, 0.0, 0.0]), |on| {
            (on.t, barycentric(&self.on_second, &on.corners, &on.normal))
        });
        Contact {
            features: FeaturePair {
                obstacle,
                on_body,
                on_obstacle,
            },
            point_on_body: self.on_first,
            point_on_obstacle: self.on_second,
            normal: self.normal,
            gap: self.gap,
            obstacle_triangle,
            barycentric,
        }
    }
}
