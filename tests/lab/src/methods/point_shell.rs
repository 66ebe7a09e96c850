//! A nested shell of points of the body, held against signed distance fields.
//!
//! The points are sorted into a tree of balls. A distance field changes by no more than the way between two points, so one look at the middle of a
//! ball says whether any point in it can be near. Source: the nested point shell of Barbic and James 2008, whose upper levels are points of the
//! shell and stand for those below them; here they are balls that hold all of them, so that no contact is left out.

use std::collections::HashSet;

use god_object::geometry::Primitive;
use god_object::{Body, Mesh, Pose, World};
use nalgebra::{Point3, Vector3};

use super::shell::{DistanceField, nearest_on_obstacle};
use super::tangent_plane::TangentPlane;
use crate::tuning::ShellPoints;

/// Of the angle between a point's own normal and the field's gradient, where it pushes: 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Points of a ball that is not divided further.
const LEAF: usize = 4;
/// Points nearer to each other than this are one, over the size of the body; normals, absolute.
const SAME_PLACE: f64 = 1e-9;
const SAME_NORMAL: f64 = 1e-6;

/// A point of the shell, or one ball that stands for all of it.
#[derive(Clone, Copy, Debug)]
struct Place {
    center: Point3<f64>,
    radius: f64,
    /// Unit, into the body; `None` where the field's own direction counts.
    inward: Option<Vector3<f64>>,
}

/// A ball around points.
#[derive(Clone, Copy, Debug)]
struct Ball {
    center: Point3<f64>,
    radius: f64,
    /// Of its points.
    first: usize,
    end: usize,
    /// The second of the balls that it is divided into; the first one is next to it. `None`: it is not
    /// divided.
    second: Option<usize>,
}

/// The shell, and the fields that it is held against.
#[derive(Debug)]
pub(super) struct PointShell {
    places: Vec<Place>,
    balls: Vec<Ball>,
    fields: Vec<DistanceField>,
    /// Balls that wait.
    stack: Vec<usize>,
}

impl PointShell {
    /// Of a world's body. `own_normals`: forces go along the normals of the points, else along the field's
    /// gradient.
    pub(super) fn new(world: &World, points: ShellPoints, own_normals: bool) -> Self {
        let mut places = places(&world.body, points, own_normals);
        let mut balls = Vec::new();
        let count = places.len();
        divide(&mut places, 0, count, &mut balls);
        let obstacles = world.obstacles.iter();
        Self {
            places,
            balls,
            fields: obstacles.map(|o| DistanceField::new(&o.mesh)).collect(),
            stack: Vec::new(),
        }
    }

    /// Appends the planes of one obstacle before every point that is in it, or no farther away than `margin`,
    /// m.
    pub(super) fn find(
        &mut self,
        world: &World,
        obstacle: usize,
        pose: &Pose,
        margin: f64,
        found: &mut Vec<TangentPlane>,
    ) {
        let (field, obstacle) = (&self.fields[obstacle], &world.obstacles[obstacle]);
        let look =
            |point: &Point3<f64>, margin| nearest_on_obstacle(obstacle, field, point, margin);
        self.stack.clear();
        self.stack.push(0);
        while let Some(index) = self.stack.pop() {
            let ball = &self.balls[index];
            if look(&(pose * ball.center), margin + ball.radius).is_none() {
                continue;
            }
            if let Some(second) = ball.second {
                self.stack.extend([second, index + 1]);
                continue;
            }
            for place in &self.places[ball.first..ball.end] {
                let point = pose * place.center;
                let Some(nearest) = look(&point, margin + place.radius) else {
                    continue;
                };
                // A point of the far side of the body would push it in, one of an edge along the surface.
                let turned = |inward: &Vector3<f64>| (pose.rotation * inward).dot(&nearest.normal);
                if place
                    .inward
                    .is_some_and(|inward| turned(&inward) < LEAST_COSINE)
                {
                    continue;
                }
                found.push(TangentPlane {
                    center: place.center,
                    radius: place.radius,
                    on_obstacle: point - nearest.normal * nearest.distance,
                    normal: nearest.normal,
                    push: place.inward,
                });
            }
        }
    }
}

fn places(body: &Body, points: ShellPoints, own_normals: bool) -> Vec<Place> {
    let spacing = match (points, body.primitive) {
        (ShellPoints::Round, Some(Primitive::Sphere { center, radius })) => {
            return vec![Place {
                center,
                radius,
                inward: None,
            }];
        }
        (ShellPoints::Round, _) => f64::INFINITY,
        (ShellPoints::Spaced(spacing), _) => spacing,
    };
    let [low, high] = body.mesh.bounding_box();
    let size = (high - low).amax();
    let mut known = HashSet::new();
    let mut places = spread(&body.mesh, spacing * size, own_normals);
    // Faces share their edges.
    places.retain(|place| {
        let inward = place.inward.unwrap_or_else(Vector3::zeros) / SAME_NORMAL;
        let key = [place.center.coords / (SAME_PLACE * size), inward];
        known.insert(key.map(|v| [v.x, v.y, v.z].map(|x| x.round() as i64)))
    });
    places
}

/// Points of every face, edges and corners among them, no farther than `spacing` from each other, m;
/// infinite: corners alone.
fn spread(mesh: &Mesh, spacing: f64, own_normals: bool) -> Vec<Place> {
    let mut places = Vec::new();
    for triangle in 0..mesh.triangles().len() as u32 {
        let inward = own_normals.then(|| -mesh.face_normal(triangle));
        let mut pieces = vec![mesh.corners(triangle)];
        while let Some(corners) = pieces.pop() {
            let length = |k: usize| (corners[(k + 1) % 3] - corners[k]).norm();
            let longest = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
            if length(longest) > spacing {
                // Halved along its longest edge, so that a slender one has no more points than it is long.
                let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
                let middle = nalgebra::center(&a, &b);
                pieces.extend([[a, middle, c], [middle, b, c]]);
            } else {
                places.extend(corners.map(|center| Place {
                    center,
                    radius: 0.0,
                    inward,
                }));
            }
        }
    }
    places
}

/// Adds the ball of these points and those that it is divided into.
fn divide(places: &mut [Place], first: usize, end: usize, balls: &mut Vec<Ball>) {
    let own = &mut places[first..end];
    let fold = |least: bool| {
        let start = own[0].center.coords;
        own.iter().fold(start, |so_far, place| {
            let at = &place.center.coords;
            if least {
                so_far.inf(at)
            } else {
                so_far.sup(at)
            }
        })
    };
    let (low, high) = (fold(true), fold(false));
    let center = Point3::from((low + high) * 0.5);
    let reach = |place: &Place| (place.center - center).norm() + place.radius;
    let radius = own.iter().map(reach).fold(0.0, f64::max);
    let index = balls.len();
    balls.push(Ball {
        center,
        radius,
        first,
        end,
        second: None,
    });
    if own.len() > LEAF {
        let axis = (high - low).imax();
        let middle = own.len() / 2;
        own.select_nth_unstable_by(middle, |a, b| a.center[axis].total_cmp(&b.center[axis]));
        divide(places, first, first + middle, balls);
        balls[index].second = Some(balls.len());
        divide(places, first + middle, end, balls);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::above_a_plate;
    use super::*;
    use crate::recipes::cube;

    /// Tilted so that one corner is the lowest.
    fn world() -> (Arc<World>, Pose) {
        let pose = Pose::new(Vector3::new(0.0, 0.0, 0.006), Vector3::new(0.4, 0.3, 0.0));
        (above_a_plate::scene(cube(0.005), 0.001).world, pose)
    }

    #[test]
    fn no_point_that_is_near_is_left_out() {
        let (world, pose) = world();
        let margin = 2e-3;
        let mut shell = PointShell::new(&world, ShellPoints::Spaced(0.1), false);
        let mut found = Vec::new();
        shell.find(&world, 0, &pose, margin, &mut found);
        let near = |place: &&Place| (pose * place.center).z <= margin;
        assert_eq!(found.len(), shell.places.iter().filter(near).count());
        assert!(!found.is_empty() && found.len() < shell.places.len());
        for plane in &found {
            let height = (pose * plane.center).z;
            assert!((plane.gap(&pose) - height).abs() < 1e-15);
            assert!((plane.normal - Vector3::z()).norm() < 1e-12);
        }
    }

    #[test]
    fn points_with_normals_of_their_own_do_not_push_the_body_in() {
        let (world, pose) = world();
        let mut shell = PointShell::new(&world, ShellPoints::Spaced(0.5), true);
        let mut found = Vec::new();
        shell.find(&world, 0, &pose, 0.1, &mut found);
        assert!(!found.is_empty());
        for plane in found {
            let push = pose.rotation * plane.push.expect("its own");
            assert!(push.z >= LEAST_COSINE, "{push}");
        }
    }

    #[test]
    fn each_place_of_a_cube_is_one_point() {
        let (world, _) = world();
        let shell = PointShell::new(&world, ShellPoints::Spaced(0.75), false);
        // Corners, and the middles of edges and faces: sides and diagonals are halved once.
        assert_eq!(shell.places.len(), 8 + 12 + 6);
    }
}
