//! Which edges of an obstacle the body meets: those within reach of it, and not inside another obstacle.

use god_object::{Mesh, Pose, Primitive};
use nalgebra::Point3;

use super::reach::Reach;

/// Most faces of a mesh that is looked into: of larger ones nothing is said to be inside.
const MAX_FACES: usize = 64;
/// Depth from which a point is inside, m: edges that lie on another obstacle are met.
const INSIDE: f64 = 1e-6;

/// An obstacle where it stands.
#[derive(Clone, Debug)]
pub struct Solid<'a> {
    mesh: &'a Mesh,
    primitive: Option<Primitive>,
    pose: Pose,
    convex: bool,
}

impl<'a> Solid<'a> {
    /// At a pose.
    #[must_use]
    pub fn new(mesh: &'a Mesh, primitive: Option<Primitive>, pose: Pose) -> Self {
        let convex = mesh.triangles().len() <= MAX_FACES
            && mesh.edges().iter().all(|e| e.convexity > 0.0 || e.flat);
        Self {
            mesh,
            primitive,
            pose,
            convex,
        }
    }

    /// The same where it moves: nothing is inside it for good.
    #[must_use]
    pub fn that_moves(self, moves: bool) -> Self {
        Self {
            primitive: self.primitive.filter(|_| !moves),
            convex: self.convex && !moves,
            ..self
        }
    }

    /// Whether a point is inside; `false` of a mesh that is not convex, or has many faces.
    fn contains(&self, point: &Point3<f64>) -> bool {
        let point = self.pose.inverse_transform_point(point);
        if let Some(primitive) = &self.primitive {
            return primitive.nearest(&point).distance < -INSIDE;
        }
        let beneath = |t: u32| {
            let corner = self.mesh.corners(t)[0];
            self.mesh.face_normal(t).dot(&(point - corner)) < -INSIDE
        };
        self.convex && (0..self.mesh.triangles().len() as u32).all(beneath)
    }
}

/// What of one obstacle is met, or of a body that is met all over.
#[derive(Clone, Copy, Debug, Default)]
pub struct Met<'a> {
    among: Option<(&'a [Solid<'a>], usize)>,
    reach: Option<Reach>,
}

impl<'a> Met<'a> {
    /// Of obstacle `own`, what is within reach, if one is known, and inside no other obstacle.
    #[must_use]
    pub fn of(solids: &'a [Solid<'a>], own: usize, reach: Option<Reach>) -> Self {
        Self {
            among: Some((solids, own)),
            reach,
        }
    }

    /// Length of a segment as far as it is met, m; its ends in the body's own frame.
    #[must_use]
    pub fn length(&self, ends: &[Point3<f64>; 2]) -> f64 {
        let left = self.left(ends);
        let far = |a: &Point3<f64>| left.iter().map(move |b| (a - b).norm()).fold(0.0, f64::max);
        left.iter().map(far).fold(0.0, f64::max)
    }

    /// Area of a triangle as far as it is met, m^2.
    #[must_use]
    pub fn area(&self, corners: &[Point3<f64>; 3]) -> f64 {
        let left = self.left(corners);
        let fan = left.windows(2).skip(1);
        let doubled = fan.map(|pair| (pair[0] - left[0]).cross(&(pair[1] - left[0])).norm());
        0.5 * doubled.sum::<f64>()
    }

    /// The part that is within reach, none of it where the middle of that is inside another obstacle.
    fn left(&self, corners: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let Some((solids, own)) = self.among else {
            return corners.to_vec();
        };
        let placed: Vec<_> = corners.iter().map(|p| solids[own].pose * p).collect();
        let left = self
            .reach
            .map_or_else(|| placed.clone(), |reach| reach.clipped(&placed));
        if left.is_empty() {
            return left;
        }
        let sum: nalgebra::Vector3<f64> = left.iter().map(|point| point.coords).sum();
        let middle = Point3::from(sum / left.len() as f64);
        let mut others = solids.iter().enumerate().filter(|(index, _)| *index != own);
        if others.any(|(_, solid)| solid.contains(&middle)) {
            Vec::new()
        } else {
            left
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fidelity::BodyNeed;
    use crate::shapes;

    fn mesh(raw: crate::RawMesh) -> Mesh {
        Mesh::new(raw.vertices, raw.triangles).expect("a closed shape")
    }

    #[test]
    fn edges_in_another_obstacle_are_not_met() {
        let slab = mesh(shapes::cuboid([0.05, 0.05, 0.01]));
        // A wall that stands in the middle of a floor: its lower edges are in it.
        let upright = Pose::translation(0.0, 0.0, 0.045);
        let wall = mesh(shapes::cuboid([0.01, 0.01, 0.04]));
        let solids = [
            Solid::new(&slab, None, Pose::identity()),
            Solid::new(&wall, None, upright),
        ];
        let met = Met::of(&solids, 1, None);
        let lower = [[-0.01, 0.01], [0.01, 0.01]].map(|[x, y]| Point3::new(x, y, -0.04));
        let upper = lower.map(|p| Point3::new(p.x, p.y, 0.04));
        assert_eq!(met.length(&lower), 0.0);
        assert!((met.length(&upper) - 0.02).abs() < 1e-12);
        let found = BodyNeed::of_mesh("wall", &wall, &met).creases;
        let all = BodyNeed::of_mesh("wall", &wall, &Met::default()).creases;
        assert!(found.is_some() && found != all);
    }
}
