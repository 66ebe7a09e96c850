//! What of a scene decides how much fidelity it needs.

use god_object::geometry::mass_properties;
use god_object::{Mesh, Primitive};

use super::errors;

/// Faces that meet at more than this are an edge and no curvature, rad: 40 degrees.
pub const CREASE: f64 = 0.7;
/// Faces that meet at less than this are one face, rad.
const FLAT: f64 = 1e-3;
/// Share of the surface whose curvature is covered; the rest is for slivers.
const COVERED: f64 = 0.95;

/// One body, as far as it decides.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyNeed {
    /// `god-object`, or the obstacle's name.
    pub name: String,
    /// Curvature of its smooth convex parts, 1/m.
    pub curvature: f64,
    /// It has convex edges.
    pub sharp: bool,
    /// Angle at which the facets of its smooth parts meet, rad; 0 of an exact form.
    pub facet_angle: f64,
    /// The largest angle between two of them that share an edge or a corner, rad.
    pub largest_facet_angle: f64,
    /// It has smooth hollow parts out of facets.
    pub hollow: bool,
    /// Triangles; 0 of an exact form.
    pub triangles: usize,
    /// m^2.
    pub area: f64,
    /// It may be simplified: it is a mesh file whose texture does not hang on its vertices.
    pub simplifiable: bool,
    /// It may be shaded: an obstacle out of facets that stand for a smooth surface.
    pub shadable: bool,
    /// How fast it moves, m/s; 0 stands still.
    pub speed: f64,
}

impl BodyNeed {
    /// An exact form.
    #[must_use]
    pub fn of_primitive(name: &str, primitive: &Primitive) -> Self {
        let (radius, sharp) = match *primitive {
            Primitive::Sphere { radius, .. } | Primitive::Capsule { radius, .. } => (radius, false),
            Primitive::Cylinder { radius, .. } => (radius, true),
            Primitive::Plane { .. } => (f64::INFINITY, false),
        };
        Self {
            name: name.to_owned(),
            curvature: radius.recip(),
            sharp,
            facet_angle: 0.0,
            largest_facet_angle: 0.0,
            hollow: false,
            triangles: 0,
            area: 0.0,
            simplifiable: false,
            shadable: false,
            speed: 0.0,
        }
    }

    /// A mesh: the curvature that the edges of its smooth convex parts stand for, their angle over the way across them. On a face whose edges all
    /// bend that is a third of its height (to its centroid in a regular mesh), on one that bends at one edge alone, as on a cylinder, half of it.
    #[must_use]
    pub fn of_mesh(name: &str, mesh: &Mesh) -> Self {
        let bending = bending_edges(mesh);
        let (mut bends, mut total, mut sharp, mut hollow) = (Vec::new(), 0.0, false, 0.0);
        for edge in mesh.edges() {
            let [a, b] = edge.vertices.map(|v| mesh.vertices()[v as usize]);
            let length = (b - a).norm();
            let doubled = edge.faces.map(|face| {
                let [p, q, r] = mesh.corners(face);
                (q - p).cross(&(r - p)).norm()
            });
            let heights = [0, 1].map(|side| {
                let among = if bending[edge.faces[side] as usize] == 1 {
                    2.0
                } else {
                    3.0
                };
                doubled[side] / (among * length)
            });
            let across = heights[0] + heights[1];
            total += length * across;
            if edge.convexity > CREASE {
                sharp = true;
            } else if edge.convexity > FLAT {
                bends.push((edge.convexity / across, edge.convexity, length * across));
            } else if (-CREASE..-FLAT).contains(&edge.convexity) {
                hollow += length * across;
            }
        }
        let largest = bends.iter().map(|bend| bend.1).fold(0.0, f64::max);
        let largest = largest.max(largest_at_corners(mesh));
        bends.sort_by(|a, b| a.0.total_cmp(&b.0));
        // From the most curved down, until the share that is left out is spent.
        let mut left_out = (1.0 - COVERED) * total;
        let mut found = (0.0, 0.0);
        for (curvature, angle, area) in bends.into_iter().rev() {
            left_out -= area;
            if left_out < 0.0 {
                found = (curvature, angle);
                break;
            }
        }
        Self {
            name: name.to_owned(),
            curvature: found.0,
            sharp,
            facet_angle: found.1,
            largest_facet_angle: largest,
            hollow: hollow > (1.0 - COVERED) * total,
            triangles: mesh.triangles().len(),
            area: surface_area(mesh),
            simplifiable: false,
            shadable: false,
            speed: 0.0,
        }
    }
}

/// For each face: its edges that neither are an edge of the body nor join two parts of one plane.
fn bending_edges(mesh: &Mesh) -> Vec<u8> {
    let mut bending = vec![0; mesh.triangles().len()];
    for edge in mesh.edges() {
        if (FLAT..=CREASE).contains(&edge.convexity.abs()) {
            for face in edge.faces {
                bending[face as usize] += 1;
            }
        }
    }
    bending
}

/// The largest angle between two faces at a corner without a hollow, rad: what slides over the corner goes from one to the other at once.
fn largest_at_corners(mesh: &Mesh) -> f64 {
    let mut hollow = vec![false; mesh.vertices().len()];
    for edge in mesh.edges().iter().filter(|edge| edge.convexity < -FLAT) {
        for v in edge.vertices {
            hollow[v as usize] = true;
        }
    }
    let mut faces = vec![Vec::new(); mesh.vertices().len()];
    for (t, corners) in (0..).zip(mesh.triangles()) {
        for v in corners.iter().filter(|v| !hollow[**v as usize]) {
            faces[*v as usize].push(mesh.face_normal(t));
        }
    }
    let between = faces.iter().flat_map(|around| {
        let pairs = around.iter().enumerate();
        pairs.flat_map(|(i, a)| around[..i].iter().map(|b| a.angle(b)))
    });
    between.filter(|angle| *angle <= CREASE).fold(0.0, f64::max)
}

fn surface_area(mesh: &Mesh) -> f64 {
    let triangles = 0..mesh.triangles().len() as u32;
    triangles
        .map(|t| {
            let [p, q, r] = mesh.corners(t);
            0.5 * (q - p).cross(&(r - p)).norm()
        })
        .sum()
}

/// Volume of a mesh, m^3: for a mass that is given as a density.
pub(crate) fn volume(mesh: &Mesh) -> f64 {
    mass_properties(mesh).volume
}

/// All that decides.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneNeed {
    /// The god-object.
    pub body: BodyNeed,
    /// The rest.
    pub obstacles: Vec<BodyNeed>,
    /// Longest side of the god-object, m.
    pub size: f64,
    /// Distance of the god-object's farthest point from where it turns, m; 0 where turning does not move its surface.
    pub lever: f64,
    /// Translational stiffness, N/m.
    pub stiffness: f64,
    /// Share of the pose difference that one update covers.
    pub k_s: f64,
    /// Fastest that the hand goes, m/s.
    pub speed: f64,
    /// Fastest that it turns, rad/s.
    pub turn_rate: f64,
    /// A usual force of contact, N.
    pub force: f64,
    /// Largest gap tolerance for which the settings are in order, m.
    pub widest_tolerance: f64,
}

impl SceneNeed {
    /// How deep the device goes with the usual force, m.
    #[must_use]
    pub fn depth(&self) -> f64 {
        self.force / self.stiffness
    }

    /// How fast a contact's normal turns along the way, 1/m: two convex bodies of curvature a and b turn about each other like
    /// ab / (a + b); an edge of the body slides over an obstacle and turns by its curvature. An edge of an obstacle is passed and not stayed
    /// on: it counts for nothing here.
    #[must_use]
    pub fn curvature(&self) -> f64 {
        let pairs = self.obstacles.iter().flat_map(|o| turning(&self.body, o));
        pairs.fold(0.0, f64::max)
    }

    /// Most that normals turn while the device goes a way, m, and what they turn in a millisecond anyway, rad. `mesh_errors` of the bodies, god-object
    /// first: a coarser mesh has larger facets. In a hollow the contact goes along the facets of the body in it, whose own curvature counts: an
    /// estimate, and no bound.
    #[must_use]
    pub fn stair(&self, way: f64, mesh_errors: &[f64]) -> (f64, f64) {
        let goes = way > 0.0; // false for NaN
        if !goes {
            return (0.0, 0.0);
        }
        let error = |index: usize| mesh_errors.get(index).copied().unwrap_or(0.0);
        let of_pair = |(index, o): (usize, &BodyNeed)| {
            let a = &self.body;
            let curvature = turning(a, o).into_iter().fold(0.0, f64::max);
            let rounding = if a.sharp { f64::INFINITY } else { a.curvature };
            // Convex contacts as the device sees them; in a hollow it goes outside the contact, where normals turn no faster.
            let deep = |curvature| errors::parallel(curvature, self.depth());
            // Facets of a simplified mesh may meet in hollow edges, where the normal turns at once however round the other body is.
            let stair = |body: &BodyNeed, error: f64, round: f64| {
                let coarser = errors::facet_angle(error, body.curvature);
                let largest = body.largest_facet_angle.max(coarser);
                let hollow = if error > 0.0 { coarser } else { 0.0 };
                let turned = |facet, round| errors::stair_turn(deep(curvature), facet, round, way);
                turned(largest, deep(round)).max(turned(hollow, f64::INFINITY))
            };
            let stairs = [
                stair(o, error(index + 1), rounding),
                stair(a, error(0), o.curvature),
                errors::normal_turn(if o.hollow { a.curvature } else { 0.0 }, way),
                errors::normal_turn(if a.hollow { o.curvature } else { 0.0 }, way),
            ];
            let own = errors::normal_turn(curvature, self.speed * errors::TICK);
            (stairs.into_iter().fold(0.0, f64::max), own)
        };
        let pairs = self.obstacles.iter().enumerate().map(of_pair);
        pairs.fold(
            (0.0, 0.0),
            |most, pair| {
                if pair.0 > most.0 { pair } else { most }
            },
        )
    }

    /// The fastest obstacle, m/s.
    #[must_use]
    pub fn obstacle_speed(&self) -> f64 {
        self.obstacles.iter().fold(0.0, |v, o| v.max(o.speed))
    }
}

fn turning(a: &BodyNeed, b: &BodyNeed) -> [f64; 2] {
    let sum = a.curvature + b.curvature;
    let smooth = if sum > 0.0 {
        a.curvature * b.curvature / sum
    } else {
        0.0
    };
    let edge_of_a = if a.sharp { b.curvature } else { 0.0 };
    [smooth, edge_of_a]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn mesh(raw: crate::RawMesh) -> Mesh {
        Mesh::new(raw.vertices, raw.triangles).expect("a closed shape")
    }

    #[test]
    fn a_tessellated_sphere_is_as_curved_as_the_sphere() {
        for subdivisions in [2, 3] {
            let found = BodyNeed::of_mesh("a", &mesh(shapes::sphere(0.02, subdivisions)));
            assert!((found.curvature * 0.02 - 1.0).abs() < 0.3, "{found:?}");
            assert!(!found.sharp);
        }
    }

    #[test]
    fn a_tessellated_cylinder_is_as_curved_as_the_cylinder() {
        for facets in [24, 60] {
            let raw = shapes::cylinder(0.01, 0.03, facets, shapes::Axis::Z);
            let found = BodyNeed::of_mesh("a", &mesh(raw));
            assert!((found.curvature * 0.01 - 1.0).abs() < 0.02, "{found:?}");
            assert!(found.sharp);
        }
    }

    #[test]
    fn a_corner_of_a_ball_turns_more_than_an_edge_and_a_hole_does_not() {
        let ball = BodyNeed::of_mesh("a", &mesh(shapes::sphere(0.02, 3)));
        let ratio = ball.largest_facet_angle / ball.facet_angle;
        assert!((1.3..3.0).contains(&ratio), "{ratio}");
        let hole = shapes::box_with_hole([0.03; 3], 0.0105, 24, shapes::Axis::Z);
        assert_eq!(BodyNeed::of_mesh("a", &mesh(hole)).largest_facet_angle, 0.0);
    }

    #[test]
    fn a_hole_is_hollow_and_its_box_is_not() {
        let hole = shapes::box_with_hole([0.03; 3], 0.0105, 24, shapes::Axis::Z);
        assert!(BodyNeed::of_mesh("a", &mesh(hole)).hollow);
        assert!(!BodyNeed::of_mesh("a", &mesh(shapes::cuboid([0.03; 3]))).hollow);
        assert!(!BodyNeed::of_mesh("a", &mesh(shapes::sphere(0.02, 2))).hollow);
    }

    #[test]
    fn a_box_has_edges_and_no_curvature() {
        let found = BodyNeed::of_mesh("a", &mesh(shapes::cuboid([0.01, 0.02, 0.03])));
        assert_eq!((found.curvature, found.sharp), (0.0, true));
        assert!((found.area - 8.0 * 1e-4 * 11.0).abs() < 1e-12);
    }

    #[test]
    fn two_spheres_turn_about_each_other_like_the_sum_of_their_radii() {
        let sphere = |radius| {
            let center = nalgebra::Point3::origin();
            BodyNeed::of_primitive("a", &Primitive::Sphere { center, radius })
        };
        let [smooth, ..] = turning(&sphere(0.02), &sphere(0.03));
        assert!((smooth - 20.0).abs() < 1e-9);
    }
}
