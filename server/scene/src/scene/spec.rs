//! A scene as it was written, checked value by value but without its meshes. SI units.

use god_object::{Pose, Primitive, Surface};
use nalgebra::{Point3, UnitQuaternion};
use taut_plant::HandPreset;

use crate::appearance::Appearance;
use crate::document::At;
use crate::shapes::{
    Axis, BoardText, PLATE, exact_capsule, exact_cylinder, exact_plane, exact_sphere,
};

/// The form of a body.
///
/// A primitive is exact unless its tessellation is named: what names `facets` or `subdivisions` is that mesh, and what names none is round. A plane that
/// names neither `size` nor `thickness` is a half-space.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A mesh file, relative to the scene file, else to the data directory.
    Mesh {
        /// As written.
        path: String,
        /// Factor on all coordinates: that of the unit, m, times the scale.
        scale: f64,
        /// Whether the scene names a unit or a scale.
        is_scaled: bool,
        /// Nodes, objects or groups of the file that are the shape; none is all of it.
        only: Vec<String>,
        /// Most distance to the mesh in the file, either way, m; the mesh gets as few triangles as that allows.
        simplify: Option<f64>,
    },
    /// A sphere, or an icosphere within it.
    Sphere {
        /// m.
        radius: f64,
        /// 20 · 4^subdivisions triangles; `None` is exact.
        subdivisions: Option<u32>,
    },
    /// A box.
    Box {
        /// m.
        half_extents: [f64; 3],
    },
    /// A capsule.
    Capsule {
        /// m.
        radius: f64,
        /// Origin to the centre of either half sphere, m.
        half_length: f64,
        /// Meridians; `None` is exact.
        facets: Option<usize>,
        /// Its axis.
        axis: Axis,
    },
    /// A cylinder, or a prism within it.
    Cylinder {
        /// Of a prism's vertices, m.
        radius: f64,
        /// m.
        half_length: f64,
        /// Sides; `None` is exact.
        facets: Option<usize>,
        /// Its axis.
        axis: Axis,
    },
    /// A box with a hole right through.
    BoxWithHole {
        /// m.
        half_extents: [f64; 3],
        /// Apothem of the hole, m.
        radius: f64,
        /// Sides of the hole.
        facets: usize,
        /// The hole's axis.
        axis: Axis,
    },
    /// A plane through the origin: a half-space, or a big box of this thickness whose upper face holds the origin.
    Plane {
        /// Length of either side and thickness, m; `None` has no end, and is not in the hand.
        plate: Option<[f64; 2]>,
        /// The normal.
        axis: Axis,
    },
    /// A hand, which is only seen: thumb and index finger meet at the origin.
    Hand {
        /// Wrist to the tip of the middle finger, m.
        length: f64,
        /// Of the left side.
        is_left: bool,
    },
    /// A board with a text, which is only seen.
    Board {
        /// What is written on it.
        text: BoardText,
        /// m; it is as high as its text.
        width: f64,
    },
}

/// What carries a piece of scenery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// The body in the hand, where the constraints let it be.
    GodObject,
    /// The device: where the hand is.
    Device,
    /// The obstacle at this place, which moves: no file says so.
    Obstacle(usize),
}

impl Shape {
    /// The mesh file that it names, as written.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::Mesh { path, .. } => Some(path),
            _ => None,
        }
    }

    /// Within what its mesh is to be simplified, m, where the scene says so.
    pub(super) fn simplify(&self) -> Option<f64> {
        match self {
            Self::Mesh { simplify, .. } => *simplify,
            _ => None,
        }
    }

    /// The same in the hand, where a plane is its plate: a half-space cannot be held.
    pub(super) fn held(self) -> Self {
        match self {
            Self::Plane { plate: None, axis } => Self::Plane {
                plate: Some(PLATE),
                axis,
            },
            other => other,
        }
    }

    /// The exact form, if the shape is one: a primitive that does not name its tessellation.
    pub fn primitive(&self) -> Option<Primitive> {
        match *self {
            Self::Sphere {
                radius,
                subdivisions: None,
            } => Some(exact_sphere(radius)),
            Self::Capsule {
                radius,
                half_length,
                facets: None,
                axis,
            } => Some(exact_capsule(radius, half_length, axis)),
            Self::Cylinder {
                radius,
                half_length,
                facets: None,
                axis,
            } => Some(exact_cylinder(radius, half_length, axis)),
            Self::Plane { plate: None, axis } => Some(exact_plane(axis)),
            _ => None,
        }
    }
}

/// How heavy the god-object is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MassSpec {
    /// kg.
    Mass(f64),
    /// kg/m^3.
    Density(f64),
}

/// The point G, at which motion is split and wrenches act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferencePoint {
    /// The centre of mass.
    CenterOfMass,
    /// In the body's frame, m.
    At(Point3<f64>),
}

/// The body in the user's hand.
#[derive(Clone, Debug, PartialEq)]
pub struct BodySpec {
    /// Its form.
    pub shape: Shape,
    /// Its mass.
    pub mass: MassSpec,
    /// Start pose.
    pub pose: Pose,
    /// Where forces act.
    pub reference_point: ReferencePoint,
    /// How it looks.
    pub appearance: Appearance,
    /// What is drawn instead of its form.
    pub visual: Option<VisualSpec>,
    pub(crate) at: At,
    pub(crate) shape_at: At,
}

/// `visual = { mesh = "fine.glb" }`: what is drawn of a body, in its frame, and never touched; a mesh need not be closed.
#[derive(Clone, Debug, PartialEq)]
pub struct VisualSpec {
    /// Its form.
    pub shape: Shape,
    pub(crate) at: At,
}

/// A body that stands still, or moves as a trace says.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstacleSpec {
    /// Unique in the scene.
    pub name: String,
    /// Its form.
    pub shape: Shape,
    /// World from obstacle.
    pub pose: Pose,
    /// How it feels; a height map is loaded by [`Scene::build`](super::Scene::build).
    pub surface: Surface,
    /// The height map of its texture, if it has one.
    pub height_map: Option<HeightMapSpec>,
    /// How it moves; `None` stands still at its pose.
    pub motion: Option<MotionSpec>,
    /// How it looks.
    pub appearance: Appearance,
    /// What is drawn instead of its form.
    pub visual: Option<VisualSpec>,
    pub(crate) shape_at: At,
}

/// Something that is seen and never touched.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenerySpec {
    /// Unique in the scene, obstacles included.
    pub name: String,
    /// Its form; a mesh need not be closed.
    pub shape: Shape,
    /// World from scenery; of what is carried, carrier from scenery.
    pub pose: Pose,
    /// What carries it; `None` stands still.
    pub carrier: Option<Carrier>,
    /// How it looks.
    pub appearance: Appearance,
    pub(crate) shape_at: At,
}

/// `motion = { trace = "plate.csv" }`: an obstacle is where the trace says, whatever its pose is.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSpec {
    /// Poses in the trace format, relative to the scene file, else to the data directory.
    pub trace: String,
    /// Begin again at the end; otherwise it stays there.
    pub repeat: bool,
    pub(crate) at: At,
}

/// A height map as written.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMapSpec {
    /// A grey PNG, relative to the scene file, else to the data directory.
    pub path: String,
    /// How the picture is laid on.
    pub mapping: HeightMapMapping,
    /// Height of white over black, m.
    pub amplitude: f64,
    pub(crate) at: At,
}

/// How a picture is laid on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HeightMapMapping {
    /// Along the obstacle's axes, whatever its form.
    Triplanar {
        /// Length of one row of the picture, m.
        tile: f64,
    },
    /// By the texture coordinates of the mesh file; the picture covers 0 to 1.
    Uv,
}

/// `[hand]`: what the simulated hand intends.
#[derive(Clone, Debug, PartialEq)]
pub struct HandPathSpec {
    /// Via points in the trace format, relative to the scene file, else to the data directory.
    pub path: String,
    /// Begin again at the end.
    pub repeat: bool,
    /// The hand's impedance.
    pub preset: HandPreset,
    pub(crate) at: At,
}

/// `[view] environment`: the light around the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EnvironmentSpec {
    /// An equirectangular .hdr, relative to the scene file, else to the data directory.
    pub(super) path: String,
    pub(super) at: At,
}

/// `[view]`: how the scene stands on the workbench.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Magnification of what is drawn.
    pub display_scale: f64,
    /// Where the scene's origin lies, workbench frame, m; `None` leaves it to the workbench.
    pub origin: Option<Point3<f64>>,
    /// Workbench from scene; `None` leaves it to the workbench.
    pub rotation: Option<UnitQuaternion<f64>>,
}

impl Default for View {
    fn default() -> Self {
        Self {
            display_scale: 1.0,
            origin: None,
            rotation: None,
        }
    }
}
