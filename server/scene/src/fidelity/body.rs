//! One body of a scene, as far as it decides how much fidelity is needed.

use god_object::geometry::mass_properties;
use god_object::{Mesh, Primitive};

use super::edges::Edges;
use super::met::Met;

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
    /// It is an exact form, whose rows can be made anew for each force.
    pub exact: bool,
    /// Angle at which the facets of its smooth parts meet, rad; 0 of an exact form.
    pub facet_angle: f64,
    /// Edges of the facets that stand for its smooth parts, of the largest angle between two that share an
    /// edge or a corner.
    pub bends: Option<Edges>,
    /// Its convex edges, as far as the hand's path brings the body to them.
    pub creases: Option<Edges>,
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
    /// Coefficient of friction of an obstacle's surface.
    pub friction: f64,
}

impl BodyNeed {
    /// An exact form; its edges are those of the mesh that it is drawn as.
    #[must_use]
    pub fn of_primitive(name: &str, primitive: &Primitive, mesh: &Mesh, met: &Met<'_>) -> Self {
        let (radius, sharp) = match *primitive {
            Primitive::Sphere { radius, .. } | Primitive::Capsule { radius, .. } => (radius, false),
            Primitive::Cylinder { radius, .. } => (radius, true),
            Primitive::Plane { .. } => (f64::INFINITY, false),
        };
        Self {
            name: name.to_owned(),
            curvature: radius.recip(),
            sharp,
            exact: true,
            facet_angle: 0.0,
            bends: None,
            creases: if sharp {
                edges_between(mesh, met, |angle| angle > CREASE)
            } else {
                None
            },
            hollow: false,
            triangles: 0,
            area: 0.0,
            simplifiable: false,
            shadable: false,
            speed: 0.0,
            friction: 0.0,
        }
    }

    /// A mesh: the curvature that the edges of its smooth convex parts stand for, their angle over the way
    /// across them. On a face whose edges all
    /// bend that is a third of its height (to its centroid in a regular mesh), on one that bends at one edge
    /// alone, as on a cylinder, half of it.
    ///
    /// Edges and faces count as far as they are `met`.
    #[must_use]
    pub fn of_mesh(name: &str, mesh: &Mesh, met: &Met<'_>) -> Self {
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
        let bends = edges_between(mesh, met, |angle| angle <= CREASE);
        Self {
            name: name.to_owned(),
            curvature: found.0,
            sharp,
            exact: false,
            facet_angle: found.1,
            bends: bends.map(|edges| Edges {
                turn: edges.turn.max(largest_at_corners(mesh)),
                ..edges
            }),
            creases: edges_between(mesh, met, |angle| angle > CREASE),
            hollow: hollow > (1.0 - COVERED) * total,
            triangles: mesh.triangles().len(),
            area: surface_area(mesh, &Met::default()),
            simplifiable: false,
            shadable: false,
            speed: 0.0,
            friction: 0.0,
        }
    }

    /// How fast a normal turns about it, 1/m: infinite about an edge.
    #[must_use]
    pub fn rounding(&self) -> f64 {
        if self.sharp {
            f64::INFINITY
        } else {
            self.curvature
        }
    }
}

/// The convex edges whose angle is wanted, as far as they are met.
fn edges_between(mesh: &Mesh, met: &Met<'_>, wanted: impl Fn(f64) -> bool) -> Option<Edges> {
    let (mut length, mut turn) = (0.0, 0.0_f64);
    for edge in mesh.edges() {
        if edge.convexity > FLAT && wanted(edge.convexity) {
            let ends = edge.vertices.map(|v| mesh.vertices()[v as usize]);
            let within = met.length(&ends);
            length += within;
            if within > 0.0 {
                turn = turn.max(edge.convexity);
            }
        }
    }
    Edges::on(surface_area(mesh, met), length, turn)
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

/// The largest angle between two faces at a corner without a hollow, rad: what slides over the corner goes
/// from one to the other at once.
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

/// Of the faces as far as they are met, m^2.
fn surface_area(mesh: &Mesh, met: &Met<'_>) -> f64 {
    let triangles = 0..mesh.triangles().len() as u32;
    triangles.map(|t| met.area(&mesh.corners(t))).sum()
}

/// Volume of a mesh, m^3: for a mass that is given as a density.
pub(crate) fn volume(mesh: &Mesh) -> f64 {
    mass_properties(mesh).volume
}

#[cfg(test)]
mod tests {
    use super::super::met::Solid;
    use super::super::reach::Reach;
    use super::*;
    use crate::shapes;
    use god_object::Pose;

    fn mesh(raw: crate::RawMesh) -> Mesh {
        Mesh::new(raw.vertices, raw.triangles).expect("a closed shape")
    }

    fn need(raw: crate::RawMesh) -> BodyNeed {
        BodyNeed::of_mesh("a", &mesh(raw), &Met::default())
    }

    #[test]
    fn a_tessellated_sphere_is_as_curved_as_the_sphere() {
        for subdivisions in [2, 3] {
            let found = need(shapes::sphere(0.02, subdivisions));
            assert!((found.curvature * 0.02 - 1.0).abs() < 0.3, "{found:?}");
            assert!(!found.sharp && found.creases.is_none());
        }
    }

    #[test]
    fn a_tessellated_cylinder_is_as_curved_as_the_cylinder() {
        for facets in [24, 60] {
            let found = need(shapes::cylinder(0.01, 0.03, facets, shapes::Axis::Z));
            assert!((found.curvature * 0.01 - 1.0).abs() < 0.02, "{found:?}");
            assert!(found.sharp);
        }
    }

    #[test]
    fn a_corner_of_a_ball_turns_more_than_an_edge_and_a_hole_does_not() {
        let ball = need(shapes::sphere(0.02, 3));
        let ratio = ball.bends.map(|bends| bends.turn / ball.facet_angle);
        assert!(
            ratio.is_some_and(|ratio| (1.3..3.0).contains(&ratio)),
            "{ratio:?}"
        );
        let hole = shapes::box_with_hole([0.03; 3], 0.0105, 24, shapes::Axis::Z);
        assert_eq!(need(hole).bends, None);
    }

    #[test]
    fn a_hole_is_hollow_and_its_box_is_not() {
        let hole = shapes::box_with_hole([0.03; 3], 0.0105, 24, shapes::Axis::Z);
        assert!(need(hole).hollow);
        assert!(!need(shapes::cuboid([0.03; 3])).hollow);
        assert!(!need(shapes::sphere(0.02, 2)).hollow);
    }

    #[test]
    fn a_box_has_edges_and_no_curvature() {
        let found = need(shapes::cuboid([0.01, 0.02, 0.03]));
        assert_eq!((found.curvature, found.sharp), (0.0, true));
        assert!((found.area - 8.0 * 1e-4 * 11.0).abs() < 1e-12);
        let edges = found.creases.expect("twelve edges");
        let apart = found.area / (8.0 * 0.06);
        assert!((edges.apart / apart - 1.0).abs() < 1e-12);
        assert!((edges.turn - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
    }

    #[test]
    fn edges_out_of_reach_are_not_met() {
        let block = mesh(shapes::cuboid([0.05, 0.05, 0.01]));
        let body = mesh(shapes::cuboid([0.01; 3]));
        let over = |x: f64| {
            let path = [0.0, x].map(|x| Pose::translation(x, 0.0, 0.02));
            Reach::of(&body, &path, 1e-3)
        };
        let met = |x: f64| {
            let solids = [Solid::new(&block, None, Pose::identity())];
            let met = Met::of(&solids, 0, over(x));
            BodyNeed::of_mesh("a", &block, &met).creases
        };
        assert_eq!(met(0.02), None);
        assert!(met(0.045).is_some());
    }
}
