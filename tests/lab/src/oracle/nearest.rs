//! Nearest points of two cells, feature by feature, and which of them can be contacts.
//!
//! Two triangles that do not cross are nearest at a vertex and a face, two edges, a vertex and an edge, or two vertices. All are tried.
//! A vertex before a face is always a constraint: it cannot go through. Two edges, a vertex and an edge, and two vertices are one where
//! their distance is a local minimum over both surfaces: the surfaces beside them fall away from each other. (A vertex that slides over
//! two coplanar triangles is also near to the edge between them, obliquely; that is none.)

use god_object::Pose;
use nalgebra::{Point3, Vector3};

use super::solid::{Cell, Solid};

/// Sine of the angle by which a surface may rise beside a local minimum: some times what rounding makes of
/// flat surfaces, and a slope that holds a body by a millionth of the force.
const FLAT: f64 = 1e-6;
/// Squared sine of the angle below which two edges are parallel; their ends are tried by themselves.
const PARALLEL: f64 = 1e-12;
/// A foot may be so far outside of a face, relative to its size: rounding.
const INSIDE: f64 = 1e-12;

/// A feature of a [`Solid`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Feature {
    Vertex(u32),
    Edge(u32),
    /// Of a cell.
    Face(u32),
}

/// A pair of features that may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Of the body and of the obstacle.
    pub(super) features: [Feature; 2],
    /// On the core of the body, world, m.
    pub(super) point: Point3<f64>,
    /// From the obstacle to the body, unit.
    pub(super) normal: Vector3<f64>,
    /// Between the surfaces, m.
    pub(super) gap: f64,
}

/// A solid at a pose.
#[derive(Clone, Copy)]
pub(super) struct Placed<'a> {
    pub(super) solid: &'a Solid,
    pub(super) pose: &'a Pose,
}

impl Placed<'_> {
    fn at(&self, point: u32) -> Point3<f64> {
        self.pose * self.solid.points[point as usize]
    }

    fn edge(&self, edge: u32) -> [Point3<f64>; 2] {
        self.solid.edges[edge as usize].ends.map(|end| self.at(end))
    }

    /// Whether the surface beside a feature falls away from the plane through it that is normal to
    /// `direction`.
    fn falls_away(&self, feature: Feature, direction: &Vector3<f64>) -> bool {
        let (from, beside) = match feature {
            Feature::Vertex(vertex) => (vertex, &self.solid.adjacent[vertex as usize]),
            Feature::Edge(edge) => {
                let edge = &self.solid.edges[edge as usize];
                (edge.ends[0], &edge.opposite)
            }
            Feature::Face(_) => return true,
        };
        let direction = self.pose.rotation.inverse() * direction;
        let points = &self.solid.points;
        beside.iter().all(|other| {
            let along = points[*other as usize] - points[from as usize];
            direction.dot(&along) <= FLAT * along.norm()
        })
    }
}

/// Adds the contacts of two cells that are nearer than `band` to `found`; answers their distance, m.
pub(super) fn examine(
    (body, a): (Placed<'_>, u32),
    (obstacle, b): (Placed<'_>, u32),
    band: f64,
    found: &mut Vec<Contact>,
) -> f64 {
    let mut search = Search {
        body,
        obstacle,
        mine: &body.solid.cells[a as usize],
        other: &obstacle.solid.cells[b as usize],
        band,
        least: f64::INFINITY,
        found,
    };
    search.faces(a, b);
    search.edges();
    search.vertices();
    search.least
}

/// What has been found of two cells so far.
struct Search<'a> {
    body: Placed<'a>,
    obstacle: Placed<'a>,
    mine: &'a Cell,
    other: &'a Cell,
    band: f64,
    least: f64,
    found: &'a mut Vec<Contact>,
}

impl Search<'_> {
    /// A pair of nearest points, `apart` between the cores, the body's at `point`.
    fn offer(
        &mut self,
        features: [Feature; 2],
        point: Point3<f64>,
        normal: Vector3<f64>,
        apart: f64,
    ) {
        let gap = apart - self.mine.radius - self.other.radius;
        self.least = self.least.min(gap);
        if gap > self.band {
            return;
        }
        let flat_end =
            |cell: &Cell, feature| cell.flat_ends && matches!(feature, Feature::Vertex(_));
        assert!(
            !flat_end(self.mine, features[0]) && !flat_end(self.other, features[1]),
            "the flat end of a cylinder is near: not modelled"
        );
        let falls_away = self.body.falls_away(features[0], &-normal)
            && self.obstacle.falls_away(features[1], &normal);
        // A vertex before a face cannot go through it, whatever is beside the vertex.
        if falls_away || features.iter().any(|f| matches!(f, Feature::Face(_))) {
            self.found.push(Contact {
                features,
                point,
                normal,
                gap,
            });
        }
    }

    /// Two points of the cores that are not the same.
    fn offer_points(
        &mut self,
        features: [Feature; 2],
        on_body: Point3<f64>,
        on_obstacle: Point3<f64>,
    ) {
        let between = on_body - on_obstacle;
        let apart = between.norm();
        if apart > 0.0 {
            self.offer(features, on_body, between / apart, apart);
        }
    }

    /// Vertices before faces. One behind a face is inside, or beyond a thin wall: near, and no contact.
    fn faces(&mut self, a: u32, b: u32) {
        let mut behind = f64::INFINITY;
        if let Some(corners) = self.other.face {
            let face = corners.map(|i| self.obstacle.at(i));
            for vertex in &self.mine.vertices {
                let point = self.body.at(*vertex);
                match height_over(&point, &face) {
                    Some((normal, height)) if height > 0.0 => {
                        let features = [Feature::Vertex(*vertex), Feature::Face(b)];
                        self.offer(features, point, normal, height);
                    }
                    Some((_, height)) => behind = behind.min(-height),
                    None => {}
                }
            }
        }
        if let Some(corners) = self.mine.face {
            let face = corners.map(|i| self.body.at(i));
            for vertex in &self.other.vertices {
                let point = self.obstacle.at(*vertex);
                match height_over(&point, &face) {
                    Some((normal, height)) if height > 0.0 => {
                        let features = [Feature::Face(a), Feature::Vertex(*vertex)];
                        self.offer(features, point - normal * height, -normal, height);
                    }
                    Some((_, height)) => behind = behind.min(-height),
                    None => {}
                }
            }
        }
        self.least = self
            .least
            .min(behind - self.mine.radius - self.other.radius);
    }

    fn edges(&mut self) {
        for e in &self.mine.edges {
            let mine = self.body.edge(*e);
            for f in &self.other.edges {
                if let Some((point, normal, apart)) = between_edges(&mine, &self.obstacle.edge(*f))
                {
                    self.offer([Feature::Edge(*e), Feature::Edge(*f)], point, normal, apart);
                }
            }
        }
    }

    fn vertices(&mut self) {
        for v in &self.mine.vertices {
            let vertex = self.body.at(*v);
            for f in &self.other.edges {
                if let Some(foot) = foot_on_edge(&vertex, &self.obstacle.edge(*f)) {
                    self.offer_points([Feature::Vertex(*v), Feature::Edge(*f)], vertex, foot);
                }
            }
            for w in &self.other.vertices {
                let other = self.obstacle.at(*w);
                self.offer_points([Feature::Vertex(*v), Feature::Vertex(*w)], vertex, other);
            }
        }
        for w in &self.other.vertices {
            let vertex = self.obstacle.at(*w);
            for e in &self.mine.edges {
                if let Some(foot) = foot_on_edge(&vertex, &self.body.edge(*e)) {
                    self.offer_points([Feature::Edge(*e), Feature::Vertex(*w)], foot, vertex);
                }
            }
        }
    }
}

/// Outward normal of a face, and how high over it a point is, m; `None` where its foot is outside.
fn height_over(point: &Point3<f64>, face: &[Point3<f64>; 3]) -> Option<(Vector3<f64>, f64)> {
    let [a, b, c] = face;
    let out = (b - a).cross(&(c - a));
    let doubled = out.norm();
    let normal = out / doubled;
    let height = normal.dot(&(point - a));
    let foot = point - normal * height;
    let inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(from, to)| normal.dot(&(*to - *from).cross(&(foot - *from))) >= -INSIDE * doubled);
    inside.then_some((normal, height))
}

/// Nearest point on the first of two edges, the normal from the second to it, and their distance; `None`
/// where they are parallel, or nearest at an end.
fn between_edges(
    mine: &[Point3<f64>; 2],
    other: &[Point3<f64>; 2],
) -> Option<(Point3<f64>, Vector3<f64>, f64)> {
    let (d, e, r) = (mine[1] - mine[0], other[1] - other[0], mine[0] - other[0]);
    let cross = d.cross(&e);
    let (dd, ee, squared) = (d.norm_squared(), e.norm_squared(), cross.norm_squared());
    if squared <= PARALLEL * dd * ee {
        return None;
    }
    let (s, t) = (
        -r.cross(&e).dot(&cross) / squared,
        -r.cross(&d).dot(&cross) / squared,
    );
    if !(0.0..=1.0).contains(&s) || !(0.0..=1.0).contains(&t) {
        return None;
    }
    let normal = cross / squared.sqrt();
    let apart = normal.dot(&r);
    let point = mine[0] + d * s;
    Some(if apart < 0.0 {
        (point, -normal, -apart)
    } else {
        (point, normal, apart)
    })
}

/// The foot of a point on an edge, ends included.
fn foot_on_edge(point: &Point3<f64>, edge: &[Point3<f64>; 2]) -> Option<Point3<f64>> {
    let along = edge[1] - edge[0];
    let share = along.dot(&(point - edge[0])) / along.norm_squared();
    (0.0..=1.0)
        .contains(&share)
        .then(|| edge[0] + along * share)
}

/// Whether an edge of one cell goes through the face of the other.
pub(super) fn cross((body, a): (Placed<'_>, u32), (obstacle, b): (Placed<'_>, u32)) -> bool {
    let (mine, other) = (
        &body.solid.cells[a as usize],
        &obstacle.solid.cells[b as usize],
    );
    let through = |edges: &[u32], of: &Placed<'_>, face: Option<[u32; 3]>, at: &Placed<'_>| {
        face.is_some_and(|corners| {
            let face = corners.map(|i| at.at(i));
            edges.iter().any(|e| goes_through(&of.edge(*e), &face))
        })
    };
    through(&mine.edges, &body, other.face, &obstacle)
        || through(&other.edges, &obstacle, mine.face, &body)
}

/// By signs of volumes: the ends on different sides of the face, and the line on the same side of its three
/// edges.
fn goes_through(edge: &[Point3<f64>; 2], face: &[Point3<f64>; 3]) -> bool {
    let volume = |p: &Point3<f64>, q: &Point3<f64>, r: &Point3<f64>, s: &Point3<f64>| {
        (q - p).cross(&(r - p)).dot(&(s - p))
    };
    let [a, b, c] = face;
    let [from, to] = edge;
    if volume(a, b, c, from) * volume(a, b, c, to) >= 0.0 {
        return false;
    }
    let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| volume(from, to, p, q));
    sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
}
