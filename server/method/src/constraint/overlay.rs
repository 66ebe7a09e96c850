//! Pairs of features of two surfaces that lie along each other, found by walking on both.
//!
//! Where surfaces conform, thousands of volumes of two trees come near each other for every pair that faces, and a search nearest first is
//! given up before it has seen more than a part of what touches. But the pairs of neighbours are neighbours: from a vertex over a face, each
//! vertex next to it is over a face near by, and the way from foot to foot crosses the edges that the edge between them crosses. A few triangles are
//! looked at for each pair that is found. What was found before a motion is where the walk after it begins.
//!
//! It finds vertices of the body over faces and edges of the obstacle, and edges across edges, of every place that is joined to one where it began by
//! vertices within the distance: what is not is left to the trees, and so are vertices of the obstacle.
//!
//! Source: beyond Ortega et al. 2007; the walk from triangle to triangle is that of point location in triangulations, Devillers, Pion and Teillaud 2002.

use nalgebra::{Point3, Vector3};

use super::facing::{Facing, Pair};
use super::{Contact, Feature, FeaturePair};
use crate::collision::Work;
use crate::geometry::Mesh;

/// Most vertices that are placed over the obstacles in one go.
pub(super) const MAX_PLACES: usize = 2048;
/// Most triangles on the way from one foot to the next.
const MAX_STEPS: usize = 12;
/// Marks a vertex that is over no face within the distance.
const NONE: u32 = u32::MAX;

/// A vertex of the body, and the face of the obstacle that it is over or that the search for it begins at.
#[derive(Clone, Copy, Debug)]
struct Place {
    obstacle: u16,
    vertex: u32,
    face: u32,
}

/// When a vertex was looked at last, and its place then.
#[derive(Clone, Copy, Debug)]
struct Mark {
    turn: u32,
    place: u32,
}

/// The places where surfaces lie along each other. No allocation after `new`.
#[derive(Debug)]
pub(super) struct Overlay {
    /// Edges of the body that stand out, by vertex, with their other ends; where those of each vertex begin.
    edges: Vec<[u32; 2]>,
    begins: Vec<u32>,
    marks: Vec<Mark>,
    turn: u32,
    places: Vec<Place>,
    /// The vertices of the places that were found, obstacle frame.
    points: Vec<Point3<f64>>,
    before: Vec<Place>,
}

/// Where a point is over a face.
#[derive(Clone, Copy, Debug)]
struct Foot {
    face: u32,
    /// Above the face's plane, m.
    gap: f64,
    /// How far inside each side it lies, as [`inside_of`].
    inside: [f64; 3],
    /// The side that it is beyond as seen from either face at it, when it is.
    side: Option<usize>,
}

impl Overlay {
    /// For this body.
    pub(super) fn new(body: &Mesh) -> Self {
        let vertices = body.vertices().len();
        let standing_out = || {
            body.edges()
                .iter()
                .enumerate()
                .filter(|(_, e)| e.is_convex())
        };
        let mut begins = vec![0; vertices + 1];
        for (_, edge) in standing_out() {
            for v in edge.vertices {
                begins[v as usize + 1] += 1;
            }
        }
        for v in 0..vertices {
            begins[v + 1] += begins[v];
        }
        let mut edges = vec![[NONE; 2]; begins[vertices] as usize];
        let mut next = begins.clone();
        for (index, edge) in standing_out() {
            let [v, w] = edge.vertices;
            for (v, w) in [(v, w), (w, v)] {
                edges[next[v as usize] as usize] = [index as u32, w];
                next[v as usize] += 1;
            }
        }
        Self {
            edges,
            begins,
            marks: vec![
                Mark {
                    turn: 0,
                    place: NONE
                };
                vertices
            ],
            turn: 0,
            places: Vec::with_capacity(MAX_PLACES),
            points: Vec::with_capacity(MAX_PLACES),
            before: Vec::with_capacity(MAX_PLACES),
        }
    }

    /// What was found becomes what was found before.
    pub(super) fn begin(&mut self) {
        std::mem::swap(&mut self.places, &mut self.before);
        self.places.clear();
        self.points.clear();
    }

    /// Begins on one obstacle where the walk before this one was, and where `contacts` are.
    pub(super) fn begin_at<'a>(
        &mut self,
        facing: &Facing,
        contacts: impl Iterator<Item = &'a Contact>,
    ) {
        self.turn = self.turn.wrapping_add(1);
        let obstacle = facing.obstacle_index;
        for k in 0..self.before.len() {
            if self.before[k].obstacle == obstacle {
                self.push(self.before[k]);
            }
        }
        for contact in contacts {
            let face = contact.obstacle_triangle;
            let near = contact.gap <= facing.activation_distance; // false for NaN
            if near
                && contact.features.obstacle == obstacle
                && let Some(vertex) = vertex_at(facing.body, contact.features.on_body)
            {
                self.push(Place {
                    obstacle,
                    vertex,
                    face,
                });
            }
        }
    }

    /// Walks on from there; calls `found` for what faces. Returns how many vertices were looked at.
    pub(super) fn walk(
        &mut self,
        facing: &Facing,
        work: &mut Work,
        mut found: impl FnMut(Contact),
    ) -> u64 {
        let (body, obstacle) = (facing.body, facing.obstacle);
        let begin = self.points.len();
        let (mut next, mut kept) = (begin, begin);
        while next < self.places.len() {
            let place = self.places[next];
            next += 1;
            let v = place.vertex;
            let x = facing.placement.point(&body.vertices()[v as usize]);
            let Some(foot) = foot_of(obstacle, place.face, &x, work) else {
                continue;
            };
            let near = foot.gap.abs() <= facing.activation_distance; // false for NaN
            if !near {
                continue;
            }
            let face = foot.face;
            self.marks[v as usize].place = kept as u32;
            self.places[kept] = Place { face, ..place };
            self.points.push(x);
            kept += 1;
            look_at_vertex(facing, v, &x, &foot, work, &mut found);
            for w in body.neighbours(v) {
                self.push(Place {
                    vertex: *w,
                    face,
                    ..place
                });
            }
            let range = self.begins[v as usize] as usize..self.begins[v as usize + 1] as usize;
            for [edge, w] in &self.edges[range] {
                // Each edge at the later of its ends.
                let there = self.marks[*w as usize];
                let place = there.place as usize;
                let found_there = self.places.get(place).zip(self.points.get(place));
                if there.turn == self.turn
                    && let Some((there, end)) = found_there
                    && there.face != face
                {
                    for_crossings(obstacle, face, [&x, end], work, |f, work| {
                        look_at_edges(facing, *edge, f, work, &mut found);
                    });
                }
            }
        }
        self.places.truncate(kept);
        (next - begin) as u64
    }

    fn push(&mut self, place: Place) {
        let mark = &mut self.marks[place.vertex as usize];
        if mark.turn != self.turn && self.places.len() < MAX_PLACES {
            *mark = Mark {
                turn: self.turn,
                place: NONE,
            };
            self.places.push(place);
        }
    }
}

/// A vertex of the feature, or next to it.
fn vertex_at(mesh: &Mesh, feature: Feature) -> Option<u32> {
    match feature {
        Feature::Vertex(v) => Some(v),
        Feature::Edge(e) => Some(mesh.edges()[e as usize].vertices[0]),
        Feature::Face(t) => Some(mesh.triangles()[t as usize][0]),
        Feature::Whole | Feature::Side | Feature::Cap(_) | Feature::Rim(..) => None,
    }
}

/// Vertex `v` of the body, at `x`, over its foot.
fn look_at_vertex(
    facing: &Facing,
    v: u32,
    x: &Point3<f64>,
    foot: &Foot,
    work: &mut Work,
    found: &mut impl FnMut(Contact),
) {
    work.feature_pairs += 1;
    // Also one that does not stand out: where an edge lies along a face, its ends may be far from where the walk is.
    let contact = match foot.side {
        None => facing.vertex_over(v, x, foot.face, foot.gap, || {
            let [opposite_2, opposite_0, opposite_1] = foot.inside;
            let sum = opposite_0 + opposite_1 + opposite_2;
            [opposite_0, opposite_1, opposite_2].map(|area| area / sum)
        }),
        Some(j) => at_vertex(facing, v, x, foot.face, |pair, i| {
            facing.vertex_edge(pair, i, j)
        }),
    };
    contact.map(found);
}

/// Looks at a vertex of the body, at `x`, as the corner of a triangle.
fn at_vertex(
    facing: &Facing,
    v: u32,
    x: &Point3<f64>,
    face: u32,
    look: impl FnOnce(&Pair, usize) -> Option<Contact>,
) -> Option<Contact> {
    let a = facing.body.vertex_owner(v)?;
    let corners = facing.body.triangles()[a as usize];
    let i = corners.iter().position(|w| *w == v)?;
    let pair = Pair {
        a,
        b: face,
        x: [*x; 3],
        y: facing.obstacle.corners(face),
    };
    look(&pair, i)
}

/// An edge of the body across one of the obstacle.
fn look_at_edges(
    facing: &Facing,
    on_body: u32,
    on_obstacle: u32,
    work: &mut Work,
    found: &mut impl FnMut(Contact),
) {
    work.feature_pairs += 1;
    let features = FeaturePair {
        obstacle: facing.obstacle_index,
        on_body: Feature::Edge(on_body),
        on_obstacle: Feature::Edge(on_obstacle),
    };
    facing.features(&features).map(found);
}

/// The face that a point is over, from face to face towards it.
fn foot_of(mesh: &Mesh, start_face: u32, x: &Point3<f64>, work: &mut Work) -> Option<Foot> {
    let (mut face, mut from) = (start_face, NONE);
    for _ in 0..MAX_STEPS {
        work.feature_pairs += 1;
        let corners = mesh.corners(face);
        let normal = mesh.face_normal(face);
        let inside = inside_of(&corners, normal, x);
        let gap = normal.dot(&(x - corners[0]));
        let Some(k) = (0..3).find(|k| inside[*k] < 0.0) else {
            return Some(Foot {
                face,
                gap,
                inside,
                side: None,
            });
        };
        let edge = mesh.triangle_edges(face)[k];
        let next = across(mesh, edge, face);
        if next == from {
            // Beyond the edge on either side: over what stands out.
            return Some(Foot {
                face,
                gap,
                inside,
                side: Some(k),
            });
        }
        (from, face) = (face, next);
    }
    None
}

/// Calls `each` for the convex edges that the way from a point over `face` to another one crosses.
#[inline]
fn for_crossings(
    mesh: &Mesh,
    mut face: u32,
    [x, end]: [&Point3<f64>; 2],
    work: &mut Work,
    mut each: impl FnMut(u32, &mut Work),
) {
    let mut entered = NONE;
    for _ in 0..MAX_STEPS {
        work.feature_pairs += 1;
        let corners = mesh.corners(face);
        let normal = mesh.face_normal(face);
        let there = inside_of(&corners, normal, end);
        if there.iter().all(|inside| *inside >= 0.0) {
            return;
        }
        let here = inside_of(&corners, normal, x);
        let edges = mesh.triangle_edges(face);
        let mut first = (f64::INFINITY, NONE);
        for k in 0..3 {
            let share = here[k].max(0.0) / (here[k].max(0.0) - there[k]);
            let leaves = there[k] < 0.0 && edges[k] != entered && share < first.0;
            if leaves {
                first = (share, edges[k]);
            }
        }
        let edge = first.1;
        if edge == NONE {
            return;
        }
        let convex = mesh.edges()[edge as usize].is_convex();
        if convex {
            each(edge, work);
        }
        (entered, face) = (edge, across(mesh, edge, face));
    }
}

/// How far inside each side a point lies, times its length; negative beyond it.
#[inline(always)]
fn inside_of(corners: &[Point3<f64>; 3], normal: &Vector3<f64>, x: &Point3<f64>) -> [f64; 3] {
    let from = [x - corners[0], x - corners[1], x - corners[2]];
    // The sides times the point, as products of the ways from it to the corners.
    [
        normal.dot(&from[0].cross(&from[1])),
        normal.dot(&from[1].cross(&from[2])),
        normal.dot(&from[2].cross(&from[0])),
    ]
}

#[inline]
fn across(mesh: &Mesh, edge: u32, face: u32) -> u32 {
    let [left, right] = mesh.edges()[edge as usize].faces;
    if left == face { right } else { left }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::collision::{CollisionWorkspace, Placement};
    use crate::constraint::{collect_contacts, in_world};
    use crate::spatial::Pose;

    const CELL: f64 = 5e-4;
    const ROUGH: f64 = 1e-6;
    const NEAR: f64 = 2e-5;

    /// A rough square of `cells` x `cells` about the z axis, on a point below.
    pub(in crate::constraint) fn rough(
        cells: u32,
        cell: f64,
        seed: u64,
    ) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let mut state = seed;
        let mut height = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005) + 1;
            ROUGH * (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        let at = |i: u32, j: u32| i * (cells + 1) + j;
        let place = |i: u32| cell * (f64::from(i) - 0.5 * f64::from(cells));
        let mut vertices: Vec<Point3<f64>> = (0..=cells)
            .flat_map(|i| (0..=cells).map(move |j| [i, j]))
            .map(|[i, j]| Point3::new(place(i), place(j), height()))
            .collect();
        let mut triangles = Vec::new();
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
        let apex = vertices.len() as u32;
        vertices.push(Point3::new(0.0, 0.0, -cell * f64::from(cells)));
        for k in 0..cells {
            let rim = [
                [at(k, 0), at(k + 1, 0)],
                [at(cells, k), at(cells, k + 1)],
                [at(k + 1, cells), at(k, cells)],
                [at(0, k + 1), at(0, k)],
            ];
            triangles.extend(rim.map(|[a, b]| [b, a, apex]));
        }
        (vertices, triangles)
    }

    fn names(mut found: Vec<FeaturePair>) -> Vec<FeaturePair> {
        found.sort_unstable();
        found.dedup();
        found
    }

    /// What the trees find of what a walk is to find.
    fn by_trees(body: &Mesh, pose: &Pose, obstacle: &Mesh, index: u16) -> Vec<Contact> {
        let mut contacts = Vec::with_capacity(1 << 14);
        let collected = collect_contacts(
            body,
            pose,
            obstacle,
            &Pose::identity(),
            index,
            NEAR,
            &mut CollisionWorkspace::with_candidates(1 << 15),
            &mut contacts,
            &mut Work::default(),
        );
        assert!(!collected.truncated);
        contacts.retain(|c| !matches!(c.features.on_obstacle, Feature::Vertex(_)));
        contacts
    }

    #[test]
    fn a_walk_finds_what_the_trees_find_on_rough_surfaces_from_one_pair_and_from_where_it_was_before()
     {
        let (mut vertices, mut triangles) = rough(14, 1.1 * CELL, 3);
        vertices.iter_mut().for_each(|p| p.z = -p.z);
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let body = Mesh::new(vertices, triangles).expect("a closed block");
        let (vertices, triangles) = rough(24, CELL, 7);
        let obstacle = Mesh::new(vertices, triangles).expect("a closed block");
        let mut overlay = Overlay::new(&body);
        for (x, seeded) in [(1.3e-4, true), (5.1e-4, false)] {
            let pose = Pose::new(Vector3::new(x, 0.7e-4, 6e-6), Vector3::z() * 0.2);
            overlay.begin();
            // Two obstacles at one place: what was looked at for one is not for the other.
            for index in [0, 1] {
                let facing = Facing {
                    body: &body,
                    obstacle: &obstacle,
                    placement: &Placement::of(&pose, &Pose::identity()),
                    obstacle_index: index,
                    activation_distance: NEAR,
                    past_reentrant_edges: false,
                };
                let expected = by_trees(&body, &pose, &obstacle, index);
                let seeds = &expected[..usize::from(seeded)];
                let mut found = Vec::new();
                overlay.begin_at(&facing, seeds.iter());
                let looked_at = overlay.walk(&facing, &mut Work::default(), |contact| {
                    found.push(in_world(&contact, &Pose::identity()).features);
                });
                let expected = names(expected.iter().map(|c| c.features).collect());
                assert!(expected.len() > 150, "{}", expected.len());
                let (known, more): (Vec<_>, Vec<_>) = names(found)
                    .into_iter()
                    .partition(|pair| expected.binary_search(pair).is_ok());
                assert_eq!(known, expected, "obstacle {index} at {x}");
                // Trees leave vertices that do not stand out to those that do.
                let vertex_face = |pair: &FeaturePair| {
                    let features = (pair.on_body, pair.on_obstacle);
                    matches!(features, (Feature::Vertex(_), Feature::Face(_)))
                };
                assert!(more.iter().all(vertex_face), "{more:?}");
                assert!(looked_at >= 15 * 15, "{looked_at}");
            }
        }
    }
}
