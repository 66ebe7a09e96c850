//! Do two elements face each other: is the separation a local minimum of the distance between the surfaces?
//!
//! | symbol | name in code | unit | meaning                                                         |
//! |--------|--------------|------|-----------------------------------------------------------------|
//! | n      | `normal`     | –    | unit, from the second element to the first                      |
//! | x, y   |              | m    | points on the first and on the second                           |
//! | g      | `gap`        | m    | `n.(x - y)` less the balls, in [0, activation distance]         |
//!
//! n must lie in the normal cone of the second and -n in that of the first: no surface next to the element rises towards the other
//! one. The normal is that of the face or the product of the segments; only where a point meets a segment or a point is it the direction of the
//! difference.
//! Source: Ortega et al. 2007, Section 4.1; Lin and Canny 1991 (Voronoi regions of features).

use nalgebra::{Point3, Vector3};

use super::collect::triangle_of;
use super::cones::{LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE};
use super::element::{Cone, Element, Face, Frame, Placed, Point, Row, Segment, Skin};
use super::foot::past_end;
use super::piece::{Pieces, Triangle, elements_of};
use super::reentrant::{covers_outline, covers_way};
use super::{Contact, Feature, FeaturePair};
use crate::collision::{Collider, Placement};

/// Segments at a smaller angle are parallel, as its sine: their ends stand for them.
pub(super) const PARALLEL_SINE: f64 = 1e-6;
/// Points nearer than this have no direction, m: some rounding errors of a metre.
const NO_DIRECTION: f64 = 1e-14;

/// How far elements are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Activation distance, m.
    pub(super) within: f64,
    /// The same of rows that others imply.
    pub(super) implied_within: f64,
    /// Rows count beyond the end of their feature, too, where that is reentrant ([`reentrant`](super::reentrant)): for rows that are known.
    pub(super) past_reentrant_edges: bool,
}

impl Reach {
    pub(super) fn new(within: f64) -> Self {
        Self {
            within,
            implied_within: within,
            past_reentrant_edges: false,
        }
    }

    #[inline(always)]
    pub(super) fn is_near(&self, gap: f64) -> bool {
        gap >= 0.0 && gap <= self.within // false for NaN
    }

    /// Unit direction and length of a difference within the activation distance and balls of radius `round`, m; `otherwise` where it is too short to have
    /// one.
    #[inline(always)]
    fn direction(
        &self,
        difference: &Vector3<f64>,
        round: f64,
        otherwise: impl FnOnce() -> Vector3<f64>,
    ) -> Option<(Vector3<f64>, f64)> {
        let (squared, most) = (difference.norm_squared(), self.within + round);
        let near = squared <= most * most; // false for NaN
        if !near {
            return None;
        }
        let length = squared.sqrt();
        let normal = if length > NO_DIRECTION {
            difference / length
        } else {
            otherwise().try_normalize(0.0)?
        };
        Some((normal, length))
    }
}

impl Skin<'_> {
    /// The row of points x of this and y of the other, `length` (m) apart along `normal`, less the balls, where that lies in both cones to the tilts, rad.
    #[inline(always)]
    pub(super) fn row(
        &self,
        other: &Self,
        [x, y]: [Point3<f64>; 2],
        (normal, length): (Vector3<f64>, f64),
        tilts: [f64; 2],
    ) -> Option<Row> {
        let facing = other.cone.holds(&normal, tilts[1]) && self.cone.holds(&-normal, tilts[0]);
        facing.then(|| Row {
            features: [self.feature, other.feature],
            on_first: x - normal * self.round,
            on_second: y + normal * other.round,
            normal,
            gap: length - (self.round + other.round),
            implied: false,
        })
    }
}

#[inline(always)]
pub(super) fn point_point(a: &Point, b: &Point, reach: &Reach) -> Option<Row> {
    let round = a.skin.round + b.skin.round;
    let apart = reach.direction(&(a.at - b.at), round, || b.skin.cone.outward())?;
    let tilts = [NORMAL_CONE_TOLERANCE; 2];
    a.skin.row(&b.skin, [a.at, b.at], apart, tilts)
}

/// A point over the inside of a segment. What has no edge there is let in before the body tilts onto it.
#[inline(always)]
pub(super) fn point_segment(a: &Point, b: &Segment, reach: &Reach) -> Option<Row> {
    let along = b.ends[1] - b.ends[0];
    let share = along.dot(&(a.at - b.ends[0])) / along.norm_squared();
    if !(0.0..=1.0).contains(&share) {
        return None;
    }
    let foot = b.ends[0] + along * share;
    let round = a.skin.round + b.skin.round;
    let apart = reach.direction(&(a.at - foot), round, || b.skin.cone.outward())?;
    let tilt = if round > 0.0 {
        LOOK_AHEAD_TILT
    } else {
        NORMAL_CONE_TOLERANCE
    };
    let tilts = [tilt, NORMAL_CONE_TOLERANCE];
    a.skin.row(&b.skin, [a.at, foot], apart, tilts)
}

/// Two segments that cross.
#[inline(always)]
pub(super) fn segment_segment(a: &Segment, b: &Segment, reach: &Reach) -> Option<Row> {
    let (p, q) = (a.ends[0], b.ends[0]);
    let (u, v, r) = (a.ends[1] - p, b.ends[1] - q, p - q);
    let (aa, bb, ab) = (u.norm_squared(), v.norm_squared(), u.dot(&v));
    let denominator = aa * bb - ab * ab;
    let crossing = denominator > PARALLEL_SINE * PARALLEL_SINE * aa * bb; // false for NaN
    if !crossing {
        return None;
    }
    let (c, f) = (u.dot(&r), v.dot(&r));
    let (s, t) = (
        (ab * f - bb * c) / denominator,
        (aa * f - ab * c) / denominator,
    );
    let inside = [s, t].map(|at| (0.0..=1.0).contains(&at));
    if inside != [true; 2] && !reach.past_reentrant_edges {
        return None;
    }
    let cross = u.cross(&v);
    let unit = cross / cross.norm();
    let (x, y) = (p + u * s, q + v * t);
    let round = a.skin.round + b.skin.round;
    // Of edges by the faces at them, out of the second and into the first: the points may be too near to say.
    let out = if round > 0.0 {
        x - y
    } else {
        b.skin.cone.outward() - a.skin.cone.outward()
    };
    let normal = if unit.dot(&out) < 0.0 { -unit } else { unit };
    let length = normal.dot(&(x - y));
    if !reach.is_near(length - round) {
        return None;
    }
    let tilts = [LOOK_AHEAD_TILT; 2];
    let row = a.skin.row(&b.skin, [x, y], (normal, length), tilts);
    row.filter(|_| {
        (inside[0] || goes_on(a.skin.cone, u, s, &v))
            && (inside[1] || goes_on(b.skin.cone, v, t, &u))
    })
}

/// Whether the line of an edge on to a place past its end, in lengths, lies under the surface, or under another edge as seen along what it meets there.
fn goes_on(cone: Cone, along: Vector3<f64>, place: f64, across: &Vector3<f64>) -> bool {
    let Cone::Edge(Placed { mesh, frame }, e) = cone else {
        return false;
    };
    let end = mesh.edges()[e as usize].vertices[usize::from(place > 0.5)];
    let way = frame.turn_back(&(along * past_end(place)));
    covers_way(mesh, end, &way) || covers_outline(mesh, end, &way, &frame.turn_back(across))
}

/// A point over a face; a ball also past its end, where the rows of the faces that it is over imply that of this one.
#[inline(always)]
pub(super) fn point_face(a: &Point, face: &Face, reach: &Reach) -> Option<Row> {
    let height = face.normal.dot(&(a.at - face.point));
    let gap = height - a.skin.round;
    if !reach.is_near(gap) {
        return None;
    }
    let over =
        face.is_under(&a.at, height) || reach.past_reentrant_edges && face.goes_on_under(&a.at);
    let may_be_past = !over && a.skin.round > 0.0 && gap <= reach.implied_within;
    let faces = (over || may_be_past) && a.skin.cone.holds(&-face.normal, LOOK_AHEAD_TILT);
    if !faces || may_be_past && !face.goes_on_under_ball(&a.at) {
        return None;
    }
    Some(Row {
        features: [a.skin.feature, face.feature],
        on_first: a.at - face.normal * a.skin.round,
        on_second: a.at - face.normal * height,
        normal: face.normal,
        gap,
        implied: may_be_past,
    })
}

/// Calls `found` for the rows of two elements, the first one first.
pub(super) fn rows(a: &Element, b: &Element, reach: &Reach, found: &mut dyn FnMut(Row)) {
    let row = match (a, b) {
        (Element::Point(a), Element::Point(b)) => point_point(a, b, reach),
        (Element::Point(a), Element::Segment(b)) => point_segment(a, b, reach),
        (Element::Point(a), Element::Face(b)) => point_face(a, b, reach),
        (Element::Segment(a), Element::Segment(b)) => segment_segment(a, b, reach),
        (Element::Circle(a), Element::Point(b)) => a.beside_point(b),
        (Element::Circle(a), Element::Segment(b)) => return a.beside_segment(b, reach, found),
        (Element::Circle(a), Element::Face(b)) => return a.over_face(b, reach, found),
        (Element::Circle(a), Element::Circle(b)) => return a.beside_circle(b, reach, found),
        (_, Element::Point(_) | Element::Circle(_)) => {
            return rows(b, a, reach, &mut |row: Row| found(row.reversed()));
        }
        (Element::Segment(_) | Element::Face(_), Element::Segment(_) | Element::Face(_)) => None,
    };
    row.into_iter().for_each(found);
}

/// Looks at features of one body and one obstacle at rest.
#[derive(Debug)]
pub(super) struct Facing<'a> {
    pub(super) body: Pieces<'a>,
    pub(super) obstacle: Pieces<'a>,
    pub(super) obstacle_index: u16,
    pub(super) reach: Reach,
}

impl<'a> Facing<'a> {
    pub(super) fn new(
        body: impl Into<Collider<'a>>,
        obstacle: impl Into<Collider<'a>>,
        placement: &'a Placement,
        obstacle_index: u16,
        reach: Reach,
    ) -> Self {
        Self {
            body: Pieces::of(body.into(), Frame(Some(placement))),
            obstacle: Pieces::of(obstacle.into(), Frame(None)),
            obstacle_index,
            reach,
        }
    }
}

/// The contact between two features by their names, when they face each other here, in the obstacle's frame.
pub(super) fn contact_of(
    features: &FeaturePair,
    (body, obstacle): (&Collider<'_>, &Collider<'_>),
    placement: &Placement,
    reach: &Reach,
) -> Option<Contact> {
    let (on_body, on_obstacle) = (features.on_body, features.on_obstacle);
    let mut found = None;
    for_named(body, Frame(Some(placement)), on_body, |x, _| {
        for_named(obstacle, Frame(None), on_obstacle, |y, triangle| {
            rows(x, y, reach, &mut |row| {
                if row.features == [on_body, on_obstacle] {
                    found = Some(row.contact(features.obstacle, triangle));
                }
            });
        });
    });
    found
}

/// Calls `each` for what a feature is part of: an element of a triangle, with that, or each of a primitive, of which rows say what features they are of.
fn for_named(
    collider: &Collider<'_>,
    frame: Frame<'_>,
    feature: Feature,
    mut each: impl FnMut(&Element, Option<&Triangle>),
) {
    match *collider {
        Collider::Mesh(mesh) => {
            let triangle = triangle_of(mesh, feature).map(|t| Placed { mesh, frame }.triangle(t));
            let element = (triangle.as_ref()).and_then(|triangle| triangle.element(feature));
            if let Some(element) = element {
                each(&element, triangle.as_ref());
            }
        }
        Collider::Primitive(primitive) => {
            let elements = elements_of(primitive, frame);
            elements.iter().for_each(|element| each(element, None));
        }
    }
}
