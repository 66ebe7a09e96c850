//! The 3D picture: what is sent once, and what moves.

use nalgebra::{Point3, Vector3};
use rerun::{
    Arrows3D, EntityPath, LineStrips3D, Mesh3D, Points3D, Quaternion, RecordingStream,
    RecordingStreamResult, Transform3D, ViewCoordinates,
};

use crate::error::MonitorError;
use crate::head::Head;
use crate::sample::MonitorSample;
use crate::scene::{BodyRole, MonitorBody, MonitorScene, Pose};
use crate::{colours, paths, shading};

/// Sizes of marks, as fractions of the god-object's diagonal.
const CONTACT_RADIUS: f64 = 0.018;
const NORMAL_LENGTH: f64 = 0.18;
const NORMAL_RADIUS: f64 = 0.005;
const FORCE_RADIUS: f64 = 0.012;
/// A force of this many newtons is drawn as long as the god-object's diagonal.
const NEWTONS_PER_DIAGONAL: f64 = 8.0;
/// Forces below this are not drawn, N: the arrow would be shorter than it is thick.
const LEAST_DRAWN_FORCE: f64 = 0.01;

/// Draws; holds what the moving part needs of the scene.
pub(crate) struct Picture {
    reference_point: Point3<f64>,
    diagonal: f64,
    metres_per_newton: f64,
    head: Head,
    /// Path of each obstacle that moves; `None` for one at rest. In the scene's order of obstacles.
    moving: Vec<Option<EntityPath>>,
    /// Session time at which no contacts were last sent, in nanoseconds; `None` while some may be drawn.
    erased_ns: Option<u64>,
}

/// Time after which what has not changed is sent again: an unmoved head, that there are no contacts.
pub(crate) const REPEAT_NS: u64 = 1_000_000_000;

/// Says what is wrong with a body's mesh, if anything.
pub(crate) fn check_mesh(body: &MonitorBody) -> Result<(), MonitorError> {
    let count = body.vertices.len();
    let finite = body.vertices.iter().flatten().all(|x| x.is_finite());
    let in_range = body
        .triangles
        .iter()
        .flatten()
        .all(|&index| (index as usize) < count);
    let reason = if body.triangles.is_empty() {
        "it has no triangles".to_owned()
    } else if !finite || !is_finite(&body.pose) {
        "a vertex or its pose is not a finite number".to_owned()
    } else if !in_range {
        format!("a triangle names a vertex beyond the last of {count}")
    } else {
        return Ok(());
    };
    Err(MonitorError::Mesh {
        body: body.name.clone(),
        reason,
    })
}

impl Picture {
    /// Sends everything that does not move, and the first poses.
    pub(crate) fn draw_scene(
        stream: &RecordingStream,
        scene: &MonitorScene,
    ) -> RecordingStreamResult<Picture> {
        stream.log_static(paths::WORLD, &view_coordinates(&scene.up))?;
        for body in &scene.bodies {
            draw_body(stream, body)?;
        }
        for screen in &scene.screens {
            let [a, b, c, d] = screen.corners.map(to_array);
            let outline = LineStrips3D::new([[a, b, c, d, a]])
                .with_colors([colours::WORKBENCH])
                .with_radii([rerun::Radius::new_ui_points(1.0)]);
            stream.log_static(paths::named("world/screens", &screen.name), &outline)?;
        }
        let head = Head::draw(stream, scene)?;

        let diagonal = god_object_diagonal(scene);
        Ok(Picture {
            reference_point: scene.reference_point,
            diagonal,
            metres_per_newton: diagonal / NEWTONS_PER_DIAGONAL,
            head,
            moving: moving_paths(scene),
            erased_ns: None,
        })
    }

    /// Length of the force arrow, metres per newton.
    pub(crate) fn metres_per_newton(&self) -> f64 {
        self.metres_per_newton
    }

    /// Moves everything to where `sample` says; the stream's time must be set. `false`: the sample holds a number
    /// that is not finite, and nothing was moved.
    pub(crate) fn show(
        &mut self,
        stream: &RecordingStream,
        sample: &MonitorSample,
    ) -> RecordingStreamResult<bool> {
        let finite = is_finite(&sample.god_object_pose)
            && is_finite(&sample.device_pose)
            && sample.head_pose.as_ref().is_none_or(is_finite)
            && sample
                .moving
                .as_slice()
                .iter()
                .all(|(_, pose)| is_finite(pose))
            && sample.wrench.iter().all(|x| x.is_finite());
        if !finite {
            return Ok(false);
        }
        stream.log(paths::GOD_OBJECT, &transform(&sample.god_object_pose))?;
        stream.log(paths::DEVICE, &transform(&sample.device_pose))?;
        for (obstacle, pose) in sample.moving.as_slice() {
            if let Some(Some(path)) = self.moving.get(usize::from(*obstacle)) {
                stream.log(path.clone(), &transform(pose))?;
            }
        }
        self.head
            .show(stream, sample.head_pose, sample.session_time_ns)?;
        self.show_contacts(stream, sample)?;
        self.show_force(stream, sample)?;
        Ok(true)
    }

    /// As long as there is nothing to draw, that is sent now and then, as the head is.
    fn show_contacts(
        &mut self,
        stream: &RecordingStream,
        sample: &MonitorSample,
    ) -> RecordingStreamResult<()> {
        let contacts = sample.contacts.as_slice();
        let now_ns = sample.session_time_ns;
        let recent = |erased_ns: u64| now_ns.saturating_sub(erased_ns) < REPEAT_NS;
        if contacts.is_empty() && self.erased_ns.is_some_and(recent) {
            return Ok(());
        }
        self.erased_ns = contacts.is_empty().then_some(now_ns);
        let points = || contacts.iter().map(|contact| to_array(contact.point));
        let length = NORMAL_LENGTH * self.diagonal;
        let normals = contacts
            .iter()
            .map(|contact| to_vector(contact.normal * length));
        let dots = Points3D::new(points())
            .with_colors([colours::CONTACT])
            .with_radii([(CONTACT_RADIUS * self.diagonal) as f32]);
        let arrows = Arrows3D::from_vectors(normals)
            .with_origins(points())
            .with_colors([colours::NORMAL])
            .with_radii([(NORMAL_RADIUS * self.diagonal) as f32]);
        stream.log(
            paths::CONTACTS,
            &[&dots as &dyn rerun::AsComponents, &arrows],
        )
    }

    fn show_force(
        &self,
        stream: &RecordingStream,
        sample: &MonitorSample,
    ) -> RecordingStreamResult<()> {
        let force: Vector3<f64> = sample.wrench.fixed_rows::<3>(0).into_owned();
        let drawn = (force.norm() >= LEAST_DRAWN_FORCE).then(|| {
            let start = sample.god_object_pose * self.reference_point;
            (to_array(start), to_vector(force * self.metres_per_newton))
        });
        let arrow = Arrows3D::from_vectors(drawn.iter().map(|(_, vector)| *vector))
            .with_origins(drawn.iter().map(|(start, _)| *start))
            .with_colors([colours::FORCE])
            .with_radii([(FORCE_RADIUS * self.diagonal) as f32]);
        stream.log(paths::FORCE_ARROW, &arrow)
    }
}

/// The mesh; for the god-object also its ghost at the device's pose.
fn draw_body(stream: &RecordingStream, body: &MonitorBody) -> RecordingStreamResult<()> {
    let shaded = shading::shaded(&body.vertices, &body.triangles);
    let mesh = Mesh3D::new(shaded.vertices)
        .with_triangle_indices(shaded.triangles)
        .with_vertex_normals(shaded.normals);
    match body.role {
        BodyRole::Obstacle | BodyRole::MovingObstacle => {
            let [r, g, b] = body.colour.unwrap_or(colours::OBSTACLE);
            let path = obstacle_path(body);
            // What is static hides what comes later at the same place.
            if body.role == BodyRole::Obstacle {
                stream.log_static(path.clone(), &transform(&body.pose))?;
            } else {
                stream.log(path.clone(), &transform(&body.pose))?;
            }
            stream.log_static(
                path,
                &mesh
                    .with_albedo_factor([r, g, b, colours::OBSTACLE_OPACITY])
                    .with_face_rendering(rerun::components::MeshFaceRendering::Front),
            )
        }
        BodyRole::GodObject => {
            let [r, g, b] = body.colour.unwrap_or(colours::GOD_OBJECT);
            let solid = mesh.clone().with_albedo_factor([r, g, b, 255]);
            stream.log_static(paths::named(paths::GOD_OBJECT, &body.name), &solid)?;
            let ghost = mesh.with_albedo_factor(colours::DEVICE);
            stream.log_static(paths::named(paths::DEVICE, &body.name), &ghost)?;
            stream.log(paths::GOD_OBJECT, &transform(&body.pose))?;
            stream.log(paths::DEVICE, &transform(&body.pose))
        }
    }
}

fn obstacle_path(body: &MonitorBody) -> EntityPath {
    paths::named("world/obstacles", &body.name)
}

fn moving_paths(scene: &MonitorScene) -> Vec<Option<EntityPath>> {
    let obstacles = scene
        .bodies
        .iter()
        .filter(|body| body.role != BodyRole::GodObject);
    obstacles
        .map(|body| (body.role == BodyRole::MovingObstacle).then(|| obstacle_path(body)))
        .collect()
}

/// Largest extent of the god-object's bounding box, corner to corner; of all bodies if there is no god-object.
fn god_object_diagonal(scene: &MonitorScene) -> f64 {
    let god_object = scene
        .bodies
        .iter()
        .find(|body| body.role == BodyRole::GodObject);
    let bounds = match god_object {
        Some(body) => Bounds::of(body.vertices.iter().map(|v| point(*v))),
        None => Bounds::of_bodies(scene),
    };
    bounds.map_or(0.1, |bounds| 2.0 * bounds.half_diagonal())
}

/// An axis-aligned box.
pub(crate) struct Bounds {
    least: Point3<f64>,
    most: Point3<f64>,
}

impl Bounds {
    fn of(points: impl Iterator<Item = Point3<f64>>) -> Option<Bounds> {
        points.fold(None, |bounds: Option<Bounds>, point| {
            let (least, most) = bounds.map_or((point, point), |b| (b.least, b.most));
            Some(Bounds {
                least: least.inf(&point),
                most: most.sup(&point),
            })
        })
    }

    /// Around all bodies at their starting poses, world axes; `None` without bodies.
    pub(crate) fn of_bodies(scene: &MonitorScene) -> Option<Bounds> {
        Bounds::of(scene.bodies.iter().flat_map(|body| {
            body.vertices
                .iter()
                .map(move |vertex| body.pose * point(*vertex))
        }))
    }

    pub(crate) fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.least, &self.most)
    }

    pub(crate) fn half_diagonal(&self) -> f64 {
        0.5 * (self.most - self.least).norm()
    }
}

/// Right-handed with the axis nearest to `up` as up.
fn view_coordinates(up: &Vector3<f64>) -> ViewCoordinates {
    let axis = up.iamax();
    match (axis, up[axis] < 0.0) {
        (0, false) => ViewCoordinates::RIGHT_HAND_X_UP(),
        (0, true) => ViewCoordinates::RIGHT_HAND_X_DOWN(),
        (1, false) => ViewCoordinates::RIGHT_HAND_Y_UP(),
        (1, true) => ViewCoordinates::RIGHT_HAND_Y_DOWN(),
        (_, false) => ViewCoordinates::RIGHT_HAND_Z_UP(),
        (_, true) => ViewCoordinates::RIGHT_HAND_Z_DOWN(),
    }
}

pub(crate) fn transform(pose: &Pose) -> Transform3D {
    let rotation = pose.rotation.coords.map(|x| x as f32); // x, y, z, w
    Transform3D::from_translation_rotation(
        to_vector(pose.translation.vector),
        Quaternion::from_xyzw(rotation.into()),
    )
}

fn is_finite(pose: &Pose) -> bool {
    let numbers = pose.translation.vector.iter();
    numbers
        .chain(pose.rotation.coords.iter())
        .all(|x| x.is_finite())
}

fn point(vertex: [f32; 3]) -> Point3<f64> {
    Point3::from(vertex.map(f64::from))
}

fn to_array(point: Point3<f64>) -> [f32; 3] {
    to_vector(point.coords)
}

fn to_vector(vector: Vector3<f64>) -> [f32; 3] {
    vector.map(|x| x as f32).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::ShownContact;
    use rerun::RecordingStreamBuilder;
    use rerun::log::{ChunkBatcherConfig, LogMsg};

    /// An observer who missed the end of a contact hears of it soon.
    #[test]
    fn that_nothing_touches_is_sent_again_each_second() {
        let (stream, stored) = RecordingStreamBuilder::new("test")
            .batcher_config(ChunkBatcherConfig {
                flush_num_rows: 1,
                ..ChunkBatcherConfig::DEFAULT
            })
            .memory()
            .unwrap();
        let mut picture = Picture::draw_scene(&stream, &MonitorScene::new("nothing")).unwrap();
        drop(stored.take());
        let mut is_sent = |time_ms: u64, touches: bool| {
            let mut sample = MonitorSample::at(time_ms * 1_000_000);
            if touches {
                sample.contacts.push(ShownContact {
                    point: Point3::origin(),
                    normal: Vector3::z(),
                });
            }
            picture.show_contacts(&stream, &sample).unwrap();
            let sent = stored.take();
            sent.iter().any(|sent| matches!(sent, LogMsg::ArrowMsg(..)))
        };
        for (time_ms, touches, expected) in [
            (0, true, true),
            (20, true, true),
            (40, false, true),
            (60, false, false),
            (1039, false, false),
            (1040, false, true),
            (1060, false, false),
            (2040, false, true),
        ] {
            assert_eq!(is_sent(time_ms, touches), expected, "at {time_ms} ms");
        }
    }
}
