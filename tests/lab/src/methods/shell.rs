//! Points all over a mesh, and the signed distance of a point to one: what penalty methods are made of.

use std::collections::HashMap;

use god_object::geometry::NearestOnPrimitive;
use god_object::geometry::distance::closest_on_triangle;
use god_object::geometry::nearest_on_mesh;
use god_object::{Mesh, Obstacle};
use nalgebra::{Point3, Vector3};

/// Between the way to the nearest point of a face and the face's normal: less is rounding, rad.
const SAME_DIRECTION: f64 = 1e-6;

/// Points of a mesh: its vertices, and more on its edges and faces, no farther than `spacing` from each other, m; infinite: none.
pub(super) fn points(mesh: &Mesh, spacing: f64) -> Vec<Point3<f64>> {
    let mut points = mesh.vertices().to_vec();
    if !spacing.is_finite() {
        return points;
    }
    for triangle in 0..mesh.triangles().len() as u32 {
        let [a, b, c] = mesh.corners(triangle);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let pieces = (longest / spacing).ceil() as u32;
        for i in 0..=pieces {
            for j in 0..=pieces - i {
                let corner = [i, j, pieces - i - j].contains(&pieces);
                if !corner {
                    let share = |k: u32| f64::from(k) / f64::from(pieces);
                    points.push(a + (b - a) * share(i) + (c - a) * share(j));
                }
            }
        }
    }
    points
}

/// The exact signed distance field of a closed mesh.
///
/// The sign is that of the pseudo-normal of the nearest feature. Source: Baerentzen and Aanaes 2005, angle-weighted pseudo-normals.
#[derive(Debug)]
pub(super) struct DistanceField {
    mesh: Mesh,
    vertex_normals: Vec<Vector3<f64>>,
    edge_normals: HashMap<[u32; 2], Vector3<f64>>,
}

impl DistanceField {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let mut vertex_normals = vec![Vector3::zeros(); mesh.vertices().len()];
        let mut edge_normals = HashMap::new();
        for (t, triangle) in (0..).zip(mesh.triangles()) {
            let (normal, corners) = (mesh.face_normal(t), mesh.corners(t));
            for k in 0..3 {
                let (next, last) = ((k + 1) % 3, (k + 2) % 3);
                let angle = (corners[next] - corners[k]).angle(&(corners[last] - corners[k]));
                vertex_normals[triangle[k] as usize] += normal * angle;
                let edge = key(triangle[k], triangle[next]);
                *edge_normals.entry(edge).or_insert_with(Vector3::zeros) += normal;
            }
        }
        Self {
            mesh: mesh.clone(),
            vertex_normals,
            edge_normals,
        }
    }

    /// The nearest of the surface to a point that is inside, or outside and no farther away than `margin`, m; else `None`.
    pub(super) fn nearest(&self, point: &Point3<f64>, margin: f64) -> Option<NearestOnPrimitive> {
        let [low, high] = self.mesh.bounding_box();
        if !(0..3).all(|axis| (low[axis] - margin..high[axis] + margin).contains(&point[axis])) {
            return None;
        }
        let found = nearest_on_mesh(&self.mesh, point, 0);
        let corners = self.mesh.corners(found.triangle);
        let nearest = closest_on_triangle(point, &corners).point;
        let out = nearest - point;
        let outward = self.pseudo_normal(found.triangle, &corners, &nearest);
        let inside = outward.dot(&out) > 0.0;
        if !inside && out.norm() > margin {
            return None;
        }
        let way = if inside { out } else { -out };
        let face = self.mesh.face_normal(found.triangle);
        // Across a face its own normal is exact; near the surface the way is rounding.
        let aside = (way - face * way.norm()).norm();
        let normal = if aside < SAME_DIRECTION * way.norm() {
            *face
        } else {
            // On the surface there is no way.
            (way.try_normalize(f64::MIN_POSITIVE)).unwrap_or_else(|| outward.normalize())
        };
        Some(NearestOnPrimitive {
            normal,
            distance: -normal.dot(&out),
        })
    }

    /// Of the face, edge or vertex of triangle `t` that `nearest` lies on.
    fn pseudo_normal(
        &self,
        t: u32,
        corners: &[Point3<f64>; 3],
        nearest: &Point3<f64>,
    ) -> Vector3<f64> {
        let indices = self.mesh.triangles()[t as usize];
        let scale = (corners[1] - corners[0]).norm() + (corners[2] - corners[0]).norm();
        // Rounding of a nearest point, over the size of its triangle.
        let on = 1e-12 * scale;
        for k in 0..3 {
            if (nearest - corners[k]).norm() <= on {
                return self.vertex_normals[indices[k] as usize];
            }
        }
        for k in 0..3 {
            let next = (k + 1) % 3;
            let along = corners[next] - corners[k];
            let off = along.cross(&(nearest - corners[k])).norm();
            if off <= on * along.norm() {
                return self.edge_normals[&key(indices[k], indices[next])];
            }
        }
        *self.mesh.face_normal(t)
    }
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The nearest of an obstacle's surface to a point that is inside, or outside and no farther away than `margin`, m; world.
pub(super) fn nearest_on_obstacle(
    obstacle: &Obstacle,
    field: &DistanceField,
    point: &Point3<f64>,
    margin: f64,
) -> Option<NearestOnPrimitive> {
    let local = obstacle.pose.inverse_transform_point(point);
    let found = match &obstacle.primitive {
        Some(primitive) => Some(primitive.nearest(&local)).filter(|n| n.distance <= margin),
        None => field.nearest(&local, margin),
    }?;
    Some(NearestOnPrimitive {
        normal: obstacle.pose.rotation * found.normal,
        ..found
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_method_tests::solids::{cells, mesh};
    use taut_scene::shapes::{cuboid, sphere};

    /// From a point inside to the nearest of the surface, m; `None` outside.
    fn way_out(field: &DistanceField, point: Point3<f64>) -> Option<Vector3<f64>> {
        let found = field.nearest(&point, 0.0)?;
        (found.distance < 0.0).then(|| found.normal * -found.distance)
    }

    #[test]
    fn the_way_out_is_to_the_nearest_face() {
        let field = DistanceField::new(&mesh(cuboid([0.1, 0.1, 0.01])));
        let out = |z: f64| way_out(&field, Point3::new(0.02, 0.03, z));
        let up = out(0.007).expect("inside");
        assert!((up - Vector3::z() * 0.003).norm() < 1e-15);
        let down = out(-0.007).expect("inside");
        assert!((down + Vector3::z() * 0.003).norm() < 1e-15);
        assert_eq!(out(0.011), None);
        assert_eq!(out(-0.5), None);
        let above = Point3::new(0.02, 0.03, 0.012);
        assert_eq!(field.nearest(&above, 1.9e-3), None);
        let near = field.nearest(&above, 2.1e-3).expect("near");
        assert!((near.distance - 2e-3).abs() < 1e-15);
        assert!((near.normal - Vector3::z()).norm() < 1e-14);
    }

    /// Along a face's diagonal, too, where two of its triangles meet.
    #[test]
    fn near_a_face_the_normal_is_that_of_the_face() {
        let field = DistanceField::new(&mesh(cuboid([0.1, 0.1, 0.01])));
        for (x, y) in [(0.0, 0.0), (0.03, 0.03), (0.02, -0.07)] {
            for height in [1e-9, -1e-9, 1e-6, -1e-6] {
                let point = Point3::new(x, y, 0.01 + height);
                let found = field.nearest(&point, 1e-3).expect("near");
                assert!((found.normal - Vector3::z()).norm() < 1e-15, "{found:?}");
                assert!((found.distance - height).abs() < 1e-15, "{found:?}");
            }
        }
    }

    #[test]
    fn between_the_walls_of_a_u_is_outside_and_in_them_is_not() {
        let planes = [-0.03, -0.02, 0.02, 0.03];
        let field = DistanceField::new(&mesh(cells(
            [&planes, &[-0.05, 0.05], &[-0.01, 0.0, 0.1]],
            |[i, _, k]| k == 0 || i != 1,
        )));
        for z in [0.001, 0.05, 0.099] {
            assert_eq!(way_out(&field, Point3::new(0.01, 0.0, z)), None);
            let out = way_out(&field, Point3::new(0.022, 0.0, 0.05)).expect("in");
            assert!((out - Vector3::x() * -0.002).norm() < 1e-15);
        }
    }

    #[test]
    fn points_are_on_the_surface_and_near_each_other() {
        let ball = mesh(sphere(0.01, 1));
        let spacing = 2e-3;
        let points = points(&ball, spacing);
        for point in &points {
            assert!(nearest_on_mesh(&ball, point, 0).distance < 1e-12);
        }
        // The middle of every face has a point within the spacing.
        for t in 0..ball.triangles().len() as u32 {
            let [a, b, c] = ball.corners(t).map(|p| p.coords);
            let middle = Point3::from((a + b + c) / 3.0);
            let near = points.iter().map(|p| (p - middle).norm());
            assert!(near.fold(f64::INFINITY, f64::min) <= spacing);
        }
    }
}
