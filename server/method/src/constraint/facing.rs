//! Do two features face each other: is the separation a local minimum of the distance between the surfaces?
//!
//! | symbol | name in code | unit | meaning                                                         |
//! |--------|--------------|------|-----------------------------------------------------------------|
//! | n      | `normal`     | –    | unit, obstacle to body                                          |
//! | x, y   |              | m    | points on the body and on the obstacle                          |
//! | g      | `gap`        | m    | `n.(x - y)`, in [0, activation distance]                        |
//!
//! n must lie in the normal cone of the obstacle's feature and -n in that of the body's: no surface next to the feature rises
//! towards the other body. The normal is that of the face or the product of the edges; only where a vertex meets an edge or a vertex
//! is it the direction of the difference. All in the obstacle's frame until the contacts are handed out.
//! Source: Ortega et al. 2007, Section 4.1; Lin and Canny 1991 (Voronoi regions of features).

use nalgebra::{Point3, Vector3};

use super::collect::triangle_of;
use super::cones::{
    LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE, is_in_edge_cone, is_in_vertex_cone, outward_of_edge,
};
use super::foot::{at_corner, foot_on_side, is_over, on_side, past_end};
use super::reentrant;
use super::{Contact, Feature, FeaturePair};
use crate::collision::Placement;
use crate::geometry::Mesh;
use crate::geometry::distance::barycentric;

/// Edges at a smaller angle are parallel, as its sine: their vertices stand for them.
const PARALLEL_SINE: f64 = 1e-6;
/// Points nearer than this have no direction, m: some rounding errors of a metre.
const NO_DIRECTION: f64 = 1e-14;

/// Looks at features of one body and one obstacle at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing<'a> {
    pub(super) body: &'a Mesh,
    pub(super) obstacle: &'a Mesh,
    pub(super) placement: &'a Placement,
    pub(super) obstacle_index: u16,
    pub(super) activation_distance: f64,
    /// Rows count beyond the end of their feature, too, where that is reentrant ([`reentrant`]): for rows that are known.
    pub(super) past_reentrant_edges: bool,
}

/// One triangle of each, corners in both frames where needed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) a: u32,
    pub(super) b: u32,
    /// Corners of the body's triangle, obstacle frame.
    pub(super) x: [Point3<f64>; 3],
    /// Corners of the obstacle's triangle.
    pub(super) y: [Point3<f64>; 3],
}

impl Facing<'_> {
    /// Corner `k` of the body's triangle over the obstacle's face.
    pub(super) fn vertex_face(&self, pair: &Pair, k: usize) -> Option<Contact> {
        let normal = *self.obstacle.face_normal(pair.b);
        let gap = normal.dot(&(pair.x[k] - pair.y[0]));
        let over = self.is_near(gap)
            && (is_over(&pair.x[k], &pair.y, &normal, gap)
                || self.past_reentrant_edges && {
                    let place = |t| self.obstacle.corners(t);
                    reentrant::covers_foot(self.obstacle, pair.b, place, &pair.x[k])
                });
        if !over {
            return None;
        }
        let v = self.body.triangles()[pair.a as usize][k];
        let outward = -self.placement.rotation.tr_mul(&normal);
        let faces = is_in_vertex_cone(self.body, v, &outward, LOOK_AHEAD_TILT);
        faces.then(|| {
            let foot = pair.x[k] - normal * gap;
            self.contact(
                Feature::Vertex(v),
                Feature::Face(pair.b),
                [pair.x[k], foot],
                normal,
                gap,
                (pair.b, barycentric(&foot, &pair.y, &normal)),
            )
        })
    }

    /// Corner `k` of the obstacle's triangle under the body's face.
    pub(super) fn face_vertex(&self, pair: &Pair, k: usize) -> Option<Contact> {
        let normal = -(self.placement.rotation * self.body.face_normal(pair.a));
        let gap = normal.dot(&(pair.x[0] - pair.y[k]));
        let over = self.is_near(gap)
            && (is_over(&pair.y[k], &pair.x, &-normal, gap)
                || self.past_reentrant_edges && {
                    let place = |t| self.pair(t, pair.b).x;
                    reentrant::covers_foot(self.body, pair.a, place, &pair.y[k])
                });
        if !over {
            return None;
        }
        let v = self.obstacle.triangles()[pair.b as usize][k];
        if !is_in_vertex_cone(self.obstacle, v, &normal, LOOK_AHEAD_TILT) {
            return None;
        }
        let on_body = pair.y[k] + normal * gap;
        Some(self.contact(
            Feature::Face(pair.a),
            Feature::Vertex(v),
            [on_body, pair.y[k]],
            normal,
            gap,
            (pair.b, at_corner(k)),
        ))
    }

    /// Side `i` of the body's triangle across side `j` of the obstacle's.
    pub(super) fn edge_edge(&self, pair: &Pair, i: usize, j: usize) -> Option<Contact> {
        let (p, q) = (pair.x[i], pair.y[j]);
        let (u, v, r) = (pair.x[(i + 1) % 3] - p, pair.y[(j + 1) % 3] - q, p - q);
        let (a, e, b) = (u.norm_squared(), v.norm_squared(), u.dot(&v));
        let denominator = a * e - b * b;
        let crossing = denominator > PARALLEL_SINE * PARALLEL_SINE * a * e; // false for NaN
        if !crossing {
            return None;
        }
        let (c, f) = (u.dot(&r), v.dot(&r));
        let (s, t) = ((b * f - c * e) / denominator, (a * f - b * c) / denominator);
        let inside = [s, t].map(|at| (0.0..=1.0).contains(&at));
        if inside != [true; 2] && !self.past_reentrant_edges {
            return None;
        }
        let cross = u.cross(&v);
        let unit = cross / cross.norm();
        let (edge_a, edge_b) = (
            self.body.triangle_edges(pair.a)[i],
            self.obstacle.triangle_edges(pair.b)[j],
        );
        // Out of the obstacle and into the body, by the faces at the edges: the points may be too near to say.
        let out_of_body = self.placement.rotation * outward_of_edge(self.body, edge_a);
        let side = unit.dot(&(outward_of_edge(self.obstacle, edge_b) - out_of_body));
        let normal = if side < 0.0 { -unit } else { unit };
        let (x, y) = (p + u * s, q + v * t);
        let gap = normal.dot(&(x - y));
        let into_body = -self.placement.rotation.tr_mul(&normal);
        let facing = self.is_near(gap)
            && is_in_edge_cone(self.obstacle, edge_b, &normal, LOOK_AHEAD_TILT)
            && is_in_edge_cone(self.body, edge_a, &into_body, LOOK_AHEAD_TILT)
            && (inside[0] || {
                let end = self.body.triangles()[pair.a as usize][(i + usize::from(s > 0.5)) % 3];
                let [way, across] =
                    [u * past_end(s), v].map(|d| self.placement.rotation.tr_mul(&d));
                reentrant::covers_way(self.body, end, &way)
                    || reentrant::covers_outline(self.body, end, &way, &across)
            })
            && (inside[1] || {
                let end =
                    self.obstacle.triangles()[pair.b as usize][(j + usize::from(t > 0.5)) % 3];
                let way = v * past_end(t);
                reentrant::covers_way(self.obstacle, end, &way)
                    || reentrant::covers_outline(self.obstacle, end, &way, &u)
            });
        facing.then(|| {
            self.contact(
                Feature::Edge(edge_a),
                Feature::Edge(edge_b),
                [x, y],
                normal,
                gap,
                (pair.b, on_side(j, t)),
            )
        })
    }

    /// Corner `i` of the body's triangle against side `j` of the obstacle's.
    pub(super) fn vertex_edge(&self, pair: &Pair, i: usize, j: usize) -> Option<Contact> {
        let (foot, t) = foot_on_side(&pair.x[i], &pair.y, j)?;
        let edge = self.obstacle.triangle_edges(pair.b)[j];
        let (normal, gap) =
            self.direction(&(pair.x[i] - foot), &outward_of_edge(self.obstacle, edge))?;
        let v = self.body.triangles()[pair.a as usize][i];
        let facing = is_in_edge_cone(self.obstacle, edge, &normal, NORMAL_CONE_TOLERANCE)
            && is_in_vertex_cone(
                self.body,
                v,
                &-self.placement.rotation.tr_mul(&normal),
                NORMAL_CONE_TOLERANCE,
            );
        facing.then(|| {
            self.contact(
                Feature::Vertex(v),
                Feature::Edge(edge),
                [pair.x[i], foot],
                normal,
                gap,
                (pair.b, on_side(j, t)),
            )
        })
    }

    /// Side `i` of the body's triangle against corner `j` of the obstacle's.
    pub(super) fn edge_vertex(&self, pair: &Pair, i: usize, j: usize) -> Option<Contact> {
        let (foot, _) = foot_on_side(&pair.y[j], &pair.x, i)?;
        let edge = self.body.triangle_edges(pair.a)[i];
        let into_body = -(self.placement.rotation * outward_of_edge(self.body, edge));
        let (normal, gap) = self.direction(&(foot - pair.y[j]), &into_body)?;
        let v = self.obstacle.triangles()[pair.b as usize][j];
        let facing = is_in_vertex_cone(self.obstacle, v, &normal, NORMAL_CONE_TOLERANCE)
            && is_in_edge_cone(
                self.body,
                edge,
                &-self.placement.rotation.tr_mul(&normal),
                NORMAL_CONE_TOLERANCE,
            );
        facing.then(|| {
            self.contact(
                Feature::Edge(edge),
                Feature::Vertex(v),
                [foot, pair.y[j]],
                normal,
                gap,
                (pair.b, at_corner(j)),
            )
        })
    }

    /// Corner `i` of the body's triangle against corner `j` of the obstacle's.
    pub(super) fn vertex_vertex(&self, pair: &Pair, i: usize, j: usize) -> Option<Contact> {
        let (normal, gap) =
            self.direction(&(pair.x[i] - pair.y[j]), self.obstacle.face_normal(pair.b))?;
        let (v, w) = (
            self.body.triangles()[pair.a as usize][i],
            self.obstacle.triangles()[pair.b as usize][j],
        );
        let facing = is_in_vertex_cone(self.obstacle, w, &normal, NORMAL_CONE_TOLERANCE)
            && is_in_vertex_cone(
                self.body,
                v,
                &-self.placement.rotation.tr_mul(&normal),
                NORMAL_CONE_TOLERANCE,
            );
        facing.then(|| {
            self.contact(
                Feature::Vertex(v),
                Feature::Vertex(w),
                [pair.x[i], pair.y[j]],
                normal,
                gap,
                (pair.b, at_corner(j)),
            )
        })
    }

    /// A triangle of each.
    #[inline]
    pub(super) fn pair(&self, a: u32, b: u32) -> Pair {
        Pair {
            a,
            b,
            x: self.body.corners(a).map(|p| self.placement.point(&p)),
            y: self.obstacle.corners(b),
        }
    }

    /// The contact between two features by their names, when they face each other here.
    pub(super) fn features(&self, features: &FeaturePair) -> Option<Contact> {
        let (body, obstacle) = (self.body, self.obstacle);
        let a = triangle_of(body, features.on_body)?;
        let b = triangle_of(obstacle, features.on_obstacle)?;
        let pair = self.pair(a, b);
        let corner = |mesh: &Mesh, t: u32, v: u32| {
            let corners = mesh.triangles()[t as usize];
            corners.iter().position(|w| *w == v)
        };
        let side = |mesh: &Mesh, t: u32, e: u32| {
            let edges = mesh.triangle_edges(t);
            edges.iter().position(|f| *f == e)
        };
        match (features.on_body, features.on_obstacle) {
            (Feature::Vertex(v), Feature::Face(_)) => self.vertex_face(&pair, corner(body, a, v)?),
            (Feature::Face(_), Feature::Vertex(w)) => {
                self.face_vertex(&pair, corner(obstacle, b, w)?)
            }
            (Feature::Edge(e), Feature::Edge(f)) => {
                self.edge_edge(&pair, side(body, a, e)?, side(obstacle, b, f)?)
            }
            (Feature::Vertex(v), Feature::Edge(f)) => {
                self.vertex_edge(&pair, corner(body, a, v)?, side(obstacle, b, f)?)
            }
            (Feature::Edge(e), Feature::Vertex(w)) => {
                self.edge_vertex(&pair, side(body, a, e)?, corner(obstacle, b, w)?)
            }
            (Feature::Vertex(v), Feature::Vertex(w)) => {
                self.vertex_vertex(&pair, corner(body, a, v)?, corner(obstacle, b, w)?)
            }
            // Faces on edges and faces are their corners' contacts; features of primitives are not those of meshes.
            _ => None,
        }
    }

    #[inline]
    fn is_near(&self, gap: f64) -> bool {
        gap >= 0.0 && gap <= self.activation_distance // false for NaN
    }

    /// Unit direction and length of a difference within the activation distance; `otherwise` where it is too short to have one.
    #[inline]
    fn direction(
        &self,
        difference: &Vector3<f64>,
        otherwise: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, f64)> {
        let squared = difference.norm_squared();
        let near = squared <= self.activation_distance * self.activation_distance; // false for NaN
        if !near {
            return None;
        }
        let gap = squared.sqrt();
        let normal = if gap > NO_DIRECTION {
            difference / gap
        } else {
            otherwise.try_normalize(0.0)?
        };
        Some((normal, gap))
    }

    fn contact(
        &self,
        on_body: Feature,
        on_obstacle: Feature,
        [x, y]: [Point3<f64>; 2],
        normal: Vector3<f64>,
        gap: f64,
        (obstacle_triangle, barycentric): (u32, [f64; 3]),
    ) -> Contact {
        Contact {
            features: FeaturePair {
                obstacle: self.obstacle_index,
                on_body,
                on_obstacle,
            },
            point_on_body: x,
            point_on_obstacle: y,
            normal,
            gap,
            obstacle_triangle,
            barycentric,
        }
    }
}
