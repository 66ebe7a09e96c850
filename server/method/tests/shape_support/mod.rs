//! Shapes with an independent distance oracle for the tests of primitives: parry's shapes and queries.

use god_object::nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};
use god_object::{Body, Mesh, Obstacle, Pose, Primitive, Surface};
use parry3d_f64::math;
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Cylinder, HalfSpace, Segment, Shape, TriMesh};
use proptest::prelude::*;

use crate::support::box_mesh;

/// Forms about the origin, axis y, in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Form {
    Sphere(f64),
    Capsule(f64, f64),
    Cylinder(f64, f64),
    Plane,
    Cube(f64),
    Hole(f64, usize),
}

impl Form {
    pub(crate) fn primitive(self) -> Option<Primitive> {
        let ends = |half: f64| [Point3::new(0.0, -half, 0.0), Point3::new(0.0, half, 0.0)];
        match self {
            Self::Sphere(radius) => Some(Primitive::Sphere {
                center: Point3::origin(),
                radius,
            }),
            Self::Capsule(radius, half) => Some(Primitive::Capsule {
                ends: ends(half),
                radius,
            }),
            Self::Cylinder(radius, half) => Some(Primitive::Cylinder {
                ends: ends(half),
                radius,
            }),
            Self::Plane => Some(Primitive::Plane {
                normal: Vector3::z(),
                point: Point3::origin(),
            }),
            Self::Cube(_) | Self::Hole(..) => None,
        }
    }

    /// A tessellation within the form; coarse, it is not what collides.
    pub(crate) fn mesh(self) -> Mesh {
        match self {
            Self::Sphere(radius) => box_mesh(Vector3::repeat(0.5 * radius)),
            Self::Capsule(radius, half) | Self::Cylinder(radius, half) => prism(radius, half, 24),
            Self::Plane => {
                let mut plate = box_mesh(Vector3::new(0.5, 0.5, 0.05));
                let lowered = plate
                    .vertices()
                    .iter()
                    .map(|v| v - Vector3::z() * 0.05)
                    .collect();
                plate = Mesh::new(lowered, plate.triangles().to_vec()).expect("still closed");
                plate
            }
            Self::Cube(half) => box_mesh(Vector3::repeat(half)),
            Self::Hole(apothem, facets) => hole_mesh(apothem, facets),
        }
    }

    /// parry's form of it, and the radius around it: of a capsule parry's distance is off by up to 1e-5 m, of its segment it is not.
    pub(crate) fn oracle(self) -> Oracle {
        let point = |y: f64| math::Vector::new(0.0, y, 0.0);
        let (shape, round): (Box<dyn Shape>, f64) = match self {
            Self::Sphere(radius) => (Box::new(Ball::new(radius)), 0.0),
            Self::Capsule(radius, half) => {
                (Box::new(Segment::new(point(-half), point(half))), radius)
            }
            Self::Cylinder(radius, half) => (Box::new(Cylinder::new(half, radius)), 0.0),
            Self::Plane => (
                Box::new(HalfSpace::new(math::Vector::new(0.0, 0.0, 1.0))),
                0.0,
            ),
            Self::Cube(_) | Self::Hole(..) => {
                let mesh = self.mesh();
                let vertices = mesh
                    .vertices()
                    .iter()
                    .map(|v| math::Vector::new(v.x, v.y, v.z))
                    .collect();
                let surface = TriMesh::new(vertices, mesh.triangles().to_vec()).expect("a mesh");
                (Box::new(surface), 0.0)
            }
        };
        Oracle {
            shape,
            round,
            form: self,
        }
    }

    pub(crate) fn body(self) -> Body {
        Body {
            mesh: self.mesh(),
            primitive: self.primitive(),
            mass: 1.0,
            inertia: Matrix3::identity() * 1e-4,
            reference_point: Point3::origin(),
        }
    }

    pub(crate) fn obstacle(self, name: &str, pose: Pose) -> Obstacle {
        Obstacle {
            name: name.into(),
            mesh: self.mesh(),
            primitive: self.primitive(),
            pose,
            surface: Surface::default(),
        }
    }
}

/// A pose in parry's mathematics.
pub(crate) fn oracle_pose(pose: &Pose) -> math::Pose {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    math::Pose::from_parts(
        math::Vector::new(t.x, t.y, t.z),
        math::Rotation::from_xyzw(q.x, q.y, q.z, q.w),
    )
}

/// A shape of parry's with a radius around it.
pub(crate) struct Oracle {
    shape: Box<dyn Shape>,
    round: f64,
    form: Form,
}

/// Distance of a capsule's segment from a cylinder, m: a point's is a formula and convex along the segment, so thirds close in on the least.
fn segment_to_cylinder(half: f64, pose: &Pose, [radius, length]: [f64; 2], cylinder: &Pose) -> f64 {
    let there = cylinder.inverse() * pose;
    let distance = |y: f64| {
        let p = there * Point3::new(0.0, y, 0.0);
        let (side, cap) = (p.x.hypot(p.z) - radius, p.y.abs() - length);
        side.max(0.0).hypot(cap.max(0.0))
    };
    let (mut low, mut high) = (-half, half);
    for _ in 0..200 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) {
            high = b;
        } else {
            low = a;
        }
    }
    distance(0.5 * (low + high))
}

/// Distance by parry, m; 0 or less where they overlap.
pub(crate) fn oracle_distance(a: &Oracle, pose_a: &Pose, b: &Oracle, pose_b: &Pose) -> f64 {
    // parry's search is off by some 1e-4 of a distance, too much for the core of a capsule.
    match (a.form, b.form) {
        (Form::Capsule(r, h), Form::Cylinder(radius, length)) => {
            return segment_to_cylinder(h, pose_a, [radius, length], pose_b) - r;
        }
        (Form::Cylinder(radius, length), Form::Capsule(r, h)) => {
            return segment_to_cylinder(h, pose_b, [radius, length], pose_a) - r;
        }
        _ => {}
    }
    let (on_a, on_b) = (oracle_pose(pose_a), oracle_pose(pose_b));
    let cores = query::distance(&on_a, &*a.shape, &on_b, &*b.shape).expect("supported");
    cores.distance - a.round - b.round
}

/// A prism with vertices on the cylinder, axis y.
pub(crate) fn prism(radius: f64, half: f64, facets: u32) -> Mesh {
    let mut vertices = Vec::new();
    for k in 0..facets {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(facets)).sin_cos();
        vertices.push(Point3::new(radius * sin, -half, radius * cos));
        vertices.push(Point3::new(radius * sin, half, radius * cos));
    }
    vertices.push(Point3::new(0.0, -half, 0.0));
    vertices.push(Point3::new(0.0, half, 0.0));
    let mut triangles = Vec::new();
    for k in 0..facets {
        let (a, b) = (2 * k, 2 * ((k + 1) % facets));
        triangles.push([a, b, b + 1]);
        triangles.push([a, b + 1, a + 1]);
        triangles.push([2 * facets, b, a]);
        triangles.push([2 * facets + 1, a + 1, b + 1]);
    }
    Mesh::new(vertices, triangles).expect("a prism is closed")
}

/// A ring of height 60 mm and outer radius 30 mm about a prismatic hole along y.
pub(crate) fn hole_mesh(apothem: f64, facets: usize) -> Mesh {
    let n = facets as u32;
    let inner = apothem / (std::f64::consts::PI / facets as f64).cos();
    let mut vertices = Vec::new();
    for k in 0..n {
        let (sin, cos) = (std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(n)).sin_cos();
        for (radius, y) in [(inner, -0.03), (inner, 0.03), (0.03, -0.03), (0.03, 0.03)] {
            vertices.push(Point3::new(radius * sin, y, radius * cos));
        }
    }
    let mut triangles = Vec::new();
    for k in 0..n {
        let (a, b) = (4 * k, 4 * ((k + 1) % n));
        let mut quad = |p: u32, q: u32, r: u32, s: u32| {
            triangles.push([p, q, r]);
            triangles.push([p, r, s]);
        };
        quad(b, a, a + 1, b + 1); // the wall looks inwards
        quad(a + 2, b + 2, b + 3, a + 3);
        quad(a + 1, a + 3, b + 3, b + 1);
        quad(a, b, b + 2, a + 2);
    }
    Mesh::new(vertices, triangles).expect("a ring is closed")
}

pub(crate) fn turned(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), angle)
}

/// Forms that may move.
pub(crate) fn forms() -> impl Strategy<Value = Form> {
    prop_oneof![
        (0.005..0.02f64).prop_map(Form::Sphere),
        (0.005..0.02f64, 0.01..0.03f64).prop_map(|(r, h)| Form::Capsule(r, h)),
        (0.005..0.02f64, 0.005..0.03f64).prop_map(|(r, h)| Form::Cylinder(r, h)),
        (0.005..0.02f64).prop_map(Form::Cube),
    ]
}

/// Forms that may stand in the way.
pub(crate) fn obstacles() -> impl Strategy<Value = Form> {
    prop_oneof![forms(), Just(Form::Plane), Just(Form::Hole(0.015, 24))]
}

/// Vectors whose components are less than `size`.
pub(crate) fn vectors(size: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-size..size).prop_map(Vector3::from)
}
