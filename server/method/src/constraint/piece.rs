//! Convex pieces, and what of them can touch.
//!
//! A triangle has the corners and sides that it owns, and its face; a sphere a point, a capsule its ends and a segment, a cylinder a segment, two rims and two
//! caps, a half-space its face.

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::Feature;
use super::arc::Arc;
use super::circle::Circle;
use super::collect::for_bits;
use super::element::{Cone, Element, Extent, Face, Frame, Placed, Point, Segment, Skin};
use crate::collision::Collider;
use crate::geometry::{Primitive, across, unit_axis};

/// Most elements of a primitive.
const MAX_ELEMENTS: usize = 5;

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle<'a> {
    pub(super) placed: Placed<'a>,
    pub(super) t: u32,
    pub(super) corners: [Point3<f64>; 3],
    pub(super) normal: Vector3<f64>,
}

impl<'a> Placed<'a> {
    #[inline(always)]
    pub(super) fn triangle(self, t: u32) -> Triangle<'a> {
        // Plain: `map` on arrays is not always inlined.
        let [p, q, r] = self.mesh.corners(t);
        let place = |p| self.frame.point(p);
        Triangle {
            placed: self,
            t,
            corners: [place(&p), place(&q), place(&r)],
            normal: self.frame.turn(self.mesh.face_normal(t)),
        }
    }

    #[inline(always)]
    fn vertex(self, v: u32, at: Point3<f64>) -> Point<'a> {
        let (round, cone, feature) = (0.0, Cone::Vertex(self, v), Feature::Vertex(v));
        Point {
            at,
            skin: Skin {
                round,
                cone,
                feature,
            },
        }
    }

    #[inline(always)]
    fn edge(self, e: u32, ends: [Point3<f64>; 2]) -> Segment<'a> {
        let (round, cone, feature) = (0.0, Cone::Edge(self, e), Feature::Edge(e));
        Segment {
            ends,
            skin: Skin {
                round,
                cone,
                feature,
            },
        }
    }
}

impl<'a> Triangle<'a> {
    /// The bits of [`Mesh::owned_features`].
    #[inline]
    pub(super) fn owned(&self) -> u8 {
        self.placed.mesh.owned_features(self.t)
    }

    #[inline(always)]
    pub(super) fn corner(&self, k: usize) -> Point<'a> {
        let v = self.placed.mesh.triangles()[self.t as usize][k];
        self.placed.vertex(v, self.corners[k])
    }

    /// From corner `k` to the next.
    #[inline(always)]
    pub(super) fn side(&self, k: usize) -> Segment<'a> {
        let e = self.placed.mesh.triangle_edges(self.t)[k];
        self.placed
            .edge(e, [self.corners[k], self.corners[(k + 1) % 3]])
    }

    #[inline(always)]
    pub(super) fn face(&self) -> Face<'_> {
        Face {
            normal: self.normal,
            point: self.corners[0],
            extent: Extent::Triangle(self),
            feature: Feature::Face(self.t),
        }
    }

    /// Side `k`, which it owns: the first of an edge's faces is its owner.
    #[inline(always)]
    pub(super) fn arc(&self, k: usize) -> Arc {
        let Placed { mesh, frame } = self.placed;
        let other = mesh.edges()[mesh.triangle_edges(self.t)[k] as usize].faces[1];
        let along = self.corners[(k + 1) % 3] - self.corners[k];
        let normals = [self.normal, frame.turn(mesh.face_normal(other))];
        Arc { along, normals }
    }

    /// Its face, or a corner or side of it.
    pub(super) fn element(&self, feature: Feature) -> Option<Element<'_>> {
        let (mesh, t) = (self.placed.mesh, self.t);
        let place = |all: [u32; 3], one: u32| all.iter().position(|other| *other == one);
        Some(match feature {
            Feature::Vertex(v) => {
                Element::Point(self.corner(place(mesh.triangles()[t as usize], v)?))
            }
            Feature::Edge(e) => Element::Segment(self.side(place(mesh.triangle_edges(t), e)?)),
            _ => Element::Face(self.face()),
        })
    }

    /// Calls `each` for what it owns, and its face.
    pub(super) fn for_elements(&self, mut each: impl FnMut(&Element)) {
        let owned = self.owned();
        each(&Element::Face(self.face()));
        for_bits(owned, |k| each(&Element::Point(self.corner(k))));
        for_bits(owned >> 3, |k| each(&Element::Segment(self.side(k))));
    }

    /// A point in the mesh's own frame.
    pub(super) fn back(&self, p: &Point3<f64>) -> Point3<f64> {
        let placement = self.placed.frame.0;
        placement.map_or(*p, |placement| placement.back(p))
    }
}

/// The pieces of a collider.
#[derive(Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "on the stack, in a search that allocates nothing"
)]
pub(super) enum Pieces<'a> {
    Triangles(Placed<'a>),
    /// The elements of its only one.
    One(ArrayVec<Element<'a>, MAX_ELEMENTS>),
}

/// One of them.
pub(super) enum Piece<'a> {
    Triangle(Triangle<'a>),
    Primitive(&'a [Element<'a>]),
}

impl<'a> Pieces<'a> {
    pub(super) fn of(collider: Collider<'a>, frame: Frame<'a>) -> Self {
        match collider {
            Collider::Mesh(mesh) => Self::Triangles(Placed { mesh, frame }),
            Collider::Primitive(primitive) => Self::One(elements_of(primitive, frame)),
        }
    }

    #[inline(always)]
    pub(super) fn piece(&self, t: u32) -> Piece<'_> {
        match self {
            Self::Triangles(placed) => Piece::Triangle(placed.triangle(t)),
            Self::One(elements) => Piece::Primitive(elements),
        }
    }
}

impl Piece<'_> {
    pub(super) fn triangle(&self) -> Option<&Triangle<'_>> {
        match self {
            Self::Triangle(triangle) => Some(triangle),
            Self::Primitive(_) => None,
        }
    }

    /// The elements of a primitive that may be within `reach` (m) of another piece; none of a triangle.
    pub(super) fn near(&self, other: &Self, reach: f64) -> ArrayVec<&Element<'_>, MAX_ELEMENTS> {
        let is_near = |element: &&Element| match (element, other.triangle()) {
            (Element::Circle(rim), Some(triangle)) => rim.may_be_near(&triangle.corners, reach),
            _ => true,
        };
        match self {
            Self::Triangle(_) => ArrayVec::new(),
            Self::Primitive(elements) => elements.iter().filter(is_near).collect(),
        }
    }

    /// Calls `each` for what a triangle owns, and its face; or for the elements of a primitive that are `near`.
    pub(super) fn for_elements(&self, near: &[&Element], mut each: impl FnMut(&Element)) {
        match self {
            Self::Triangle(triangle) => triangle.for_elements(each),
            Self::Primitive(_) => near.iter().for_each(|element| each(element)),
        }
    }
}

/// What of a primitive can touch.
pub(super) fn elements_of<'a>(
    primitive: &Primitive,
    frame: Frame<'_>,
) -> ArrayVec<Element<'a>, MAX_ELEMENTS> {
    let skin = |round, cone, feature| Skin {
        round,
        cone,
        feature,
    };
    let mut all = ArrayVec::new();
    let mut side = |ends: &[Point3<f64>; 2], round| {
        let axis = frame.turn(&unit_axis(ends));
        let ends = ends.map(|p| frame.point(&p));
        let skin = skin(round, Cone::Any, Feature::Side);
        all.push(Element::Segment(Segment { ends, skin }));
        [(0, ends[0], -axis), (1, ends[1], axis)]
    };
    match primitive {
        Primitive::Sphere { center, radius } => all.push(Element::Point(Point {
            at: frame.point(center),
            skin: skin(*radius, Cone::Any, Feature::Whole),
        })),
        Primitive::Capsule { ends, radius } => {
            let ends = side(ends, *radius);
            all.extend(ends.map(|(end, at, outward)| {
                let skin = skin(*radius, Cone::End(outward), Feature::Cap(end));
                Element::Point(Point { at, skin })
            }));
        }
        Primitive::Cylinder { ends, radius } => {
            // Turns with the body.
            let mark = frame.turn(&across(&unit_axis(ends)));
            for (end, center, outward) in side(ends, *radius) {
                all.push(Element::Circle(Circle {
                    center,
                    outward,
                    radius: *radius,
                    mark,
                    end,
                }));
                all.push(Element::Face(Face {
                    normal: outward,
                    point: center,
                    extent: Extent::Disc(*radius),
                    feature: Feature::Cap(end),
                }));
            }
        }
        Primitive::Plane { normal, point } => all.push(Element::Face(Face {
            normal: frame.turn(normal),
            point: frame.point(point),
            extent: Extent::HalfSpace,
            feature: Feature::Whole,
        })),
    }
    all
}
