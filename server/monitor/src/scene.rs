//! What the monitor draws once: the bodies' meshes, the screens, the head.
//!
//! Everything is in world axes, metres. Meshes are in their own body frame.

use nalgebra::{Isometry3, Point3, Vector3};

/// A pose in SE(3), `world_from_body`.
pub type Pose = Isometry3<f64>;

/// The fixed part of a session's picture.
#[derive(Clone, Debug, PartialEq)]
pub struct MonitorScene {
    /// The scene's name, shown as the recording's name.
    pub name: String,
    /// The god-object and the obstacles.
    pub bodies: Vec<MonitorBody>,
    /// The outlines of the workbench's screens; may be empty.
    pub screens: Vec<MonitorScreen>,
    /// Where the viewer's head starts; a sample may move it. `None` draws no head.
    pub head: Option<Pose>,
    /// Size of the head in the picture over its true size: that of a workbench whose scene is magnified is as much smaller.
    pub head_size: f64,
    /// The reference point G, in the god-object's body frame: the force arrow starts there.
    pub reference_point: Point3<f64>,
    /// The direction that is up in the picture, world axes; need not be a unit vector.
    pub up: Vector3<f64>,
}

impl MonitorScene {
    /// An empty scene of this name with z up; fill in the public fields.
    #[must_use]
    pub fn new(name: impl Into<String>) -> MonitorScene {
        MonitorScene {
            name: name.into(),
            bodies: Vec::new(),
            screens: Vec::new(),
            head: None,
            head_size: 1.0,
            reference_point: Point3::origin(),
            up: Vector3::z(),
        }
    }
}

/// One rigid body: its mesh is sent once, only its pose after that.
#[derive(Clone, Debug, PartialEq)]
pub struct MonitorBody {
    /// Name, unique in the scene; becomes part of the entity path.
    pub name: String,
    /// Vertices in the body frame, metres.
    pub vertices: Vec<[f32; 3]>,
    /// Triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Colour, sRGB. `None`: the role's own colour.
    pub colour: Option<[u8; 3]>,
    /// What the body is.
    pub role: BodyRole,
    /// Pose at the start; an obstacle at rest keeps it.
    pub pose: Pose,
}

/// What a body is in the method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyRole {
    /// The virtual body that never penetrates; also drawn, translucent, at the device's pose.
    GodObject,
    /// A fixed body.
    Obstacle,
    /// A body that moves by itself: samples say where it is. Counted among the obstacles.
    MovingObstacle,
}

/// The outline of one screen of the workbench.
#[derive(Clone, Debug, PartialEq)]
pub struct MonitorScreen {
    /// Name, unique in the scene.
    pub name: String,
    /// The four corners in order around the screen, world axes, metres.
    pub corners: [Point3<f64>; 4],
}
